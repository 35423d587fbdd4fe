"""The roofline plot (Williams, Waterman & Patterson 2009)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.methods import methods_of
from rtbench.report.peaks import Peaks
from rtbench.report.roofline import Bound
from rtbench.report.tables import four_digits

if TYPE_CHECKING:
    from rtbench.records.run import Run

MANY = 10  # kernels that colours and shapes tell apart beside each other
_ABOVE, _BESIDE = 3.0, 4.0  # how far the scales go beyond what is drawn, as factors


@style.styled
def roofline_chart(run: "Run", found: Sequence[Bound], peaks: Peaks) -> Figure:
    """Draw the rate of each cell over its operations a byte, under the machine's roofs.

    Parameters
    ----------
    run : Run
    found : sequence of Bound
        At least one.
    peaks : Peaks

    Returns
    -------
    Figure
        A panel a precision and order; a mark a cell, one look a kernel (of many kernels: a
        method), with the 95 % interval of its time; roofs labelled with their measured values.
    """
    kernels = list(dict.fromkeys(one.cell["kernel"] for one in found))
    label = {kernel: kernel for kernel in kernels}
    if len(kernels) > MANY:  # a look for each method then, whatever its ending
        label = {name: method.base for name, method in methods_of(run, kernels).items()}
    names = list(dict.fromkeys(label.values()))
    look = style.looks(names)
    groups: dict[tuple, list[Bound]] = {}
    for one in sorted(found, key=_place):
        groups.setdefault((_precision(one), one.cell.get("order")), []).append(one)
    height = max(3.9, 0.26 * len(names))  # the legend stands beside
    figure, axes = style.grid(len(groups), 4.3, height, sharex=True, sharey=True)
    across, up = _scales(found, peaks)
    for number, (panel, ((precision, order), members)) in enumerate(
        zip(axes, groups.items(), strict=True)
    ):
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xlim(*across)
        panel.set_ylim(*up)
        _roofs(panel, peaks, precision, across, up)
        for one in members:
            _mark(panel, one, look[label[one.cell["kernel"]]])
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_locator(LogLocator(10))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_minor_formatter(NullFormatter())
        panel.set_title(", ".join(str(word) for word in (precision, order) if word))
        if number + 3 >= len(axes):
            panel.set_xlabel("arithmetic intensity (operations a byte)")
        if number % 3 == 0:
            panel.set_ylabel("operations a second (G/s)")
    last = axes[min(3, len(axes)) - 1]
    for name in names:
        last.plot([], [], color=look[name].color, marker=look[name].marker, ls="", label=name)
    marks.legend(last)
    noted = any(one.low is not None for one in found)
    words = [
        style.kernel_list(kernels),
        *(["a look a method"] if len(names) < len(kernels) else []),
        machine.processor(run),
        marks.INTERVAL_NOTE if noted else "no intervals",
        f"peaks of {peaks.machine}, one core",
    ]
    style.head(figure, "Roofline: what a kernel reaches of the machine's peaks", "; ".join(words))
    return figure


def _precision(one: Bound) -> str:
    return one.cell.get("precision") or "float32"


def _place(one: Bound) -> tuple[int, int]:
    """Return where its panel stands: precisions and orders as in every other chart."""
    order = one.cell.get("order")
    return (
        cells.PRECISIONS.index(_precision(one)),
        cells.ORDERS.index(order) if order in cells.ORDERS else -1,
    )


def _scales(found: Sequence[Bound], peaks: Peaks) -> tuple[tuple, tuple]:
    """Return the ends of both scales: all marks, and every corner of the roofs."""
    top = max(peaks.arithmetic("vector", _precision(one), "both").rate for one in found)
    widths = [level.bandwidth.rate for level in peaks.levels]
    across = [one.intensity for one in found]
    rates = [one.flops / one.ns for one in found]
    left = min(*across, top / max(widths) / _BESIDE) / 2
    right = max(*across, top / min(widths)) * _BESIDE
    return (left, right), (min(rates) / _ABOVE, top / 1e9 * _ABOVE)


def _roofs(panel, peaks: Peaks, precision: str, across: tuple, up: tuple) -> None:
    bits = peaks.register_bits(precision)
    flat = {
        form: peaks.arithmetic(form, precision, "both").rate / 1e9 for form in ("scalar", "vector")
    }
    fastest = max(level.bandwidth.rate for level in peaks.levels) / 1e9
    for form, rate in flat.items():
        begin = max(rate / fastest, across[0])
        panel.plot([begin, across[1]], [rate, rate], color=style.GREY, linewidth=1.1, zorder=1)
        width = f", {bits} bit" if form == "vector" and bits else ""
        panel.annotate(
            f"{form} add + mul{width}: {four_digits(rate)} G/s",
            (across[1], rate),
            xytext=(-3, 2.5),
            textcoords="offset points",
            ha="right",
            va="bottom",
            fontsize=7,
            color=style.GREY,
        )
    for level in peaks.levels:
        width = level.bandwidth.rate / 1e9
        begin = max(across[0], up[0] / width)
        end = max(flat.values()) / width
        if begin >= end:
            continue
        ends = np.array([begin, end])
        panel.plot(ends, ends * width, color=style.GREY, linewidth=0.8, zorder=1)
        place = end / 1.25
        panel.text(
            place,
            place * width * 1.06,
            f"{level.name} {four_digits(width)} GB/s",
            ha="right",
            va="bottom",
            # Along the line: its direction in the data at this point.
            rotation=np.degrees(np.arctan2(width, 1)),
            rotation_mode="anchor",
            transform_rotates_text=True,
            fontsize=7,
            color=style.GREY,
        )


def _mark(panel, one: Bound, look: style.Look) -> None:
    rate = one.flops / one.ns
    low = float("nan") if one.high is None else one.flops / one.high
    high = float("nan") if one.low is None else one.flops / one.low
    panel.errorbar(
        [one.intensity],
        [rate],
        yerr=marks.errors([rate], [low], [high]),
        color=look.color,
        marker=look.marker,
        markersize=5,
        elinewidth=1,
        linestyle="none",
        zorder=3,
    )
