"""Measured costs against the mixture of outcomes plus mispredicted branches."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.charts.density import DENSITY
from rtbench.report.digits import absent, interval, measured

if TYPE_CHECKING:
    from rtbench.records.run import Run


@style.styled
def penalty_chart(run: "Run") -> Figure:
    """Draw costs over density as measured, as predicted, and what is left over.

    Parameters
    ----------
    run : Run
        A run of the experiment ``prediction`` whose run.json has a ``fit``.

    Returns
    -------
    Figure
        Above: points as measured, full lines sum(f_i t_i) + m x penalty, dotted lines the sum
        alone. Below: measured less predicted. A column a precision.
    """
    fit = run.info["fit"]
    points = fit["points"]
    names = list(dict.fromkeys(point["kernel"] for point in points))
    precisions = list(dict.fromkeys(point.get("precision") for point in points))
    look = style.looks(names)
    figure, axes = style.panels(
        2,
        len(precisions),
        2.2 + 3.6 * len(precisions),
        4.4,
        sharex=True,
        sharey="row",
        gridspec_kw={"height_ratios": [2.4, 1]},
    )
    for column, precision in enumerate(precisions):
        upper, lower = axes[0][column], axes[1][column]
        for place, name in enumerate(names):
            mine = [p for p in points if (p["kernel"], p.get("precision")) == (name, precision)]
            if mine:
                # Residuals lie near each other: the kernels stand side by side there.
                aside = 0.012 * (place - (len(names) - 1) / 2)
                _one_kernel(upper, lower, sorted(mine, key=_density), look[name], name, aside)
        lower.axhline(0, color=style.GREY, linewidth=0.8)
        lower.set_xlabel(DENSITY)
        upper.set_title(precision if len(precisions) > 1 else "")
        upper.set_ylim(bottom=0)
        for panel in (upper, lower):
            panel.grid(axis="y")
            panel.set_xlim(-0.04, 1.04)
    axes[0][0].set_ylabel(marks.NS_A_TEST)
    axes[1][0].set_ylabel("measured -\npredicted (ns)")
    last = axes[0][-1]
    last.plot([], [], color=style.GREY, label="predicted")
    last.plot([], [], color=style.GREY, linestyle=(0, (1, 2)), label="without penalty")
    marks.legend(last)
    style.head(figure, "Cost of a test = sum of f t + m x penalty", _subtitle(run, fit, names))
    return figure


def _one_kernel(upper, lower, points: list[dict], look, name: str, aside: float) -> None:
    density = np.array([_density(point) for point in points])
    found, low, high, mixture, predicted = (
        np.array([_number(point.get(key)) for point in points])
        for key in ("measured", "ci_low", "ci_high", "mixture", "predicted")
    )
    bars = marks.errors(found, low, high)
    point = {"color": look.color, "marker": look.marker, "elinewidth": 1}
    upper.plot(density, mixture, color=look.color, linestyle=(0, (1, 2)), linewidth=1)
    upper.plot(density, predicted, color=look.color)
    upper.errorbar(density, found, yerr=bars, linestyle="none", label=name, **point)
    lower.errorbar(density + aside, found - predicted, yerr=bars, linestyle="none", **point)


def _subtitle(run: "Run", fit: dict, names: list[str]) -> str:
    low, high = fit.get("ci") or (None, None)
    price = ""
    if not absent(fit.get("penalty_ns")):
        price = f"penalty {measured(fit['penalty_ns'], low, high).text} ns"
        span = interval(fit["penalty_ns"], low, high)
        price += f" {span}" if span else ""
    has = any(not absent(point.get("ci_low")) for point in fit["points"])
    words = [
        price,
        style.kernel_list(names),
        machine.processor(run),
        marks.INTERVAL_NOTE if has else "",
    ]
    return "; ".join(word for word in words if word)


def _density(point: dict) -> float:
    return float(point["density"])


def _number(value) -> float:
    return float("nan") if absent(value) else float(value)
