"""From how many rays on a slower build pays by its faster rays."""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rtbench.report.tree_cells import NAIVE, Timed

if TYPE_CHECKING:
    from rtbench.report.trees import Trees

NEVER = math.inf


class Total(NamedTuple):
    """What is shot through a tree: seconds before the first ray, then nanoseconds a ray.

    Each as a median, with the least and the greatest of the processes.
    """

    timed: Timed
    seconds: tuple[float, float, float]
    ns: tuple[float, float, float]
    by_process: list[tuple[float, float]]

    def at(self, rays: np.ndarray, which: int = 0) -> np.ndarray:
        """Return the seconds that building and so many rays take."""
        return self.seconds[which] + rays * self.ns[which] / 1e9


class Crossing(NamedTuple):
    """From how many rays on a tree takes less in all than another: 0 at once, NEVER at no number.

    `low` and `high` are the least and the greatest that any one process says.
    """

    rays: float
    low: float
    high: float


def totals(trees: "Trees", model: str, rays: str) -> list[Total]:
    """Return what building and tracing takes, of the first kernel by its first way.

    Parameters
    ----------
    trees : Trees
    model, rays : str

    Returns
    -------
    list of Total
        Trees of the first ending, then the naive way, which builds nothing.
    """
    found, seen = [], set()
    timed = trees.of(model, rays)
    first = next((one for one in timed if one.ours), None)
    for one in timed if first is not None else ():
        naive = one.cell["way"] == NAIVE
        name = one.key[:3]
        if not (naive or one.ours) or one.form != first.form or name in seen:
            continue
        if one.ours and one.key[0] == "kd" and one.key[3] != first.key[3]:
            continue
        tree = trees.tree(one) if not naive else None
        if not naive and tree is None:
            continue
        seen.add(name)
        seconds = np.zeros(1) if tree is None else tree.seconds
        times = one.cpu if one.by_cpu else one.times
        per_ray = [float(np.median(times.ns[times.process == p])) for p in np.unique(times.process)]
        builds = np.resize(seconds, len(per_ray))  # a process that was cut off has built all of it
        middle = trees.median(one).value
        found.append(
            Total(
                one,
                (float(np.median(seconds)), float(seconds.min()), float(seconds.max())),
                (middle, min(per_ray), max(per_ray)),
                list(zip(builds.tolist(), per_ray, strict=True)),
            )
        )
    return found


def crossing(one: Total, other: Total) -> Crossing:
    """Return from how many rays on one takes less in all than the other."""
    pairs = zip(one.by_process, other.by_process, strict=False)
    each = [_crossing(*mine, *theirs) for mine, theirs in pairs]
    middle = _crossing(one.seconds[0], one.ns[0], other.seconds[0], other.ns[0])
    return Crossing(middle, min(each), max(each))


def _crossing(seconds: float, ns: float, other_seconds: float, other_ns: float) -> float:
    later, saved = seconds - other_seconds, (other_ns - ns) / 1e9
    if saved <= 0:  # it never wins back what it has not won at once
        return NEVER if later >= 0 or saved < 0 else 0.0
    return max(0.0, later / saved)
