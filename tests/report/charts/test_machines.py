import numpy as np
import pytest

from rtbench.errors import NotComparable
from rtbench.report.charts.machines import machines_chart


def bars(axes):
    return {
        container.get_label(): [patch.get_height() for patch in container.patches]
        for container in axes.containers
        if hasattr(container, "patches")
    }


def test_the_thesis_s_figure(published):
    """Table 4.3; Moller and Chirkov stand next to each other."""
    figure = machines_chart([published(f"blecha-pc{number}") for number in (1, 2, 3, 4)])
    times, ratios = figure.axes
    assert list(bars(times)) == ["moller1", "chirkov", "badouel"]
    seconds = {
        "moller1": [34.228, 27.694, 23.562, 18.409],
        "badouel": [45.268, 36.628, 38.907, 30.422],
        "chirkov": [30.703, 24.856, 26.024, 20.319],
    }
    for kernel, expected in seconds.items():
        assert bars(times)[kernel] == pytest.approx([2 * value for value in expected], rel=1e-3)
        fastest = np.min(list(seconds.values()), axis=0)
        assert bars(ratios)[kernel] == pytest.approx(np.array(expected) / fastest, rel=1e-3)
    labels = [label.get_text().replace("\n", " ") for label in ratios.get_xticklabels()]
    assert labels[0] == "AMD Athlon 64 3000+" and labels[3] == "Intel Core 2 Duo E6600"


def test_a_measured_run_beside_a_published_mean(make, published):
    run = make("density")
    times = machines_chart([published("blecha-pc2"), run]).axes[0]
    rows = run.summary[(run.summary.kernel == "moller1") & (run.summary.order == "repeat")]
    assert bars(times)["moller1"][1] == pytest.approx(rows["ns_per_test"].mean())


def test_measured_runs_have_intervals_that_hold_their_means(make):
    times = machines_chart([make("density"), make("density", name="other", seed=2)]).axes[0]
    bar = next(c for c in times.containers if hasattr(c, "patches"))
    for patch, segment in zip(bar.patches, bar.errorbar.lines[2][0].get_segments(), strict=True):
        assert segment[0, 1] < patch.get_height() < segment[1, 1]


def test_runs_of_one_machine_are_told_apart_by_name(make):
    figure = machines_chart([make("density"), make("density", name="other")])
    labels = [label.get_text() for label in figure.axes[-1].get_xticklabels()]
    assert labels == ["AMD EPYC 9B14\na-density", "AMD EPYC 9B14\nother"]


def test_each_common_order_has_its_panels(make):
    figure = machines_chart([make("density"), make("density", name="other")])
    assert len(figure.axes) == 4
    assert figure.axes[2].get_ylabel().startswith("float32, sweep")


def test_a_kernel_that_a_run_lacks_is_left_out(make):
    both = [make("density"), make("density", name="fewer", kernels=("moller1", "chirkov"))]
    assert list(bars(machines_chart(both).axes[0])) == ["moller1", "chirkov"]


def test_nothing_in_common(make, published):
    with pytest.raises(NotComparable, match="no kernel, precision, order and densities common"):
        machines_chart([published("blecha-pc2"), make("density", densities=(0.3,))])
