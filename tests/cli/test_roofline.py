"""rtbench roofline: what bounds each kernel of a run."""

import json

import pytest

RUN = ("run", "--density", "0.5", "--tris", "40", "--reps", "40", "--processes", "2")
RUN += ("--order", "sorted", "--order", "shuffled", "--kernel", "moller1", "--quiet")


@pytest.fixture
def kept(rtbench, monkeypatch):
    """Measure the peaks, quickly, as the command prints them; return the file they are in."""
    from rtbench.measure import peaks

    measure = peaks.peaks
    monkeypatch.setattr(peaks, "peaks", lambda **told: measure(2, 1e-4, **told))

    def measured(*arguments):
        return rtbench("roofline", *arguments)

    return measured


def test_a_run_is_bounded_by_peaks_of_the_spot(rtbench, kept, tmp_path):
    folder = json.loads(rtbench(*RUN, "--format", "json").out)["run"]
    told = kept(folder)
    assert told.code == 0, told.err
    assert "moller1" in told.out and "shuffled" in told.out and "GB/s" in told.out
    place = tmp_path / "here" / "results" / folder
    assert (place / "plots" / "roofline.png").stat().st_size > 1000
    peaks = place / "tables" / "peaks.json"
    # The same peaks again: nothing is measured, and the bounds are the same.
    first = (place / "tables" / "roofline.csv").read_text(encoding="utf-8")
    again = rtbench("roofline", folder, "--peaks", peaks, "--format", "json")
    assert again.code == 0, again.err
    assert (place / "tables" / "roofline.csv").read_text(encoding="utf-8") == first
    tables = json.loads(again.out)
    assert {row["order"] for row in tables["roofline"]} == {"sorted", "shuffled"}
    for row in tables["roofline"]:
        assert row["by_outcome"] is True
        assert row["branches_percent"] is None or row["order"] == "shuffled"
    assert rtbench("roofline", folder, "--peaks", peaks, "--format", "csv").out.count("\n") == 3


def test_peaks_of_another_machine_are_remarked_upon(rtbench, kept, tmp_path):
    folder = json.loads(rtbench(*RUN, "--format", "json").out)["run"]
    told = json.loads(kept("--format", "json").out)
    told["machine"]["label"] = "another-machine"
    path = tmp_path / "peaks.json"
    path.write_text(json.dumps(told), encoding="utf-8")
    ended = rtbench("roofline", folder, "--peaks", path)
    assert ended.code == 0 and "another-machine" in ended.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("blecha-pc1",), "published"),
        (("no-such-run",), "no-such-run"),
        (("--peaks", "absent.json"), "absent.json"),
    ],
)
def test_what_is_refused_is_told_in_one_line_without_measuring(
    rtbench, monkeypatch, arguments, words
):
    from rtbench.measure import peaks

    def never(**told):
        raise AssertionError("measured")

    monkeypatch.setattr(peaks, "peaks", never)
    told = rtbench("roofline", *arguments)
    assert told.code == 2 and told.out == ""
    assert words in told.err and told.err.count("\n") == 1


def test_a_run_cut_off_before_its_first_sample(rtbench, tmp_path):
    folder = json.loads(rtbench(*RUN, "--format", "json").out)["run"]
    place = tmp_path / "here" / "results" / folder
    header = (place / "samples.csv").read_text(encoding="utf-8").splitlines()[0]
    (place / "samples.csv").write_text(header + "\n", encoding="utf-8")
    told = rtbench("roofline", folder)
    assert told.code == 2 and "no cell has a time" in told.err
