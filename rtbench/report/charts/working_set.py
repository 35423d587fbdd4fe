"""Time over the number of distinct pairs, with the sizes of the machine's caches."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.charts.density import subtitle

if TYPE_CHECKING:
    from rtbench.records.run import Run

_LINEAR_UP_TO = 6.0


@style.styled
def working_set_chart(run: "Run") -> Figure:
    """Draw ns a test over the number of distinct pairs, a line a kernel with its interval.

    Parameters
    ----------
    run : Run
        A run of the experiment ``working_set``.

    Returns
    -------
    Figure
        A panel a precision, order and density; vertical lines where the pairs fill a cache. The
        times are on a logarithmic scale where they spread widely, without the empty loop then.
    """
    frame = cells.times_of(run)
    names = cells.kernels(frame)
    look = style.looks(names)
    blocks = list(cells.groups(frame))
    times = frame.loc[frame["kernel"] != cells.EMPTY_LOOP, "ns_per_test"]
    # From the predictor's few ns to the memory's many: only ratios show both.
    logarithmic = len(times) and times.max() > _LINEAR_UP_TO * times.min()
    figure, axes = style.grid(len(blocks), 3.6, 3.3, sharex=True, sharey=True)
    for number, (panel, (group, block)) in enumerate(zip(axes, blocks, strict=True)):
        for name in names if logarithmic else [*names, cells.EMPTY_LOOP]:
            rows = cells.where(block, kernel=name).sort_values("triangles")
            if not len(rows):
                continue
            pairs = rows["triangles"].to_numpy(float)
            empty = name == cells.EMPTY_LOOP
            color = style.GREY if empty else look[name].color
            low, high = (rows[end].to_numpy(float) for end in ("ci_low", "ci_high"))
            panel.fill_between(pairs, low, high, color=color, alpha=0.22, linewidth=0)
            panel.plot(
                pairs,
                rows["ns_per_test"].to_numpy(float),
                color=color,
                marker="" if empty else look[name].marker,
                linestyle=(0, (1, 2)) if empty else look[name].dashes,
                label="(empty loop)" if empty else name,
            )
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(10))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
        panel.xaxis.set_minor_formatter(NullFormatter())
        if logarithmic:
            panel.set_yscale("log")
            panel.yaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5)))
            panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            panel.yaxis.set_minor_formatter(NullFormatter())
        else:
            panel.set_ylim(bottom=0)
        panel.grid(axis="y")
        if number + 3 >= len(axes):
            panel.set_xlabel("distinct pairs")
        if number % 3 == 0:
            panel.set_ylabel(marks.NS_A_TEST)
        panel.set_title(cells.group_words(frame, group), pad=16)
        _caches(panel, run, group["precision"])
    marks.legend(axes[min(3, len(axes)) - 1])
    words = subtitle(run, frame, amount=False)
    words = words.replace(marks.INTERVAL_NOTE, "bands: 95 % interval")
    style.head(figure, "Working set: time over the number of distinct pairs", words)
    return figure


def bytes_per_pair(run: "Run", precision: str | None) -> float | None:
    """Return the bytes that a pair takes in memory, from the run's config or its workloads."""
    config = run.info.get("config") or {}
    sources = [config, *(run.info.get("workloads") or [])]
    for source in sources:
        found = source.get("bytes_per_pair")
        if isinstance(found, dict):
            found = found.get(precision)
        if isinstance(found, int | float) and source.get("precision", precision) == precision:
            return float(found)
    return None


def _caches(panel, run: "Run", precision: str | None) -> None:
    each = bytes_per_pair(run, precision)
    if not each:
        return
    first, last = panel.get_xlim()
    for name, size in machine.data_caches(run):
        pairs = size / each
        if not first < pairs < last:
            continue
        panel.axvline(pairs, color=style.GREY, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0)
        panel.annotate(
            f"{name} {_size(size)}",
            (pairs, 1),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=7,
            color=style.GREY,
        )


def _size(size: int) -> str:
    steps = int(np.log2(size) // 10)
    return f"{size / 1024**steps:.3g} {('B', 'KiB', 'MiB', 'GiB')[steps]}"
