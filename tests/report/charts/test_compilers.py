import numpy as np
import pytest

from rtbench.report.charts.compilers import compilers_chart

WRONG = [("wald_last_uv", "avx2", "contract", 2), ("wald_last_uv", "avx2", "fast", 3)]


def marks(axes):
    """Return kernel, target and flags to the point, its height and the ends of its interval."""
    found = {}
    for container in axes.containers:
        points, _, (ends,) = container
        (segment,) = ends.get_segments()
        found[tuple(container.get_label().split())] = points, segment[:, 0]
    return found


def test_a_mark_is_million_tests_a_second_with_its_interval(make):
    run = make("compilers")
    figure = compilers_chart(run)
    assert [axes.get_title() for axes in figure.axes] == [
        "hit ratio 0.1 (exactly 0.104)",
        "hit ratio 0.5 (exactly 0.518)",
    ]
    for axes, ratio in zip(figure.axes, (0.1, 0.5), strict=True):
        found = marks(axes)
        rows = run.summary[run.summary.density == ratio]
        assert len(found) == len(rows) == 27
        for row in rows.itertuples():
            points, ends = found[row.kernel, row.target, row.flags]
            assert points.get_xdata()[0] == pytest.approx(1000 / row.ns_per_test)
            assert ends == pytest.approx(np.array([1000 / row.ci_high, 1000 / row.ci_low]))
        assert axes.get_xlabel() == "million tests per second"


def test_targets_are_rows_and_flags_are_colours(make):
    axes = compilers_chart(make("compilers")).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == (
        ["x86-64", "avx2", "avx512-512"] * 3
    )
    found = marks(axes)
    places = dict(zip(axes.get_yticks(), ["x86-64", "avx2", "avx512-512"] * 3, strict=True))
    for (_, target, _), (points, _) in found.items():
        near = min(places, key=lambda place: abs(place - points.get_ydata()[0]))
        assert places[near] == target
    colors = {flags: points.get_color() for (_, _, flags), (points, _) in found.items()}
    assert len(set(colors.values())) == 3
    assert [text.get_text() for text in axes.texts] == [
        "Möller-Trumbore: u, v first",
        "Wald: t first",
        "Möller-Trumbore: nothing skipped",
    ]


def test_another_t_is_a_hollow_mark(make):
    found = marks(compilers_chart(make("compilers")).axes[0])
    hollow = {key for key, (points, _) in found.items() if points.get_markerfacecolor() == "white"}
    assert hollow == {
        (kernel, target, flags)
        for kernel, target, flags in found
        if flags != "strict" and target != "x86-64"
    }


def test_another_triangle_is_a_cross_with_the_number_of_rays(make):
    figure = compilers_chart(make("compilers", other_hits=WRONG))
    axes = figure.axes[0]
    crosses = {key for key, (points, _) in marks(axes).items() if points.get_marker() == "X"}
    assert crosses == {("wald_last_uv", "avx2", "contract"), ("wald_last_uv", "avx2", "fast")}
    assert "contract 2, fast 3 rays" in [text.get_text() for text in axes.texts]
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "another triangle on so many rays" in words


def test_without_other_answers_the_legend_is_that_of_flags(make):
    figure = compilers_chart(make("compilers", targets=("x86-64",)))
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["strict", "contract", "fast"]
