"""The ledger: what each effect costs a scene, what it brings, and what it would cost if forced on.

One renderer is the scene's own; beside it stands one for each effect: with the effect left out
where the scene calls for it, forced in where it does not. They render in turns, and who begins
changes from round to round: what the machine does meanwhile hits all alike.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rtbench.scenes.model import Scene
from rtbench.tracer.effects import DESCRIBED, EFFECTS, reasons, with_settings
from rtbench.tracer.options import Options

if TYPE_CHECKING:
    from rtbench.tracer.render import Picture, Renderer

REPEATS = 6  # the fewest rounds whose median has a 95 % interval
LEVEL = 0.95
OF_LIGHTS = ("light_behind", "no_contribution")  # reasons for which rays to lights are saved


@dataclass(frozen=True)
class Row:
    """What one effect is to a scene.

    Everything is a difference of two renderings: of the scene's own and of one without the effect
    where the scene calls for it; else of one with the effect forced in and of the scene's own.

    Attributes
    ----------
    key, title : str
    called : bool
        Whether the scene calls for it.
    why : str
        What in the scene does, or why nothing does.
    neutral : str
        What it does where it is forced in.
    along : tuple of str
        Effects that come and go with it.
    rays : dict of str to int
        Rays by kind that it shoots; kinds of which it changes nothing are left out.
    saved : dict of str to int
        Rays by reason that it considers and does not shoot.
    seconds : float
        That the scene's picture takes longer by it; exactly 0 where it is not compiled in.
    forced_seconds : float
        That the picture takes longer with it compiled in, called for or not: the median of the
        rounds' differences.
    low, high : float or None
        An interval of 95 % of ``forced_seconds``; None: too few rounds.
    share : float
        ``forced_seconds`` over the seconds without the effect.
    rounds : list of (float, float)
        Seconds with and without it, round by round.
    max_difference : float
        Of any part of any pixel, linear; infinite where one picture alone has a number.
    same_bits : bool
        Whether both pictures are equal to the last bit.
    """

    key: str
    title: str
    called: bool
    why: str
    neutral: str
    along: tuple[str, ...]
    rays: dict[str, int]
    saved: dict[str, int]
    seconds: float
    forced_seconds: float
    low: float | None
    high: float | None
    share: float
    rounds: list[tuple[float, float]]
    max_difference: float
    same_bits: bool


@dataclass(frozen=True)
class Ledger:
    """The rows, in the order of the effects, and what they are differences to.

    Attributes
    ----------
    scene : str
    rows : list of Row
    picture : Picture
        The scene's own.
    seconds : float
        That it takes to trace, median of the rounds.
    """

    scene: str
    rows: list[Row]
    picture: Picture = field(repr=False)
    seconds: float

    def record(self) -> dict:
        """Return everything but the pixels as plain values, as reports and json take it."""
        height, width = self.picture.pixels.shape[:2]
        return {
            "scene": self.scene,
            "width": width,
            "height": height,
            "seconds": self.seconds,
            "rays": {kind: int(count) for kind, count in self.picture.rays.items()},
            "saved": {reason: int(count) for reason, count in self.picture.saved.items()},
            "effects": [dataclasses.asdict(row) for row in self.rows],
        }


def ledger(
    scene: Scene,
    options: Options | None = None,
    repeats: int = REPEATS,
    progress: Callable[[float], None] | None = None,
    make: Callable[[Scene, Options], Renderer] | None = None,
    threads: int = 1,
) -> Ledger:
    """Render a scene with and without each effect, and tell what each of them does.

    Parameters
    ----------
    scene : Scene
    options : Options
        What the renderings share; what is left out and forced in them does not count here.
    repeats : int
        Rounds that are timed, from 1; one goes before, untimed.
    progress : callable, optional
        Told the fraction done.
    make : callable, optional
        What makes a renderer.
    threads : int

    Returns
    -------
    Ledger
    """
    options = dataclasses.replace(options or Options(), without=(), force=())
    found = reasons(with_settings(scene, options.depth, options.samples, options.threshold))
    asked = [options]
    for key, reason in found.items():
        chosen = {"without": (key,)} if reason.called else {"force": (key,)}
        asked.append(dataclasses.replace(options, **chosen))
    steps = _Steps(len(asked) * (2 + repeats), progress)
    renderers = _made(scene, asked, make, steps)
    pictures = []
    for each in renderers:
        pictures.append(each.render(threads=threads))
        steps.done()
    seconds = np.zeros((len(asked), repeats))
    for turn in range(repeats):
        for place in range(len(asked)):
            at = (place + turn) % len(asked)
            picture = renderers[at].render(threads=threads)
            seconds[at, turn] = picture.seconds["trace"]
            steps.done()
    rows = [
        _row(key, found[key], pictures[0], pictures[at], seconds[0], seconds[at])
        for at, key in enumerate(EFFECTS, 1)
    ]
    return Ledger(scene.name, rows, pictures[0], float(np.median(seconds[0])))


def _made(scene, asked, make, steps) -> list:
    """Return the renderers; real ones are compiled on all cores side by side."""
    if make is not None:
        renderers = []
        for each in asked:
            renderers.append(make(scene, each))
            steps.done()
    else:
        from rtbench.tracer.render import Renderer, compile_all

        renderers = [Renderer(scene, each, later=True) for each in asked]
        compile_all(renderers, steps.part(len(asked)))
        steps.count = len(asked)
    return renderers


class _Steps:
    def __init__(self, total: int, progress: Callable[[float], None] | None) -> None:
        self.total, self.progress, self.count = total, progress, 0

    def part(self, steps: int) -> Callable[[float], None]:
        """Return what tells the fraction done of so many steps."""

        def told(fraction: float) -> None:
            if self.progress is not None:
                self.progress((self.count + fraction * steps) / self.total)

        return told

    def done(self) -> None:
        self.count += 1
        if self.progress is not None:
            self.progress(self.count / self.total)


def _row(key, reason, own, other, own_seconds, other_seconds) -> Row:
    less, more = (other, own) if reason.called else (own, other)
    without, within = (
        (other_seconds, own_seconds) if reason.called else (own_seconds, other_seconds)
    )
    cost = float(np.median(within - without))
    low, high = median_interval(within - without) or (None, None)
    return Row(
        key=key,
        title=EFFECTS[key],
        called=reason.called,
        why=reason.why,
        neutral=DESCRIBED[key].neutral,
        along=tuple(
            each for each in EFFECTS if each != key and own.effects[each] != other.effects[each]
        ),
        rays=_difference(more.rays, less.rays),
        saved=_difference(_saved(more), _saved(less)),
        seconds=cost if reason.called else 0.0,
        forced_seconds=cost,
        low=low,
        high=high,
        share=cost / float(np.median(without)),
        rounds=[(float(a), float(b)) for a, b in zip(within, without, strict=True)],
        max_difference=max_difference(own.pixels, other.pixels),
        same_bits=own.pixels.tobytes() == other.pixels.tobytes(),
    )


def _saved(picture: Picture) -> dict[str, int]:
    # Lights are looked at without shadows too; but then no ray to them is saved.
    shadows = picture.effects["shadows"]
    return {k: count for k, count in picture.saved.items() if shadows or k not in OF_LIGHTS}


def _difference(more: dict[str, int], less: dict[str, int]) -> dict[str, int]:
    keys = dict.fromkeys([*more, *less])
    changes = {key: int(more.get(key, 0)) - int(less.get(key, 0)) for key in keys}
    return {key: change for key, change in changes.items() if change}


def max_difference(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest absolute difference of two pictures.

    Parameters
    ----------
    a, b : (H, W, 3) arrays of one float dtype

    Returns
    -------
    float
        0 where both are equal, infinities and NaN included; infinite where one alone is finite.
    """
    with np.errstate(invalid="ignore"):
        apart = np.abs(np.subtract(a, b, dtype=np.float64))
    apart[(a == b) | (np.isnan(a) & np.isnan(b))] = 0.0
    apart[np.isnan(apart)] = np.inf
    return float(apart.max(initial=0.0))


def median_interval(values: np.ndarray, level: float = LEVEL) -> tuple[float, float] | None:
    """Return an interval of the median of what was sampled, by the order of the samples alone.

    Parameters
    ----------
    values : (N,) array
        Independent samples, of any distribution.
    level : float
        The confidence.

    Returns
    -------
    (float, float) or None
        The k-th least and the k-th greatest sample, k as large as the level allows; None where
        even the least and the greatest do not reach it: fewer than 6 samples at 95 %.

    Source
    ------
    Thompson 1936: the median lies outside with twice the chance of fewer than k heads in N throws.
    """
    ordered = np.sort(values)
    count = len(ordered)
    outside, k = 0.0, 0
    while k < count // 2:
        outside += 2 * math.comb(count, k) / 2**count
        if outside > 1 - level:
            break
        k += 1
    return (float(ordered[k - 1]), float(ordered[count - k])) if k else None
