"""Images of a model as trees see it: steps and triangle tests per pixel, rules side by side."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure

from rtbench.report import machine
from rtbench.report.charts import style
from rtbench.report.tree_cells import RULES, file_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rtbench.records.run import Run

COLOURS = "viridis"  # perceptually uniform, dark to light in grey print too
STEPS, TESTS = "traversal steps per ray", "triangle tests per ray"
_APART = 4.0  # times the least mean: so far apart, a scale is of square roots
_MOST = 99.5  # percentile that ends a scale: a few rays along a surface meet very many
_LIGHT = np.array([-0.4, 0.5, 0.77])  # in the camera's axes: right, up, towards it


class Picture(NamedTuple):
    """What rays met through each pixel: (H, W) arrays; depth is NaN where nothing was hit."""

    rule: str
    steps: np.ndarray
    tests: np.ndarray
    depth: np.ndarray


def heat_charts(run: "Run") -> dict[str, Figure]:
    """Return a figure a model whose images a run has, by file name."""
    found = {}
    for model, pictures in pictures_of(run).items():
        found[f"heat-{file_name(model)}"] = heat_chart(run, model, pictures)
    return found


def pictures_of(run: "Run") -> dict[str, list[Picture]]:
    """Return the images of each model of a run, the rules in the order of RULES.

    Files that cannot be read are left out: a run that was cut off may hold half of one.
    """
    folder = Path(run.path) / "images"
    told = [one["model"] for one in run.info.get("models") or []]
    found: dict[str, list[Picture]] = {}
    for model in told:
        for rule in [*RULES, "bvh"]:
            path = folder / f"{model}-{rule}.npz".replace(":", "-").replace("/", "-")
            picture = _read(path, rule) if path.exists() else None
            if picture is not None:
                found.setdefault(model, []).append(picture)
    return found


def _read(path: Path, rule: str) -> Picture | None:
    import zipfile

    try:
        # Opened here: numpy leaves a file open that turns out to be none.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = [np.array(stored[name]) for name in ("steps", "tests", "depth")]
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile):
        return None
    return Picture(rule, *arrays) if len({a.shape for a in arrays}) == 1 else None


@style.styled
def heat_chart(run: "Run", model: str, pictures: list[Picture]) -> Figure:
    """Draw the model, and a column a rule: its steps above, its triangle tests below.

    Parameters
    ----------
    run : Run
    model : str
    pictures : list of Picture

    Returns
    -------
    Figure
        One scale of colours a row, with its bar and unit; it ends where 0.5 % of the pixels of all
        rules lie beyond.
    """
    height, width = pictures[0].steps.shape
    columns = len(pictures) + 1
    wide = min(2.6, 8.6 / columns)
    tall = wide * height / width
    figure, axes = style.panels(2, columns, wide * columns + 0.9, 2 * (tall + 0.42))
    _model(axes[0][0], pictures[0].depth)
    facts = next((one for one in run.info.get("models") or [] if one["model"] == model), {})
    count = facts.get("triangles")
    axes[0][0].set_title("the model, shaded by its depth")
    _summary(axes[1][0], pictures)
    keys = axes[1][0].get_legend_handles_labels()
    figure.legend(*keys, loc="outside lower left", ncols=len(pictures), fontsize=7.5)
    for line, name, words in zip(axes, ("steps", "tests"), (STEPS, TESTS), strict=True):
        values = [getattr(picture, name) for picture in pictures]
        most = max(float(np.percentile(np.stack(values), _MOST)), 1.0)
        # Where one rule meets many times as much, a linear scale shows nothing of the others.
        means = [max(float(image.mean()), 1e-9) for image in values]
        power = 0.5 if max(means) > _APART * min(means) else 1.0
        for panel, picture, image in zip(line[1:], pictures, values, strict=True):
            shown = panel.imshow(
                image,
                cmap=COLOURS,
                norm=PowerNorm(power, vmin=0, vmax=most),
                interpolation="nearest",
                rasterized=True,
            )
            panel.set_title(f"{RULES.get(picture.rule, 'BVH')}: mean {image.mean():.1f}")
            _bare(panel)
        over = any((image > most).any() for image in values)
        bar = figure.colorbar(
            shown,
            ax=line[1:],
            pad=0.012,
            fraction=0.05,
            aspect=16,
            extend="max" if over else "neither",
        )
        bar.set_label(words if power == 1 else f"{words},\nsquare-root scale")
        bar.outline.set_linewidth(0.5)
    notes = [f"{width} x {height} pixels", "one scale for all rules of a row"]
    notes += [
        f"lightest: beyond the scale, {100 - _MOST:g} % of the pixels",
        machine.processor(run),
    ]
    title = f"{model}, {count:,} triangles" if count else model
    style.head(figure, f"{title}: what primary rays meet", "; ".join(notes))
    return figure


def _bare(panel: "Axes") -> None:
    panel.set_xticks([])
    panel.set_yticks([])
    for side in panel.spines.values():
        side.set_visible(False)


def _model(panel: "Axes", depth: np.ndarray) -> None:
    panel.imshow(
        shaded(depth), cmap="gray", vmin=0, vmax=1, interpolation="nearest", rasterized=True
    )
    _bare(panel)


def shaded(depth: np.ndarray) -> np.ndarray:
    """Return a picture of a surface from its depth: lit by the slope between pixels, (H, W) 0 to 1.

    The angle of a pixel is not known here: slopes are taken against the median step between
    neighbours, which makes flat and steep differ whatever the scale. White where nothing was hit.
    """
    there = np.isfinite(depth)
    if not there.any():
        return np.ones(depth.shape)
    filled = np.where(there, depth, np.nan)
    down, across = (_slope(filled, axis) for axis in (0, 1))
    steps = np.hypot(down, across)[there]
    steps = steps[np.isfinite(steps) & (steps > 0)]
    unit = float(np.median(steps)) if len(steps) else 1.0
    normal = np.stack([across / unit, -down / unit, np.ones(depth.shape)], axis=2)
    normal = np.nan_to_num(normal, nan=0.0, posinf=1e3, neginf=-1e3)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    light = np.maximum(normal @ (_LIGHT / np.linalg.norm(_LIGHT)), 0)
    near, far = np.quantile(depth[there], (0.02, 0.98))
    fade = np.clip((depth - near) / max(far - near, 1e-30), 0, 1)
    picture = (0.12 + 0.78 * light) * (1 - 0.35 * np.nan_to_num(fade))
    return np.where(there, picture, 1.0)


def _slope(depth: np.ndarray, axis: int) -> np.ndarray:
    """Return the difference to a neighbour: the smaller of both, so that borders are not steep."""
    step = np.diff(depth, axis=axis)
    pad = [(0, 0), (0, 0)]
    pad[axis] = (0, 1)
    after = np.pad(step, pad, constant_values=np.nan)
    pad[axis] = (1, 0)
    before = np.pad(step, pad, constant_values=np.nan)
    use_before = np.isnan(after) | (np.abs(before) < np.abs(after))
    return np.where(use_before, before, after)


def _summary(panel: "Axes", pictures: list[Picture]) -> None:
    """Draw how the steps are spread over the pixels, below the model."""
    looks = style.looks([picture.rule for picture in pictures])
    most = max(float(np.percentile(p.steps, _MOST)) for p in pictures)
    edges = np.linspace(0, max(most, 1.0), 40)
    for picture in pictures:
        look = looks[picture.rule]
        held, _ = np.histogram(picture.steps, edges)
        panel.stairs(
            100 * held / picture.steps.size,
            edges,
            color=look.color,
            linestyle=look.dashes,
            label=RULES.get(picture.rule, "BVH"),
        )
    panel.set_xlabel("steps per ray")
    panel.set_ylabel("pixels (%)")
    panel.set_ylim(0)
    panel.grid(axis="y")
