"""Time and frequency of every outcome of every kernel (Blecha 2007, tables 4.5 and 4.7)."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.digits import absent, frequency

if TYPE_CHECKING:
    from rtbench.records.run import Run


@style.styled
def outcomes_chart(run: "Run") -> Figure:
    """Draw the time of pairs that all return one outcome, its frequency written beside.

    Parameters
    ----------
    run : Run
        A run whose outcomes were counted and timed.

    Returns
    -------
    Figure
        A panel a kernel (rows) and precision (columns), a point an outcome; of times at several
        densities that of the most pairs.
    """
    frame = cells.outcomes_of(run)
    names, precisions = cells.values(frame, "kernel"), cells.precisions(frame) or [None]
    sizes = [
        max(len(cells.values(cells.where(frame, kernel=name), "outcome")), 1) for name in names
    ]
    figure, axes = style.panels(
        len(names),
        len(precisions),
        2.4 + 4.0 * len(precisions),
        0.3 + sum(0.42 + 0.24 * size for size in sizes),
        sharex=True,
        gridspec_kw={"height_ratios": [size + 0.7 for size in sizes]},
    )
    look = style.looks(names)
    for row, name in enumerate(names):
        for column, precision in enumerate(precisions):
            panel = axes[row][column]
            block = cells.where(frame, kernel=name, precision=precision)
            outcomes = sorted(cells.values(block, "outcome"))
            labels, shares = [], []
            for place, outcome in enumerate(outcomes):
                rows = cells.where(block, outcome=outcome)
                labels.append(f"{outcome}  {rows['label'].iloc[0]}")
                shares.append(_share(rows, block))
                _points(panel, rows, place, look[name])
            marks.category_axis(panel, labels)
            _beside(panel, shares)
            panel.set_title(f"{name}, {precision}" if len(precisions) > 1 else name, loc="left")
    for panel in axes[-1]:
        panel.set_xlabel(marks.NS_A_TEST)
        top = frame[["ns_per_test", "ci_high"]].astype(float).max().max()
        if not absent(top):
            panel.set_xlim(0, top * 1.06)
    counts = frame.groupby("kernel", sort=False)["count"].sum()
    words = [
        f"pairs that all return the outcome; right: its share of {int(counts.max()):,} pairs",
        precisions[0] if len(precisions) == 1 else "",
        machine.processor(run),
        marks.INTERVAL_NOTE if frame["ci_low"].notna().any() else "no intervals",
    ]
    style.head(figure, "Time per outcome", "; ".join(word for word in words if word))
    return figure


def _share(rows, block) -> str:
    """Return the outcome's frequency over all densities as text, with its count if it is rare."""
    count, pairs = (int(some["count"].sum()) for some in (rows, block))
    if not pairs:
        return ""
    text = f"{frequency(count / pairs).text} %"
    return f"{text} ({count:,})" if 0 < count < 0.001 * pairs else text


def _points(panel, rows, place: int, look: style.Look) -> None:
    timed = cells.longest_timed(rows)
    for cell in timed.to_dict("records"):
        marks.dot(panel, cell["ns_per_test"], cell["ci_low"], cell["ci_high"], place, look)
    if not len(timed):
        panel.text(
            0.01,
            place,
            "not timed",
            transform=panel.get_yaxis_transform(),
            va="center",
            fontsize=7.5,
            color=style.GREY,
            bbox=marks.ON_PAPER,
        )


def _beside(panel, shares: list[str]) -> None:
    """Write the frequencies to the right of the axes, where they are part of the layout."""
    other = panel.twinx()
    other.set_ylim(panel.get_ylim())
    other.set_yticks(range(len(shares)), shares)
    other.tick_params(axis="y", length=0)
    for spine in other.spines.values():
        spine.set_visible(False)
