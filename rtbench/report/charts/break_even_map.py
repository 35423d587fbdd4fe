"""The map of the kernel of least cost, over the number of triangles and rays per triangle."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from rtbench.report import machine
from rtbench.report.break_even import Costs, costs_of
from rtbench.report.charts import marks, style
from rtbench.report.charts.break_even import (
    cache_note,
    caches,
    endings_note,
    legend,
    panels,
    row_names,
    scales,
    title_of,
)
from rtbench.report.methods import Method, methods_of

if TYPE_CHECKING:
    from rtbench.records.run import Run

_COLUMNS, _ROWS = 241, 161  # of the raster that regions and their names are found on
_COARSE = 4  # the doubt is found on every fourth of them
_COLORS = (*style.OKABE_ITO[:-1], "#8C8C8C")  # hatching would not be seen on black
# How far a region's colour goes towards white, by the method's ending: letters stand on it.
_TINTS = (0.4, 0.72, 0.86)
_LETTER = 0.0185, 0.052  # of a panel's width and height
_JUMP = 0.04  # decades of rays from which on a border upright between two sizes is drawn
_LEAST_RAYS = 1.0
_LEAST = 0.0005  # of a panel: smaller regions are not in the legend


class Regions(NamedTuple):
    """Which kernel (index) is cheapest at each rays (rows) and triangles (columns)."""

    sizes: np.ndarray
    rays: np.ndarray
    winner: np.ndarray


@style.styled
def break_even_map(run: "Run") -> Figure:
    """Draw which kernel costs least, preparing included, over triangles and rays per triangle.

    Parameters
    ----------
    run : Run
        A run of the experiment ``break_even`` with times.

    Returns
    -------
    Figure
        A panel a hit ratio (columns) and precision (rows); regions coloured by the kernel of
        least ns a test + ns to prepare / rays. Between the sizes that were measured, which are
        the ticks, costs are straight lines over the logarithm. Hatched where another kernel is
        cheaper in more than 2.5 % of the resamples.
    """
    found = costs_of(run)
    if not found:
        return _nothing(run)
    methods = methods_of(run, list(dict.fromkeys(k for costs in found for k in costs.kernels)))
    names = row_names(list(methods.values()))
    top = _most_rays(found)
    maps = [_regions(costs, top) for costs in found]
    winners = [
        name
        for name in methods
        if any(
            name in costs.kernels and (area.winner == costs.kernels.index(name)).any()
            for costs, area in zip(found, maps, strict=True)
        )
    ]
    colors = _colors([methods[name] for name in winners])
    rows = len({costs.precision for costs in found})
    figure, axes = panels(rows, -(-len(found) // rows))
    doubtful = False
    for panel, costs, area in zip(axes, found, maps, strict=False):
        scales(panel, costs.sizes, _LEAST_RAYS, top)
        panel.set_xlim(area.sizes[0], area.sizes[-1])
        _fill(panel, costs, area, colors)
        doubtful |= _hatch(panel, costs, area)
        for name in costs.kernels:
            _name(panel, area, costs.kernels.index(name), names[name])
        panel.set_title(title_of(costs.density, costs.precision if rows > 1 else None), pad=15)
        caches(panel, run, costs.precision)
    keys = [
        Patch(facecolor=colors[name], edgecolor="black", linewidth=0.6, label=names[name])
        for name in winners
        if _seen(name, found, maps)
    ]
    if doubtful:
        keys.append(
            Patch(facecolor="white", edgecolor="#555555", hatch="/////", label="not told apart")
        )
    legend(figure, keys, [key.get_label() for key in keys])
    words = [
        f"cheapest of {style.kernel_list(list(methods))}",
        "ns a test + ns to prepare / rays",
        "hatched: best not told from another (95 %)" if doubtful else "",
        endings_note(list(methods.values())),
        cache_note(run),
        machine.processor(run),
    ]
    title = "Break-even map: the kernel of least cost, preparing included"
    style.head(figure, title, "; ".join(word for word in words if word))
    return figure


def _nothing(run: "Run") -> Figure:
    """Return the chart of a run that was cut off before any kernel had all its sizes."""
    figure, (panel,) = panels(1, 1)
    marks.absent_note(panel, "no kernel has all sizes")
    style.head(figure, "Break-even map", machine.processor(run))
    return figure


def _seen(name: str, found: list[Costs], maps: list[Regions]) -> bool:
    """Return whether a kernel's region is large enough somewhere to be found by its colour."""
    return any(
        name in costs.kernels and (area.winner == costs.kernels.index(name)).mean() > _LEAST
        for costs, area in zip(found, maps, strict=True)
    )


def _most_rays(found: list[Costs]) -> float:
    """Return the upper end of the scale of rays: a decade or more above the last change."""
    ends = [
        stretch.start
        for costs in found
        for place in range(len(costs.sizes))
        for stretch in costs.stretches(place)
    ]
    return float(np.clip(10 ** np.ceil(np.log10(max([*ends, 1.0])) + 0.5), 1e3, 1e5))


def _regions(costs: Costs, top: float) -> Regions:
    aside = 1.5 if len(costs.sizes) == 1 else 1.0  # one size is a stripe, not a line
    sizes = np.geomspace(costs.sizes[0] / aside, costs.sizes[-1] * aside, _COLUMNS)
    rays = np.geomspace(_LEAST_RAYS, top, _ROWS)
    there = costs.at(sizes)
    cost = there.test[:, None] + there.preparation[:, None] / rays[:, None]
    return Regions(sizes, rays, np.argmin(cost, axis=0))


def _colors(methods: list[Method]) -> dict[str, tuple[float, ...]]:
    """Return a colour for each kernel: a method's own, an ending's tint of it."""
    bases = list(dict.fromkeys(method.base for method in methods))
    found, tints = {}, dict.fromkeys(bases, 0)
    for method in methods:
        strong = np.array(to_rgb(_COLORS[bases.index(method.base) % len(_COLORS)]))
        tint = _TINTS[tints[method.base] % len(_TINTS)]
        found[method.kernel] = tuple(strong + (1 - strong) * tint)
        tints[method.base] += 1
    return found


def _fill(panel: Axes, costs: Costs, area: Regions, colors: dict) -> None:
    """Colour each kernel's region between exact borders, and draw the borders."""
    there = costs.at(area.sizes)
    spans = np.full((len(costs.kernels), 2, len(area.sizes)), np.nan)
    for place in range(len(area.sizes)):
        for stretch in there.stretches(place):
            spans[costs.kernels.index(stretch.kernel), :, place] = stretch.start, stretch.end
    least, top = area.rays[0] / 2, area.rays[-1] * 2
    for name, (low, high) in zip(costs.kernels, spans, strict=True):
        if name not in colors:
            continue
        low, high = np.clip(low, least, top), np.clip(high, least, top)
        # A column further on either side: between two columns one region ends and one begins.
        wide = _widened(low), _widened(high)
        panel.fill_between(area.sizes, *wide, color=colors[name], linewidth=0, zorder=1, label=name)
        panel.plot(area.sizes, np.where(low > least, low, np.nan), "k", linewidth=0.9, zorder=3)
        for place in np.flatnonzero(np.isnan(low[:-1]) != np.isnan(low[1:])):
            ends = np.nanmax(low[place : place + 2]), np.nanmax(high[place : place + 2])
            if ends[1] > ends[0] * 10**_JUMP:
                at = np.sqrt(area.sizes[place] * area.sizes[place + 1])
                panel.plot([at, at], ends, "k", linewidth=0.9, zorder=3)


def _widened(ends: np.ndarray) -> np.ndarray:
    """Return the ends of a region with one column more wherever it begins or stops."""
    left, right = np.append(ends[1:], np.nan), np.insert(ends[:-1], 0, np.nan)
    return np.where(~np.isnan(ends), ends, np.where(np.isnan(left), right, left))


def _hatch(panel: Axes, costs: Costs, area: Regions) -> bool:
    """Hatch where the cheapest kernel is not told from another; return whether there is any."""
    sizes, rays = area.sizes[::_COARSE], area.rays[::_COARSE]
    mask = costs.at(sizes).unresolved(rays)
    if mask is None or not mask.any():
        return False
    hatched = panel.contourf(
        sizes, rays, mask.T.astype(float), [0.5, 1.5], colors="none", hatches=["/////"], zorder=2
    )
    hatched.set_edgecolor("#6A6A6A")
    hatched.set_linewidth(0)
    return True


def _name(panel: Axes, area: Regions, kernel: int, name: str) -> None:
    """Write a kernel's name where its region is widest, in one line or two; else nowhere."""
    from scipy.ndimage import minimum_filter

    for words in (name, name.replace(", ", "\n", 1).replace(" (", "\n(", 1)):
        lines = words.split("\n")
        wide = int(_LETTER[0] * max(map(len, lines)) * _COLUMNS) + 2
        high = int(_LETTER[1] * len(lines) * _ROWS) + 2
        inside = (area.winner == kernel).astype(np.uint8)
        room = minimum_filter(inside, size=(high, wide), mode="constant", cval=0)
        if not room.any():
            continue
        rows, columns = np.nonzero(room)
        middle = np.hypot(rows - rows.mean(), columns - columns.mean()).argmin()
        panel.text(
            area.sizes[columns[middle]],
            area.rays[rows[middle]],
            words,
            ha="center",
            va="center",
            fontsize=7.5,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": (1, 1, 1, 0.75), "linewidth": 0},
            zorder=5,
        )
        return
