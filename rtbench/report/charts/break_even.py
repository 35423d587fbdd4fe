"""From how many rays per triangle on preparing pays, a line a kernel, over the triangles."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.digits import absent
from rtbench.report.methods import TESTED_FIRST, Method, labels, methods_of, storage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rtbench.records.run import Run

RAYS, TRIANGLES = "rays per triangle", "triangles"
_STEPS = ("B", "KiB", "MiB", "GiB")
_ASIDE = 0.035  # decades between two kernels at one size, so that their bars lie side by side
_NEVER = 0.93  # of the panel's height, where what never pays is marked


@style.styled
def break_even_chart(run: "Run") -> Figure:
    """Draw the break-even of each kernel that prepares triangles.

    Parameters
    ----------
    run : Run
        A run of the experiment ``break_even`` with its conclusion.

    Returns
    -------
    Figure
        A panel a hit ratio (columns) and precision (rows): rays per triangle with their 95 %
        interval, an arrow where it has no end; at the upper edge what never pays.
    """
    rows = run.info["break_even"]
    methods = methods_of(run, list(dict.fromkeys(row["kernel"] for row in rows)))
    looks, names = style.looks(list(methods)), row_names(list(methods.values()))
    groups = sorted({(str(row["precision"]), row["density"]) for row in rows})
    sizes = sorted({row["scene"] for row in rows})
    least, most = _limits(rows)
    figure, axes = panels(len({p for p, _ in groups}), len({d for _, d in groups}))
    for panel, (precision, density) in zip(axes, groups, strict=False):
        scales(panel, sizes, least, most)
        for number, kernel in enumerate(methods):
            aside = 10 ** (_ASIDE * (number - (len(methods) - 1) / 2))
            mine = [
                row
                for row in rows
                if (row["kernel"], str(row["precision"]), row["density"])
                == (kernel, precision, density)
            ]
            mine.sort(key=lambda row: row["scene"])
            _line(panel, mine, aside, looks[kernel], names[kernel], most)
        panel.grid(axis="y")
        several = len({p for p, _ in groups}) > 1
        panel.set_title(title_of(density, precision if several else None), pad=15)
        caches(panel, run, precision)
    legend(figure, *axes[0].get_legend_handles_labels())
    against = list(dict.fromkeys(row["against"] for row in rows))
    head = "Break-even: rays per triangle from which on preparing it pays"
    words = [f"against the fastest that stores nothing: {style.kernel_list(against)}"]
    words += ["at the upper edge: never pays", f"{marks.INTERVAL_NOTE} (arrow: no end)"]
    words += [endings_note(list(methods.values())), cache_note(run), machine.processor(run)]
    style.head(figure, head, "; ".join(word for word in words if word))
    return figure


def row_names(methods: "Sequence[Method]") -> dict[str, str]:
    """Return a name for each kernel: its method, and its ending in short where that differs."""
    names = labels(list(methods))
    several = len({method.ending for method in methods}) > 1
    return {
        method.kernel: names[method.base]
        + (f", {method.ending}" if several and method.ending else "")
        for method in methods
    }


def endings_note(methods: "Sequence[Method]") -> str:
    """Return what the short names of endings mean, of those that stand in the legend."""
    endings = {method.ending for method in methods}
    parts = {part for ending in endings for part in ending.split(" ")}
    told = {"last": "last: division last", "whole": "whole: nothing skipped"}
    told |= {order: f"{order}: {words}" for order, words in TESTED_FIRST.items()}
    words = [text for part, text in told.items() if part in parts]
    return ", ".join(words) if len(endings) > 1 else ""


def legend(figure: Figure, handles: list, names: list[str]) -> None:
    """Put the legend below the panels, as many to a line as there is room for."""
    wide = 0.75 + 0.068 * max(map(len, names))
    columns = max(int(figure.get_size_inches()[0] / wide), 1)
    lines = -(-len(names) // columns)
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + 0.17 * lines + 0.1)
    figure.legend(handles, names, loc="outside lower center", ncols=-(-len(names) // lines))


def panels(rows: int, columns: int) -> tuple[Figure, list[Axes]]:
    """Return a figure with panels for hit ratios (columns) and precisions (rows)."""
    size = 0.7 + 3.5 * columns, 0.3 + 3.4 * rows
    figure, axes = style.panels(rows, columns, *size, sharex=True, sharey=True)
    for line in axes:
        line[0].set_ylabel(RAYS)
    for panel in axes[-1]:
        panel.set_xlabel(TRIANGLES)
    return figure, [panel for line in axes for panel in line]


def scales(panel: Axes, sizes: "Sequence[float]", least: float, most: float) -> None:
    """Make both scales logarithmic, the sizes that were measured the ticks of the lower one."""
    panel.set_xscale("log")
    panel.set_yscale("log")
    wide = 10**0.2 if len(sizes) > 1 else 2.0
    panel.set_xlim(min(sizes) / wide, max(sizes) * wide)
    panel.set_ylim(least, most)
    panel.xaxis.set_major_locator(FixedLocator(_apart(sizes)))
    panel.xaxis.set_minor_locator(FixedLocator(list(sizes)))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    panel.yaxis.set_major_locator(LogLocator(10))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))
    panel.yaxis.set_minor_locator(NullLocator())


def title_of(density, precision: str | None) -> str:
    """Return what a panel shows in words."""
    words = f"hit ratio {cells.density_text(density)}"
    return f"{words}, {precision}" if precision else words


def caches(panel: Axes, run: "Run", precision: str | None) -> None:
    """Mark the numbers of triangles whose vertices alone fill a cache."""
    each = _bytes(run, precision)
    first, last = panel.get_xlim()
    for name, size in machine.data_caches(run) if each else []:
        if not first < size / each < last:
            continue
        panel.axvline(size / each, color="black", linewidth=0.8, linestyle=(0, (4, 3)), zorder=4)
        steps = int(np.log2(size) // 10)
        panel.annotate(
            f"{name} {size / 1024**steps:.3g} {_STEPS[steps]}",
            (size / each, 1),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=7,
            color=style.GREY,
        )


def cache_note(run: "Run") -> str:
    """Return what the dashed lines are, or nothing where there are none."""
    each = _bytes(run, None)
    if not each or not machine.data_caches(run):
        return ""
    return f"dashed: the triangles fill a cache ({each} bytes each, vertices alone)"


def _bytes(run: "Run", precision: str | None) -> int | None:
    """Return the bytes of a triangle of a kernel that stores nothing, in the run's layout."""
    padded = (run.info.get("config") or {}).get("layout") == "padded"
    key = "bytes_per_triangle_padded" if padded else "bytes_per_triangle"
    for kernel, facts in (run.info.get("methods") or {}).items():
        forms = (run.info.get("kernels") or {}).get(kernel) or {}
        if facts.get("stored") == "none" and forms:
            return storage(run, kernel, precision or next(iter(forms)))[key]
    return None


def _apart(sizes: "Sequence[float]") -> list[float]:
    """Return the sizes that leave their labels room, the last one among them."""
    kept: list[float] = []
    for size in sorted(sizes, reverse=True):
        if not kept or np.log10(kept[-1] / size) > 0.55:
            kept.append(size)
    return kept


def _limits(rows: list[dict]) -> tuple[float, float]:
    """Return the ends of the scale of rays: decades about what is finite, at most five of them."""
    finite = [row["rays_per_triangle"] for row in rows if not absent(row["rays_per_triangle"])]
    least = 10.0 ** np.floor(np.log10(max(min(finite, default=1.0), 0.1)))
    most = 10.0 ** (np.ceil(np.log10(max(finite, default=100.0))) + 1)
    return least, min(most, 1e5 * least)


def _line(panel: Axes, rows: list[dict], aside: float, look, name: str, most: float) -> None:
    """Draw a kernel's break-even over the sizes; it is torn where preparing never pays."""
    at = [row["scene"] * aside for row in rows]
    rays = [
        np.nan if absent(row["rays_per_triangle"]) else row["rays_per_triangle"] for row in rows
    ]
    panel.plot(
        at,
        rays,
        color=look.color,
        marker=look.marker,
        linestyle=look.dashes,
        linewidth=1.0,
        label=name,
    )
    top = 10 ** (np.log10(panel.get_ylim()[0] / most) * (1 - _NEVER)) * most
    for x, y, row in zip(at, rays, rows, strict=True):
        low, high = row.get("ci_low"), row.get("ci_high")
        if np.isnan(y):
            panel.plot([x], [top], color=look.color, marker=look.marker, markerfacecolor="white")
            y = top
        if absent(low):
            continue
        end, open_above = (top, True) if absent(high) else (high, False)
        # Faint: an interval without an end covers what is known of others.
        faint = 0.35 if open_above else 1
        panel.plot(
            [x, x], [min(low, y), end], color=look.color, linewidth=0.9, zorder=2, alpha=faint
        )
        if open_above:
            panel.plot([x], [top], marker="^", markersize=2.5, color=look.color)
