"""What is said of resampled times: verdicts, rankings, averages, outliers.

Several comparisons at once are corrected by Holm's procedure; what is not resolved is said to be
so. There is no test of means: every statistic is a median or a ratio of medians.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtbench.records.resampling import (
    LEVEL,
    Estimate,
    Times,
    joined,
    mean,
    median,
    p_value,
    paired_ratio,
    ratio,
    seed_of,
    total,
)

__all__ = [
    "Estimate",
    "GeometricMean",
    "Times",
    "geometric_mean",
    "holm",
    "kendall_tau",
    "mean",
    "median",
    "not_separable",
    "outliers",
    "p_value",
    "paired_ratio",
    "ranking",
    "ratio",
    "seed_of",
    "slower_than_best",
    "total",
    "verdict",
]

FASTER, SLOWER = "faster", "slower"
UNRESOLVED, NO_INTERVAL = "no difference resolved", "no interval"


def holm(p: Sequence[float | None], alpha: float = 1 - LEVEL) -> list[bool]:
    """Return which of several comparisons are resolved (Holm 1979).

    Parameters
    ----------
    p : sequence of float or None
        One value a comparison; None is never resolved and does not count.
    alpha : float
        The chance of any false one among them.

    Returns
    -------
    list of bool
        In the order given.
    """
    known = sorted((value, place) for place, value in enumerate(p) if value is not None)
    resolved = [False] * len(p)
    for step, (value, place) in enumerate(known):
        if value > alpha / (len(known) - step):
            break
        resolved[place] = True
    return resolved


def verdict(estimate: Estimate, resolved: bool) -> str:
    """Return the word for a ratio: faster, slower, no difference resolved, or no interval."""
    if estimate.draws is None:
        return NO_INTERVAL
    if not resolved:
        return UNRESOLVED
    return SLOWER if estimate.value > 1 else FASTER


def slower_than_best(sums: dict[str, float]) -> dict[str, float]:
    """Return how much slower than the best each is, in per cent.

    Parameters
    ----------
    sums : dict of float
        The sum (or mean) over the densities, by kernel; the same densities for all.

    Returns
    -------
    dict of float
        100 (sum / least sum - 1), by kernel.

    Source
    ------
    Blecha 2007, chapter 4, the last column of tables 4.1, 4.2 and 4.10.
    """
    best = min(sums.values(), default=math.nan)
    return {name: 100 * (value / best - 1) for name, value in sums.items()}


def not_separable(times: dict[str, Times], seed: int = 0) -> tuple[str, list[str]]:
    """Return the best kernel and those that cannot be told from it.

    Parameters
    ----------
    times : dict of Times
        The samples of one run, by kernel, over several densities as `total` sums them.
    seed : int
        As in `median`.

    Returns
    -------
    best : str
        The kernel with the least median.
    others : list of str
        Every kernel whose paired ratio to the best is not resolved from 1 (Holm over all).

    Raises
    ------
    ValueError
        If there is no kernel.
    """
    best = min(times, key=lambda name: float(np.median(times[name].ns)))
    others = [name for name in times if name != best]
    ratios = [paired_ratio(times[name], times[best], seed) for name in others]
    p = [None if found is None else p_value(found) for found in ratios]
    resolved = holm(p)
    return best, [name for name, sure in zip(others, resolved, strict=True) if not sure]


@dataclass(frozen=True)
class GeometricMean:
    """A geometric mean of ratios (Fleming & Wallace 1986) and how far they spread.

    Attributes
    ----------
    estimate : Estimate
        The mean with its resamples.
    deviation : float
        The geometric standard deviation, 1 if all are equal; NaN for a single ratio.
    least, greatest : float
        The extreme ratios.
    count : int
        Number of ratios.
    """

    estimate: Estimate
    deviation: float
    least: float
    greatest: float
    count: int


def geometric_mean(ratios: Sequence[Estimate]) -> GeometricMean:
    """Return the geometric mean of ratios with interval and spread.

    Parameters
    ----------
    ratios : sequence of Estimate
        At least one; cells of the same runs, resampled together.

    Returns
    -------
    GeometricMean
        Its estimate has no draws if one of the ratios has none.
    """
    logs = np.log([item.value for item in ratios])
    draws = None
    if all(item.draws is not None for item in ratios):
        draws = np.exp(np.mean([np.log(item.draws) for item in ratios], axis=0))
    value = math.exp(float(np.mean(logs)))
    spread = math.exp(float(np.std(logs, ddof=1))) if len(logs) > 1 else math.nan
    extremes = math.exp(float(logs.min())), math.exp(float(logs.max()))
    return GeometricMean(joined(value, draws, ratios), spread, *extremes, len(logs))


def ranking(values: dict[str, float]) -> list[str]:
    """Return the names from the least to the greatest value; ties by name."""
    return sorted(values, key=lambda name: (values[name], name))


def kendall_tau(a: Sequence[float], b: Sequence[float]) -> float | None:
    """Return the rank correlation tau-b of two sequences.

    Parameters
    ----------
    a, b : sequence of float
        Values of the same things in the same order.

    Returns
    -------
    float or None
        From -1 to 1; None if it is not defined (fewer than two, or all tied).

    Source
    ------
    Kendall 1945.
    """
    above = np.triu_indices(len(a), 1)
    signs = [np.sign(np.subtract.outer(np.asarray(x), np.asarray(x)))[above] for x in (a, b)]
    norm = math.sqrt(np.count_nonzero(signs[0]) * np.count_nonzero(signs[1]))
    return float(np.sum(signs[0] * signs[1])) / norm if norm else None


def outliers(times: Times, width: float = 3.0) -> np.ndarray:
    """Flag samples far from their process's median; they are counted, never left out.

    Parameters
    ----------
    times : Times
        The samples of one cell.
    width : float
        How many scaled median absolute deviations (1.4826 MAD) are far.

    Returns
    -------
    ndarray of bool, (n,)
        True where far; never where more than half the samples of a process are equal.
    """
    flags = np.zeros(len(times.ns), bool)
    for process in np.unique(times.process):
        inside = times.process == process
        distance = np.abs(times.ns[inside] - np.median(times.ns[inside]))
        scale = 1.4826 * np.median(distance)
        flags[inside] = (distance > width * scale) & (scale > 0)
    return flags
