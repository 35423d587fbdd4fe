"""Speed-up against image error of subsampling, and what each technique saves, scene by scene."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.techniques import (
    CACHE,
    FIRST_HIT,
    Group,
    Techniques,
    Ways,
    root_mean_square,
)

_ROW = 0.42  # inches a scene
_LEAST = 0.1  # steps of 8 bits: below it the error's scale is linear, so that 0 has a place
# Of the speeds: room for a legend above the curves; a wider interval is cut off.
_BELOW, _ABOVE = 0.75, 3.5
TITLES = {CACHE: "shadow cache", FIRST_HIT: "first hits by rasterising"}


def subsampling_charts(ways: Ways) -> dict[str, Figure]:
    """Return the charts of a run of the experiment ``subsampling``, by file name."""
    found = {}
    for number, group in enumerate(ways.groups):
        suffix = "" if len(ways.groups) == 1 else f"-{number + 1}"
        found[f"subsampling{suffix}"] = subsampling_chart(ways, group)
    return found


def _points(ways: Ways, group: Group, scene: str | None, grid: str, how: str) -> list[tuple]:
    """Return (tolerance, error, speed-up estimate) of a curve; no scene: means over all."""
    found, cpu = [], not ways.free_cores
    for tolerance in ways.tolerances:
        way = (grid, tolerance, how)
        if scene is None:
            faster, told = ways.mean(group, way, cpu)
        else:
            faster, told = ways.faster(group, scene, way, cpu), ways.row(group, scene, way)
        if faster is not None and told is not None:
            found.append((tolerance, root_mean_square(told["mean_square"]), faster))
    return found


def _curve(axes: Axes, points: list[tuple], look: style.Look, marked: dict[float, str]) -> None:
    """Draw a curve; the marks are the tolerances'."""
    x = [error for _, error, _ in points]
    y = [faster.value for *_, faster in points]
    axes.plot(x, y, color=look.color, linestyle=look.dashes, zorder=2)
    for tolerance, error, faster in points:
        ends = faster.interval() or (np.nan, np.nan)
        axes.errorbar(
            [error],
            [faster.value],
            yerr=marks.errors([faster.value], [ends[0]], [ends[1]]),
            color=look.color,
            marker=marked[tolerance],
            markersize=5,
            markeredgecolor="white",
            markeredgewidth=0.5,
            elinewidth=0.9,
            zorder=3,
        )


@style.styled
def subsampling_chart(ways: Ways, group: Group) -> Figure:
    """Draw the speed-up of adaptive subsampling over the error that it costs.

    Parameters
    ----------
    ways : Ways
    group : (str, str)
        Kernel and precision.

    Returns
    -------
    Figure
        Left a curve a scene with the first grid, right a curve a grid, means over the scenes; the
        marks along a curve are the tolerances, error bars 95 % intervals.
    """
    scenes = ways.scenes(group)
    marked = dict(zip(ways.tolerances, _cycled(style.MARKERS, ways.tolerances), strict=True))
    first, second = ways.interpolations[0], ways.interpolations[1:]
    lines = [(grid, first) for grid in ways.grids] + [(ways.grids[0], how) for how in second]
    figure, (panels,) = style.panels(1, 2, 9.6, 4.6, sharex=True, sharey=True)
    by_scene = style.looks(scenes)
    by_line = style.looks([f"{grid} {how}" for grid, how in lines])
    values = [1.0]
    for scene in scenes:
        points = _points(ways, group, scene, ways.grids[0], first)
        _curve(panels[0], points, by_scene[scene], marked)
        values += [faster.value for *_, faster in points]
    for grid, how in lines:
        points = _points(ways, group, None, grid, how)
        _curve(panels[1], points, by_line[f"{grid} {how}"], marked)
        values += [faster.value for *_, faster in points]
    for axes, legend, looks in (
        (panels[0], "scene", by_scene),
        (panels[1], "grid", by_line),
    ):
        axes.set_xscale("symlog", linthresh=_LEAST, linscale=0.4)
        axes.set_xlim(left=-0.02)
        axes.set_yscale("log")
        axes.set_ylim(min(values) * _BELOW, max(values) * _ABOVE)
        axes.yaxis.set_major_locator(LogLocator(10, (1, 2, 5)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.axhline(1, color=style.GREY, linewidth=0.9, linestyle=(0, (4, 2)), zorder=0.5)
        axes.grid(axis="both")
        axes.set_xlabel("root mean square error (steps of 1/255)")
        handles = [
            Line2D([], [], color=look.color, linestyle=look.dashes, label=name)
            for name, look in looks.items()
        ]
        axes.add_artist(axes.legend(handles=handles, loc="upper left", title=legend))
    panels[0].set_ylabel(f"{_time(ways)} of the full picture / subsampled (ratio)")
    panels[0].set_title(f"grid {ways.grids[0]}, {first}")
    panels[1].set_title("means over the scenes")
    handles = [
        Line2D(
            [], [], color=style.GREY, marker=mark, linestyle="none", markersize=5, label=f"{t:g}"
        )
        for t, mark in marked.items()
    ]
    marks.legend(panels[1], handles=handles, title="tolerance")
    notes = [f"{group[0]}, {group[1]}", f"paired by rounds, {marks.noted(*panels)}"]
    notes += ["with tolerance 0 cells are filled whose corners are equal, whatever is inside"]
    notes += ["left of the first decade the error's scale is linear", machine.processor(ways.run)]
    style.head(figure, "Adaptive subsampling: speed-up against error", "; ".join(notes))
    return figure


def _time(run: Ways | Techniques) -> str:
    """Return which time is drawn: on a busy machine waiting would hide what is to be seen."""
    return "time" if run.free_cores else "processor time"


def _cycled(marks_: tuple[str, ...], names: list) -> list[str]:
    return [marks_[place % len(marks_)] for place in range(len(names))]


def techniques_charts(techniques: Techniques) -> dict[str, Figure]:
    """Return the charts of a run of the experiment ``techniques``, by file name."""
    found = {}
    for number, group in enumerate(techniques.groups):
        suffix = "" if len(techniques.groups) == 1 else f"-{number + 1}"
        found[f"techniques{suffix}"] = techniques_chart(techniques, group)
    return found


@style.styled
def techniques_chart(techniques: Techniques, group: Group) -> Figure:
    """Draw how many times as fast each technique makes a scene's picture.

    Parameters
    ----------
    techniques : Techniques
    group : (str, str)
        Kernel and precision.

    Returns
    -------
    Figure
        A line a scene, a point a technique with its 95 % interval; a line at 1: ordinary tracing.
    """
    scenes = techniques.scenes(group)
    threads = techniques.threads if techniques.free_cores else []
    known = [*TITLES, *(f"{n} threads" for n in threads)]
    looks = style.looks(known)
    figure, ((axes,),) = style.panels(1, 1, 7.0, 0.9 + _ROW * len(scenes))
    ticks, named = [1.0], set()
    for place, scene in enumerate(scenes):
        for aside, name in enumerate(known):
            if name in TITLES:
                estimate = techniques.faster(group, scene, name, cpu=not techniques.free_cores)
            else:
                estimate = techniques.threaded(group, scene, int(name.split()[0]))
            if estimate is None:
                continue
            ends = estimate.interval() or (np.nan, np.nan)
            y = place + (aside - (len(known) - 1) / 2) * 0.22
            label = None if name in named else TITLES.get(name, f"{name}, beside one")
            named.add(name)
            marks.dot(axes, estimate.value, *ends, y, looks[name], label)
            ticks += [estimate.value, *(end for end in ends if math.isfinite(end))]
    axes.axvline(1, color=style.GREY, linewidth=0.9, linestyle=(0, (4, 2)), zorder=0.5)
    axes.set_xscale("log")
    axes.set_xlim(min(ticks) / 1.1, max(ticks) * 1.1)
    axes.xaxis.set_major_locator(LogLocator(10, (1, 1.5, 2, 3, 5, 7)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    marks.category_axis(axes, scenes)
    axes.grid(axis="x")
    axes.set_xlabel(f"{_time(techniques)} without / with it (ratio)")
    marks.legend(axes)
    notes = [f"{group[0]}, {group[1]}", f"paired by rounds, {marks.noted(axes)}"]
    notes += ["right of 1: it saves time", machine.processor(techniques.run)]
    style.head(figure, "Shadow cache, first hits, threads", "; ".join(notes))
    return figure
