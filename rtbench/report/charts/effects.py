"""Tracers that hold more than a scene calls for, and effects added one by one."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from rtbench.report import machine
from rtbench.report.charts import marks, style
from rtbench.report.effects import MORE, TITLES, Effects

_ROW = 0.42  # inches a scene
_ALL = "geometric mean"
_WIDEST = 1.3  # how far an interval may reach beyond the points


def effects_charts(effects: Effects) -> dict[str, Figure]:
    """Return the charts of a run of the experiment ``effects``, by file name."""
    found = {}
    for number, group in enumerate(effects.groups):
        suffix = "" if len(effects.groups) == 1 else f"-{number + 1}"
        scenes = effects.scenes(group)
        if any(effects.ratio(group, scene, tracer) for scene in scenes for tracer in MORE):
            found[f"effects{suffix}"] = tracers_chart(effects, group)
        if any(len(effects.steps(group, scene)) > 1 for scene in scenes):
            found[f"effects-steps{suffix}"] = steps_chart(effects, group)
    return found


@style.styled
def tracers_chart(effects: Effects, group: tuple[str, str]) -> Figure:
    """Draw how many times as long tracers take that hold more than a scene calls for.

    Parameters
    ----------
    effects : Effects
    group : (str, str)
        Kernel and precision.

    Returns
    -------
    Figure
        A line a scene, a point a tracer with its 95 % interval, paired by rounds; a line at 1: the
        scene's own tracer.
    """
    scenes = effects.scenes(group)
    there = [t for t in MORE if any(effects.ratio(group, scene, t) for scene in scenes)]
    looks = style.looks(there)
    points = [1.0]
    lines = [*scenes, *([_ALL] if len(scenes) > 1 else [])]
    figure, ((axes,),) = style.panels(1, 1, 6.6, 0.9 + _ROW * len(lines))
    for place, line in enumerate(lines):
        for aside, tracer in enumerate(there):
            mean = effects.mean(group, tracer)
            estimate = mean and mean.estimate
            if line != _ALL:
                estimate = effects.ratio(group, line, tracer)
            if estimate is None:
                continue
            ends = estimate.interval() or (np.nan, np.nan)
            points.append(estimate.value)
            y = place + (aside - (len(there) - 1) / 2) * 0.22
            label = TITLES[tracer] if place == 0 else None
            marks.dot(axes, estimate.value, *ends, y, looks[tracer], label)
    low, high = axes.get_xlim()
    axes.set_xlim(max(low, min(points) / _WIDEST), min(high, max(points) * _WIDEST))
    axes.axvline(1, color=style.GREY, linewidth=0.9, linestyle=(0, (4, 2)), zorder=0.5)
    marks.category_axis(axes, lines)
    axes.grid(axis="x")
    if len(lines) > len(scenes):
        axes.axhline(len(scenes) - 0.5, color=style.GREY, linewidth=0.6)
    axes.set_xlabel("time / time of the scene's own tracer (ratio)")
    marks.legend(axes, title="compiled in")
    notes = [f"{group[0]}, {group[1]}", f"paired by rounds, {marks.noted(axes)}"]
    notes += ["right of 1: slower than with only what the scene calls for"]
    notes.append(machine.processor(effects.run))
    style.head(figure, "Compiled in and not called for", "; ".join(notes))
    return figure


@style.styled
def steps_chart(effects: Effects, group: tuple[str, str]) -> Figure:
    """Draw what each effect adds to a picture's time, bar on bar.

    Parameters
    ----------
    effects : Effects
    group : (str, str)
        Kernel and precision.

    Returns
    -------
    Figure
        A line a scene, as parts of the time with all its effects; the ends of the bars have the
        95 % interval of the time up to there.
    """
    scenes = [scene for scene in effects.scenes(group) if len(effects.steps(group, scene)) > 1]
    steps = {scene: effects.steps(group, scene) for scene in scenes}
    order = {name: None for scene in scenes for name in [s.name for s in steps[scene]]}
    known = list(_in_their_order(order))
    reached = [(step, each[-1].time.value) for each in steps.values() for step in each]
    looks = style.looks(known)
    figure, ((axes,),) = style.panels(1, 1, 7.2, 0.9 + _ROW * len(scenes))
    for place, scene in enumerate(scenes):
        whole = steps[scene][-1].time.value
        before = 0.0
        for step in steps[scene]:
            now = step.time.value / whole
            look = looks[step.name]
            # One that saves time, within noise or by fewer rays, goes back over the one before.
            axes.barh(
                place,
                now - before,
                left=before,
                height=0.62,
                color=look.color,
                hatch=look.hatch,
                edgecolor="white",
                linewidth=0.5,
            )
            ends = step.time.interval()
            if ends:
                spread = marks.errors([now], [ends[0] / whole], [ends[1] / whole])
                axes.errorbar(
                    [now], [place], xerr=spread, color="black", elinewidth=0.9, linestyle="none"
                )
            before = now
        fact = effects.facts[scene]
        text = f"{whole * fact['width'] * fact['height'] / 1e6:,.3g} ms"
        axes.text(
            1.02,
            place,
            text,
            transform=axes.get_yaxis_transform(),
            va="center",
            fontsize=7.5,
            color=style.GREY,
        )
    marks.category_axis(axes, scenes)
    axes.grid(axis="x")
    # Intervals of few processes are wide: they are cut off, the bars are not.
    axes.set_xlim(0, 1.25 * max(step.time.value / whole for step, whole in reached))
    axes.set_xlabel("time / time with all effects of the scene")
    handles = [
        Patch(
            facecolor=looks[name].color,
            hatch=looks[name].hatch,
            edgecolor="white",
            label=name.replace("_", " "),
        )
        for name in known
    ]
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.13, 1.02), borderaxespad=0)
    notes = [f"{group[0]}, {group[1]}", "plain: rays from the camera and Lambert's law"]
    notes += [f"times up to there: {marks.noted(axes)}", machine.processor(effects.run)]
    style.head(figure, "Effects, one by one", "; ".join(notes))
    return figure


def _in_their_order(names: dict[str, None]) -> list[str]:
    """Return names so that each stands after those that any scene has before it."""
    order = (
        *("plain", "shadows", "reflection", "refraction", "dispersion", "specular", "texture"),
        *("smooth_normals", "soft_shadows", "glossy", "depth_of_field", "motion_blur"),
        *("antialiasing", "indirect"),
    )
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))
