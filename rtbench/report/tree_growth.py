"""How times grow with the number of triangles: the exponent of N, over all sizes and the larger."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtbench.records import student

LEVEL = 0.95
LARGEST_N = 2  # of all sizes, one in so many is among the largest


class Exponent(NamedTuple):
    """The slope of the logarithm of seconds over that of N, with its 95 % interval (or None)."""

    value: float
    low: float | None
    high: float | None
    points: int

    @property
    def text(self) -> str:
        """The exponent and its interval as they are printed."""
        ends = "" if self.low is None else f" [{self.low:.2f}, {self.high:.2f}]"
        return f"{self.value:.2f}{ends}"


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> Exponent | None:
    """Return the exponent of N in times.

    Parameters
    ----------
    sizes : sequence of float
        Numbers of triangles.
    seconds : sequence of float
        A median for each; those that are not above 0 are left out.

    Returns
    -------
    Exponent or None
        A line through the logarithms by least squares. Its interval is Student's by how far the
        points lie from the line, which holds noise and curvature alike: N log N is no power of N.
        Two points have none, one has no exponent.
    """
    good = [(n, s) for n, s in zip(sizes, seconds, strict=True) if n > 0 and s > 0]
    if len({n for n, _ in good}) < 2:
        return None
    x, y = (np.log(np.array(column, float)) for column in zip(*good, strict=True))
    around = x - x.mean()
    slope = float(around @ y / (around @ around))
    freedom = len(x) - 2
    if freedom < 1:
        return Exponent(slope, None, None, len(x))
    rest = y - y.mean() - slope * around
    error = math.sqrt(float(rest @ rest) / freedom / float(around @ around))
    reach = student.quantile(1 - LEVEL, freedom) * error
    return Exponent(slope, slope - reach, slope + reach, len(x))


def largest(sizes: Sequence[float]) -> list[int]:
    """Return the places of the larger half of the sizes, the middle one among them."""
    order = sorted(range(len(sizes)), key=lambda place: sizes[place])
    return sorted(order[len(order) // LARGEST_N :])


def both_exponents(
    sizes: Sequence[float], seconds: Sequence[float]
) -> tuple[Exponent | None, Exponent | None]:
    """Return the exponent over all sizes, and over the larger half (None of fewer than three)."""
    top = largest(sizes)
    over_top = [sizes[k] for k in top], [seconds[k] for k in top]
    return exponent(sizes, seconds), exponent(*over_top) if len(top) > 2 else None
