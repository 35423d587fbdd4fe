"""Where in a kernel the time goes: its stages as one bar a stage, end to end (Blecha 2007, 4.4)."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.digits import measured
from rtbench.report.stages import Stage, stages_of

if TYPE_CHECKING:
    from rtbench.records.run import Run


@style.styled
def stages_chart(run: "Run") -> Figure:
    """Draw the stages of each kernel, each bar from the end of the stage before to its own.

    Parameters
    ----------
    run : Run
        A run of the experiment ``stages``.

    Returns
    -------
    Figure
        A panel a kernel (and precision, order, density), one row a stage: a stacked bar unrolled,
        so that names fit and a stage that takes less than nothing is seen as such (open bar).
    """
    groups: dict[tuple[str, str], list[Stage]] = {}
    for stage in stages_of(run):
        groups.setdefault((stage.kernel, stage.group), []).append(stage)
    figure, axes = style.panels(
        len(groups),
        1,
        7.0,
        0.4 + sum(0.45 + 0.19 * len(stages) for stages in groups.values()),
        sharex=True,
        gridspec_kw={"height_ratios": [len(stages) + 1.2 for stages in groups.values()]},
    )
    names = list(dict.fromkeys(kernel for kernel, _ in groups))
    look = style.looks(names)
    longest = max(max(s.end, s.ci_high or 0) for stages in groups.values() for s in stages)
    for (kernel, group), stages, panel in zip(groups, groups.values(), axes, strict=True):
        _one_kernel(panel[0], stages, look[kernel], longest)
        panel[0].set_title(", ".join(filter(None, [kernel, group])), loc="left")
    axes[-1][0].set_xlabel("time up to the end of the stage (ns a test)")
    axes[-1][0].set_xlim(0, longest * 1.2)
    words = [
        style.kernel_list(names),
        machine.processor(run),
        "whiskers: 95 % interval of the time so far",
        "bars start at the empty loop; right of each: what it adds and its share of the kernel",
        "an open bar takes time off",
    ]
    style.head(figure, "Time by stage", "; ".join(words))
    return figure


def _one_kernel(panel, stages: list[Stage], look: style.Look, longest: float) -> None:
    for place, stage in enumerate(stages):
        loss = stage.added < 0
        panel.barh(
            place,
            stage.added,
            left=stage.start,
            height=0.66,
            color="white" if loss else look.color,
            edgecolor=look.color,
            alpha=1 if loss else 0.75,
            linewidth=0.8,
        )
        if place:
            panel.plot(
                [stage.start] * 2, [place - 0.67, place + 0.33], color=style.GREY, linewidth=0.5
            )
        low, high = stage.ci_low, stage.ci_high
        if low is not None and high is not None:
            panel.errorbar(
                [stage.end],
                [place],
                xerr=marks.errors([stage.end], [low], [high]),
                color="black",
                linestyle="none",
                elinewidth=0.9,
            )
        right = max(stage.start, stage.end, stage.ci_high or 0)
        share = "" if stage.share != stage.share else f"  {100 * stage.share:.0f} %"
        panel.text(
            right + 0.012 * longest,
            place,
            f"{measured(stage.added, low, high).text} ns{share}",
            va="center",
            fontsize=7,
            color="#333333",
            bbox=marks.ON_PAPER,
        )
    marks.category_axis(panel, [stage.name for stage in stages])
