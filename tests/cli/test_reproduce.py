"""What can be repeated, and what is said of what cannot."""

import pytest


def test_help_names_every_thesis(rtbench):
    told = rtbench("reproduce", "silhavy", "--help")
    assert (told.code, told.err) == (0, "")
    for word in ("Blecha 2007", "Havel 2008", "Šilhavý 2010", '"builders"', "RTBENCH_MODELS"):
        assert word in " ".join(told.out.split())


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("silhavi", "unknown table 'silhavi'; did you mean 'silhavy'?"),
        ("silhavy-55", "unknown table 'silhavy-55'"),
        ("bilders", "unknown table 'bilders'; did you mean 'builders'?"),
        ("", "unknown table ''"),
    ],
)
def test_unknown_tables(rtbench, tmp_path, table, said):
    told = rtbench("reproduce", table, "--quick")
    assert (told.code, told.out) == (2, "")
    assert told.err.startswith(f"rtbench: {said}") and told.err.count("\n") == 1
    assert not list((tmp_path / "here").iterdir())


def test_statements_follow_the_tables(rtbench, monkeypatch, tmp_path):
    from rtbench.experiments import reproduce, silhavy
    from rtbench.experiments.config import Config

    tiny = Config(
        name="silhavy-sizes",
        kernels=("moller1",),
        triangles=40,
        repetitions=2,
        processes=1,
        samples=1,
    )
    monkeypatch.setattr(reproduce, "configs", lambda table: [tiny])
    row = {"section": "2.1", "statement": "as said", "verdict": "confirmed", "number": "1.23"}
    asked = []
    monkeypatch.setattr(silhavy, "judged", lambda runs: asked.append(list(runs)) or [row])
    told = rtbench("reproduce", "silhavy", "--quiet")
    assert told.code == 0, told.err
    assert asked == [["sizes"]]
    tables, _, statements = told.out.partition("What Šilhavý 2010 states, on this machine")
    assert "moller1" in tables and "Records, tables and plots: " in tables
    assert statements.split() == ["confirmed", "2.1", "as", "said", "1.23"]
