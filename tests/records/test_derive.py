"""Summary and outcomes, by hand from known samples."""

import os

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.records import schema
from rtbench.records.run import write_derived
from rtbench.records.store import load_run
from rtbench.records.writer import RunWriter

CELL = ["kernel", "precision", "order", "density"]
OUTCOMES = [
    {"kernel": "m", "precision": "float32", "density": 0.5, "triangles": 10, "outcome": code}
    | {"label": label, "count": count}
    for code, label, count in ((0, "hit", 5), (1, "u outside", 4), (2, "v outside", 1))
]


def row(kernel="m", process=0, number=0, ns=100, order="repeat", **more) -> dict:
    base = {"kernel": kernel, "precision": "float32", "order": order, "density": 0.5}
    base |= {"process": process, "launch": 0, "round": number, "position": 0, "triangles": 10}
    return base | {"repetitions": 2, "tests": 20, "ns": ns, "cpu_ns": ns} | more


@pytest.fixture
def make(tmp_path):
    def build(rows, cell=CELL, **info):
        info = {"experiment": "density", "cell": cell, "outcomes": OUTCOMES} | info
        made = RunWriter.create(tmp_path, "pc", "c", info, schema.sample_columns(cell))
        with made:
            made.append(rows)
        return made.path

    return build


def test_a_summary_by_hand(make):
    rows = [row(number=k, ns=ns) for k, ns in enumerate((100, 300, 140))]
    rows += [row(process=1, number=k, ns=ns) for k, ns in enumerate((120, 160))]
    rows += [row("empty", ns=20), row(ns=60, outcome=0, triangles=3)]
    summary = load_run(make(rows)).summary
    assert summary["kernel"].tolist() == ["m", "empty"]
    cell = summary.iloc[0]
    assert cell["ns_per_test"] == 140 / 20
    assert cell["seconds"] == pytest.approx(820e-9)
    assert (cell["repetitions"], cell["tests"], cell["triangles"], cell["hits"]) == (10, 100, 10, 5)
    assert (cell["samples"], cell["processes"]) == (5, 2)
    assert 0 < cell["ci_low"] <= 7 <= cell["ci_high"]
    empty = summary.iloc[1]
    assert np.isnan(empty["ci_low"]) and empty["hits"] is not None
    assert summary["hits"].isna().tolist() == [False, True]


def test_hits_are_those_of_the_cells_own_workload(make):
    other = [entry | {"density": 1.0, "count": 9} for entry in OUTCOMES]
    none = [entry | {"density": 0.0} for entry in OUTCOMES if entry["outcome"] != 0]
    rows = [row(density=density) for density in (0.5, 1.0, 0.0, 0.25)]
    summary = load_run(make(rows, outcomes=OUTCOMES + other + none)).summary
    hits = dict(zip(summary["density"], summary["hits"], strict=True))
    assert (hits[0.5], hits[1.0], hits[0.0]) == (5, 9, 0)
    assert list(summary["density"][summary["hits"].isna()]) == [0.25]


def test_further_columns_of_a_cell_are_in_the_summary(make):
    rows = [row(triangles=n, tests=2 * n, stage=stage) for n in (256, 512) for stage in ("a", "b")]
    run = load_run(make(rows, cell=["kernel", "triangles", "stage", "precision"], **{}))
    assert run.summary["triangles"].tolist() == [256, 256, 512, 512]
    assert run.summary["stage"].tolist() == ["a", "b", "a", "b"]
    assert run.summary["order"].isna().all()


@pytest.fixture(autouse=True)
def _only_known_columns(monkeypatch):
    # Rows of the tests hold every column; a table takes those that it has.
    append = RunWriter.append

    def known(self, rows):
        append(self, [{k: v for k, v in one.items() if k in self.columns} for one in rows])

    monkeypatch.setattr(RunWriter, "append", known)


def test_outcomes_by_hand(make):
    rows = [row(number=k, ns=ns, outcome=0, triangles=3) for k, ns in enumerate((100, 300, 140))]
    rows += [row(ns=80, outcome=1, triangles=4), row(ns=999, outcome=1, order="sweep")]
    table = load_run(make(rows)).outcomes
    assert list(table.columns) == list(schema.OUTCOME_COLUMNS)
    assert table["fraction"].tolist() == [0.5, 0.4, 0.1]
    assert table["ns_per_test"].tolist()[:2] == [7, 4]
    assert table["pairs_timed"].tolist()[:2] == [3, 4]
    assert table.loc[2, ["ns_per_test", "pairs_timed", "tests"]].isna().all()
    assert table["ci_low"].isna().all()  # one process


def test_an_outcome_without_a_density_finds_its_times(make):
    natural = [entry | {"density": None} for entry in OUTCOMES]
    rows = [row(ns=80, outcome=1, density=None, triangles=4)]
    table = load_run(make(rows, outcomes=natural)).outcomes
    assert table["ns_per_test"].tolist()[1] == 4
    assert table["density"].isna().all()


def test_written_tables_are_read_back_as_they_were(make):
    rows = [row(process=p, number=k, ns=100 + 7 * k + p) for p in range(3) for k in range(4)]
    path = make([*rows, row("empty", ns=10), row(ns=60, outcome=0, triangles=3)])
    derived = load_run(path)
    summary, outcomes = derived.summary, derived.outcomes
    write_derived(path)
    again = load_run(path)
    assert again._stands(schema.SUMMARY) and again._stands(schema.OUTCOMES)
    for before, after in ((summary, again.summary), (outcomes, again.outcomes)):
        assert before.to_csv() == after.to_csv()
        assert before.dtypes.to_dict() == after.dtypes.to_dict()


def test_tables_older_than_the_samples_are_not_believed(make):
    path = make([row()])
    write_derived(path)
    old = (path / schema.SAMPLES).stat().st_mtime_ns - 10**9
    os.utime(path / schema.SUMMARY, ns=(old, old))
    with RunWriter.reopen(path) as writer:
        writer.append([row("late")])
    assert load_run(path).summary["kernel"].tolist() == ["m", "late"]


def test_published_tables_are_not_replaced(tmp_path, make):
    path = make([row()], published=True)
    write_derived(path)
    assert not (path / schema.SUMMARY).exists()


def test_tables_that_cannot_be_written_are_told(make, monkeypatch):
    path = make([row()])

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(RtbenchError, match=r"summary.csv: no space left on device"):
        write_derived(path)
    assert sorted(file.name for file in path.iterdir()) == ["run.json", "samples.csv"]


def test_words_that_look_like_numbers_stay_words(make):
    path = make([row("1e3", density=0), row("007", density=1)])
    run = load_run(path)
    assert run.samples["kernel"].tolist() == ["1e3", "007"]
    assert run.samples["density"].tolist() == [0.0, 1.0]
