"""Marks that several charts share: points with 95 % intervals, value axes, legends."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer

from rtbench.report.charts.style import GREY, Look

NS_A_TEST = "time per test (ns)"
INTERVAL_NOTE = "bars: 95 % interval"
# Behind a text that stands on a grid line.
ON_PAPER = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none"}


def errors(middle: Sequence[float], low: Sequence, high: Sequence) -> np.ndarray | None:
    """Return what an error bar needs, or None if there is no interval at all.

    Parameters
    ----------
    middle : sequence of float
        The values.
    low, high : sequence of float
        The ends of their intervals; NaN where one is absent.

    Returns
    -------
    array of float, shape (2, N), or None
        Distances down and up; NaN where an interval is absent.
    """
    middle, low, high = (np.array(list(one), dtype=float) for one in (middle, low, high))
    distances = np.stack([middle - low, high - middle])
    # A bootstrap interval of a median holds the median; rounding in a file may undo that.
    return None if np.isnan(distances).all() else np.maximum(distances, 0)


def noted(*panels: Axes) -> str:
    """Return what is said of error bars: what they are, or that there are none."""
    bars = (
        each.has_xerr or each.has_yerr
        for axes in panels
        for each in axes.containers
        if isinstance(each, ErrorbarContainer)
    )
    return INTERVAL_NOTE if any(bars) else "no intervals"


def line(axes: Axes, x, frame, look: Look, label: str) -> ErrorbarContainer:
    """Draw a kernel's times over x with their intervals."""
    middle, low, high = (frame[name].astype(float) for name in ("ns_per_test", "ci_low", "ci_high"))
    return axes.errorbar(
        np.array(x, dtype=float),
        middle.to_numpy(),
        yerr=errors(middle, low, high),
        color=look.color,
        marker=look.marker,
        linestyle=look.dashes,
        elinewidth=1,
        markeredgewidth=0.6,
        label=label,
    )


def dot(axes: Axes, middle: float, low, high, y: float, look: Look, label: str | None = None):
    """Draw one value with its interval on a horizontal scale."""
    return axes.errorbar(
        [middle],
        [y],
        xerr=errors([middle], [low], [high]),
        color=look.color,
        marker=look.marker,
        linestyle="none",
        markersize=5,
        elinewidth=1.2,
        label=label,
    )


def from_zero(axes: Axes, smallest: float, largest: float, axis: str = "y") -> None:
    """Let a value axis start at zero unless that would waste more than half of it."""
    if smallest < 0.5 * largest:
        limits = axes.set_ylim if axis == "y" else axes.set_xlim
        limits(0, largest * 1.08)


def legend(axes: Axes, **options) -> None:
    """Put the legend to the right of the axes, where no data are."""
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0, **options)


def category_axis(axes: Axes, labels: Sequence[str]) -> None:
    """Label the rows of a horizontal chart, the first at the top, a faint line each."""
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y")
    axes.spines["left"].set_visible(False)


def absent_note(axes: Axes, text: str) -> None:
    """Say in an empty panel why it is empty."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=GREY)
