"""Leaks of a closed mesh: a row a kernel or peer, a panel a place of the mesh."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.layouts.watertightness import upper_bound

if TYPE_CHECKING:
    from rtbench.records.run import Run

AIMED = ("vertex", "edge")
MILLION = 1e6
APART = 0.26  # rows; between the precisions of one kernel


@style.styled
def leaks_chart(run: "Run") -> Figure:
    """Draw how many of a million rays at vertices and edges leak.

    Parameters
    ----------
    run : Run
        A run of the experiment ``watertightness``.

    Returns
    -------
    Figure
        Logarithmic; who leaks nothing stands, hollow, at the bound that this many rays allow.
    """
    frame = run.leaks
    frame = frame[frame["aim"].isin(AIMED)]
    who, places = cells.values(frame, "kernel"), cells.values(frame, "place")
    looks = style.looks(cells.values(frame, "precision"))
    figure, axes = style.panels(
        1, len(places), 1.9 + 2.5 * len(places), 1.1 + 0.24 * len(who), sharex=True, sharey=True
    )
    for panel, place in zip(axes[0], places, strict=True):
        for row, name in enumerate(who):
            block = cells.where(frame, place=place, kernel=name)
            _dots(panel, block, row, looks)
        marks.category_axis(panel, who)
        panel.set_title(place)
        panel.set_xlabel("leaks (rays of a million)")
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(numticks=5))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.10g}"))
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.grid(axis="x")
        panel.margins(x=0.06)
    _legend(figure, looks)
    asked = frame.groupby(["kernel", "precision", "place"])["rays"].sum()
    words = [
        f"{style.kernel_list([name for name in who if name in _kernels(frame)])}",
        f"{_count(int(asked.min()), int(asked.max()))} rays from inside at vertices and edges",
        machine.processor(run),
    ]
    style.head(figure, "Leaks of a closed mesh", "; ".join(words))
    return figure


def _count(least: int, most: int) -> str:
    return f"{most:,}" if least == most else f"{least:,} to {most:,}"


def _kernels(frame) -> list[str]:
    return cells.values(frame[frame["peer"].isna()], "kernel")


def _dots(panel, block, row: int, looks: dict[str, style.Look]) -> None:
    there = [name for name in looks if (block["precision"] == name).any()]
    for number, precision in enumerate(there):
        rows = block[block["precision"] == precision]
        leaks, rays = int(rows["leaks"].sum()), int(rows["rays"].sum())
        look = looks[precision]
        panel.plot(
            [upper_bound(leaks, rays) * MILLION],
            [row + APART * (number - (len(there) - 1) / 2)],
            marker=look.marker if leaks else "<",
            color=look.color,
            markerfacecolor=look.color if leaks else "white",
            markersize=4.4,
            linestyle="none",
        )


def _legend(figure: Figure, looks: dict[str, style.Look]) -> None:
    invisible = figure.axes[0]
    handles = [
        invisible.plot([], [], look.marker, color=look.color, markersize=4.4, label=name)[0]
        for name, look in looks.items()
    ]
    handles += invisible.plot(
        [],
        [],
        "<",
        color=style.GREY,
        markerfacecolor="white",
        markersize=4.4,
        label="none: below this, at 95 %",
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
