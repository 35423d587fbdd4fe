"""Our numbers beside published ones, each relative to its own best."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from rtbench.report import cells
from rtbench.report.charts import marks, style
from rtbench.report.charts.density import DENSITY
from rtbench.report.digits import absent


@style.styled
def side_by_side(
    ours_rows: Sequence[dict], published_rows: Sequence[dict], title: str, subtitle: str = ""
) -> Figure:
    """Draw a published table and ours, each divided by the mean of its own fastest kernel.

    Parameters
    ----------
    ours_rows, published_rows : sequence of dict
        One a kernel and density (of one precision and order): ``kernel``, ``density`` (absent for
        one value a kernel), ``ns_per_test``, and ``ci_low``, ``ci_high`` where known.
    title, subtitle : str
        What is compared, and on which machines.

    Returns
    -------
    Figure
        Two panels over density that share their axis; a row a kernel with two points where there
        is one density.
    """
    ours, published = _relative(ours_rows), _relative(published_rows)
    names = list(dict.fromkeys(row["kernel"] for row in [*published, *ours]))
    over = {row.get("density") for row in [*published, *ours]}
    draw = _lines if len(over) > 1 else _dots
    figure = draw(ours, published, names, style.looks(names))
    style.head(figure, title, subtitle)
    return figure


def _relative(rows: Sequence[dict]) -> list[dict]:
    """Divide the times by the mean over the densities of the kernel whose mean is least."""
    timed = [row for row in rows if not absent(row.get("ns_per_test"))]
    timed = [row for row in timed if row["kernel"] != cells.EMPTY_LOOP]
    by_kernel: dict[str, list[float]] = {}
    for row in timed:
        by_kernel.setdefault(row["kernel"], []).append(float(row["ns_per_test"]))
    # A kernel that lacks a density has another mean, and is not what the others are measured by.
    most = max(map(len, by_kernel.values()), default=0)
    best = min((np.mean(v) for v in by_kernel.values() if len(v) == most), default=1.0)
    return [
        row
        | {
            key: float("nan") if absent(row.get(key)) else float(row[key]) / best
            for key in ("ns_per_test", "ci_low", "ci_high")
        }
        for row in timed
    ]


def _lines(ours, published, names, look) -> Figure:
    figure, axes = style.panels(1, 2, 7.4, 0.3 + max(2.9, 0.2 * len(names)), sharey=True)
    for panel, rows, label in zip(axes[0], (published, ours), ("published", "here"), strict=True):
        for name in names:
            mine = sorted(
                (row for row in rows if row["kernel"] == name),
                key=lambda row: cells.density_key(row["density"]),
            )
            if not mine:
                continue
            values, low, high = (
                [row[key] for row in mine] for key in ("ns_per_test", "ci_low", "ci_high")
            )
            panel.errorbar(
                [float(row["density"]) for row in mine],
                values,
                yerr=marks.errors(values, low, high),
                color=look[name].color,
                marker=look[name].marker,
                linestyle=look[name].dashes,
                elinewidth=1,
                label=name,
            )
        panel.set_title(label)
        panel.set_xlabel(DENSITY)
        panel.set_xlim(-0.04, 1.04)
        panel.grid(axis="y")
        if not rows:
            marks.absent_note(panel, "no times")
    axes[0][0].set_ylabel("time / mean of the fastest (ratio)")
    marks.legend(axes[0][0 if not ours else 1])
    return figure


def _dots(ours, published, names, look) -> Figure:
    figure, axes = style.panels(1, 1, 6.2, 0.9 + 0.36 * len(names))
    panel = axes[0][0]
    sides = (
        ("published", published, "o", style.OKABE_ITO[1], -0.13),
        ("here", ours, "s", style.OKABE_ITO[0], 0.13),
    )
    for label, rows, marker, color, offset in sides:
        for row in rows:
            side = style.Look(color, marker, "-", "")
            place = names.index(row["kernel"]) + offset
            marks.dot(panel, row["ns_per_test"], row["ci_low"], row["ci_high"], place, side)
        panel.plot([], [], marker=marker, color=color, linestyle="none", label=label)
    marks.category_axis(panel, names)
    panel.axvline(1, color=style.GREY, linewidth=0.8, linestyle=(0, (4, 2)))
    panel.set_xlabel("time / fastest (ratio)")
    marks.legend(panel)
    return figure
