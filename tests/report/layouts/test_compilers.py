import csv
import io

import numpy as np
import pytest

from rtbench.report.layouts.compilers import answers_table, compilers_table

WIDEST = 133
WRONG = [("wald_last_uv", "avx2", "fast", 3)]


def taken(run):
    """Return kernel, hit ratio, target and flags to ns a test, as the file of samples has them."""
    found = {}
    with (run.path / "samples.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["kernel"], row["density"], row["target"], row["flags"]
            found.setdefault(key, []).append(int(row["ns"]) / int(row["tests"]))
    return found


def raw(table):
    return list(csv.DictReader(io.StringIO(table.render("csv"))))


def row_of(table, kernel, ending, ratio, flags):
    (row,) = (
        row
        for row in table.rows
        if (row["kernel"], row["ending"], row["flags"]) == (kernel, ending, flags)
        and row["density"].value == ratio
    )
    return row


def test_times_are_those_of_the_samples(make):
    run = make("compilers")
    times, rows = taken(run), raw(compilers_table(run))
    assert len(rows) == len(times) == 3 * 2 * 3 * 3
    for row in rows:
        ns = np.median(times[row["kernel"], row["density"], row["target"], row["flags"]])
        assert float(row["ns_per_test"]) == pytest.approx(ns)
        assert float(row["ci_low"]) < ns < float(row["ci_high"])


def test_a_row_a_kernel_ratio_and_flags_a_column_a_target(make):
    table = compilers_table(make("compilers"))
    assert table.columns[-3:] == ["x86-64", "avx2", "avx512-512"]
    assert len(table.rows) == 3 * 2 * 3
    assert [row["flags"] for row in table.rows[:3]] == ["strict", "contract", "fast"]
    cell = row_of(table, "moller_trumbore", "whole", 0.5, "fast")["avx512-512"]
    assert cell.value == pytest.approx(8.0 * 0.93 * 0.94 * 0.875, rel=0.03)
    assert cell.text.startswith(f"{cell.value:.2f} [") and cell.text.endswith("]~")
    assert "every ending: last" in table.notes


def test_other_answers_are_marked_and_counted(make):
    run = make("compilers", other_hits=WRONG)
    times, answers = compilers_table(run), answers_table(run)
    row = row_of(times, "wald", "tuv", 0.1, "fast")
    assert [row[target].text[-1] for target in ("x86-64", "avx2", "avx512-512")] == ["]", "!", "~"]
    row = row_of(answers, "wald", "tuv", 0.1, "fast")
    told = [row[target].text for target in ("x86-64", "avx2", "avx512-512")]
    assert told == ["0", "3! / 700", "0 / 700"]
    assert {row["flags"] for row in answers.rows} == {"contract", "fast"}
    assert answers.title.startswith("of 1,024 rays")
    counted = [row for row in raw(times) if row["other_hits"] == "3"]
    assert [(row["kernel"], row["target"]) for row in counted] == [("wald_last_uv", "avx2")] * 2


def test_where_nothing_differs_there_is_no_table_of_answers(make):
    run = make("compilers", targets=("x86-64",))
    assert answers_table(run).rows == []
    assert "every ray has the bits of strict arithmetic for x86-64" in compilers_table(run).notes


def test_a_line_is_no_wider_than_a_screen(make):
    run = make("compilers", other_hits=WRONG, processes=2, rounds=1)
    for table in (compilers_table(run), answers_table(run)):
        lines = table.render("plain").splitlines()
        assert max(map(len, lines[2 : len(table.rows) + 4])) <= WIDEST


def test_a_run_without_samples_has_no_rows(make):
    assert compilers_table(make("compilers", rounds=0)).rows == []
