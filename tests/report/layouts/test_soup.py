import csv
import io

import numpy as np
import pytest

from rtbench.report.layouts.density import SLOWER
from rtbench.report.layouts.soup import soup_table, stored_table

WIDEST = 130


def taken(run):
    """Return kernel, precision and hit ratio to ns a test, one a sample, as the file has them."""
    found = {}
    with (run.path / "samples.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["kernel"], row["precision"], float(row["density"])
            found.setdefault(key, []).append(int(row["ns"]) / int(row["tests"]))
    return found


def raw(table):
    return list(csv.DictReader(io.StringIO(table.render("csv"))))


def test_times_and_speeds_are_those_of_the_samples(make):
    run = make("soup")
    times = taken(run)
    rows = raw(soup_table(run))
    assert len(rows) == len(times) == 12
    for row in rows:
        ns = np.median(times[row["kernel"], row["precision"], float(row["density"])])
        assert float(row["ns_per_test"]) == pytest.approx(ns)
        assert float(row["mtests_per_s"]) == pytest.approx(1000 / ns)
        assert float(row["ci_low"]) < ns < float(row["ci_high"])


def test_a_row_a_kernel_with_both_hit_ratios(make):
    table = soup_table(make("soup"))
    wald = next(row for row in table.rows if row["kernel"] == "wald")
    assert wald["ending"] == "last tuv" and wald["stored"] == "precomputed"
    assert wald["ns_0.1"].value == pytest.approx(6.9 * 1.04, rel=0.03)
    assert wald["mtests_0.5"].value == pytest.approx(1000 / (4.6 * 1.04), rel=0.03)


def test_slower_is_of_the_sum_over_the_hit_ratios(make):
    run = make("soup")
    times = taken(run)
    sums = {
        kernel: sum(np.median(times[kernel, "float32", ratio]) for ratio in (0.1, 0.5))
        for kernel, _, _ in times
    }
    for row in raw(soup_table(run)):
        expected = 100 * (sums[row["kernel"]] / min(sums.values()) - 1)
        assert float(row[SLOWER]) == pytest.approx(expected)


def test_kernels_level_with_the_best_are_marked(make):
    table = soup_table(make("soup", bases=("wald",), endings=("tuv", "last_tuv"), spread=0.2))
    marks = [row[SLOWER].text.endswith("*") for row in table.rows]
    assert sorted(marks) == [False, True]
    assert any(note.startswith("* no difference resolved from wald_") for note in table.notes)


def test_precisions_are_ranked_apart(make):
    table = soup_table(make("soup", precisions=("float32", "float64")))
    best = [row for row in table.rows if row[SLOWER].value == 0]
    assert [row["precision"] for row in best] == ["float32", "float64"]
    assert "precision" in table.columns and "prepared" not in table.columns


def test_ways_of_preparing_are_rows(make):
    table = soup_table(make("soup", bases=("wald", "moller_trumbore"), prepared=("own", "double")))
    found = [(row["kernel"], row["prepared"]) for row in table.rows]
    assert found == [("wald", "own"), ("moller_trumbore", "own"), ("wald", "double")]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"endings": ("tuv", "last_whole")},
        {"precisions": ("float32", "float64"), "bases": ("kensler_shirley_stored", "wald")},
    ],
)
def test_a_line_is_no_wider_than_a_screen(make, options):
    table = soup_table(make("soup", **options))
    lines = table.render("plain").splitlines()
    assert max(map(len, lines[: len(table.rows) + 4])) <= WIDEST


def test_the_workloads_stand_below(make):
    notes = soup_table(make("soup")).notes
    assert (
        "hit ratio 0.5: 512 triangles x 1,024 rays, 51.85 % of the pairs hit, "
        "90.14 % of the tests end at a distance test that comes first"
    ) in notes
    assert "nearest triangle: every kernel finds the exact one on every ray" in notes


def test_another_nearest_triangle_is_named(make):
    notes = soup_table(make("soup", differ=3)).notes
    assert (
        "nearest triangle, not the exact one: kensler_shirley_last_tuv_uv (float32, hit ratio "
        "0.1) 3 of 1,024 rays, 1 beyond rounding"
    ) in notes


def test_what_is_stored_is_a_row_a_method(make):
    run = make("soup", endings=("tuv", "last_tuv"), processes=2, rounds=2)
    table = stored_table(run)
    rows = {row["kernel"]: row for row in raw(table)}
    assert len(table.rows) == len(rows) == 6
    assert rows["wald"]["bytes_per_triangle"] == "48"
    assert rows["kensler_shirley_stored"]["bytes_per_triangle_padded"] == "64"
    assert float(rows["wald"]["prepare_ns_per_triangle"]) == 130
    assert rows["moller_trumbore"]["prepare_ns_per_triangle"] == ""


def test_doubles_are_stored_in_rows_of_their_own(make):
    table = stored_table(make("soup", precisions=("float32", "float64"), processes=2, rounds=2))
    sizes = [row["bytes_per_triangle"] for row in table.rows if row["kernel"] == "wald"]
    assert sizes == [48, 96]


def test_a_run_without_samples_has_no_rows(make):
    assert soup_table(make("soup", rounds=0)).rows == []
