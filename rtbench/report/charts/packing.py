"""How lanes are filled: speed by layout of memory, choice of axes, and form of the reciprocal."""

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from rtbench.report import cells, packed
from rtbench.report.charts import marks, style
from rtbench.report.charts.packets import fastest_first, name_kernels, subtitle, top
from rtbench.report.charts.rates import SPEED, hit_ratio
from rtbench.report.methods import variants

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

_SHAPES = ("o", "s", "D")
_ROW = 0.3  # inches a kernel
_BELOW = 0.46  # inches from an axis to the legend below its label
_ACROSS = 3
_NARROWEST = 6.2  # inches: the title must fit
_SAID = {"fontsize": 7, "color": style.GREY}
_LAYOUTS = ("blocks", "struct of arrays", "array of structs")
_PANELS = (
    ("rays in lanes", "layout", packed.LAYOUTS, {"form": "rays"}, _LAYOUTS),
    ("triangles in lanes", "layout", packed.LAYOUTS, {"form": "triangles"}, _LAYOUTS),
    ("pairs in lanes", "layout", packed.LAYOUTS, {"form": "pairs"}, _LAYOUTS),
    ("axes of projection", "axes", packed.AXES, {}, packed.AXES),
    ("reciprocal", "reciprocal", packed.RECIPROCALS, {}, packed.RECIPROCALS),
)


def has_packings(run: "Run") -> bool:
    """Return whether a run of packets has several layouts, axes or forms of the reciprocal."""
    frame = cells.times_of(run)
    return bool(len(frame) and _there(frame, packed.base(run, frame)))


@style.styled
def packing_chart(run: "Run") -> Figure:
    """Draw what layout, axes and reciprocal do to the speed of lanes.

    Parameters
    ----------
    run : Run
        A run of the experiment ``packets`` for which `has_packings` is true.

    Returns
    -------
    Figure
        At the greatest hit ratio: a row a kernel, the fastest in packets at the top; a panel for
        the layout of each form, the axes and the reciprocal, and in it a mark for each choice with
        its interval.
    """
    frame = cells.times_of(run)
    base, forms = packed.base(run, frame), variants(frame)
    ratio = cells.densities(frame)[-1]
    frame = cells.where(frame, density=ratio)
    names, there = fastest_first(frame, base), _there(frame, base)
    rows = [
        (form, words, there[start : start + _ACROSS])
        for form, words in forms
        for start in range(0, len(there), _ACROSS)
    ]
    across = min(_ACROSS, len(there))
    figure, axes = style.panels(
        len(rows),
        across,
        max(1.9 + 2.15 * across, _NARROWEST),
        (1.25 + _ROW * len(names)) * len(rows),
        sharex=True,
        sharey=True,
    )
    for (form, words, shown), line in zip(rows, axes, strict=True):
        block = cells.where(frame, **form)
        for panel, (title, column, choices, changed, told) in zip(line, shown, strict=False):
            for place, name in enumerate(names):
                found = cells.where(block, kernel=name)
                _row(panel, place, found, base | changed, column, choices)
            panel.set_title(", ".join(filter(None, [title, words])))
            panel.grid(axis="x")
            panel.tick_params(labelbottom=True)
            panel.set_xlabel(SPEED)
            below = ScaledTranslation(0, -_BELOW, figure.dpi_scale_trans)
            panel.legend(
                handles=_keys(choices, told),
                loc="upper center",
                bbox_to_anchor=(0.5, 0),
                bbox_transform=panel.transAxes + below,
                borderaxespad=0,
                fontsize=8,
            )
        name_kernels(line[: len(shown)], run, names)
        for unused in line[len(shown) :]:
            unused.remove()
    axes[0][0].set_xlim(0, top(frame.to_dict("records")) * 1.05)
    about = [hit_ratio(run, ratio), f"{base['width']} at a time"]
    title = f"{run.info.get('title') or 'Packets'}, by layout, axes and reciprocal"
    style.head(figure, title, subtitle(run, frame, *about))
    return figure


def _there(frame: "DataFrame", base: dict) -> list[tuple]:
    """Return the panels for which some kernel has two choices."""
    found = []
    for panel in _PANELS:
        _, column, choices, changed, _ = panel
        several = [
            choice
            for choice in choices
            if packed.cell(frame, base, **changed, **{column: choice}) is not None
        ]
        if len(several) > 1:
            found.append(panel)
    return found


def _row(
    panel: Axes, place: int, rows: "DataFrame", base: dict, column: str, choices: tuple
) -> None:
    if place % 2 == 0:
        panel.axhspan(place - 0.5, place + 0.5, color="#F4F4F4", linewidth=0, zorder=0)
    found = {choice: packed.cell(rows, base, **{column: choice}) for choice in choices}
    if sum(cell is not None for cell in found.values()) < 2:
        said = "does not project" if column == "axes" else "-"
        panel.text(0.03, place, said, transform=panel.get_yaxis_transform(), va="center", **_SAID)
        return
    for number, (choice, cell) in enumerate(found.items()):
        if cell is None:
            continue
        middle, low, high = packed.speed(cell)
        panel.errorbar(
            [middle],
            [place + (number - (len(choices) - 1) / 2) * 0.27],
            xerr=marks.errors([middle], [low], [high]),
            color=style.OKABE_ITO[number],
            marker=_SHAPES[number],
            markersize=4.2,
            elinewidth=0.9,
            capsize=1.6,
            linestyle="none",
            zorder=3,
            label=f"{cell['kernel']} {choice}",
        )


def _keys(choices: tuple, told: tuple) -> list[Line2D]:
    return [
        Line2D([], [], color=style.OKABE_ITO[n], marker=_SHAPES[n], linestyle="none", label=words)
        for n, words in zip(range(len(choices)), told, strict=True)
    ]
