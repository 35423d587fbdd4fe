"""Time against wrong answers: every form of a kernel a point, and the front of those worth it."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator
from matplotlib.transforms import Bbox

from rtbench.report import cells, machine
from rtbench.report.accuracy import (
    FORMS,
    MEASURES,
    ON_FRONT,
    PRECISIONS,
    RANDOM,
    UNSURE,
    Accuracy,
    Measure,
    Placed,
)
from rtbench.report.charts import marks, style
from rtbench.report.charts.style import GREY

if TYPE_CHECKING:
    from rtbench.records.run import Run

CHARTS = {
    "front": ("wrong_corpus", "leaks"),
    "front_typical": ("wrong_random", "wrong_leaf"),
    "front_t": ("relative_t",),
}
TITLES = {
    "front": "What accuracy costs: time against wrong answers to hard cases",
    "front_typical": "What accuracy costs: time against wrong answers to typical tests",
    "front_t": "What accuracy costs: time against the error of t",
}
# Named wherever they lie, in float32: a reader looks for them.
KNOWN = ("moller_trumbore_uv", "moller_trumbore_stable_uv", "half_open_uv", "watertight_uv")
KNOWN += ("watertight_safe_uv", "adaptive_exact_uv")
BELOW = 0.55  # decades from the least count to the line of zero
OFFSETS = ((7, 0), (-7, 0), (0, 9), (0, -9), (9, 9), (-9, 9), (9, -9), (-9, -9))
OFFSETS += ((9, 4), (-9, 4), (9, -4), (-9, -4), (4, 9), (-4, 9), (4, -9), (-4, -9))
FARTHER = (1, 1.6, 2.3, 3.1, 4, 5, 6.2, 7.5, 9, 11)


def front_charts(run: "Run") -> dict[str, Figure]:
    """Return the charts of a run of the experiment ``accuracy``, by file name.

    Parameters
    ----------
    run : Run

    Returns
    -------
    dict of str to Figure
        Hard cases; typical tests; the error of t. What was not judged has none.
    """
    accuracy = Accuracy(run)
    known = {measure.name: measure for measure in MEASURES}
    found = {}
    for name, measures in CHARTS.items():
        shown = [known[each] for each in measures]
        shown = [m for m in shown if any(accuracy.front(m, form) for form in FORMS)]
        if shown:
            found[name] = front_chart(accuracy, shown, TITLES[name])
    return found


@style.styled
def front_chart(accuracy: Accuracy, measures: Sequence[Measure], title: str) -> Figure:
    """Draw time against measures: a row a measure, a column a form.

    Parameters
    ----------
    accuracy : Accuracy
    measures : sequence of Measure
    title : str

    Returns
    -------
    Figure
        The scale of a measure is logarithmic, with a line for 0 below it. The front is a line
        through those that none is better than; they are named.
    """
    run = accuracy.run
    forms = [form for form in FORMS if accuracy.points(RANDOM, form)]
    figure, axes = style.panels(
        len(measures), len(forms), 1.0 + 4.6 * len(forms), 0.7 + 3.3 * len(measures)
    )
    looks = style.looks(list(PRECISIONS))
    drawn = []
    for row, measure in zip(axes, measures, strict=True):
        for panel, form in zip(row, forms, strict=True):
            placed = accuracy.front(measure, form)
            if not placed:
                marks.absent_note(panel, "nothing was judged")
                continue
            height = _scale(panel, placed)
            _points(panel, placed, looks, height)
            panel.set_title(FORMS[form])
            panel.set_xlabel(f"{marks.NS_A_TEST}, {measure.timed}")
            panel.set_ylabel(measure.label)
            drawn.append((panel, placed, height))
    _legend(figure, looks)
    kernels = list(dict.fromkeys(point.kernel for point in accuracy.points(RANDOM)))
    words = [style.kernel_list(kernels), "random: half of the tests hit; leaf: 4.7 %"]
    frame = cells.times_of(run)
    words += [marks.INTERVAL_NOTE if frame["ci_low"].notna().any() else "no intervals"]
    words += ["line: the front", "named: on the front, and kernels to know in f32"]
    style.head(figure, title, "; ".join([*words, machine.processor(run)]))
    style.settle(figure)
    for panel, placed, height in drawn:
        _names(panel, placed, height)
    return figure


def _scale(panel: Axes, placed: Sequence[Placed]):
    """Set the axes up; return what gives the height of a count."""
    positive = [each.value for each in placed if each.value > 0]
    least = math.floor(math.log10(min(positive, default=1.0)))
    most = math.ceil(math.log10(max(positive, default=1.0)) + 0.05)
    most = max(most, least + 1)
    zero = least - BELOW

    def height(value: float) -> float:
        return math.log10(value) if value > 0 else zero

    decades = list(range(least, most + 1, max(1, (most - least) // 6)))
    none = len(positive) < len(placed)
    panel.set_ylim((zero if none else least) - 0.25, most + 0.1)
    panel.yaxis.set_major_locator(FixedLocator([*([zero] if none else []), *decades]))
    panel.yaxis.set_major_formatter(
        FuncFormatter(lambda y, _: "0" if y == zero else f"{10.0**y:,.6g}")
    )
    panel.yaxis.set_minor_locator(NullLocator())
    if none:
        panel.axhline(zero, color=GREY, linewidth=0.8, linestyle=(0, (2, 2)), zorder=0.5)
    times = [each.time.value for each in placed]
    panel.set_xscale("log")
    panel.set_xlim(min(times) / 1.25, max(times) * 1.45)
    panel.xaxis.set_major_locator(FixedLocator(_ticks(min(times) / 1.25, max(times) * 1.45)))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.xaxis.set_minor_locator(NullLocator())
    panel.grid()
    return height


def _ticks(low: float, high: float) -> list[float]:
    """Return round numbers inside a logarithmic scale: 1, 1.5, 2, 3, 5, 7 of each decade."""
    found = []
    for decade in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1):
        found += [round(step * 10.0**decade, 9) for step in (1, 1.5, 2, 3, 5, 7)]
    return [tick for tick in found if low <= tick <= high]


def _points(panel: Axes, placed: Sequence[Placed], looks: dict, height) -> None:
    front = [each for each in placed if each.standing in (ON_FRONT, UNSURE)]
    front.sort(key=lambda each: each.time.value)
    line = [(each.time.value, height(each.value)) for each in front]
    if line:
        panel.step(*zip(*line, strict=True), where="post", color=GREY, linewidth=1, zorder=1)
    for each in placed:
        point, look = each.point, looks[each.point.precision]
        plain = point.flags == "strict" and point.reciprocal == "division"
        low, high = each.time.interval() or (None, None)
        panel.errorbar(
            [each.time.value],
            [height(each.value)],
            xerr=marks.errors([each.time.value], [low or math.nan], [high or math.nan]),
            color=look.color,
            marker=look.marker,
            markersize=5.5 if each in front else 4.2,
            markerfacecolor=look.color if plain else "white",
            markeredgewidth=0.9,
            elinewidth=0.7,
            capsize=1.4,
            linestyle="none",
            alpha=1.0 if each in front else 0.75,
            zorder=3 if each in front else 2,
        )


def _names(panel: Axes, placed: Sequence[Placed], height) -> None:
    """Name points where there is room, with a line to those that the name is not next to."""
    renderer = panel.figure.canvas.get_renderer()
    front = [each for each in placed if each.standing in (ON_FRONT, UNSURE)]
    others = [
        each
        for each in placed
        if each not in front
        and (each.point.kernel, each.point.precision, each.point.flags, each.point.reciprocal)
        in [(kernel, "float32", "strict", "division") for kernel in KNOWN]
    ]
    inside = panel.get_window_extent(renderer)
    taken = _Taken(inside)
    for each in placed:
        x, y = panel.transData.transform((each.time.value, height(each.value)))
        taken.boxes.append(Bbox.from_bounds(x - 4, y - 4, 8, 8))
    for each in [*front, *others]:
        mark = "?" if each.standing == UNSURE else ""
        text = panel.annotate(
            each.point.name + mark,
            (each.time.value, height(each.value)),
            xytext=(7, 0),
            textcoords="offset points",
            size=7,
            weight="bold" if each in front else "normal",
            color="black" if each in front else "#444444",
            va="center",
            arrowprops={
                "arrowstyle": "-",
                "linewidth": 0.5,
                "color": GREY,
                "shrinkA": 0,
                "shrinkB": 3,
                "relpos": (0.5, 0.5),
            },
            zorder=4,
        )
        text.set_in_layout(False)
        # What is on the front is named, if need be across another one's line.
        if not _place(text, taken, renderer) and not (
            each in front and _place(text, taken, renderer, lines=False)
        ):
            text.remove()


class _Taken:
    """What of a panel is covered: by points and names, and by lines from one to the other."""

    def __init__(self, inside: Bbox) -> None:
        self.inside = inside
        self.boxes: list[Bbox] = []
        self.lines: list[np.ndarray] = []  # points along them

    def free(self, box: Bbox, line: np.ndarray, lines: bool) -> bool:
        """Tell whether a name covers nothing in the panel, nor a line (with ``lines``) a name."""
        within = box.x0 >= self.inside.x0 and box.x1 <= self.inside.x1
        within &= box.y0 >= self.inside.y0 and box.y1 <= self.inside.y1
        if not within or any(box.overlaps(other) for other in self.boxes):
            return False
        if not lines:
            return True
        names = [other for other in self.boxes if other.width > 10]
        return not any(_touches(other, line) for other in names) and not any(
            _touches(box, other) for other in self.lines
        )


def _touches(box: Bbox, line: np.ndarray) -> bool:
    x, y = line.T
    return bool(((x > box.x0) & (x < box.x1) & (y > box.y0) & (y < box.y1)).any())


def _place(text: Annotation, taken: _Taken, renderer, lines: bool = True) -> bool:
    """Move a name to where it covers nothing; tell whether there is such a place."""
    start = text.axes.transData.transform(text.xy)
    for farther in FARTHER:
        for x, y in OFFSETS:
            text.set_position((x * farther, y * farther))
            text.set_horizontalalignment("left" if x > 0 else "right" if x < 0 else "center")
            text.update_positions(renderer)
            box = Text.get_window_extent(text, renderer)
            end = np.clip(start, (box.x0, box.y0), (box.x1, box.y1))
            line = start + np.linspace(0, 1, 40)[:, None] * (end - start)
            if taken.free(box, line, lines):
                taken.boxes.append(box)
                taken.lines.append(line)
                return True
    return False


def _legend(figure: Figure, looks: dict) -> None:
    handles = [
        Line2D([], [], linestyle="none", color=look.color, marker=look.marker, label=name)
        for name, look in looks.items()
    ]
    hollow = {"marker": "o", "markerfacecolor": "white", "color": GREY, "linestyle": "none"}
    handles.append(Line2D([], [], label="contraction, fastmath, estimated 1/x", **hollow))
    handles.append(Line2D([], [], color=GREY, linewidth=1, label="front (?: not resolved)"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
