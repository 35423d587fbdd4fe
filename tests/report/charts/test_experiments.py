"""The charts of single experiments show the numbers of the records."""

import numpy as np
import pytest

from rtbench.report.charts.drift import deviations, drift_chart
from rtbench.report.charts.latency import latency_chart
from rtbench.report.charts.outcomes import outcomes_chart
from rtbench.report.charts.penalty import penalty_chart
from rtbench.report.charts.side_by_side import side_by_side
from rtbench.report.charts.stages import stages_chart
from rtbench.report.charts.working_set import working_set_chart


def test_working_set_has_the_caches_in_pairs(make):
    run = make("working_set")
    (axes,) = working_set_chart(run).axes
    upright = [line for line in axes.lines if len(set(line.get_xdata())) == 1]
    # 100 bytes a pair: L1d 32 KiB, L2 1 MiB, L3 32 MiB; the instruction cache holds no pairs.
    sizes = sorted(line.get_xdata()[0] for line in upright)
    assert sizes == pytest.approx([327.68, 10485.76, 335544.32])
    assert [text.get_text() for text in axes.texts] == ["L1d 32 KiB", "L2 1 MiB", "L3 32 MiB"]
    assert axes.get_xscale() == "log" and len(axes.lines) - len(upright) == 3
    assert len(axes.collections) == 3  # a band a kernel


def test_wide_working_sets_have_logarithmic_times(make, sample_runs, tmp_path):
    from rtbench.records.store import load_run

    cells = [
        {"kernel": "moller1", "precision": "float32", "triangles": pairs, "ns": ns}
        for pairs, ns in ((256, 4.0), (4096, 6.0), (1_000_000, 70.0))
    ]
    folder = sample_runs.write_run(
        tmp_path / "wide", "working_set", cells, ["kernel", "precision", "triangles"]
    )
    (axes,) = working_set_chart(load_run(folder)).axes
    assert axes.get_yscale() == "log"


def test_an_unknown_machine_has_no_cache_lines(make):
    run = make("working_set", machine={"cpu_model": "unknown", "caches": "unknown"})
    (axes,) = working_set_chart(run).axes
    assert len(axes.lines) == 3 and not axes.texts


def test_outcomes_stand_with_labels_frequencies_and_intervals(make):
    run = make("outcomes")
    figure = outcomes_chart(run)
    moller1 = next(axes for axes in figure.axes if axes.get_title("left") == "moller1")
    assert [t.get_text() for t in moller1.get_yticklabels()][:2] == [
        "0  hit",
        "1  det > 0, u outside",
    ]
    beside = [t.get_text() for axes in figure.axes[3:] for t in axes.get_yticklabels()]
    assert beside[0] == "12.07 %" and "0.0014 % (14)" in beside
    rows = run.outcomes[run.outcomes.kernel == "moller1"].sort_values("outcome")
    assert [bar[0].get_xdata()[0] for bar in moller1.containers] == pytest.approx(
        rows["ns_per_test"].to_numpy()
    )
    ends = [bar[2][0].get_segments()[0][:, 0] for bar in moller1.containers]
    assert np.array(ends) == pytest.approx(rows[["ci_low", "ci_high"]].to_numpy())


def test_an_outcome_without_pairs_is_not_timed(make):
    badouel = outcomes_chart(make("outcomes")).axes[1]
    assert [text.get_text() for text in badouel.texts] == ["not timed"]
    assert len(badouel.containers) == 4


def test_penalty_residuals_are_measured_less_predicted(make):
    run = make("prediction", processes=2, rounds=2)
    upper, lower = penalty_chart(run).axes
    points = [p for p in run.info["fit"]["points"] if p["kernel"] == "badouel"]
    badouel = next(c for c in upper.containers if c.get_label() == "badouel")
    assert badouel[0].get_ydata() == pytest.approx([p["measured"] for p in points])
    ends = np.array([segment[:, 1] for segment in badouel[2][0].get_segments()])
    assert ends == pytest.approx(np.array([[p["ci_low"], p["ci_high"]] for p in points]))
    assert lower.containers[1][0].get_ydata() == pytest.approx(
        [p["measured"] - p["predicted"] for p in points]
    )
    predicted = [
        line
        for line in upper.lines
        if list(line.get_ydata()) == pytest.approx([p["predicted"] for p in points])
    ]
    assert len(predicted) == 1


def test_drift_shows_every_sample_in_the_order_taken(make):
    run = make("density", processes=2, rounds=3)
    place, change, far, process, rounds = deviations(run)
    assert len(place) == len(run.samples) == 2 * 3 * 40
    assert list(process) == ([0] * 40 + [1] * 40) * 3
    assert list(rounds) == [0] * 80 + [1] * 80 + [2] * 80
    # Half the samples of each cell lie on either side of its median.
    assert abs(np.median(change)) < 0.1
    (axes,) = drift_chart(run).axes
    labelled = [line for line in axes.lines if not line.get_label().startswith("_")]
    dots = [line for line in labelled if line.get_label() != "median of a turn"]
    assert sum(len(line.get_xdata()) for line in dots) == len(place)
    assert bool(far.any()) == any("outlier" in line.get_label() for line in labelled)


def test_drift_does_not_hide_what_is_beyond_the_scale(make, sample_runs):
    run = make("density", processes=2, rounds=8)
    samples = run.samples
    samples.loc[samples.index[5], "ns"] = samples["ns"].iloc[5] * 50
    (axes,) = drift_chart(run).axes
    assert any("above the scale" in line.get_label() for line in axes.lines)
    assert axes.get_ylim()[1] < 1000


def test_stages_stand_end_to_end(make):
    run = make("stages")
    moller1 = stages_chart(run).axes[0]
    bars = moller1.patches
    ends = [bar.get_x() + bar.get_width() for bar in bars]
    assert [bar.get_x() for bar in bars][1:] == pytest.approx(ends[:-1])
    empty = run.summary[run.summary.kernel == "empty"]["ns_per_test"].iloc[0]
    assert bars[0].get_x() == pytest.approx(empty)
    whole = run.summary[run.summary.kernel == "moller1"].sort_values("stage_index")
    assert ends == pytest.approx(whole["ns_per_test"].to_numpy())
    assert [label.get_text() for label in moller1.get_yticklabels()] == list(whole["stage"])


def test_latency_has_two_points_a_kernel(make):
    run = make("latency")
    (axes,) = latency_chart(run).axes
    assert len(axes.containers) == 6
    shown = sorted(float(container[0].get_xdata()[0]) for container in axes.containers)
    assert shown == pytest.approx(sorted(run.summary["ns_per_test"]))


def test_latency_of_many_groups_wraps(make, sample_runs, tmp_path):
    from rtbench.records.store import load_run

    cell = ["kernel", "precision", "order", "density", "chain"]
    cells = [
        {
            "kernel": "moller1",
            "precision": "float32",
            "order": order,
            "density": density,
            "chain": chain,
            "ns": 5.0,
        }
        for order in ("repeat", "sweep")
        for density in (1.0, 0.0)
        for chain in ("independent", "dependent")
    ]
    run = load_run(sample_runs.write_run(tmp_path / "many", "latency", cells, cell))
    figure = latency_chart(run)
    assert [axes.get_title() for axes in figure.axes] == [
        "repeat, density 0",
        "repeat, density 1",
        "sweep, density 0",
        "sweep, density 1",
    ]
    assert figure.get_size_inches()[0] < 12


OURS = [
    {
        "kernel": kernel,
        "density": density,
        "ns_per_test": ns * (1 + density),
        "ci_low": ns * (1 + density) - 0.2,
        "ci_high": ns * (1 + density) + 0.3,
    }
    for kernel, ns in (("moller1", 4.0), ("chirkov", 5.0))
    for density in (0.0, 0.5, 1.0)
]


def test_side_by_side_is_relative_to_each_side_s_best():
    published = [
        row | {"ns_per_test": 10 * row["ns_per_test"], "ci_low": None, "ci_high": None}
        for row in OURS
    ]
    figure = side_by_side(OURS, published, "Table 4.2", "here and there")
    left, right = figure.axes
    assert [axes.get_title() for axes in (left, right)] == ["published", "here"]
    for axes in (left, right):
        moller1, chirkov = (container[0].get_ydata() for container in axes.containers)
        assert moller1 == pytest.approx([2 / 3, 1, 4 / 3])
        assert chirkov == pytest.approx([5 / 6, 5 / 4, 5 / 3])
    assert left.containers[0][2] == ()
    ends = right.containers[0][2][0].get_segments()[0][:, 1]
    assert ends == pytest.approx([3.8 / 6, 4.3 / 6])


def test_side_by_side_of_one_density_is_dots():
    rows = [row for row in OURS if row["density"] == 0.5]
    (axes,) = side_by_side(rows, rows, "Table 4.3").axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["moller1", "chirkov"]
    assert sorted(float(c[0].get_xdata()[0]) for c in axes.containers) == pytest.approx(
        [1, 1, 1.25, 1.25]
    )
