"""Kernels by tree and way, and trees beside libraries: points with their 95 % intervals."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter, NullLocator

from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.charts.trees import NS_A_RAY
from rtbench.report.layouts.tree_kernels import head_of
from rtbench.report.layouts.tree_peers import Against, against_peers, beside
from rtbench.report.tree_cells import Timed
from rtbench.report.trees import Trees

_ROW = 0.3  # inches a line of points
_LINEAR = 0.45  # decades, below which round numbers lie as on a linear scale
_WIDEST = 1.5  # how far an interval may reach beyond the points


def kernels_charts(trees: Trees) -> dict[str, Figure]:
    """Return the charts of kernels by way, and of libraries, that a run has cells for."""
    found = {}
    models = [m for m in trees.models if len({o.form for o in trees.of(m) if o.ours}) > 1]
    if models:
        found["kernels_in_trees"] = kernels_chart(trees, models)
    against = beside(against_peers(trees))
    if against:
        found["tree_peers"] = peers_chart(trees, against)
    return found


@style.styled
def kernels_chart(trees: Trees, models: list[str]) -> Figure:
    """Draw ns a ray of every kernel: rows of panels are models, columns ray sets.

    Parameters
    ----------
    trees : Trees
    models : list of str

    Returns
    -------
    Figure
        A line a kernel and precision, a point a tree and way with its 95 % interval; logarithmic.
    """
    ours = [one for model in models for one in trees.of(model) if one.ours]
    forms = list(dict.fromkeys(one.form for one in ours))
    looks = style.looks(list(dict.fromkeys(head_of(one) for one in ours)))
    sets = trees.ray_sets()
    figure, axes = style.panels(
        len(models),
        len(sets),
        1.9 + 2.4 * len(sets),
        (0.55 + _ROW * len(forms)) * len(models) + 0.3,
        sharey=True,
        sharex="col",
    )
    precise = len({precision for _, precision in forms}) > 1
    names = [f"{kernel}, {precision}" if precise else kernel for kernel, precision in forms]
    for line, model in zip(axes, models, strict=True):
        for panel, rays in zip(line, sets, strict=True):
            cells = [one for one in ours if (one.cell["model"], one.cell["rays"]) == (model, rays)]
            _points(trees, panel, cells, forms, looks)
            panel.set_title(f"{model}, {rays} rays")
            panel.grid(axis="x")
        marks.category_axis(line[0], names)
        line[0].grid(axis="x")
        for panel in line[1:]:
            panel.tick_params(axis="y", length=0)
            panel.grid(axis="y")
            panel.spines["left"].set_visible(False)
    for panel in axes[-1]:
        panel.set_xlabel(NS_A_RAY)
    for rays, column in zip(sets, zip(*axes, strict=True), strict=True):
        times = [trees.median(one).value for one in ours if one.cell["rays"] == rays]
        _log_scale(column[0], min(times), max(times))
    _legend(figure, looks)
    notes = [style.kernel_list(list(dict.fromkeys(k for k, _ in forms))), marks.INTERVAL_NOTE]
    style.head(figure, "Kernels inside trees", "; ".join([*notes, machine.processor(trees.run)]))
    return figure


def _points(trees: Trees, panel: Axes, cells: list[Timed], forms: list, looks: dict) -> None:
    heads = list(looks)
    for one in cells:
        estimate = trees.median(one)
        ends = estimate.interval() or (np.nan, np.nan)
        aside = (heads.index(head_of(one)) - (len(heads) - 1) / 2) * min(0.16, 0.8 / len(heads))
        look = looks[head_of(one)]
        marks.dot(panel, estimate.value, *ends, forms.index(one.form) + aside, look)


@style.styled
def peers_chart(trees: Trees, against: list[Against]) -> Figure:
    """Draw how many times a library's speed trees have: a panel a ray set and library.

    Parameters
    ----------
    trees : Trees
    against : list of Against

    Returns
    -------
    Figure
        A line a model, a point a tree, way and kernel with its 95 % interval, a faint line from the
        least to the greatest of single rounds; logarithmic, with a line at 1.
    """
    # In one precision and thread: others are in the tables.
    precision = against[0].ours.cell["precision"]
    against = [one for one in against if one.ours.cell["precision"] == precision]
    against = [one for one in against if one.ours.threads == 1] or against
    kernels = list(dict.fromkeys(str(one.ours.cell["kernel"]) for one in against))
    named = [(one, _look_key(one)) for one in against]
    names = list(dict.fromkeys(key for _, key in named))
    heads = style.looks(list(dict.fromkeys(head for head, _ in names)))
    shapes = dict(zip(kernels, style.MARKERS, strict=False))
    looks = {key: heads[key[0]]._replace(marker=shapes[key[1]]) for key in names}
    models = list(dict.fromkeys(one.ours.cell["model"] for one in against))
    groups = list(
        dict.fromkeys((one.peer.cell["kernel"], one.ours.cell["rays"]) for one in against)
    )
    row = max(_ROW, 0.12 * len(names))
    columns = min(3, len(groups))
    names.sort(key=lambda key: (list(heads).index(key[0]), kernels.index(key[1])))
    lines = -(-len(groups) // columns)
    figure, axes = style.panels(
        lines,
        columns,
        1.6 + 2.6 * columns,
        (0.6 + row * len(models)) * lines + 0.3,
        sharey=True,
        sharex=True,
    )
    flat = [panel for line in axes for panel in line]
    for unused in flat[len(groups) :]:
        unused.remove()
    for number, (panel, group) in enumerate(zip(flat, groups, strict=False)):
        for one, name in named:
            if (one.peer.cell["kernel"], one.ours.cell["rays"]) != group:
                continue
            aside = (names.index(name) - (len(names) - 1) / 2) * min(0.2, 0.8 / len(names))
            place = models.index(one.ours.cell["model"]) + aside
            ends = one.speed.interval() or (np.nan, np.nan)
            panel.plot(
                [one.least, one.greatest],
                [place, place],
                color=looks[name].color,
                alpha=0.3,
                linewidth=2.6,
                solid_capstyle="butt",
                zorder=1,
            )
            marks.dot(panel, one.speed.value, *ends, place, looks[name])
        panel.axvline(1, color=style.GREY, linewidth=0.9, linestyle=(0, (4, 2)), zorder=0.5)
        panel.set_title(f"against {group[0]}, {group[1]} rays")
        panel.grid(axis="x")
        if number % columns == 0:
            marks.category_axis(panel, models)
            panel.grid(axis="x")
        else:
            panel.tick_params(axis="y", length=0)
            panel.grid(axis="y")
            panel.spines["left"].set_visible(False)
        if number + columns >= len(groups):
            panel.set_xlabel("speed / its speed (ratio of times)")
            panel.tick_params(labelbottom=True)
    _log_scale(
        flat[0],
        min(1.0, *(one.least for one in against)),
        max(1.0, *(one.greatest for one in against)),
    )
    keys = {head: look._replace(marker="o") for head, look in heads.items()}
    if len(kernels) > 1:
        keys |= {k: style.Look(style.GREY, shapes[k], "-", "") for k in kernels}
    _legend(figure, keys)
    notes = [f"{', '.join(kernels)} {precision}", f"{marks.INTERVAL_NOTE}, paired by rounds"]
    notes += ["faint: single rounds, least to greatest", "right of 1: rtbench is faster"]
    style.head(figure, "Trees beside libraries", "; ".join([*notes, machine.processor(trees.run)]))
    return figure


def _look_key(one: Against) -> tuple[str, str]:
    """Return what gives a point its colour, the tree and way, and its shape, the kernel."""
    return head_of(one.ours), str(one.ours.cell["kernel"])


def _log_scale(panel: Axes, least: float, most: float) -> None:
    """Make the scale of values logarithmic, with round numbers that leave each other room.

    Values lie from ``least`` to ``most``; no interval, of too few processes, takes all of it.
    """
    panel.set_xscale("log")
    low, high = panel.get_xlim()
    low, high = max(low, least / _WIDEST), min(high, most * _WIDEST)
    panel.set_xlim(low, high)
    decades = np.log10(high / low)
    steps = (1, 2, 5) if decades < 2.2 else (1,)
    steps = (1, 1.5, 2, 3, 5, 7) if decades < 0.9 else steps
    ticks = [
        round(step * 10.0**power, 9)
        for power in range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
        for step in steps
    ]
    if decades < _LINEAR:
        ticks = [round(float(tick), 9) for tick in MaxNLocator(4).tick_values(low, high)]
    panel.xaxis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    panel.xaxis.set_minor_locator(NullLocator())
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.6g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())


def _legend(figure: Figure, looks: dict) -> None:
    handles = [
        Line2D([], [], linestyle="none", color=look.color, marker=look.marker, label=name)
        for name, look in looks.items()
    ]
    longest = max((len(name) for name in looks), default=1)
    columns = max(1, int(figure.get_size_inches()[0] / (0.4 + 0.075 * longest)))
    lines = -(-len(handles) // columns)
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + 0.17 * lines)
    figure.legend(handles=handles, loc="outside lower center", ncols=-(-len(handles) // lines))
