import pytest

from rtbench.report.charts.packets import packets_chart
from rtbench.report.charts.packing import packing_chart
from rtbench.report.charts.spread import chosen, spread_chart


def rows_of(run, **wanted):
    rows = run.summary
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    return rows


def speed(run, **wanted):
    (ns,) = rows_of(run, **wanted).ns_per_test
    return 1000 / ns


def bars(axes):
    """Return label to the length of each bar."""
    return {
        container.get_label(): container.patches[0].get_width()
        for container in axes.containers
        if hasattr(container, "patches")
    }


def lines(axes):
    """Return label to the points of each line or mark."""
    return {container.get_label(): container[0] for container in axes.containers}


PLAIN = {"layout": "blocks", "axes": "stored", "reciprocal": "division"}


def test_a_bar_a_width_and_one_of_the_widest_with_the_exit(make):
    run = make("packets")
    figure = packets_chart(run)
    axes = figure.axes[1]
    assert axes.get_title() == "hit ratio 0.5 (exactly 0.518)"
    found = bars(axes)
    known = {"density": 0.5, "form": "rays", "packet": "general", "angle": 10.0}
    for kernel in ("wald_uv", "moller_trumbore_uv"):
        known["kernel"] = kernel
        scalar = found[f"{kernel} one by one, with early exits"]
        assert scalar == pytest.approx(speed(run, **known, width=1))
        for width in (4, 8, 16):
            expected = speed(run, **known, **PLAIN, width=width, exit="none")
            assert found[f"{kernel} packets of {width}"] == pytest.approx(expected)
        expected = speed(run, **known, **PLAIN, width=16, exit="any")
        assert found[f"{kernel} packets of 16, any-lane exit"] == pytest.approx(expected)
    assert len(found) == 3 * 5


def test_the_fastest_in_packets_is_at_the_top_with_its_gain(make):
    axes = packets_chart(make("packets")).axes[0]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["Wald", "Kensler-Shirley (stored)", "Möller-Trumbore"]
    assert float(axes.texts[0].get_text().removesuffix("x")) == pytest.approx(2.3 / 0.3, rel=0.03)


def test_lines_over_the_angle_with_the_exit_and_without(make):
    run = make("packets")
    figure = spread_chart(run)
    titles = [axes.get_title() for axes in figure.axes[:3]]
    assert titles == ["nothing in common", "common origin", "parallel"]
    for axes, kind in zip(figure.axes[3:], ("general", "common", "parallel"), strict=True):
        found = lines(axes)
        assert len(found) == 3 * 2
        known = {"kernel": "wald_uv", "density": 0.5, "form": "rays", "width": 16}
        for way in ("none", "any"):
            rows = rows_of(run, **known, **PLAIN, packet=kind, exit=way).sort_values("angle")
            points = found[f"wald_uv {way}"]
            assert list(points.get_ydata()) == pytest.approx(list(1000 / rows.ns_per_test))
            # Marks stand a little aside of one another.
            assert list(points.get_xdata()) == pytest.approx([0, 1, 10, 30, 90], abs=2)


def test_few_kernels_of_many_are_shown_the_ends_among_them():
    names = list("abcdefg")
    assert chosen(names) == ["a", "c", "e", "g"]
    assert chosen(names[:3]) == ["a", "b", "c"]


def test_a_panel_for_each_choice_of_how_lanes_are_filled(make):
    run = make("packets")
    figure = packing_chart(run)
    panels = {axes.get_title(): axes for axes in figure.axes}
    assert list(panels) == [
        "rays in lanes",
        "triangles in lanes",
        "pairs in lanes",
        "axes of projection",
        "reciprocal",
    ]
    found = lines(panels["triangles in lanes"])["wald_uv aos"].get_xdata()[0]
    known = {"kernel": "wald_uv", "form": "triangles", "layout": "aos", "density": 0.5}
    assert found == pytest.approx(speed(run, **known))
    found = lines(panels["axes of projection"])
    assert {label.split()[0] for label in found} == {"wald_uv"}
    told = [text.get_text() for text in panels["axes of projection"].texts]
    assert told == ["does not project"] * 2
    keys = panels["reciprocal"].get_legend().get_texts()
    assert [text.get_text() for text in keys] == ["division", "estimate"]
