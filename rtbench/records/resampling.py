"""Medians, ratios and their intervals, by resampling processes and then the rounds inside them.

Code placement is constant inside a process and differs between processes, so the process is the
unit of replication (Kalibera & Jones 2013): a resample draws processes with replacement, then
rounds inside each drawn process. With five processes a plain percentile interval is too short;
its tails are moved outwards to Phi(-sqrt(n / (n - 1)) t), t the quantile of Student's
distribution with n - 1 degrees of freedom (Hesterberg 2015, the expanded percentile interval).
Fewer than five get a t interval of the logarithm from the resamples' spread; one process, none.
No test of means anywhere: every statistic is a median.
"""

import math
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from statistics import NormalDist

import numpy as np

from rtbench.records import student

RESAMPLES = 2000
FEW = 5  # processes; below, a percentile interval misses far more than it says
LEVEL = 0.95

_NORMAL = NormalDist()


@dataclass(frozen=True)
class Times:
    """The samples of one cell.

    Attributes
    ----------
    ns : ndarray of float64, (n,)
        Nanoseconds a test.
    process, round : ndarray of int64, (n,)
        Where each was taken; a process that was resumed is another process.
    """

    ns: np.ndarray
    process: np.ndarray
    round: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """A value with the values that resampling gave for it.

    Attributes
    ----------
    value : float
        The estimate.
    draws : ndarray of float64, (RESAMPLES,), or None
        Resampled values; None if nothing is known of the spread.
    units : int
        Units of replication behind it: processes.
    freedom : float
        Degrees of freedom of the spread.
    """

    value: float
    draws: np.ndarray | None = None
    units: int = 1
    freedom: float = 0.0

    def interval(self, level: float = LEVEL) -> tuple[float, float] | None:
        """Return (low, high) at a confidence level, or None if there is no interval."""
        if self.draws is None:
            return None
        if self.units < FEW:
            # So few processes never drew the ends of their distribution: its shape is assumed.
            t = student.quantile(1 - level, self.freedom)
            if self.value <= 0 or np.min(self.draws) <= 0:  # a difference, not a time or a ratio
                reach = t * standard_error(self.draws, self.units)
                return self.value - reach, self.value + reach
            reach = t * standard_error(np.log(self.draws), self.units)
            return self.value * math.exp(-reach), self.value * math.exp(reach)
        tail = student.tail(1 - level, self.units, self.freedom)
        low, high = np.quantile(self.draws, [tail, 1 - tail])
        return float(low), float(high)


def standard_error(draws: np.ndarray, units: int) -> float:
    """Return the standard error of resampled values, as an unbiased variance has it."""
    return float(np.std(draws)) * math.sqrt(units / (units - 1))


def seed_of(name: str) -> int:
    """Return the seed of a run's resamples, from its name: tables are reproducible."""
    return zlib.crc32(name.encode())


def median(times: Times, seed: int = 0, resamples: int = RESAMPLES) -> Estimate:
    """Return the median of a cell with its resamples.

    Parameters
    ----------
    times : Times
        At least one sample.
    seed : int
        Cells with one seed and the same processes and rounds draw the same ones together.
    resamples : int
        Number of resamples.

    Returns
    -------
    Estimate
        In nanoseconds a test; without draws if there is one process.
    """
    return _resample(times, seed, resamples)


def paired_ratio(a: Times, b: Times, seed: int = 0, resamples: int = RESAMPLES) -> Estimate | None:
    """Return how many times as long ``a`` takes as ``b``, paired by process and round.

    Parameters
    ----------
    a, b : Times
        Samples of one run.
    seed, resamples : int
        As in `median`.

    Returns
    -------
    Estimate or None
        exp of the median of the log ratios; None if no round has both.
    """
    pairs = _common([a, b])
    if not len(pairs[0].ns):
        return None
    logs = replace(pairs[0], ns=np.log(pairs[0].ns) - np.log(pairs[1].ns))
    found = _resample(logs, seed, resamples)
    draws = None if found.draws is None else np.exp(found.draws)
    return replace(found, value=math.exp(found.value), draws=draws)


def total(parts: Sequence[Times]) -> Times:
    """Return the sums over several cells (densities), by process and round.

    Parameters
    ----------
    parts : sequence of Times
        Samples of one run; rounds that some lack are left out.

    Returns
    -------
    Times
        One value for each process and round that all have.
    """
    common = _common(parts)
    return replace(common[0], ns=np.sum([part.ns for part in common], axis=0))


def mean(estimates: Sequence[Estimate]) -> Estimate:
    """Return the arithmetic mean of several cells of one run."""
    draws = None
    if all(item.draws is not None for item in estimates):
        draws = np.mean([item.draws for item in estimates], axis=0)
    return joined(float(np.mean([item.value for item in estimates])), draws, estimates)


def ratio(later: Estimate, first: Estimate, paired: bool = False) -> Estimate:
    """Return later / first with its resamples.

    Parameters
    ----------
    later, first : Estimate
        Two cells, resampled the same number of times.
    paired : bool
        Whether both are of one run and were drawn together; else they are independent, and the
        degrees of freedom follow from both spreads (Welch 1947, Satterthwaite 1946).

    Returns
    -------
    Estimate
        Without draws if either has none.
    """
    value = later.value / first.value
    if later.draws is None or first.draws is None:
        return Estimate(value)
    found = joined(value, later.draws / first.draws, [later, first])
    if paired:
        return found
    spreads = [(float(np.var(np.log(item.draws))), item.freedom) for item in (later, first)]
    whole = sum(spread for spread, _ in spreads)
    parts = sum(spread**2 / freedom for spread, freedom in spreads)
    return replace(found, freedom=whole**2 / parts if parts > 0 else found.freedom)


def p_value(estimate: Estimate, bound: float = 1.0) -> float | None:
    """Return the smallest level at which the interval of a ratio lies beyond a bound.

    Inverts the expanded percentile interval. Where every resample lies on one side, the tail of
    the normal distribution with their mean and spread (of the logarithms) stands in.

    Parameters
    ----------
    estimate : Estimate
        A ratio.
    bound : float
        At least 1; a ratio r must get past bound, or below 1 / bound.

    Returns
    -------
    float or None
        Two-sided; None without draws.
    """
    if estimate.draws is None:
        return None
    if estimate.units < FEW:
        spread = standard_error(np.log(estimate.draws), estimate.units)
        apart = abs(math.log(estimate.value)) - math.log(bound)
        if apart <= 0:
            return 1.0
        return 2 * (1 - student.below(apart / spread, estimate.freedom)) if spread > 0 else 0.0
    sign = 1.0 if estimate.value >= 1 else -1.0
    beyond = sign * np.log(estimate.draws) - math.log(bound)
    if sign * math.log(estimate.value) <= math.log(bound):
        return 1.0
    tail = (np.count_nonzero(beyond < 0) + np.count_nonzero(beyond == 0) / 2) / len(beyond)
    if tail >= 20 / len(beyond):
        z = -_NORMAL.inv_cdf(min(tail, 0.5))
    else:
        spread = float(np.std(beyond))
        z = float(np.mean(beyond)) / spread if spread > 0 else math.inf
    if math.isinf(z):
        return 0.0
    t = z / math.sqrt(estimate.units / (estimate.units - 1))
    return min(1.0, 2 * (1 - student.below(t, estimate.freedom)))


def joined(value: float, draws: np.ndarray | None, parts: Iterable[Estimate]) -> Estimate:
    """Return an estimate made of others, as sure as the least sure of them."""
    if draws is None:
        return Estimate(value)
    parts = list(parts)
    return Estimate(
        value, draws, min(item.units for item in parts), min(item.freedom for item in parts)
    )


def _common(parts: Sequence[Times]) -> list[Times]:
    # Rounds are matched by (process, round), in this order.
    places = [
        {key: place for place, key in enumerate(zip(*keys, strict=True))}
        for keys in ((part.process.tolist(), part.round.tolist()) for part in parts)
    ]
    keys = sorted(set(places[0]).intersection(*places[1:]))
    process = np.array([key[0] for key in keys], np.int64)
    number = np.array([key[1] for key in keys], np.int64)
    return [
        Times(part.ns[[where[key] for key in keys]] if keys else part.ns[:0], process, number)
        for part, where in zip(parts, places, strict=True)
    ]


def _resample(times: Times, seed: int, resamples: int) -> Estimate:
    order = np.lexsort((times.round, times.process))
    values = np.asarray(times.ns, float)[order]
    _, counts = np.unique(times.process, return_counts=True)
    value = float(np.median(values))
    if len(counts) < 2:
        return Estimate(value)  # one process says nothing of how processes differ
    drawn, lengths = _draw(tuple(counts.tolist()), seed, resamples)
    return Estimate(value, _medians(values, drawn, lengths), len(counts), len(counts) - 1.0)


@lru_cache(maxsize=16)
def _draw(
    counts: tuple[int, ...], seed: int, resamples: int
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the places drawn, (resamples, k), -1 behind the end, and how many each row has."""
    generator = np.random.default_rng([seed, 2007])
    size = np.array(counts)
    start = np.cumsum(size) - size
    widest = int(size.max())
    chosen = generator.integers(0, len(size), (resamples, len(size)))
    if len(size) == 1:
        chosen[:] = 0
    length = size[chosen][:, :, None]
    inside = (generator.random((resamples, len(size), widest)) * length).astype(np.int64)
    drawn = start[chosen][:, :, None] + inside
    if widest == size.min():
        return drawn.reshape(resamples, -1), None
    drawn[np.arange(widest) >= length] = -1
    return drawn.reshape(resamples, -1), length[:, :, 0].sum(axis=1)


def _medians(values: np.ndarray, drawn: np.ndarray, lengths: np.ndarray | None) -> np.ndarray:
    if lengths is None:
        return np.median(values[drawn], axis=1)
    picked = np.sort(np.where(drawn < 0, np.inf, values[drawn]), axis=1)
    row = np.arange(len(drawn))
    return (picked[row, (lengths - 1) // 2] + picked[row, lengths // 2]) / 2
