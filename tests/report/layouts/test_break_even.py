import csv
import io

import pytest

from rtbench.report.layouts.break_even import cheapest_table, costs_table, pays_table


def raw(table):
    return list(csv.DictReader(io.StringIO(table.render("csv"))))


def test_rays_with_their_interval_over_the_sizes(make):
    run = make("break_even")
    table = pays_table(run)
    assert table.columns == [
        *("kernel", "ending", "density", "64", "512", "4096", "32768", "262144"),
    ]
    row = next(
        row
        for row in table.rows
        if (row["kernel"], row["ending"], row["density"].value) == ("wald", "last whole", 0.1)
    )
    told = next(
        one
        for one in run.info["break_even"]
        if (one["kernel"], one["density"], one["scene"]) == ("wald_last_whole_uv", 0.1, 512)
    )
    # 130 ns (1 + 200 / 512) over 6.8 - 4.2 ns.
    assert told["rays_per_triangle"] == pytest.approx(130 * (1 + 200 / 512) / 2.6, rel=1e-3)
    assert row["512"].value == told["rays_per_triangle"]
    assert row["512"].text == "70 [56, 90]"


@pytest.mark.parametrize(
    ("value", "low", "high", "text"),
    [
        (None, None, None, "never"),
        (None, 21.0, None, "never (> 21)"),
        (1234.4, 86.0, None, "1,234 [86, inf]"),
        (4.61, 1.44, 9.96, "4.6 [1.4, 10]"),
        (12.0, None, None, "12"),
    ],
)
def test_what_never_pays_is_said(make, value, low, high, text):
    run = make("break_even", processes=1, rounds=1)
    one = run.info["break_even"][0] | {"rays_per_triangle": value, "ci_low": low, "ci_high": high}
    run.info["break_even"] = [one]
    (row,) = pays_table(run).rows
    assert row[str(one["scene"])].text == text


def test_what_it_was_compared_with_stands_below(make):
    notes = pays_table(make("break_even")).notes
    assert (
        "against the fastest that stores nothing, hit ratio 0.5: kensler_shirley_last_tuv_uv"
    ) in notes


def test_the_cheapest_is_the_least_of_all_costs(make):
    run = make("break_even")
    prepared = {
        (row["kernel"], row["scene"]): row["ns_per_triangle"] for row in run.info["preparation"]
    }
    summary = run.summary
    for row in raw(cheapest_table(run)):
        ratio, scene = float(row["density"]), int(row["scene"])
        start, end = float(row["from_rays"]), float(row["to_rays"] or 1e6)
        rays = (max(start, 0.01) * end) ** 0.5  # somewhere between
        times = summary[(summary.density == ratio) & (summary.scene == scene)]
        costs = {
            kernel: ns + prepared.get((kernel, scene), 0) / rays
            for kernel, ns in zip(times.kernel, times.ns_per_test, strict=True)
        }
        assert row["name"] == min(costs, key=costs.get)


def test_stretches_of_a_size_follow_each_other(make):
    rows = [
        row
        for row in raw(cheapest_table(make("break_even")))
        if (row["density"], row["scene"]) == ("0.1", "512")
    ]
    assert float(rows[0]["from_rays"]) == 0 and rows[-1]["to_rays"] == ""
    assert [row["to_rays"] for row in rows[:-1]] == [row["from_rays"] for row in rows[1:]]
    assert rows[0]["stored"] == "none" and rows[-1]["stored"] == "precomputed"


def test_preparing_stands_behind_the_time(make):
    rows = costs_table(make("break_even")).rows
    wald = next(row for row in rows if row["kernel"] == "wald")
    plain = next(row for row in rows if row["kernel"] == "moller_trumbore")
    assert wald["4096"].text.endswith(" + 136") and "+" not in plain["4096"].text


def test_precision_is_a_column_only_where_there_are_several(make):
    both = make("break_even", precisions=("float32", "float64"), processes=2, rounds=2)
    one = make("break_even", name="one", processes=2, rounds=2)
    for table in (pays_table, cheapest_table, costs_table):
        assert "precision" in table(both).columns
        assert "precision" not in table(one).columns


def test_a_run_without_conclusion_has_no_break_even(make):
    run = make("break_even", processes=1, rounds=1)
    del run.info["break_even"]
    assert pays_table(run).rows == [] and costs_table(run).rows
