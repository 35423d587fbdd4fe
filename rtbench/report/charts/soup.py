"""Speed over a soup of triangles (Havel 2008, illustrations 4 to 10): million tests a second."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.charts.endings import endings_chart
from rtbench.report.charts.rates import (
    SPEED,
    Group,
    groups_of,
    hit_ratio,
    label_rows,
    rates,
    work_of,
)
from rtbench.report.methods import variants

if TYPE_CHECKING:
    from rtbench.records.run import Run

# By what is stored of a triangle; the names stand beside the bars too.
_COLORS = {"none": "#56B4E9", "normal": "#E69F00", "precomputed": "#0072B2", "": style.GREY}
_HATCHES = ("", "////", "....", "xxxx")
_PITCH = 0.3  # inches a bar
_BETWEEN = 0.16  # and between rows


def soup_chart(run: "Run") -> Figure:
    """Draw the speed of the kernels of a soup run, a panel a hit ratio.

    Parameters
    ----------
    run : Run
        A run of the experiment ``soup`` with times.

    Returns
    -------
    Figure
        Horizontal bars, the fastest method at the top, a bar a precision (and way of preparing);
        where a method is there with several endings, a mark each in place of the bars, see
        `rtbench.report.charts.endings.endings_chart`.
    """
    groups = groups_of(run)
    return _bars(run, groups) if all(len(g.methods) == 1 for g in groups) else endings_chart(run)


@style.styled
def _bars(run: "Run", groups: list[Group]) -> Figure:
    frame = cells.times_of(run)
    forms = variants(frame)
    ratios = cells.densities(frame)
    row = _PITCH * len(forms) * (0.8 if len(forms) > 1 else 1) + _BETWEEN
    figure, axes = style.panels(
        1,
        len(ratios),
        2.1 + 2.75 * len(ratios),
        0.55 + row * len(groups) + (0.3 if len(forms) > 1 else 0),
        sharex=True,
        sharey=True,
    )
    thick = (row - _BETWEEN) / row / len(forms)
    for panel, ratio in zip(axes[0], ratios, strict=True):
        for place, group in enumerate(groups):
            for number, (form, _) in enumerate(forms):
                (method,) = group.methods
                rows = cells.where(frame, kernel=method.kernel, density=ratio, **form)
                at = place + (number - (len(forms) - 1) / 2) * thick
                for cell in rates(rows):
                    _bar(panel, at, thick, cell, _COLORS[group.stored], _HATCHES[number % 4])
        panel.set_title(hit_ratio(run, ratio))
        panel.set_xlabel(SPEED)
        panel.grid(axis="x")
    fastest = max(
        cell["high"] if cell["high"] == cell["high"] else cell["middle"] for cell in rates(frame)
    )
    axes[0][0].set_xlim(0, fastest * 1.16)
    label_rows(axes[0], groups, [_tag(group, groups) for group in groups])
    _keys(figure, groups, forms)
    style.head(figure, str(run.info.get("title") or "Soup"), subtitle(run, frame, groups))
    return figure


def subtitle(run: "Run", frame, groups: list[Group]) -> str:
    """Return kernels, what all their endings have in common, precision, work and machine."""
    methods = [method for group in groups for method in group.methods]
    words = [style.kernel_list([method.kernel for method in methods])]
    endings = {method.ending for method in methods if method.ending}
    if len(endings) == 1 and all(method.ending for method in methods):
        method = methods[0]
        words.append(f"division {method.division}, {method.tested}")
    only = cells.precisions(frame)
    words.append(only[0] if len(only) == 1 else "")
    words += [work_of(run), machine.processor(run)]
    has = frame["ci_low"].notna().any()
    words.append(marks.INTERVAL_NOTE.replace("bars", "whiskers") if has else "no intervals")
    return "; ".join(word for word in words if word)


def _bar(panel, at: float, thick: float, cell: dict, color: str, hatch: str) -> None:
    face = "white" if hatch else color
    panel.barh(
        at,
        cell["middle"],
        0.86 * thick,
        facecolor=face,
        edgecolor=color,
        hatch=hatch,
        linewidth=0.8,
        xerr=marks.errors([cell["middle"]], [cell["low"]], [cell["high"]]),
        error_kw={"elinewidth": 0.9, "ecolor": "black", "capsize": 2},
    )
    end = cell["high"] if cell["high"] == cell["high"] else cell["middle"]
    panel.annotate(
        f"{cell['middle']:.3g}",
        (end, at),
        xytext=(3, 0),
        textcoords="offset points",
        va="center",
        fontsize=7,
    )


def _tag(group: Group, groups: list[Group]) -> str:
    """Return in what a row differs from others: what it stores, how it ends."""
    (method,) = group.methods
    words = []
    if len({other.stored for other in groups}) > 1:
        words.append(f"stored: {group.stored}" if group.stored else "")
    if len({other.methods[0].division for other in groups if other.methods[0].division}) > 1:
        words.append(f"division {method.division}" if method.division else "")
    if len({other.methods[0].tested for other in groups}) > 1:
        words.append(method.tested)
    return "; ".join(word for word in words if word)


def _keys(figure: Figure, groups: list[Group], forms: list) -> None:
    """Put the legend below: what is stored by colour, precisions by filling."""
    there = dict.fromkeys(group.stored for group in groups if group.stored)
    keys = []
    if len(there) > 1:
        keys += [
            Patch(color=_COLORS[name], label=f"stored: {name}") for name in _COLORS if name in there
        ]
    if len(forms) > 1:
        keys += [
            Patch(
                facecolor="white" if _HATCHES[number % 4] else style.GREY,
                edgecolor=style.GREY,
                hatch=_HATCHES[number % 4],
                label=words,
            )
            for number, (_, words) in enumerate(forms)
        ]
    if keys:
        figure.legend(handles=keys, loc="outside lower center", ncols=min(len(keys), 5))
