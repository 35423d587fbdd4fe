import pytest

from rtbench.report.layouts.outcomes import operations_table, outcomes_table


def test_frequencies_of_the_thesis(published):
    rows = outcomes_table(published("blecha-pc1")).rows
    moller = [row for row in rows if row["kernel"] == "moller1"]
    assert [row["count"] for row in moller] == [120720, 317737, 121256, 318641, 121632, 14]
    assert moller[5]["fraction"].text == "0.0014"  # the thesis misprints 0,01 %
    # Table 4.5: 40.188 s for 500,000,000 tests.
    assert moller[0]["ns_per_test"].value == pytest.approx(80.376)


def test_a_group_without_pairs_has_no_time(make):
    rows = outcomes_table(make("outcomes")).rows
    parallel = next(row for row in rows if row["kernel"] == "badouel" and row["outcome"] == 1)
    assert (parallel["count"], parallel["fraction"].text) == (0, "0")
    assert parallel["ns_per_test"].value is None and parallel["pairs_timed"] is None
    assert next(row for row in rows if row["outcome"] == 5)["pairs_timed"] == 14


def test_several_densities_are_columns_but_rows_in_csv(make):
    table = outcomes_table(make("density", processes=2, rounds=2))
    assert "% at 0.25" in table.columns and len(table.rows) == 6
    hit = table.rows[0]
    assert (hit["% at 0.25"].text, hit["% at 1"].text) == ("25.00", "100.00")
    assert len(table.render("csv").splitlines()) == 1 + 6 * 5


def test_eleven_densities_do_not_make_eleven_columns(make):
    densities = tuple(place / 10 for place in range(11))
    table = outcomes_table(make("density", densities=densities, processes=2, rounds=2))
    assert sum(column.startswith("%") for column in table.columns) == 5
    assert "11 densities" in table.notes[0]
    assert len(table.render("csv").splitlines()) == 1 + 6 * 11


def test_operations_of_the_thesis(published):
    table = operations_table(published("blecha-operations"))
    counts = {
        row["kernel"]: [row[c] for c in ("add", "sub", "mul", "div", "cond")] for row in table.rows
    }
    assert counts == {
        "moller1": [9, 16, 25, 1, 4],
        "badouel": [8, 11, 13, 3, 4],
        "chirkov": [11, 20, 29, 1, 2],
    }
    assert table.rows[1]["crosses"] is None
