"""Speed by what LLVM compiles for and may do with floats: a row a target, a mark a set of flags."""

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.charts.rates import SPEED, hit_ratio, rates, work_of
from rtbench.report.layouts.compilers import (
    OTHER_T,
    OTHER_TRIANGLE,
    flags,
    mark_of,
    other_answers,
    targets,
    told_apart,
)
from rtbench.report.methods import labels, methods_of, variants

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

_LOOKS = {
    "strict": ("o", style.OKABE_ITO[6]),
    "contract": ("s", style.OKABE_ITO[0]),
    "fast": ("D", style.OKABE_ITO[1]),
}
_ROW = 0.215  # inches a target
_GAP = 1.25  # rows between two kernels, for the name of the lower one
_WIDEST = 1.3  # how far an interval may reach beyond the fastest
_BAND = "#F4F4F4"
_VARIANT = ("precision", "density", "target", "flags")


@style.styled
def compilers_chart(run: "Run") -> Figure:
    """Draw the speed of every kernel for every target, with each set of flags.

    Parameters
    ----------
    run : Run
        A run of the experiment ``compilers`` with times.

    Returns
    -------
    Figure
        A panel a hit ratio (columns) and precision (rows of panels). Kernels as the config has
        them, below each name a row a target and in it a mark a set of flags: full where every ray
        has the bits of strict arithmetic for the first target, hollow where some have another t;
        a cross, and the number of rays, where some have another triangle.
    """
    frame = cells.times_of(run)
    names, there = cells.kernels(frame), targets(run, frame)
    forms, ratios = variants(frame), cells.densities(frame)
    rows = len(names) * (len(there) + _GAP)
    height = (0.5 + _ROW * rows) * len(forms) + 0.45
    figure, axes = style.panels(
        len(forms), len(ratios), 1.3 + 3.1 * len(ratios), height, sharex=True, sharey=True
    )
    for (form, words), line in zip(forms, axes, strict=True):
        for panel, ratio in zip(line, ratios, strict=True):
            block = cells.where(frame, density=ratio, **form)
            _marks(panel, block, names, there, other_answers(run))
            panel.set_title(", ".join(filter(None, [hit_ratio(run, ratio), words])))
        _name_rows(line, run, names, there)
    speeds = rates(frame)
    most = max(cell["middle"] for cell in speeds)
    # No interval, of too few samples, takes the axis for itself.
    top = min(max(max(cell["middle"], cell["high"]) for cell in speeds), _WIDEST * most)
    counted = any(counts["other_hits"] for counts in other_answers(run).values())
    axes[0][0].set_xlim(0, top * (1.3 if counted else 1.08))
    for panel in axes[-1]:
        panel.set_xlabel(SPEED)
    keys = _keys(run, frame, there)
    columns = 2 if len(keys) > len(flags(frame)) else len(keys)
    figure.legend(handles=keys, loc="outside lower center", ncols=columns)
    style.head(figure, str(run.info.get("title") or "Compilers"), _subtitle(run, frame))
    return figure


def _place(kernel: int, target: int, count: int) -> float:
    return kernel * (count + _GAP) + _GAP + target


def _marks(
    panel: Axes, block: "DataFrame", names: list[str], there: list[str], differ: dict
) -> None:
    allowed = flags(block)
    step = 0.62 / max(len(allowed), 1)
    for kernel, name in enumerate(names):
        for number, target in enumerate(there):
            at = _place(kernel, number, len(there))
            if number % 2 == 0:
                panel.axhspan(at - 0.5, at + 0.5, color=_BAND, linewidth=0, zorder=0)
            rows = cells.where(block, kernel=name, target=target)
            far, told = 0.0, []
            for row, cell in zip(rows.to_dict("records"), rates(rows), strict=True):
                counted = differ.get((name, *(row[column] for column in _VARIANT)), {})
                y = at + (allowed.index(row["flags"]) - (len(allowed) - 1) / 2) * step
                _mark(panel, cell, y, row["flags"], mark_of(counted), f"{name} {target}")
                far = max(far, cell["middle"], _end(cell))
                if counted.get("other_hits"):
                    told.append((row["flags"], counted["other_hits"]))
            _count(panel, (far, at), sorted(told, key=lambda one: allowed.index(one[0])))


def _mark(panel: Axes, cell: dict, y: float, allowed: str, kind: str, label: str) -> None:
    shape, color = _LOOKS.get(allowed, ("v", style.GREY))
    panel.errorbar(
        [cell["middle"]],
        [y],
        xerr=marks.errors([cell["middle"]], [cell["low"]], [cell["high"]]),
        color=color,
        marker="X" if kind == OTHER_TRIANGLE else shape,
        markerfacecolor="white" if kind == OTHER_T else color,
        markeredgecolor=color,
        markersize=5.5 if kind == OTHER_TRIANGLE else 4,
        markeredgewidth=1,
        elinewidth=0.9,
        capsize=1.6,
        linestyle="none",
        zorder=3,
        label=f"{label} {allowed}",
    )


def _end(cell: dict) -> float:
    return cell["high"] if cell["high"] == cell["high"] else cell["middle"]


def _count(panel: Axes, where: tuple[float, float], told: list[tuple[str, int]]) -> None:
    """Say behind a row's marks on how many rays the hits are others."""
    if not told:
        return
    text = ", ".join(f"{allowed} {count:,}" for allowed, count in told)
    panel.annotate(
        f"{text} ray{'s' if sum(count for _, count in told) > 1 else ''}",
        where,
        xytext=(5, 0),
        textcoords="offset points",
        va="center",
        fontsize=6.5,
        weight="bold",
    )


def _name_rows(axes: list[Axes], run: "Run", names: list[str], there: list[str]) -> None:
    """Put the targets beside the rows and each kernel's name above its own."""
    count = len(there)
    first = axes[0]
    places = [
        _place(kernel, number, count) for kernel in range(len(names)) for number in range(count)
    ]
    first.set_yticks(places, there * len(names))
    first.set_ylim(_place(len(names) - 1, count - 1, count) + 0.7, _GAP - 1.3)
    methods = methods_of(run, names)
    _, words = told_apart(list(methods.values()))
    told = labels(list(methods.values()))
    for panel in axes:
        panel.tick_params(axis="y", length=0, labelsize=7.5)
        panel.spines["left"].set_visible(False)
        panel.grid(axis="x")
        for kernel, name in enumerate(names):
            ending = methods[name].tested if words[name] else ""
            title = ": ".join(filter(None, [told[methods[name].base], ending]))
            panel.annotate(
                title,
                (0, _place(kernel, 0, count) - 0.95),
                xycoords=panel.get_yaxis_transform(),
                xytext=(2, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
                weight="bold",
                bbox=marks.ON_PAPER,
            )


def _keys(run: "Run", frame: "DataFrame", there: list[str]) -> list[Line2D]:
    """Return the legend: flags by colour and shape, beside them other answers by filling."""
    keys = []
    for name in flags(frame):
        shape, color = _LOOKS.get(name, ("v", style.GREY))
        keys.append(Line2D([], [], color=color, marker=shape, linestyle="none", label=name))
    found = {mark_of(counted) for counted in other_answers(run).values()}
    of = f"strict arithmetic for {there[0]}"
    grey = {"color": style.GREY, "linestyle": "none", "markeredgecolor": style.GREY}
    told = {
        "": ({"marker": "o"}, f"full: bits of {of}"),
        OTHER_T: ({"marker": "o", "markerfacecolor": "white"}, "hollow: another t on some rays"),
        OTHER_TRIANGLE: ({"marker": "X", "markersize": 6}, "another triangle on so many rays"),
    }
    if not found - {""}:
        return keys
    marked = [Line2D([], [], **grey, **told[k][0], label=told[k][1]) for k in told if k in found]
    nothing = [Line2D([], [], linestyle="none", label="")] * abs(len(keys) - len(marked))
    # A legend is filled column by column: flags in the first, fillings in the second.
    return [*keys, *nothing, *marked] if len(keys) < len(marked) else [*keys, *marked, *nothing]


def _subtitle(run: "Run", frame: "DataFrame") -> str:
    methods = list(methods_of(run, cells.kernels(frame)).values())
    common, _ = told_apart(methods)
    divisions = {method.division for method in methods if method.division}
    only = cells.precisions(frame)
    words = [style.kernel_list(cells.kernels(frame))]
    words.append(f"division {divisions.pop()}" if common and len(divisions) == 1 else "")
    words += [only[0] if len(only) == 1 else "", work_of(run), machine.processor(run)]
    words.append(marks.INTERVAL_NOTE if frame["ci_low"].notna().any() else "no intervals")
    return "; ".join(word for word in words if word)
