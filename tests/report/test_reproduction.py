"""A published table beside ours."""

import re

import pytest

from rtbench.records.store import load_run
from rtbench.report import reproduction


class Mine:
    """A run whose numbers are those of a published one, under the words of a measured run."""

    published = False

    def __init__(self, source, table, experiment, generator="pcg64"):
        self.name = "mine"
        self.info = {
            "experiment": experiment,
            "config": {"table": table, "generator": generator, "densities": []},
            "seed": 24660781,
            "machine": {"cpu_model": "a machine"},
        }
        frame = source.summary
        self.summary = frame[frame["table"] == table].copy() if "table" in frame else frame
        self.outcomes = source.outcomes.copy()
        self.operations = source.operations.copy()


@pytest.mark.parametrize(
    ("name", "table"), [("blecha-pc1-4.1", "4.1"), ("blecha-pc1", "4.2"), ("blecha-pc1", "4.10")]
)
def test_the_printed_percentages_come_out_on_both_sides(name, table):
    source = load_run(name)
    (found,) = reproduction.beside_published(Mine(source, table, "density"), source)
    printed = source.info["printed"]["slower_than_best"][table]
    for row in found.rows:
        assert row["slower"].value == pytest.approx(printed[row["kernel"]], abs=0.06)
    assert {row["where"] for row in found.rows} == {"thesis", "here"}
    assert "Kendall's tau 1.00" in "\n".join(found.notes)


def test_a_turned_ranking_says_so():
    source = load_run("blecha-pc1")
    mine = Mine(source, "4.2", "density")
    mine.summary["ns_per_test"] = 200 - mine.summary["ns_per_test"]
    (found,) = reproduction.beside_published(mine, source)
    assert "tau -1.00" in "\n".join(found.notes)


def test_the_mean_table_has_one_value_a_kernel():
    source = load_run("blecha-pc1")
    mine = Mine(source, "4.2", "density")
    mine.info["config"]["table"] = "4.3"
    (found,) = reproduction.beside_published(mine, source)
    assert found.columns == ["kernel", "where", "mean", "slower"]
    thesis = {r["kernel"]: r["mean"].value for r in found.rows if r["where"] == "thesis"}
    assert thesis["moller1"] == pytest.approx(34.228 / 30.703, abs=1e-6)


def test_equal_counts_are_called_equal_and_the_state_named():
    source = load_run("blecha-pc1")
    mine = Mine(source, "4.5", "outcomes", "msvc")
    (found,) = reproduction.beside_published(mine, source)
    rows = [row for row in found.rows if row["kernel"] == "moller1"]
    assert [row["here"].value for row in rows] == [120720, 317737, 121256, 318641, 121632, 14]
    assert {row["equal"] for row in found.rows} == {"yes"}
    notes = "\n".join(found.notes)
    assert "counts are equal" in notes
    assert "24660781" in notes and "not proven" in notes and "0.6 to 2 %" in notes


@pytest.mark.parametrize(("moved", "word"), [(300, "agree"), (3000, "differ")])
def test_other_data_is_compared_by_chi_square(moved, word):
    source = load_run("blecha-pc1")
    mine = Mine(source, "4.7", "outcomes")
    counts = mine.outcomes["count"].copy()
    badouel = mine.outcomes["kernel"] == "badouel"
    counts[badouel & (mine.outcomes["outcome"] == 3)] -= moved
    counts[badouel & (mine.outcomes["outcome"] == 4)] += moved
    mine.outcomes["count"] = counts
    (found,) = reproduction.beside_published(mine, source)
    notes = "\n".join(found.notes)
    assert f"the frequencies {word}" in notes
    assert re.search(r"p = [\d.e-]+", notes)


def test_operations_equal_and_not():
    source = load_run("blecha-operations")
    mine = Mine(source, "4.9", "operations")
    (found,) = reproduction.beside_published(mine, source)
    assert found.notes[0] == "every count is equal"
    mine.operations.loc[mine.operations["kernel"] == "chirkov", "mul"] += 1
    (found,) = reproduction.beside_published(mine, source)
    assert found.notes[0] == "not equal: chirkov mul"
