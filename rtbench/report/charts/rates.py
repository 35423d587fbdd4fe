"""What the charts of soup runs share: speeds, methods in groups, their names beside the rows."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from matplotlib.axes import Axes

from rtbench.report import cells
from rtbench.report.charts import marks, style
from rtbench.report.digits import absent
from rtbench.report.methods import Method, labels, methods_of

if TYPE_CHECKING:
    from rtbench.records.run import Run

SPEED = "million tests per second"
NAN = float("nan")


class Group(NamedTuple):
    """The kernels of a run that are one method with several endings, the fastest first."""

    label: str
    stored: str
    methods: list[Method]


def groups_of(run: "Run") -> list[Group]:
    """Return a run's kernels by method, the method with the fastest kernel first.

    Parameters
    ----------
    run : Run
        A run of the experiment ``soup``.

    Returns
    -------
    list of Group
        Fast is the least sum of ns a test over the hit ratios, in the first precision.
    """
    frame = cells.times_of(run)
    methods = methods_of(run, cells.kernels(frame))
    times = {}
    for kernel in methods:
        rows = cells.where(frame, kernel=kernel)
        rows = next((block for _, block in cells.groups(rows, ("precision", "prepared"))), rows)
        # A kernel that lacks a hit ratio comes last: its sum says nothing.
        whole = len(rows) == len(cells.densities(frame))
        times[kernel] = float(rows["ns_per_test"].sum()) if whole else float("inf")
    by_base: dict[str, list[Method]] = {}
    for kernel in sorted(methods, key=times.get):
        by_base.setdefault(methods[kernel].base, []).append(methods[kernel])
    names = labels(list(methods.values()))
    return [Group(names[base], found[0].stored, found) for base, found in by_base.items()]


def rates(frame) -> list[dict]:
    """Return, for each row of a summary, million tests a second: middle, low and high."""
    found = []
    for row in frame.to_dict("records"):
        low, high = row.get("ci_low"), row.get("ci_high")
        known = not absent(low) and not absent(high) and low > 0
        ends = (1e3 / high, 1e3 / low) if known else (NAN, NAN)
        found.append({"middle": 1e3 / row["ns_per_test"], "low": ends[0], "high": ends[1]})
    return found


def hit_ratio(run: "Run", ratio) -> str:
    """Return a hit ratio in words, with the exact one beside it where that rounds otherwise."""
    text = f"hit ratio {cells.density_text(ratio)}"
    for work in run.info.get("workloads") or []:
        if work.get("density") == ratio and not absent(work.get("hit_ratio")):
            exact = f"{work['hit_ratio']:.3f}"
            return text if float(exact) == ratio else f"{text} (exactly {exact})"
    return text


def work_of(run: "Run") -> str:
    """Return the size of a run's soups in words, nothing where they differ."""
    sizes = {(work["scene"], work["rays"]) for work in run.info.get("workloads") or []}
    if len(sizes) != 1:
        return ""
    triangles, shot = sizes.pop()
    return f"{triangles:,} triangles x {shot:,} rays"


def label_rows(axes: Sequence[Axes], groups: Sequence[Group], tags: Sequence[str]) -> None:
    """Name the rows of panels that share them, a light tag below the name where there is one.

    Parameters
    ----------
    axes : sequence of Axes
        A row of panels; the names stand to the left of the first.
    groups : sequence of Group
        The rows from the top.
    tags : sequence of str
        One a row.
    """
    first = axes[0]
    marks.category_axis(first, [group.label for group in groups])
    first.grid(visible=False, axis="y")
    for panel in axes[1:]:
        panel.tick_params(axis="y", length=0)
        panel.spines["left"].set_visible(False)
    for place, tag in enumerate(tags):
        if not tag:
            continue
        first.get_yticklabels()[place].set_verticalalignment("bottom")
        first.annotate(
            tag,
            (0, place),
            xycoords=first.get_yaxis_transform(),
            xytext=(-3.5, -1),
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=6.5,
            color=style.GREY,
        )
