"""Trees: what building takes beside what a ray takes, and from how many rays a build pays."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.tree_cells import PEER, Timed, is_peer, key_of, timed_name, tree_name
from rtbench.report.tree_pays import NEVER, Total, crossing, totals
from rtbench.report.trees import Trees

if TYPE_CHECKING:
    from rtbench.report.tree_cells import Built

NS_A_RAY = "CPU time per ray (ns)"
BUILD = "CPU time to build (s)"
RAYS = "rays"
_SHADES = {"primary": "#0072B2", "shadow": "#E69F00", "random": "#009E73", "aimed": "#CC79A7"}
_ROW = 0.115  # inches a bar
_WIDEST = 1.4  # how far an interval may reach beyond the slowest
_MODELS = 4  # in one figure


def trees_charts(trees: Trees) -> dict[str, Figure]:
    """Return the bars of every model, four in a figure, by file name."""
    found = {}
    models = [m for m in trees.alone if trees.of(m) and not trees.only_kernels(m)]
    for number, start in enumerate(range(0, len(models), _MODELS), 1):
        name = "build_and_trace" if number == 1 else f"build_and_trace-{number}"
        found[name] = bars_chart(trees, models[start : start + _MODELS])
    if models and any(_of_all(trees, models)):
        found["pays"] = pays_chart(trees, models)
    return found


def chosen(trees: Trees, model: str, rays: str) -> list[Timed]:
    """Return a cell a tree and library: of the first kernel, in the first way that goes there."""
    timed = trees.of(model, rays)
    first = next((one for one in timed if one.ours), None)
    found: dict[tuple, Timed] = {}
    for one in timed:
        if first is not None and one.ours and one.form == first.form:
            found.setdefault(one.key, one)
        elif one.cell["way"] == PEER:
            found.setdefault((one.cell["kernel"],), one)
    return list(found.values())


def words_of(trees: Trees, models: Sequence[str]) -> list[str]:
    """Return kernel, precision and ways of what `chosen` takes, in words for a subtitle."""
    ours = [
        one
        for model in models
        for rays in trees.ray_sets(model)
        for one in chosen(trees, model, rays)
        if one.ours
    ]
    forms = dict.fromkeys(f"{one.cell['kernel']} {one.cell['precision']}" for one in ours)
    ways = dict.fromkeys(one.cell["way"] for one in ours)
    return [", ".join(forms), f"ways: {', '.join(ways)}"] if ours else []


@style.styled
def bars_chart(trees: Trees, models: Sequence[str]) -> Figure:
    """Draw seconds to build beside nanoseconds a ray: a row of panels a model, bars a tree.

    Parameters
    ----------
    trees : Trees
    models : sequence of str

    Returns
    -------
    Figure
        Bars from 0; of building the range of the processes, of rays the 95 % interval.
    """
    lists = [_rows(trees, model) for model in models]
    sets = trees.ray_sets()
    heights = [0.62 + (_ROW * len(sets) + 0.09) * len(rows) for rows in lists]
    figure, axes = style.panels(
        len(models), 2, 7.6, sum(heights) + 0.35, gridspec_kw={"height_ratios": heights}
    )
    for (left, right), model, rows in zip(axes, models, lists, strict=True):
        names = [name for name, _, _ in rows]
        for place, (_, tree, cells) in enumerate(rows):
            _build_bar(left, place, tree)
            for number, rays in enumerate(sets):
                if rays in cells:
                    _ray_bar(trees, right, place, number, len(sets), cells[rays])
        marks.category_axis(left, names)
        left.grid(visible=False, axis="y")
        left.grid(axis="x")
        right.grid(axis="x")
        right.set_yticks([])
        right.spines["left"].set_visible(False)
        right.set_ylim(len(names) - 0.5, -0.5)
        left.set_title(f"{model}, {trees.triangles(model):,} triangles", loc="left")
        left.set_xlim(left=0)
        # No interval, of too few processes, takes the scale for itself.
        medians = [trees.median(one).value for _, _, cells in rows for one in cells.values()]
        right.set_xlim(0, min(right.get_xlim()[1], _WIDEST * max(medians)))
    axes[-1][0].set_xlabel(BUILD)
    axes[-1][1].set_xlabel(NS_A_RAY)
    keys = [Patch(color=_SHADES[rays], label=f"{rays} rays") for rays in sets if rays in _SHADES]
    keys.append(Patch(color="#A6A6A6", label="build"))
    figure.legend(handles=keys, loc="outside lower center", ncols=len(keys))
    notes = [*words_of(trees, models), "bars: range of the processes (build), 95 % interval (rays)"]
    style.head(
        figure,
        "Trees: what a rule costs to build and what its rays cost",
        "; ".join([*notes, machine.processor(trees.run)]),
    )
    return figure


def _rows(trees: Trees, model: str) -> list[tuple[str, "Built | None", dict[str, Timed]]]:
    """Return the name, the tree and the cells by ray set of every bar of a model."""
    found: dict[tuple, dict[str, Timed]] = {}
    for rays in trees.ray_sets(model):
        for one in chosen(trees, model, rays):
            found.setdefault((one.cell["way"] == PEER, timed_name(one)), {})[rays] = one
    rows = []
    for (of_peer, name), cells in found.items():
        one = next(iter(cells.values()))
        rows.append((name, trees.peer_built(one) if of_peer else trees.tree(one), cells))
    return rows


def _build_bar(panel: Axes, place: int, tree: "Built | None") -> None:
    if tree is None or not np.isfinite(tree.seconds).any():
        return
    middle = float(np.median(tree.seconds))
    ends = [tree.seconds.min()], [tree.seconds.max()]
    panel.barh(
        place,
        middle,
        0.62,
        color="#A6A6A6" if not is_peer(tree) else "white",
        edgecolor="#A6A6A6",
        hatch="////" if is_peer(tree) else None,
        xerr=marks.errors([middle], *ends) if len(tree.seconds) > 1 else None,
        error_kw={"elinewidth": 0.8, "capsize": 1.5},
    )


def _ray_bar(trees: Trees, panel: Axes, place: int, number: int, sets: int, one: Timed) -> None:
    estimate = trees.median(one)
    low, high = estimate.interval() or (np.nan, np.nan)
    thick = 0.8 / sets
    color = _SHADES.get(one.cell["rays"], style.GREY)
    panel.barh(
        place + (number - (sets - 1) / 2) * thick,
        estimate.value,
        0.9 * thick,
        color=color if one.ours else "white",
        edgecolor=color,
        linewidth=0.7,
        hatch=None if one.ours else "////",
        xerr=marks.errors([estimate.value], [low], [high]),
        error_kw={"elinewidth": 0.8, "capsize": 1.2},
    )


def _of_all(trees: Trees, models: Sequence[str]) -> list[list[Total]]:
    return [t for m in models if len(t := totals(trees, m, trees.ray_sets(m)[0])) > 1]


@style.styled
def pays_chart(trees: Trees, models: Sequence[str]) -> Figure:
    """Draw seconds in all, building and n rays, over n: what is lowest pays.

    Parameters
    ----------
    trees : Trees
    models : sequence of str

    Returns
    -------
    Figure
        A panel a model, both scales logarithmic, for the first ray set; a line a rule and the naive
        way, with a band from the least to the greatest of the processes. Where the SAH's crosses
        another's is marked with its number of rays.
    """
    shown = {m: totals(trees, m, trees.ray_sets(m)[0]) for m in models}
    shown = {m: found for m, found in shown.items() if len(found) > 1}
    names = list(dict.fromkeys(_name(one) for found in shown.values() for one in found))
    looks = style.looks(names)
    figure, axes = style.grid(len(shown), 3.1, 2.9, beside=0.6)
    for number, (panel, (model, found)) in enumerate(zip(axes, shown.items(), strict=True)):
        rays = np.logspace(*_decades(found), 200)
        for one in found:
            look = looks[_name(one)]
            panel.fill_between(
                rays, one.at(rays, 1), one.at(rays, 2), color=look.color, alpha=0.18, linewidth=0
            )
            panel.plot(
                rays, one.at(rays), color=look.color, linestyle=look.dashes, label=_name(one)
            )
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xlim(rays[0], rays[-1])
        _crossings(panel, found, looks)
        panel.xaxis.set_major_locator(LogLocator(10, numticks=5))
        panel.yaxis.set_major_locator(LogLocator(10, numticks=7))
        panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_minor_formatter(NullFormatter())
        panel.set_title(f"{model}, {trees.triangles(model):,} triangles")
        panel.grid()
        if number + 3 >= len(shown):
            panel.set_xlabel(f"{trees.ray_sets(model)[0]} {RAYS}")
        if number % 3 == 0:
            panel.set_ylabel("building and tracing (s)")
    handles = {}
    for panel in axes:
        handles |= dict(zip(*panel.get_legend_handles_labels()[::-1], strict=True))
    columns = max(1, int(figure.get_size_inches()[0] / 1.5))
    figure.legend(handles.values(), handles, loc="outside lower center", ncols=columns)
    notes = [*words_of(trees, models), "bands: least to greatest of the processes"]
    notes.append("marked: from so many rays on SAH takes less in all")
    style.head(
        figure, "From how many rays the SAH pays", "; ".join([*notes, machine.processor(trees.run)])
    )
    return figure


def _name(one: Total) -> str:
    return tree_name(key_of(one.timed.cell), endings=False)


def _decades(found: Sequence[Total]) -> tuple[float, float]:
    """Return the ends of the scale of rays: what is built first and all crossings lie within."""
    sah = [one for one in found if one.timed.key[1] == "sah" and one.timed.key[0] == "kd"]
    where = [crossing(sah[0], other).rays for other in found if sah and other is not sah[0]]
    where = [rays for rays in where if 0 < rays < NEVER]
    low = np.floor(np.log10(min([*where, 1e4]))) - 0.5
    return low, max(np.ceil(np.log10(max([*where, 1e6]))) + 0.5, low + 3)


def _crossings(panel: Axes, found: Sequence[Total], looks: dict) -> None:
    sah = [one for one in found if one.timed.key[0] == "kd" and one.timed.key[1] == "sah"]
    marked = []
    for other in found if sah else ():
        if other.timed.key[:2] == ("kd", "sah"):
            continue
        where = crossing(sah[0], other)
        if 0 < where.rays < NEVER:
            marked.append((where.rays, float(sah[0].at(np.array([where.rays]))[0]), other))
    for number, (rays, seconds, other) in enumerate(sorted(marked, key=lambda mark: mark[0])):
        color = looks[_name(other)].color
        panel.plot([rays], [seconds], marker="o", color=color, markersize=5, zorder=5)
        # Above and below in turn, on white: they may lie near each other.
        above = number % 2 == 1
        panel.annotate(
            _count(rays),
            (rays, seconds),
            xytext=(-4, 9) if above else (5, -11),
            textcoords="offset points",
            ha="right" if above else "left",
            fontsize=7,
            color=color,
            path_effects=[withStroke(linewidth=2, foreground="white")],
            zorder=6,
        )


def _count(rays: float) -> str:
    for size, word in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if rays >= size:
            return f"{rays / size:.2g} {word}" if rays / size < 100 else f"{rays / size:.0f} {word}"
    return f"{rays:.0f}"
