import csv
import json

import pytest

from rtbench.errors import RtbenchError
from rtbench.report.run_tables import render_all, tables_of, write_tables


@pytest.mark.parametrize(
    ("experiment", "names"),
    [
        ("density", ["times", "outcomes"]),
        ("outcomes", ["outcomes"]),
        ("operations", ["operations"]),
        ("stages", ["stages"]),
        ("prediction", ["times", "penalty", "outcomes"]),
        ("working_set", ["working_set"]),
        ("latency", ["latency"]),
        ("soup", ["soup", "stored"]),
        ("break_even", ["break_even", "cheapest", "costs"]),
        ("compilers", ["compilers", "answers"]),
        ("packets", ["packets", "spread", "layouts", "axes", "reciprocal"]),
    ],
)
def test_which_tables_an_experiment_has(make, experiment, names):
    assert [table.name for table in tables_of(make(experiment, processes=2, rounds=2))] == names


def test_three_files_a_table(make):
    run = make("density", processes=2, rounds=2)
    written = write_tables(run)
    assert sorted(path.name for path in (run.path / "tables").iterdir()) == [
        "outcomes.csv",
        "outcomes.md",
        "outcomes.tex",
        "times.csv",
        "times.md",
        "times.tex",
    ]
    assert sorted(written) == sorted((run.path / "tables").iterdir())
    with (run.path / "tables" / "times.csv").open(encoding="utf-8") as file:
        assert next(csv.DictReader(file))["kernel"] == "moller1"


def test_an_unwritable_folder_is_told(make, tmp_path):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(RtbenchError, match="cannot write"):
        write_tables(make("density", processes=1, rounds=1), tmp_path / "file")


def test_json_of_several_tables_is_one_document(make):
    found = json.loads(render_all(tables_of(make("density", processes=2, rounds=2)), "json"))
    assert list(found) == ["times", "outcomes"]
    assert found["times"][0]["kernel"] == "moller1"


def test_only_the_tables_asked_for_are_written(make):
    run = make("density", processes=2, rounds=2)
    (times, *_) = tables_of(run)
    assert {path.stem for path in write_tables(run, tables=[times])} == {"times"}
