import numpy as np
import pytest

from rtbench.report.charts.soup import soup_chart

FOUR = ("tuv", "last_tuv", "whole", "last_whole")


def names(axes):
    return [label.get_text() for label in axes.get_yticklabels()]


def bars(axes):
    """Return the lengths of the bars from the top to the bottom."""
    patches = [bar for container in axes.containers for bar in getattr(container, "patches", [])]
    return [bar.get_width() for bar in sorted(patches, key=lambda bar: bar.get_y())]


def marks(axes):
    """Return kernel to its point and the ends of its interval."""
    found = {}
    for container in axes.containers:
        points, _, (ends,) = container
        (segment,) = ends.get_segments()
        found[container.get_label()] = (points, segment[:, 0])
    return found


def speeds(run, ratio):
    rows = run.summary[run.summary.density == ratio]
    return dict(zip(rows.kernel, 1000 / rows.ns_per_test, strict=True))


def test_a_bar_is_million_tests_a_second_and_the_fastest_is_at_the_top(make):
    run = make("soup")
    figure = soup_chart(run)
    assert [axes.get_title() for axes in figure.axes] == [
        "hit ratio 0.1 (exactly 0.104)",
        "hit ratio 0.5 (exactly 0.518)",
    ]
    assert names(figure.axes[0]) == [
        "Wald",
        "Kensler-Shirley (stored)",
        "Kensler-Shirley",
        "Signed areas",
        "Möller-Trumbore",
        "Half-spaces (perpendicular)",
    ]
    for axes, ratio in zip(figure.axes, (0.1, 0.5), strict=True):
        assert axes.get_xlabel() == "million tests per second"
        assert axes.get_xlim()[0] == 0
        assert bars(axes) == pytest.approx(sorted(speeds(run, ratio).values(), reverse=True))


def test_whiskers_are_the_intervals_of_the_speed(make):
    run = make("soup")
    axes = soup_chart(run).axes[0]
    rows = run.summary[run.summary.density == 0.1]
    expected = sorted(zip(1000 / rows.ci_high, 1000 / rows.ci_low, strict=True))
    drawn = [segment[:, 0] for lines in axes.collections for segment in lines.get_segments()]
    assert np.array(sorted(map(tuple, drawn))) == pytest.approx(np.array(expected))


def test_what_is_stored_stands_beside_a_bar_and_in_its_colour(make):
    figure = soup_chart(make("soup"))
    tags = [text.get_text() for text in figure.axes[0].texts]
    assert tags.count("stored: none") == 3 and tags.count("stored: precomputed") == 2
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "stored: none",
        "stored: normal",
        "stored: precomputed",
    ]


def test_precisions_lie_side_by_side(make):
    run = make("soup", precisions=("float32", "float64"), bases=("wald", "moller_trumbore"))
    axes = soup_chart(run).axes[0]
    found = bars(axes)
    assert names(axes) == ["Wald", "Möller-Trumbore"]
    assert len(found) == 4
    # The samples have 1.25 times the time in float64.
    assert [found[0] / found[1], found[2] / found[3]] == pytest.approx([1.25, 1.25], rel=0.05)


def test_four_endings_are_four_marks_of_two_colours_and_two_fillings(make):
    run = make("soup", bases=("wald", "kensler_shirley"), endings=FOUR)
    figure = soup_chart(run)
    assert names(figure.axes[0]) == ["Wald", "Kensler-Shirley"]
    found = marks(figure.axes[1])
    told = speeds(run, 0.5)
    assert found.keys() == told.keys()
    for kernel, (points, _) in found.items():
        assert points.get_xdata()[0] == pytest.approx(told[kernel])
    looks = {
        kernel: (points.get_color(), points.get_markerfacecolor() == "white")
        for kernel, (points, _) in found.items()
    }
    assert looks["wald_tuv_uv"] == looks["kensler_shirley_tuv_uv"]
    assert len({looks[f"wald_{ending}_uv"] for ending in FOUR}) == 4
    assert looks["wald_tuv_uv"][0] == looks["wald_whole_uv"][0] != looks["wald_last_tuv_uv"][0]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "division first, as tested",
        "division last, as tested",
        "division first, worst case (nothing skipped)",
        "division last, worst case (nothing skipped)",
    ]


def test_a_line_joins_the_place_of_the_division(make):
    run = make("soup", bases=("wald",), endings=FOUR)
    axes = soup_chart(run).axes[0]
    told = speeds(run, 0.1)
    joined = [line.get_xdata() for line in axes.lines if len(line.get_xdata()) == 2]
    ends = [pair for pair in map(tuple, joined) if pair[0] != pair[1]]
    expected = [
        (told["wald_tuv_uv"], told["wald_last_tuv_uv"]),
        (told["wald_whole_uv"], told["wald_last_whole_uv"]),
    ]
    assert np.array(sorted(ends)) == pytest.approx(np.array(sorted(expected)))


def test_orders_are_told_apart_where_a_method_has_both(make):
    endings = ("last_tuv", "last_uvt", "last_whole")
    figure = soup_chart(make("soup", bases=("moller_trumbore", "kensler_shirley"), endings=endings))
    found = marks(figure.axes[0])
    shapes = {found[f"moller_trumbore_{ending}_uv"][0].get_marker() for ending in endings}
    assert len(shapes) == 3
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "division last, t first",
        "division last, u, v first",
        "division last, worst case (nothing skipped)",
    ]
