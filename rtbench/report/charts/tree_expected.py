"""What the SAH expects of a tree against what is counted and measured, and how full leaves are."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rtbench.report import machine
from rtbench.report.charts import style
from rtbench.report.charts.trees import NS_A_RAY
from rtbench.report.tree_cells import RULES, tree_name
from rtbench.report.tree_correlation import Point, correlations, points
from rtbench.report.trees import Trees

_PAIRS = (
    ("expected_steps", "counted_steps", "steps per ray"),
    ("expected_tests", "counted_leaf_tests", "triangle tests per ray"),
)
_MOST_LEAF = 40


def expected_charts(trees: Trees) -> dict[str, Figure]:
    """Return the scatter of expected against counted and measured, and the leaves' histogram."""
    found = {}
    known = {rays: _points(trees, rays) for rays in trees.ray_sets()}
    known = {rays: some for rays, some in known.items() if len(some) > 2}
    if known:
        found["expected"] = expected_chart(trees, known)
    sizes = [one for one in trees.run.info.get("leaf_sizes") or [] if one.get("sizes")]
    if sizes:
        found["leaf_sizes"] = leaves_chart(trees, sizes)
    return found


def _points(trees: Trees, rays: str) -> list[Point]:
    """Return the trees of all models, of the first kernel and way."""
    found = [point for model in trees.models for point in points(trees, model, rays)]
    form = (*found[0].timed.form, found[0].timed.cell["way"]) if found else ()
    found = [p for p in found if (*p.timed.form, p.timed.cell["way"]) == form]
    return [p for p in found if "sah_cost" in p.measures]


@style.styled
def expected_chart(trees: Trees, known: dict[str, list[Point]]) -> Figure:
    """Draw a point a tree: counted against expected steps and tests, and time against SAH cost.

    Parameters
    ----------
    trees : Trees
    known : dict of str to list of Point
        By ray set: a row of panels each.

    Returns
    -------
    Figure
        Colour: the model; shape: the rule; a dashed line where counted equals expected. Over the
        times stands Spearman's rank correlation over all trees.
    """
    some = [point for found in known.values() for point in found]
    models = style.looks(list(dict.fromkeys(p.timed.cell["model"] for p in some)))
    rules = list(dict.fromkeys(p.timed.key[1] for p in some))
    shapes = dict(zip(rules, style.MARKERS, strict=False))
    counted = [p for p in _PAIRS if any(p[1] in point.measures for point in some)]
    figure, axes = style.panels(
        len(known), len(counted) + 1, 2.75 * (len(counted) + 1) + 0.2, 2.7 * len(known) + 0.2
    )
    for line, (rays, found) in zip(axes, known.items(), strict=True):
        for panel, (x, y, words) in zip(line, counted, strict=False):
            there = [p for p in found if x in p.measures and y in p.measures]
            _scatter(panel, [(p, p.measures[x], p.measures[y]) for p in there], models, shapes)
            top = max([*(p.measures[x] for p in there), *(p.measures[y] for p in there)], default=1)
            panel.plot([0, top], [0, top], color=style.GREY, linewidth=0.8, linestyle=(0, (4, 2)))
            panel.set_xlim(0)
            panel.set_ylim(0)
            panel.set_xlabel(f"{words}, expected")
            panel.set_ylabel(f"{words}, counted")
            panel.set_title(f"{rays} rays")
        panel = line[-1]
        _scatter(panel, [(p, p.measures["sah_cost"], p.ns) for p in found], models, shapes)
        panel.set_xlim(0)
        panel.set_ylim(0)
        panel.set_xlabel("SAH cost (units of K_I)")
        panel.set_ylabel(NS_A_RAY)
        panel.set_title(f"{rays} rays{_rho(trees, rays, found)}")
    handles = [
        Line2D([], [], linestyle="none", marker="o", color=look.color, label=name)
        for name, look in models.items()
    ]
    handles += [
        Line2D([], [], linestyle="none", marker=shapes[r], color=style.GREY, label=RULES.get(r, r))
        for r in rules
    ]
    columns = max(1, int(figure.get_size_inches()[0] / 1.5))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), columns))
    one = some[0].timed
    notes = [f"{one.cell['kernel']} {one.cell['precision']}", f"way: {one.cell['way']}"]
    notes += ["a point a tree; dashed: as expected", machine.processor(trees.run)]
    style.head(figure, "What the SAH expects, and what rays meet", "; ".join(notes))
    return figure


def _scatter(panel: Axes, some: list, models: dict, shapes: dict) -> None:
    for point, x, y in some:
        panel.plot(
            [x],
            [y],
            linestyle="none",
            marker=shapes.get(point.timed.key[1], "o"),
            color=models[point.timed.cell["model"]].color,
            markersize=5,
            markeredgecolor="white",
            markeredgewidth=0.4,
        )
    panel.grid()


def _rho(trees: Trees, rays: str, found: list[Point]) -> str:
    """Return the rank correlation of cost and time over the trees that are drawn, in words."""
    one = found[0].timed
    form = (*one.form, one.cell["way"])
    there = [
        each
        for each in correlations(trees)
        if (each.rays, each.form, each.measure) == (rays, form, "sah_cost")
    ]
    # The last one is over all models.
    return f", rank correlation {there[-1].rho:.2f}" if there else ""


@style.styled
def leaves_chart(trees: Trees, sizes: list[dict]) -> Figure:
    """Draw how many leaves hold how many triangles: a panel a model, a line a tree.

    Parameters
    ----------
    trees : Trees
    sizes : list of dict
        ``model``, what names a tree, and ``sizes``: leaves with 0, 1, 2 ... triangles.
    """
    models = list(dict.fromkeys(one["model"] for one in sizes))
    names = list(dict.fromkeys(_leaf_name(one) for one in sizes))
    looks = style.looks(names)
    figure, axes = style.grid(len(models), 3.0, 2.7, beside=2.2, sharey=True)
    for number, (panel, model) in enumerate(zip(axes, models, strict=True)):
        for one in (one for one in sizes if one["model"] == model):
            held = np.array(one["sizes"], float)
            # What is beyond the scale is gathered at its end.
            held = np.append(held[:_MOST_LEAF], held[_MOST_LEAF:].sum())
            share = 100 * held / held.sum()
            look = looks[_leaf_name(one)]
            panel.stairs(
                share,
                np.arange(len(share) + 1) - 0.5,
                color=look.color,
                linestyle=look.dashes,
                label=_leaf_name(one),
            )
        panel.set_title(f"{model}, {trees.triangles(model):,} triangles")
        panel.set_ylim(0)
        panel.grid(axis="y")
        if number + 3 >= len(models):
            panel.set_xlabel("triangles in a leaf")
        if number % 3 == 0:
            panel.set_ylabel("leaves (%)")
    handles = {}
    for panel in axes:
        handles |= dict(zip(*panel.get_legend_handles_labels()[::-1], strict=True))
    axes[min(3, len(axes)) - 1].legend(
        handles.values(), handles, loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0
    )
    notes = f"of {_MOST_LEAF} and more in the last bin; {machine.processor(trees.run)}"
    style.head(figure, "How full leaves are", notes)
    return figure


def _leaf_name(one: dict) -> str:
    from rtbench.report.tree_cells import key_of

    return tree_name(key_of(one))
