"""Times over the number of triangles: builders with their exponents, rays through their trees."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.charts.trees import BUILD, NS_A_RAY, words_of
from rtbench.report.layouts.tree_growth import cpu_seconds, grouped_builds, is_usual
from rtbench.report.tree_cells import NAIVE, timed_name, tree_name
from rtbench.report.tree_growth import both_exponents
from rtbench.report.trees import Trees

if TYPE_CHECKING:
    from rtbench.records.run import Run

TRIANGLES = "triangles"


class Curve(NamedTuple):
    """Times by size: the middle, and the ends of what is drawn as an error bar."""

    name: str
    sizes: list[int]
    middle: list[float]
    low: list[float]
    high: list[float]


@style.styled
def builders_chart(run: "Run") -> Figure:
    """Draw seconds to build over the number of triangles, a line a builder with its exponent.

    Parameters
    ----------
    run : Run
        A run of the experiment ``tree_builders``.

    Returns
    -------
    Figure
        Both scales logarithmic, a panel a model; the medians of the processes with their range.
        Variants of a builder, other axes, candidates or overlaps, are in the table.
    """
    groups = grouped_builds(run)
    by_model: dict[str, list[Curve]] = {}
    for key, builds in groups.items():
        if is_usual(key):
            by_model.setdefault(key[0], []).append(_of_builds(str(key[1]), builds))
    return _build_figure(by_model, run, "Builders: seconds over the number of triangles", [])


def growth_charts(trees: Trees) -> dict[str, Figure]:
    """Return the charts of families of sizes: building, and a ray, over N; by file name."""
    if not trees.families:
        return {}
    found = {"time_over_n": rays_chart(trees)}
    by_model: dict[str, list[Curve]] = {}
    for family, models in trees.families.items():
        builds: dict[str, list[tuple[int, np.ndarray]]] = {}
        for model in models:
            for tree in trees.built(model):
                name = tree_name(tree.key)
                name += f", blocks of {tree.block}" if (tree.block or 1) > 1 else ""
                builds.setdefault(name, []).append((trees.triangles(model), tree.seconds))
        by_model[family] = [
            Curve(
                name,
                [n for n, _ in points],
                *([float(f(s)) for _, s in points] for f in (np.median, np.min, np.max)),
            )
            for name, points in builds.items()
        ]
    title = "Building over the number of triangles"
    found["build_over_n"] = _build_chart(by_model, trees.run, title, words_of(trees, trees.models))
    return found


@style.styled
def _build_chart(by_model: dict, run: "Run", title: str, notes: list[str]) -> Figure:
    return _build_figure(by_model, run, title, notes)


def _build_figure(by_model: dict, run: "Run", title: str, notes: list[str]) -> Figure:
    most = max(len(curves) for curves in by_model.values())
    # The legend of a panel stands beside it, two lines a curve.
    figure, axes = style.grid(len(by_model), 5.6, max(3.5, 0.35 * most + 0.6), beside=0.4)
    names = list(dict.fromkeys(curve.name for curves in by_model.values() for curve in curves))
    looks = style.looks(names)
    for number, (panel, (model, curves)) in enumerate(zip(axes, by_model.items(), strict=True)):
        for curve in curves:
            whole, top = both_exponents(curve.sizes, curve.middle)
            told = "" if whole is None else f": N^{whole.text}"
            told += "" if top is None else f"\n  largest half {top.text}"
            _line(panel, curve, looks[curve.name], curve.name + told)
        _scales(panel, logarithmic=True)
        panel.set_xlabel(TRIANGLES)
        if number % 3 == 0:
            panel.set_ylabel(BUILD)
        panel.set_title(model)
        marks.legend(panel, fontsize=7.5)
    notes = [*notes, "bars: range of the processes", "N^: fitted exponent with its 95 % interval"]
    notes = [f"{len(names)} builders" if not notes else "", *notes, machine.processor(run)]
    style.head(figure, title, "; ".join(filter(None, notes)))
    return figure


def _of_builds(name: str, builds: Sequence[dict]) -> Curve:
    sizes = sorted({build["triangles"] for build in builds})
    taken = [[cpu_seconds(b) for b in builds if b["triangles"] == size] for size in sizes]
    ends = ([float(f(each)) for each in taken] for f in (np.median, np.min, np.max))
    return Curve(name, sizes, *ends)


@style.styled
def rays_chart(trees: Trees) -> Figure:
    """Draw nanoseconds a ray over the number of triangles: a panel a family and ray set.

    Parameters
    ----------
    trees : Trees
        With families of three sizes or more.

    Returns
    -------
    Figure
        A line a tree and library with its 95 % interval; the naive way, beyond the scale of all
        others, is left out.
    """
    groups: dict[tuple, dict[str, list]] = {}
    for family, models in trees.families.items():
        for model in models:
            for one in trees.of(model):
                if one.cell["way"] == NAIVE:
                    continue
                several = len({o.cell["way"] for o in trees.of(model) if o.ours}) > 1
                name = timed_name(one)
                name += f", {one.cell['way']}" if several and one.ours else ""
                lines = groups.setdefault((family, one.cell["rays"]), {})
                lines.setdefault(name, []).append((trees.triangles(model), trees.median(one)))
    names = list(dict.fromkeys(name for lines in groups.values() for name in lines))
    looks = style.looks(names)
    figure, axes = style.grid(len(groups), 3.2, 3.1, beside=2.4)
    for number, (panel, ((family, rays), lines)) in enumerate(
        zip(axes, groups.items(), strict=True)
    ):
        for name, points in lines.items():
            ends = [estimate.interval() or (np.nan, np.nan) for _, estimate in points]
            curve = Curve(
                name,
                [n for n, _ in points],
                [estimate.value for _, estimate in points],
                [low for low, _ in ends],
                [high for _, high in ends],
            )
            _line(panel, curve, looks[name], name)
        _scales(panel, logarithmic=False)
        panel.set_title(f"{family}, {rays} rays")
        if number + 3 >= len(groups):
            panel.set_xlabel(TRIANGLES)
        if number % 3 == 0:
            panel.set_ylabel(NS_A_RAY)
    marks.legend(axes[min(3, len(axes)) - 1])
    notes = [*words_of(trees, trees.models), marks.INTERVAL_NOTE, machine.processor(trees.run)]
    style.head(figure, "Time per ray over the number of triangles", "; ".join(notes))
    return figure


def _line(panel: Axes, curve: Curve, look: style.Look, label: str) -> None:
    panel.errorbar(
        curve.sizes,
        curve.middle,
        yerr=marks.errors(curve.middle, curve.low, curve.high),
        color=look.color,
        marker=look.marker,
        linestyle=look.dashes,
        elinewidth=1,
        markeredgewidth=0.6,
        label=label,
    )


def _scales(panel: Axes, logarithmic: bool) -> None:
    panel.set_xscale("log")
    panel.xaxis.set_major_locator(LogLocator(10))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    if logarithmic:
        panel.set_yscale("log")
        panel.yaxis.set_major_locator(LogLocator(10))
        panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
        panel.yaxis.set_minor_formatter(NullFormatter())
    else:
        panel.set_ylim(bottom=0)
    panel.grid()
