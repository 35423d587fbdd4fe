import csv

import numpy as np
import pytest

from rtbench.report.layouts.density import density_table, run_table, time_tables

SLOWER = "slower_than_best_percent"
# Blecha 2007, the last column of tables 4.1, 4.2 and 4.10.
THESIS = {
    "times-4.1": {"moller0": "15.1", "moller1": "0", "moller3": "3.7"},
    "times-4.2": {"moller1": "11.4", "badouel": "47.7", "chirkov": "0"},
    "times-4.10": {"moller1_uv": "0", "badouel_uv": "30.1", "chirkov_uv": "15.1"},
}


@pytest.mark.parametrize(
    ("name", "run"),
    [
        ("times-4.1", "blecha-pc1-4.1"),
        ("times-4.2", "blecha-pc1"),
        ("times-4.10", "blecha-pc1"),
    ],
)
def test_the_last_column_is_the_thesis_s(published, name, run):
    table = next(table for table in time_tables(published(run)) if table.name == name)
    assert {row["kernel"].value: row[SLOWER].text for row in table.rows} == THESIS[name]
    assert not any("difference" in note for note in table.notes)


def test_seconds_are_the_thesis_s_sum(published):
    table = next(t for t in time_tables(published("blecha-pc1-4.1")))
    moller1 = next(row for row in table.rows if row["kernel"].value == "moller1")
    printed = 28.172 + 31.172 + 34.172 + 37.203 + 40.219
    assert moller1["seconds"].value == pytest.approx(printed)


def test_published_means_have_no_interval_column(published):
    (table,) = time_tables(published("blecha-pc4"))
    assert "interval" not in table.columns
    assert "mean over densities" in table.title


def test_densities_are_columns_and_the_empty_loop_comes_last(make):
    table = density_table(make("density"))
    assert table.columns[:7] == ["kernel", "order", "0", "0.25", "0.5", "0.75", "1"]
    assert [row["kernel"].value for row in table.rows] == [
        *["moller1", "badouel", "chirkov"] * 2,
        "empty",
        "empty",
    ]
    assert [row["order"] for row in table.rows][:6] == ["repeat"] * 3 + ["sweep"] * 3
    assert all(row[SLOWER].value is None for row in table.rows[6:])


def test_times_are_the_medians_of_the_samples(make):
    run = make("density")
    taken = {}
    with (run.path / "samples.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["kernel"], row["order"], float(row["density"])
            taken.setdefault(key, []).append(int(row["ns"]) / int(row["tests"]))
    for row in density_table(run).rows:
        for density in (0.0, 0.25, 0.5, 0.75, 1.0):
            expected = np.median(taken[row["kernel"].value, row["order"], density])
            assert row[f"{density:g}"].value == pytest.approx(expected)


def test_slower_is_within_an_order(make):
    rows = density_table(make("density")).rows
    for order in ("repeat", "sweep"):
        mine = [row for row in rows if row["order"] == order and row["kernel"].value != "empty"]
        sums = [sum(row[d].value for d in ("0", "0.25", "0.5", "0.75", "1")) for row in mine]
        assert [row[SLOWER].value for row in mine] == pytest.approx(
            [100 * (total / min(sums) - 1) for total in sums]
        )


def test_a_kernel_level_with_the_best_is_marked_and_named(make):
    ends = {"a": (8.0, 9.0), "b": (8.0, 9.0), "c": (11.0, 13.0), "empty": (0.4, 0.4)}
    table = density_table(make("density", kernels=("a", "b", "c"), ends=ends, orders=("repeat",)))
    marks = {row["kernel"].value: row[SLOWER].text.endswith("*") for row in table.rows}
    best = min(table.rows[:3], key=lambda row: row[SLOWER].value)["kernel"].value
    other = "b" if best == "a" else "a"
    assert marks[other] and not marks[best] and not marks["c"]
    assert table.notes[0] == f"* no difference resolved from {best}: {other} (repeat)"


def test_one_sample_a_cell_resolves_nothing(make):
    table = density_table(make("density", processes=1, rounds=1))
    assert not any(row[SLOWER].text.endswith("*") for row in table.rows)
    assert "one sample a cell" in table.notes[0]
    assert sum("one sample" in note for note in table.notes) == 1


def test_a_kernel_without_all_densities_is_not_ranked(make, sample_runs, tmp_path):
    cells = [
        {"kernel": kernel, "precision": "float32", "order": "repeat", "density": density, "ns": ns}
        for kernel, ns in (("fast", 5.0), ("slow", 9.0), ("gap", 1.0))
        for density in (0.0, 1.0)
        if (kernel, density) != ("gap", 1.0)
    ]
    from rtbench.records.store import load_run

    table = density_table(load_run(sample_runs.write_run(tmp_path / "gap", "density", cells)))
    slower = {row["kernel"].value: row[SLOWER].value for row in table.rows}
    assert slower["gap"] is None and slower["fast"] == 0
    assert slower["slow"] == pytest.approx(80, abs=5)


def test_one_density_in_full(make):
    run = make("density", densities=(0.3,), triangles=2000, orders=("repeat",))
    table = run_table(run)
    assert table.columns == [
        "kernel",
        "order",
        "ns_per_test",
        "mtests_per_s",
        "interval",
        "seconds",
        SLOWER,
        "hits",
    ]
    first = table.rows[0]
    assert first["hits"] == 600
    assert first["mtests_per_s"].value == pytest.approx(1000 / first["ns_per_test"].value)
    low, high = (float(end) for end in first["interval"].strip("[]").split(","))
    assert low <= float(first["ns_per_test"].text) <= high
    assert {"ci_low", "ci_high", "density", "precision"} <= set(table.raw_columns)


def test_precision_is_a_column_only_where_there_are_several(make):
    both = density_table(make("density", precisions=("float32", "float64"), processes=2, rounds=2))
    assert both.columns[:3] == ["kernel", "precision", "order"]
    one = density_table(make("density", name="one", processes=2, rounds=2))
    assert "precision" not in one.columns and "float32" in one.title


def test_a_run_without_samples_has_no_rows(make):
    assert run_table(make("density", rounds=0)).rows == []
