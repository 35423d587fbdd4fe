"""Student's distribution, without scipy: a diff should not wait a second for it."""

import math
from functools import lru_cache
from statistics import NormalDist

import numpy as np

_NORMAL = NormalDist()


@lru_cache(maxsize=10_000)
def tail(alpha: float, units: int, freedom: float) -> float:
    """Return the percentile, as a fraction, at which an interval that misses alpha ends."""
    return _NORMAL.cdf(-math.sqrt(units / (units - 1)) * quantile(alpha, freedom))


@lru_cache(maxsize=10_000)
def quantile(alpha: float, freedom: float) -> float:
    """Return the t beyond which, on both sides, Student's distribution has alpha."""
    low, high = 0.0, 1e9
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if below(middle, freedom) < 1 - alpha / 2 else (low, middle)
    return low


def below(t: float, freedom: float) -> float:
    """Return P(T <= t) for t >= 0, by the trapezoid rule in theta, t = sqrt(freedom) tan(theta)."""
    angle = math.atan(t / math.sqrt(freedom))
    theta = np.linspace(angle, math.pi / 2, 2001)
    # The density becomes cos(theta)^(freedom - 1); the upper tail keeps small values exact.
    density = np.cos(theta).clip(0) ** (freedom - 1)
    tail = float(np.sum(density[1:] + density[:-1])) / 2 * (math.pi / 2 - angle) / 2000
    norm = math.sqrt(math.pi) * math.exp(math.lgamma(freedom / 2) - math.lgamma((freedom + 1) / 2))
    return 1 - tail / norm
