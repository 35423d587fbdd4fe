"""How packets break up: speed over the angle that their rays spread, with the exit and without."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rtbench.report import cells, packed
from rtbench.report.charts import marks, style
from rtbench.report.charts.packets import fastest_first, row_names, subtitle, top
from rtbench.report.charts.rates import SPEED, hit_ratio, rates
from rtbench.report.methods import variants

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

MOST = 4  # kernels whose lines can be told apart
_DODGE = 0.09  # roots of degrees between the marks of two kernels
_WITHOUT = (0, (4, 2))
_TITLES = {
    "general": "nothing in common",
    "common": "common origin",
    "parallel": "parallel",
}


def has_spread(run: "Run") -> bool:
    """Return whether a run of packets has several angles."""
    return len(packed.angles(cells.times_of(run))) > 1


@style.styled
def spread_chart(run: "Run") -> Figure:
    """Draw the speed of packets over the angle that their rays spread.

    Parameters
    ----------
    run : Run
        A run of the experiment ``packets`` with several angles.

    Returns
    -------
    Figure
        A panel for what the rays have in common (columns) and a hit ratio (rows; and precision):
        for each of four kernels, from the fastest to the slowest, a line with the any-lane exit,
        marks and intervals, and a thin dashed one of its colour without the exit. The scale of
        angles is that of their roots.
    """
    frame = cells.times_of(run)
    base = packed.base(run, frame)
    lanes = cells.where(frame, form=base["form"], width=base["width"])
    lanes = cells.where(lanes, **{name: base[name] for name in ("layout", "axes", "reciprocal")})
    everyone, kinds = fastest_first(frame, base), cells.values(lanes, "packet", packed.KINDS)
    names = chosen(everyone)
    parts = list(cells.groups(lanes, ("precision", "prepared", "density")))
    figure, axes = style.panels(
        len(parts),
        len(kinds),
        1.0 + 2.45 * len(kinds),
        2.45 * len(parts) + 0.9,
        sharex=True,
        sharey=True,
    )
    looks = style.looks(names)
    words = [text for _, text in variants(lanes)]
    for line, (group, block) in zip(axes, parts, strict=True):
        for panel, kind in zip(line, kinds, strict=True):
            rows = cells.where(block, packet=kind)
            for number, name in enumerate(names):
                aside = (number - (len(names) - 1) / 2) * _DODGE
                _lines(panel, cells.where(rows, kernel=name), looks[name], aside)
            panel.grid(axis="y")
            if line is axes[0]:
                panel.set_title(_TITLES.get(kind, kind))
        told = [hit_ratio(run, group["density"])]
        told += [str(group["precision"])] if len(words) > 1 else []
        line[0].set_ylabel("\n".join([", ".join(told), SPEED]))
    _scale(axes, packed.angles(lanes))
    axes[0][0].set_ylim(0, top(lanes.to_dict("records")) * 1.06)
    keys = [
        Line2D([], [], color=looks[n].color, marker=looks[n].marker, label=label)
        for n, label in zip(names, row_names(run, names), strict=True)
    ]
    keys.append(
        Line2D(
            [], [], color=style.GREY, linewidth=0.9, linestyle=_WITHOUT, label="without the exit"
        )
    )
    figure.legend(handles=keys, loc="outside lower center", ncols=3)
    shown = cells.where(lanes, kernel=names[0]) if len(names) == 1 else lanes
    about = [f"packets of {base['width']}; full lines: with the any-lane exit"]
    if len(names) < len(everyone):
        about.insert(0, f"{len(names)} of them from the fastest to the slowest")
    style.head(
        figure,
        f"{run.info.get('title') or 'Packets'}, over the angle that they spread",
        subtitle(run, shown, *about),
    )
    return figure


def chosen(names: list[str]) -> list[str]:
    """Return at most four of the kernels, the first and the last among them."""
    places = np.linspace(0, len(names) - 1, min(MOST, len(names)))
    return [names[round(place)] for place in places]


def _lines(panel: Axes, rows: "DataFrame", look: style.Look, aside: float) -> None:
    rows = rows.sort_values("angle")
    for way in ("none", "any"):
        found = cells.where(rows, exit=way)
        if not len(found):
            continue
        speeds = rates(found)
        middle, low, high = ([cell[end] for cell in speeds] for end in ("middle", "low", "high"))
        wide = _squared(_root(found["angle"].to_numpy(float)) + aside)
        panel.errorbar(
            wide,
            middle,
            yerr=marks.errors(middle, low, high) if way == "any" else None,
            color=look.color,
            marker=look.marker if way == "any" else "",
            linestyle="-" if way == "any" else _WITHOUT,
            linewidth=1.3 if way == "any" else 0.9,
            markersize=4,
            elinewidth=0.8,
            capsize=1.6,
            label=f"{rows['kernel'].iloc[0]} {way}",
        )


def _root(angle: np.ndarray) -> np.ndarray:
    return np.sign(angle) * np.sqrt(np.abs(angle))


def _squared(root: np.ndarray) -> np.ndarray:
    return np.sign(root) * root**2


def _scale(axes: list[list[Axes]], wide: list[float]) -> None:
    for panel in (panel for line in axes for panel in line):
        panel.set_xscale("function", functions=(_root, _squared))
        panel.set_xticks(wide, [f"{angle:g}" for angle in wide])
        panel.minorticks_off()
        room = 0.06 * _root(np.array(max(wide))) + 2 * _DODGE
        panel.set_xlim(_squared(-room), _squared(_root(np.array(max(wide))) + room))
    for panel in axes[-1]:
        panel.set_xlabel("angle of the packet (degrees)")
