"""Mean relative error of t, u, v of every method (Havel 2008, illustration 11)."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.layouts.errors import QUANTITIES, unit_of, ways

if TYPE_CHECKING:
    from rtbench.records.run import Run

NAMES = {"t": "t, the distance", "u": "u, weight of v1", "v": "v, weight of v2"}
# Marker by where the division stands, colour by how what is stored was prepared.
DIVISIONS = {False: ("o", "division first"), True: ("s", "division last")}
PREPARED = {
    None: (style.OKABE_ITO[6], "nothing prepared"),
    "own": (style.OKABE_ITO[0], "prepared in own precision"),
    "double": (style.OKABE_ITO[1], "prepared in double"),
}
LAST, UV = "_last", "_uv"
APART = 0.21  # rows; between the dots of one method


@style.styled
def errors_chart(run: "Run") -> Figure:
    """Draw the mean relative errors against exact answers, with intervals, a row a method.

    Parameters
    ----------
    run : Run
        A run of the experiment ``relative_error``.

    Returns
    -------
    Figure
        A row of panels a precision, a panel a quantity; logarithmic.
    """
    frame = cells.where(run.errors, reference="exact")
    frame = frame[frame["mean"] > 0]  # none where no pair was used
    precisions = cells.values(frame, "precision")
    methods = list(dict.fromkeys(method_of(name)[0] for name in cells.values(frame, "kernel")))
    figure, axes = style.panels(
        len(precisions),
        len(QUANTITIES),
        1.9 + 2.5 * len(QUANTITIES),
        (0.75 + 0.28 * len(methods)) * len(precisions) + 0.75,
        sharex="row",
        sharey=True,
    )
    for line, precision in zip(axes, precisions, strict=True):
        for panel, quantity in zip(line, QUANTITIES, strict=True):
            block = cells.where(frame, precision=precision, quantity=quantity)
            _dots(panel, block, methods, unit_of(precision)[0])
            marks.category_axis(panel, methods)
            panel.set_title(f"{NAMES[quantity]}, {precision}")
            panel.set_xlabel(f"mean relative error ({unit_of(precision)[1]})")
            _logarithmic(panel)
    _legend(figure, frame)
    used = [int(count) for count in frame["hits"]]
    words = [
        f"against exact answers, over {min(used):,} to {max(used):,} hits with |x| > 0.001",
        machine.processor(run),
        marks.INTERVAL_NOTE,
    ]
    style.head(figure, "Relative errors", "; ".join(words))
    return figure


def method_of(kernel: str) -> tuple[str, bool]:
    """Return a kernel's method, and whether its name says that the division is last."""
    name = kernel.removesuffix(UV)
    return name.removesuffix(LAST), name.endswith(LAST)


def _logarithmic(panel) -> None:
    panel.set_xscale("log")
    panel.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    panel.xaxis.set_minor_locator(LogLocator(subs=range(1, 10)))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.grid(axis="x", which="both")


def _dots(panel, block, methods: list[str], unit: float) -> None:
    found: dict[str, list] = {}
    for kernel, prepared, rows in ways(block):
        method, last = method_of(kernel)
        found.setdefault(method, []).append((prepared, last, rows.iloc[0]))
    for method, dots in found.items():
        dots.sort(key=lambda dot: (list(PREPARED).index(dot[0]), dot[1]))
        for number, (prepared, last, row) in enumerate(dots):
            look = style.Look(PREPARED[prepared][0], DIVISIONS[last][0], "-", "")
            place = methods.index(method) + APART * (number - (len(dots) - 1) / 2)
            ends = (row[key] / unit for key in ("mean", "ci_low", "ci_high"))
            bar = marks.dot(panel, *ends, place, look)
            bar.lines[0].set_markersize(3.6)
            bar.lines[0].set_markerfacecolor("white" if last else look.color)


def _legend(figure: Figure, frame) -> None:
    handles = []
    lasts = {method_of(kernel)[1] for kernel in frame["kernel"]}
    there = {prepared for _, prepared, _ in ways(frame)}
    invisible = figure.axes[0]
    for prepared, (color, label) in PREPARED.items():
        if prepared in there:
            (mark,) = invisible.plot([], [], "D", color=color, markersize=4, label=label)
            handles.append(mark)
    for last, (marker, label) in DIVISIONS.items():
        if last in lasts:
            face = "white" if last else style.GREY
            (mark,) = invisible.plot(
                [],
                [],
                marker,
                color=style.GREY,
                markerfacecolor=face,
                markersize=4,
                label=label,
            )
            handles.append(mark)
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
