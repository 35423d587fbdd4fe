import numpy as np
import pytest

from rtbench.report import cells
from rtbench.report.charts.density import density_chart


def chart(run):
    (part,) = cells.parts(run)
    return density_chart(run, part)


def lines(axes):
    """Return label to line and the ends of its intervals."""
    found = {}
    for container in axes.containers:
        points, _, bars = container
        ends = np.array([segment[:, 1] for bar in bars for segment in bar.get_segments()])
        found[container.get_label()] = (points, ends)
    return found


def test_a_line_a_kernel_and_a_panel_an_order(make):
    figure = chart(make("density"))
    assert [axes.get_title().split(":")[0] for axes in figure.axes] == ["repeat", "sweep"]
    for axes in figure.axes:
        assert list(lines(axes)) == ["moller1", "badouel", "chirkov", "(empty loop)"]
        assert axes.get_xlabel() == "density (share of pairs that hit)"
    assert figure.axes[0].get_ylabel() == "time per test (ns)"


def test_points_and_bars_are_those_of_the_records(make):
    run = make("density")
    for axes, order in zip(chart(run).axes, ("repeat", "sweep"), strict=True):
        for kernel, (points, ends) in lines(axes).items():
            name = "empty" if kernel == "(empty loop)" else kernel
            rows = run.summary[(run.summary.kernel == name) & (run.summary.order == order)]
            rows = rows.sort_values("density")
            assert points.get_xdata() == pytest.approx(rows["density"].to_numpy())
            assert points.get_ydata() == pytest.approx(rows["ns_per_test"].to_numpy())
            assert ends == pytest.approx(rows[["ci_low", "ci_high"]].to_numpy())


def test_colours_and_markers_of_the_lines_are_distinct(make):
    found = [points for points, _ in lines(chart(make("density")).axes[0]).values()]
    assert len({line.get_color() for line in found}) == 4
    assert len({line.get_marker() for line in found}) == 4


def test_one_density_is_dots_with_bars(make):
    run = make("density", densities=(0.3,), orders=("repeat",))
    (axes,) = chart(run).axes
    assert [t.get_text() for t in axes.get_yticklabels()] == [
        "moller1",
        "badouel",
        "chirkov",
        "(empty loop)",
    ]
    assert axes.get_xlabel() == "time per test (ns)"
    for container, kernel in zip(axes.containers, ("moller1", "badouel", "chirkov"), strict=False):
        row = run.summary[run.summary.kernel == kernel].iloc[0]
        assert container[0].get_xdata() == pytest.approx([row["ns_per_test"]])
        (segment,) = container[2][0].get_segments()
        assert segment[:, 0] == pytest.approx([row["ci_low"], row["ci_high"]])


def test_published_times_have_no_bars(published):
    run = published("blecha-pc1")
    part = next(part for part in cells.parts(run) if part.suffix == "-4.2")
    (axes,) = density_chart(run, part).axes
    assert [container[2] for container in axes.containers] == [(), (), ()]
    moller1 = axes.containers[0][0]
    # Table 4.2: 28.297 s and 40.172 s for 500,000,000 tests.
    assert moller1.get_ydata()[[0, -1]] == pytest.approx([56.594, 80.344])


def test_orders_share_an_axis_unless_one_would_be_squeezed(make):
    near = chart(make("density")).axes
    assert near[0].get_ylim() == near[1].get_ylim()
    ends = {"moller1": (2.0, 2.1), "empty": (0.4, 0.4)}
    far = chart(make("density", name="far", kernels=("moller1",), ends=ends)).axes
    assert far[0].get_ylim()[1] < 0.5 * far[1].get_ylim()[1]


def test_precisions_are_rows(make):
    run = make("density", precisions=("float32", "float64"), processes=2, rounds=2)
    labels = [axes.get_ylabel() for axes in chart(run).axes]
    assert labels == ["float32: time per test (ns)", "", "float64: time per test (ns)", ""]


def test_four_orders_make_two_rows(make):
    orders = ("repeat", "sweep", "sorted", "shuffled")
    axes = chart(make("density", orders=orders, processes=2, rounds=2)).axes
    assert [panel.get_title().split(":")[0] for panel in axes] == list(orders)
    assert axes[0].get_subplotspec().get_gridspec().get_geometry() == (2, 2)
    assert [bool(panel.get_xlabel()) for panel in axes] == [False, False, True, True]
