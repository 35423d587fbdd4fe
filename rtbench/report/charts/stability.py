"""What kernels get wrong of hard cases: by family, and over the difficulty of a family."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from rtbench.records.schema import LENGTHS
from rtbench.report import cells, machine
from rtbench.report.charts import marks, style

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

KNEE = 1.0  # per cent
MOST_CURVES, MOST_PANELS, FEWEST_LEVELS = 6, 12, 4
ONLY_TIES = "#DDDDDD"
# One hue from light to dark: the order is seen by every eye, and in grey print.
STEPS = (0.0, 1e-9, 1.0, 3.0, 10.0, 30.0, 100.0)
SHADES = ("#FFFFFF", "#E3EDF7", "#BBD2E8", "#7FB0D6", "#3A7EB8", "#08396B")
SHADE_NAMES = ("none wrong", "up to 1 %", "1 to 3 %", "3 to 10 %", "10 to 30 %", "more")
DARK = 10.0  # white letters from here on


@style.styled
def families_chart(run: "Run") -> Figure:
    """Draw the share of wrong answers as a map of kernels and families, a panel a precision.

    Parameters
    ----------
    run : Run
        A run of the experiment ``stability``.

    Returns
    -------
    Figure
    """
    frame = run.families
    precisions = cells.precisions(frame)
    kernels, families = (cells.values(frame, name) for name in ("kernel", "family"))
    figure, axes = style.panels(
        len(precisions),
        1,
        2.4 + 0.25 * len(families),
        0.9 + (0.5 + 0.19 * len(kernels)) * len(precisions) + 1.1,
        sharex=True,
    )
    scale = {"cmap": ListedColormap(SHADES), "norm": BoundaryNorm(STEPS, len(SHADES))}
    for (panel,), precision in zip(axes, precisions, strict=True):
        block = cells.where(frame, precision=precision)
        share = _shares(block, kernels, families)
        panel.set_facecolor(ONLY_TIES)
        panel.pcolormesh(np.ma.masked_invalid(share), edgecolors="#F4F4F4", linewidth=0.4, **scale)
        for (row, column), value in np.ndenumerate(share):
            if value >= 0.5:
                color = "white" if value >= DARK else "black"
                words = {"ha": "center", "va": "center", "size": 5, "color": color}
                panel.text(column + 0.5, row + 0.5, f"{value:.0f}", **words)
        panel.set_yticks(np.arange(len(kernels)) + 0.5, kernels, size=7)
        panel.set_xticks(np.arange(len(families)) + 0.5, families, rotation=90, size=7)
        panel.tick_params(length=0)
        panel.invert_yaxis()
        panel.set_title(f"{precision}: wrong answers (%)")
        for spine in panel.spines.values():
            spine.set_visible(False)
    edge = {"edgecolor": style.GREY, "linewidth": 0.4}
    patches = zip((*SHADES, ONLY_TIES), (*SHADE_NAMES, "ties only"), strict=True)
    handles = [Patch(facecolor=color, label=label, **edge) for color, label in patches]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    _head(figure, run, "Hard cases by family", kernels, "of the cases that are no ties")
    return figure


def _shares(block: "DataFrame", kernels: list[str], families: list[str]) -> np.ndarray:
    share = np.full((len(kernels), len(families)), np.nan)
    for row in block.to_dict("records"):
        if row["decided"]:
            place = kernels.index(row["kernel"]), families.index(row["family"])
            share[place] = 100 * row["wrong"] / row["decided"]
    return share


def curve_charts(run: "Run") -> dict[str, Figure]:
    """Return a chart of wrong answers over difficulty for each precision, by file name."""
    found = {}
    for precision in cells.precisions(run.curves):
        block = cells.where(run.curves, precision=precision)
        kernels = few(cells.where(run.stability, precision=precision))
        families = _telling(block, kernels, run.info.get("families") or {})
        if families:
            found[f"curves-{precision}"] = curves_chart(run, precision, families, kernels)
    return found


@style.styled
def curves_chart(run: "Run", precision: str, families: list[str], kernels: list[str]) -> Figure:
    """Draw the share of wrong answers over difficulty, a panel a family, rings at the knees.

    Parameters
    ----------
    run : Run
        A run of the experiment ``stability``.
    precision : str
    families : list of str
        At least one, with several difficulties.
    kernels : list of str

    Returns
    -------
    Figure
    """
    frame = cells.where(run.curves, precision=precision)
    looks, knees = style.looks(kernels), _knees(run, precision)
    units = run.info.get("families") or {}
    figure, axes = style.grid(len(families), 2.5, 1.95, beside=2.2, sharey=True)
    for place, (panel, family) in enumerate(zip(axes, families, strict=True)):
        for kernel in kernels:
            points = cells.where(frame, family=family, kernel=kernel)
            points = points[points["decided"] > 0].sort_values("difficulty")
            _curve(panel, points, knees.get((kernel, family)), looks[kernel], kernel)
        panel.axhline(KNEE, color=style.GREY, linewidth=0.7, zorder=1)
        panel.set_yscale("symlog", linthresh=KNEE, linscale=0.5)
        panel.set_ylim(-0.15, 150)
        panel.set_yticks([0, 1, 10, 100], ["0", "1", "10", "100"])
        panel.set_yticks([], minor=True)
        panel.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        panel.grid(True)
        panel.set_title(family)
        panel.set_xlabel(units.get(family, "difficulty"))
        if place % 3 == 0:
            panel.set_ylabel("wrong answers (%)")
    marks.legend(axes[min(3, len(families)) - 1])
    words = "rings: the knee, the first difficulty with more than 1 % wrong"
    _head(figure, run, f"Wrong answers over difficulty, {precision}", kernels, words)
    return figure


def few(summary: "DataFrame") -> list[str]:
    """Return at most six kernels: who has the fewest wrong answers, who the most, some between.

    Those that claim something, and so are meant to be right, are among them.
    """
    ordered = summary.sort_values("wrong", kind="stable")
    claiming = list(ordered["kernel"][ordered["claims"].notna()])[:2]
    others = [name for name in ordered["kernel"] if name not in claiming]
    places = np.linspace(0, len(others) - 1, min(MOST_CURVES - len(claiming), len(others)))
    return claiming + [others[round(place)] for place in places]


def _telling(block: "DataFrame", kernels: list[str], units: dict[str, str]) -> list[str]:
    """Return the families whose curves differ most between kernels, in the order of the records.

    What is no scale ("kind: which are equal") makes no curve.
    """
    spread = {}
    for family in cells.values(block, "family"):
        rows = cells.where(block, family=family)
        rows = rows[(rows["decided"] > 0) & rows["kernel"].isin(kernels)]
        if units.get(family, "").startswith("kind"):
            continue
        if rows["difficulty"].nunique() >= FEWEST_LEVELS and rows["wrong"].sum():
            sums = rows.groupby("kernel")[["wrong", "decided"]].sum()
            shares = sums["wrong"] / sums["decided"]
            spread[family] = shares.max() - shares.min() + 1e-3 * shares.max()
    kept = sorted(spread, key=lambda f: (f == LENGTHS, spread[f]), reverse=True)[:MOST_PANELS]
    return [family for family in spread if family in kept]


def _curve(panel, points: "DataFrame", knee: float | None, look: style.Look, label: str) -> None:
    x = points["difficulty"].astype(float).to_numpy()
    y = 100 * points["wrong_share"].astype(float).to_numpy()
    dressed = {"color": look.color, "linestyle": look.dashes, "linewidth": 1.1}
    panel.plot(x, y, marker=look.marker, markersize=2.8, label=label, **dressed)
    if knee is not None:
        ring = {"markersize": 8, "markerfacecolor": "none", "markeredgewidth": 1.0}
        panel.plot(x[x == knee], y[x == knee], "o", color=look.color, **ring)


def _knees(run: "Run", precision: str) -> dict[tuple[str, str], float]:
    """Return where kernels begin to be wrong, by kernel and family."""
    rows = cells.where(run.families, precision=precision).to_dict("records")
    found = {(row["kernel"], row["family"]): row["knee"] for row in rows if row["knee"] is not None}
    lengths = cells.where(run.curves, precision=precision, family=LENGTHS)
    for row in lengths[lengths["wrong_share"] > KNEE / 100].to_dict("records"):
        key = row["kernel"], LENGTHS
        found[key] = min(found.get(key, row["difficulty"]), row["difficulty"], key=abs)
    return found


def _head(figure: Figure, run: "Run", title: str, kernels: list[str], words: str) -> None:
    told = [words, style.kernel_list(kernels), machine.processor(run)]
    style.head(figure, title, "; ".join(told))
