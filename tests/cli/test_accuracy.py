"""rtbench accuracy: measures, tells a run again, and prints a paragraph to quote."""

import csv
import io
import json

import pytest


@pytest.fixture
def small(monkeypatch):
    """Let the config of the command be a small one."""
    from rtbench.experiments import config

    found = config.find("accuracy")
    small = found.changed(
        kernels=("moller_trumbore_uv", "moller_trumbore_stable_uv"),
        precisions=("float32",),
        triangles=256,
        sizes=(1000,),
        rays=4,
        repetitions=10,
        processes=1,
        samples=2,
    )
    monkeypatch.setattr(config, "find", lambda name: small)


def test_a_run_is_measured_told_and_told_again(rtbench, small):
    told = rtbench("accuracy", "--label", "here")
    assert told.code == 0, told.err
    assert "The price of each step of accuracy" in told.out
    words = " ".join(told.out.split())
    assert (
        "A stable t " in words and "(no interval)" in words and "resolved difference" not in words
    )
    folder = told.out.rpartition("Records, tables and plots: ")[2].strip()
    name = folder.rpartition("/")[2]
    again = rtbench("accuracy", name)
    assert (again.code, again.out) == (0, told.out)
    found = json.loads(rtbench("accuracy", name, "--format", "json").out)
    assert found["run"] == name and found["paragraph"].startswith("On ")
    assert {"accuracy", "steps", "mesh"} <= set(found["tables"])
    steps = list(csv.DictReader(io.StringIO(rtbench("accuracy", name, "--format", "csv").out)))
    assert "stable t" in {row["step"] for row in steps}
    assert r"\begin{table}" in rtbench("accuracy", name, "--format", "latex").out
    assert rtbench("table", name).code == 0
    advised = rtbench("advise", "--exact", "--hit-ratio", "0.5")
    assert advised.code == 0 and advised.out.startswith("No measured kernel fits: not exact.")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nothing",), "unknown run 'nothing'"),
        (("blecha-pc1",), "not of accuracy"),
        (("some", "--quick"), "no other options"),
        (("--kernel", "moler1_uv"), "unknown kernel 'moler1_uv'; did you mean 'moller1_uv'?"),
        (("--precision", "float16"), "unknown precision 'float16'"),
    ],
)
def test_what_is_refused_is_told_in_one_line(rtbench, arguments, said):
    told = rtbench("accuracy", *arguments)
    assert (told.code, told.out) == (2, "")
    assert said in told.err and told.err.count("\n") == 1


def test_two_accuracies_cannot_be_asked_at_once(rtbench):
    told = rtbench("advise", "--stable", "--exact")
    assert told.code == 2 and "--stable and --exact" in told.err


def test_advice_on_accuracy_names_the_run_that_is_wanted(rtbench):
    told = rtbench("advise", "--watertight")
    assert told.code == 2 and "rtbench accuracy --quick makes one" in told.err
