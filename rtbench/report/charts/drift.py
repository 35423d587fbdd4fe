"""Every sample in the order in which it was taken: drift, steps between processes, outliers."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from rtbench.records import derive, statistics
from rtbench.report import machine
from rtbench.report.charts import style

if TYPE_CHECKING:
    from rtbench.records.run import Run

# Points of an SVG beyond this number are stored as a picture: a reader cannot tell them apart.
_MOST_VECTOR_POINTS = 4000
_SHOWN_PERCENTILE = 99


@style.styled
def drift_chart(run: "Run") -> Figure:
    """Draw each sample's time relative to its cell's median against its place in the run.

    Parameters
    ----------
    run : Run
        A run with samples.

    Returns
    -------
    Figure
        Points in percent of the cell's median, the median of each process in each round as a
        line, outliers crossed, shaded bands for the rounds. What lies beyond the scale is drawn
        at its edge.
    """
    place, change, far, process, rounds = deviations(run)
    figure, axes = style.panels(1, 1, 7.4, 2.9)
    panel = axes[0][0]
    low, high = _limits(change, far)
    inside = np.clip(change, low, high)
    beyond = change != inside
    bitmap = len(place) > _MOST_VECTOR_POINTS
    _bands(panel, place, rounds)
    plain = ~far & ~beyond
    panel.plot(
        place[plain],
        inside[plain],
        linestyle="none",
        marker=".",
        markersize=2.6,
        markeredgewidth=0,
        color=style.OKABE_ITO[0],
        alpha=0.55,
        rasterized=bitmap,
        label="sample",
    )
    crossed = far & ~beyond
    if crossed.any():
        panel.plot(
            place[crossed],
            inside[crossed],
            linestyle="none",
            marker="x",
            markersize=3.6,
            color=style.WARNING_COLOR,
            rasterized=bitmap,
            label="outlier",
        )
    for edge, marker, where in ((low, "v", "below"), (high, "^", "above")):
        outside = beyond & (inside == edge)
        if outside.any():
            panel.plot(
                place[outside],
                inside[outside],
                linestyle="none",
                marker=marker,
                markersize=4,
                color=style.WARNING_COLOR,
                clip_on=False,
                label=f"{int(outside.sum())} {where} the scale",
            )
    middles, medians = _turn_medians(place, change, process, rounds)
    panel.plot(
        middles, np.clip(medians, low, high), color="black", linewidth=1, label="median of a turn"
    )
    panel.axhline(0, color=style.GREY, linewidth=0.7, linestyle=(0, (4, 2)))
    panel.set_xlim(-0.5 - 0.005 * len(place), len(place) - 0.5 + 0.005 * len(place))
    margin = 0.04 * (high - low)
    panel.set_ylim(low - margin, high + margin)
    panel.set_xlabel(
        "sample, in the order taken (shading: rounds; in each, the processes take turns)"
    )
    panel.set_ylabel("time against the cell's median (%)")
    panel.legend(
        loc="upper left", bbox_to_anchor=(0, -0.2), ncols=5, borderaxespad=0, markerscale=1.6
    )
    counts = f"{len(place):,} samples, {int(far.sum()):,} of them outliers (all kept)"
    words = [counts, machine.processor(run), run.name]
    style.head(figure, "Drift over the run", "; ".join(words))
    return figure


def deviations(run: "Run") -> tuple[np.ndarray, ...]:
    """Return every sample in the order in which it was taken.

    Parameters
    ----------
    run : Run
        A run with samples.

    Returns
    -------
    place : ndarray of int64, (n,)
        0, 1, 2 ...
    change : ndarray of float64, (n,)
        Percent above the median of the sample's cell.
    far : ndarray of bool, (n,)
        Whether the sample is an outlier of its cell.
    process, rounds : ndarray of int64, (n,)
        Where it was taken; a resumed run's processes count anew.
    """
    samples = run.samples
    change, far = np.zeros(len(samples)), np.zeros(len(samples), bool)
    numbered = samples.assign(row=np.arange(len(samples)))
    found = derive.cells(run, [*run.cell, *(["outcome"] if "outcome" not in run.cell else [])])
    for of_cell in found.values():
        rows = numbered.loc[of_cell.index, "row"].to_numpy()
        times = derive.times(of_cell)
        change[rows] = 100 * (times.ns / max(np.median(times.ns), 1e-12) - 1)
        far[rows] = statistics.outliers(times)
    # samples.csv only grows: its lines stand in the order in which the samples were taken.
    launch, process, rounds = (
        samples[name].to_numpy(np.int64) for name in ("launch", "process", "round")
    )
    return np.arange(len(samples)), change, far, launch * 1_000_000 + process, rounds


def _limits(change: np.ndarray, far: np.ndarray) -> tuple[float, float]:
    """Return a scale that fits the samples that are no outliers: drift is what is looked for."""
    usual = np.abs(change[~far]) if not far.all() else np.abs(change)
    reach = max(1.6 * float(np.percentile(usual, _SHOWN_PERCENTILE)), 1.0)
    return max(-reach, change.min() - 0.1), min(reach, change.max() + 0.1)


def _bands(panel, place: np.ndarray, rounds: np.ndarray) -> None:
    edges = np.flatnonzero(np.diff(rounds)) + 1
    for number, (first, last) in enumerate(zip([0, *edges], [*edges, len(place)], strict=True)):
        if number % 2:
            panel.axvspan(first - 0.5, last - 0.5, color="#F2F2F2", linewidth=0, zorder=0)


def _turn_medians(place, change, process, rounds) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle place and the median of each turn: one round of one process."""
    edges = np.flatnonzero(np.diff(process) | np.diff(rounds)) + 1
    turns = list(zip([0, *edges], [*edges, len(place)], strict=True))
    middles = [(first + last - 1) / 2 for first, last in turns]
    return np.array(middles), np.array([np.median(change[first:last]) for first, last in turns])
