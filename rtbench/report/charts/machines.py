"""Kernels on several machines, side by side (Blecha 2007, figure 4.3)."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from rtbench.errors import NotComparable
from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.means import Mean, common_means

if TYPE_CHECKING:
    from rtbench.records.run import Run

_SIDE_BY_SIDE = 3
_LABEL_CHARACTERS = 14
_LABEL_INCHES = 1.05
# The thesis put Moller and Chirkov next to each other, since they change places.
_FIRST = ("moller", "chirkov", "badouel")


@style.styled
def machines_chart(runs: Sequence["Run"]) -> Figure:
    """Draw the mean time of each kernel on each machine, and relative to the machine's fastest.

    Parameters
    ----------
    runs : sequence of Run
        At least one; what is drawn are the kernels, precisions and orders that they share.

    Returns
    -------
    Figure
        Two panels (times, normalised) for each precision and order that all runs have; side by
        side, or one above the other where there are many machines.

    Raises
    ------
    NotComparable
        If the runs share no kernel at the same densities.
    """
    means = common_means(runs)
    if not means.kernels:
        names = ", ".join(run.name for run in runs)
        raise NotComparable(f"no kernel, precision, order and densities common to {names}")
    names = sorted(means.kernels, key=_place)
    look = style.looks(names)
    labels = _labels(runs)
    columns = 2 if len(runs) <= _SIDE_BY_SIDE else 1
    rows = 2 * len(means.groups) // columns
    wide = len(runs) * max(0.16 * len(names) + 0.2, _LABEL_INCHES)
    figure, axes = style.panels(rows, columns, max(7.2, 2.0 + columns * (wide + 0.6)), 2.7 * rows)
    flat = [panel for row in axes for panel in row]
    pairs = zip(flat[::2], flat[1::2], means.groups.items(), strict=True)
    for times, ratios, ((precision, order), chosen) in pairs:
        for panel, relative in ((times, False), (ratios, True)):
            _bars(panel, chosen, names, look, relative)
            panel.set_xticks(range(len(runs)), labels if panel in flat[-columns:] else [], size=8)
            panel.tick_params(axis="x", length=0)
            panel.grid(axis="y")
        where = f"{precision}, {order}\n" if len(means.groups) > 1 else ""
        times.set_ylabel(where + marks.NS_A_TEST)
        ratios.set_ylabel("time / fastest (ratio)")
    for panel, title in zip(flat, ("time", "relative to the machine's fastest"), strict=False):
        panel.set_title(title)
    marks.legend(axes[0][-1])
    style.head(figure, "The kernels on several machines", _subtitle(means, names))
    return figure


def _bars(panel, chosen: list[dict[str, Mean]], names, look, relative: bool) -> None:
    width = 0.8 / len(names)
    for place, name in enumerate(names):
        at, heights, low, high = [], [], [], []
        for group, found in enumerate(chosen):
            if name not in found:
                continue
            mean = found[name]
            if relative:
                mean = mean.over(min(found.values(), key=lambda each: each.value))
            at.append(group + (place - (len(names) - 1) / 2) * width)
            heights.append(mean.value)
            low.append(mean.low)
            high.append(mean.high)
        panel.bar(
            at,
            heights,
            width * 0.92,
            yerr=marks.errors(heights, low, high),
            color=look[name].color,
            edgecolor="white",
            hatch=look[name].hatch,
            linewidth=0.5,
            ecolor="black",
            error_kw={"elinewidth": 0.9},
            label=name,
        )
    if relative:
        panel.axhline(1, color=style.GREY, linewidth=0.8, linestyle=(0, (4, 2)))


def _labels(runs: Sequence["Run"]) -> list[str]:
    """Return the processors, each with its run's name where two are the same."""
    names = [machine.processor(run) for run in runs]
    labels = []
    for run, name in zip(runs, names, strict=True):
        lines = textwrap.wrap(name, _LABEL_CHARACTERS)
        if names.count(name) > 1 and name != run.name:
            lines += textwrap.wrap(run.name, _LABEL_CHARACTERS)
        labels.append("\n".join(lines))
    return labels


def _subtitle(means, names) -> str:
    has = any(
        not np.isnan(mean.low)
        for group in means.groups.values()
        for found in group
        for mean in found.values()
    )
    groups = list(means.groups)
    words = [
        style.kernel_list(names),
        ", ".join(word for word in groups[0] if word) if len(groups) == 1 else "",
        f"mean over {means.over}",
        marks.INTERVAL_NOTE + " (where known)" if has else "no intervals",
    ]
    return "; ".join(word for word in words if word)


def _place(name: str) -> tuple:
    for place, start in enumerate(_FIRST):
        if name.startswith(start):
            return (place, name)
    return (len(_FIRST), name)
