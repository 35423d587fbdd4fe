"""Tests that wait for each other against tests that do not."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from rtbench.report import cells
from rtbench.report.charts import marks, style
from rtbench.report.charts.density import subtitle
from rtbench.report.digits import absent

if TYPE_CHECKING:
    from rtbench.records.run import Run

CHAINS = {
    "independent": ("o", style.OKABE_ITO[0], -0.14, "independent tests"),
    "dependent": ("s", style.OKABE_ITO[1], 0.14, "each waits for the one before"),
}


@style.styled
def latency_chart(run: "Run") -> Figure:
    """Draw both times of each kernel in its row, and how many times as long the wait takes.

    Parameters
    ----------
    run : Run
        A run of the experiment ``latency``.

    Returns
    -------
    Figure
        A panel a precision, order and density.
    """
    frame = cells.times_of(run)
    blocks = list(cells.groups(frame))
    names = cells.values(frame, "kernel")
    figure, axes = style.grid(
        len(blocks), 2.6, 0.95 + 0.34 * len(names), beside=3.0, sharex=True, sharey=True
    )
    largest = frame[["ns_per_test", "ci_high"]].astype(float).max().max()
    for panel, (group, block) in zip(axes, blocks, strict=True):
        for place, name in enumerate(names):
            times, ends = {}, []
            for cell in cells.where(block, kernel=name).to_dict("records"):
                marker, color, aside, _ = CHAINS[cell["chain"]]
                look = style.Look(color, marker, "-", "")
                times[cell["chain"]] = middle = cell["ns_per_test"]
                ends.append(middle if absent(cell["ci_high"]) else cell["ci_high"])
                marks.dot(panel, middle, cell["ci_low"], cell["ci_high"], place + aside, look)
            if len(times) == 2:
                panel.annotate(
                    f"x {times['dependent'] / times['independent']:.2f}",
                    (max(ends), place),
                    xytext=(9, 0),
                    textcoords="offset points",
                    va="center",
                    fontsize=7.5,
                    color=style.GREY,
                    bbox=marks.ON_PAPER,
                )
        marks.category_axis(
            panel, ["(empty loop)" if name == cells.EMPTY_LOOP else name for name in names]
        )
        panel.set_xlim(0, largest * 1.25)
        panel.set_xlabel(marks.NS_A_TEST)
        panel.set_title(cells.group_words(frame, group))
    corner = axes[min(3, len(axes)) - 1]
    for marker, color, _, label in CHAINS.values():
        corner.plot([], [], marker=marker, color=color, linestyle="none", label=label)
    marks.legend(corner)
    style.head(figure, "Latency: dependent against independent tests", subtitle(run, frame))
    return figure
