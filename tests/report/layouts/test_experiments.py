import pytest

from rtbench.report.layouts.experiments import (
    latency_table,
    penalty_table,
    stages_table,
    working_set_table,
)


def test_stages_add_up_to_the_kernel(make):
    rows = [row for row in stages_table(make("stages")).rows if row["kernel"] == "moller1"]
    assert [row["stage"] for row in rows][:2] == ["edges", "P = D x E2"]
    assert sum(row["added_percent"].value for row in rows) == pytest.approx(100)
    assert sum(row["added_ns"].value for row in rows) == pytest.approx(8.3, abs=0.3)
    assert rows[3]["added_ns"].value == pytest.approx(0.9, abs=0.15)


def test_a_stage_may_take_time_off(make):
    rows = {row["stage"]: row for row in stages_table(make("stages")).rows}
    assert rows["second product"]["added_ns"].text.startswith("-")


def test_working_set_has_a_column_a_kernel(make):
    table = working_set_table(make("working_set"))
    assert table.columns == ["pairs", "moller1", "badouel", "chirkov"]
    assert table.rows[0]["pairs"] == 256
    assert [row["pairs"] for row in table.rows] == sorted(row["pairs"] for row in table.rows)


def test_latency_ratio(make):
    rows = {row["kernel"].value: row for row in latency_table(make("latency")).rows}
    assert rows["moller1"]["ratio"].value == pytest.approx(17.5 / 6.2, rel=0.03)


def test_penalty_names_the_price(make):
    table = penalty_table(make("prediction", processes=2, rounds=2))
    assert table.notes[0] == "a mispredicted branch costs 5.2 ns [4.8, 5.5]"
    for row in table.rows:
        assert row["residual"].value == pytest.approx(
            row["measured"].value - row["predicted"].value
        )


def test_without_a_fit_no_rows(make):
    assert penalty_table(make("density", processes=1, rounds=1)).rows == []
