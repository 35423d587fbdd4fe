"""What fits, beside the best of it: ratios inside a run, and between runs of one machine."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rtbench.records.environments import doubts
from rtbench.records.resampling import joined
from rtbench.records.statistics import (
    NO_INTERVAL,
    SLOWER,
    UNRESOLVED,
    Estimate,
    Times,
    geometric_mean,
    holm,
    median,
    p_value,
    paired_ratio,
    ratio,
    seed_of,
)
from rtbench.report.candidates import Candidate

if TYPE_CHECKING:
    from rtbench.records.run import Run

BEST = "best"
# Without code that two runs share, nothing tells how their clocks compared: 8 % was seen.
BETWEEN_RUNS = 0.1
# Preparing is timed beside the measurement, without an interval: 14 % between runs was seen.
PREPARATION = 0.2
FEWEST_SHARED = 2


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate that fits, beside the best.

    Attributes
    ----------
    candidate : Candidate
    bare, whole : Estimate
        ns a test: alone, and with its share of the preparation.
    ratio : Estimate
        How many times as long as the best it takes; 1 for the best.
    verdict : str
        best, no difference resolved, slower, or no interval.
    """

    candidate: Candidate
    bare: Estimate
    whole: Estimate
    ratio: Estimate
    verdict: str

    @property
    def level(self) -> bool:
        """Whether it is the best, or not told from it."""
        return self.verdict != SLOWER

    @property
    def unsure(self) -> float:
        """Width of the interval of its time over the time; 0 where there is none."""
        low, high = self.whole.interval() or (0.0, 0.0)
        return (high - low) / self.whole.value


class Clocks:
    """How much slower a machine ran what is the same code, from run to run.

    Parameters
    ----------
    measured : sequence of Candidate
        All that the runs measured, the same kernel in several of them too.
    """

    def __init__(self, measured: Sequence[Candidate]) -> None:
        self._all = list(dict.fromkeys(one.run for one in measured))
        self._runs: dict[int, dict[tuple, Candidate]] = {}
        for one in measured:
            self._runs.setdefault(id(one.run), {})[one.identity] = one
        self._known: dict[tuple[int, int], Estimate | None] = {}

    def shift(self, later: "Run", first: "Run") -> Estimate | None:
        """Return the geometric mean of the ratios of shared code, None if too little is shared.

        Where two runs share none, a third that shares some with both stands between them.
        """
        direct = self._direct(later, first)
        if direct is not None:
            return direct
        for run in self._all:
            parts = [self._direct(later, run), self._direct(run, first)]
            if run not in (later, first) and None not in parts:
                one, other = parts
                return joined(one.value * other.value, one.draws * other.draws, parts)
        return None

    def _direct(self, later: "Run", first: "Run") -> Estimate | None:
        key = id(later), id(first)
        if key not in self._known:
            self._known[key] = self._found(*key, later, first)
        return self._known[key]

    def _found(self, later_id: int, first_id: int, later: "Run", first: "Run"):
        if doubts([first, later], ["triangles"]):  # other workloads or layout: no code tells
            return None
        ours, theirs = self._runs.get(first_id, {}), self._runs.get(later_id, {})
        ratios = []
        for identity in ours.keys() & theirs.keys():
            pair = theirs[identity], ours[identity]
            codes = {one.facts.get("machine_code_digest") for one in pair}
            if len(codes) == 1 and None not in codes and pair[0].points == pair[1].points:
                found = ratio(*(_estimate(one, one.times) for one in pair))
                ratios += [found] if found.draws is not None else []
        return geometric_mean(ratios).estimate if len(ratios) >= FEWEST_SHARED else None


def rank(
    fits: Sequence[Candidate], clocks: Clocks, rays: float | None
) -> tuple[list[Ranked], bool]:
    """Put what fits beside the best of it.

    Parameters
    ----------
    fits : sequence of Candidate
    clocks : Clocks
        Of the runs that they are from.
    rays : float or None
        How many tests share a preparation; None: it is free.

    Returns
    -------
    ranked : list of Ranked
        Best first; slower where the ratio to the best is resolved from 1 (Holm over all).
    apart : bool
        Whether some are of a run whose clock cannot be compared with that of the best one's.
    """
    if not fits:
        return [], False
    best = _best(fits, clocks, rays)
    compared = [_beside(one, best, clocks, rays) for one in fits if one is not best]
    sure = iter(holm([p for _, p, _ in compared]))
    apart = any(alone for _, _, alone in compared)
    results = iter(compared)
    ranked = []
    for one in fits:
        bare = _estimate(one, one.times)
        whole = _estimate(one, _with_preparation(one, rays))
        if one is best:
            ranked.append(Ranked(one, bare, whole, Estimate(1.0), BEST))
            continue
        found, p, _ = next(results)
        slower = next(sure) and found.value > 1
        word = NO_INTERVAL if p is None else SLOWER if slower else UNRESOLVED
        ranked.append(Ranked(one, bare, whole, found, word))
    ranked.sort(key=lambda one: (one.verdict != BEST, not one.level, one.ratio.value))
    return ranked, apart


def _best(fits: Sequence[Candidate], clocks: Clocks, rays: float | None) -> Candidate:
    """Return the fastest of the run whose fastest is surely fast: its interval ends first.

    The least time of all may be of a disturbed run; beside it nothing could be told.
    """
    whole = {one: _estimate(one, _with_preparation(one, rays)) for one in fits}
    fastest: dict[int, Candidate] = {}
    for one in sorted(fits, key=lambda one: whole[one].value):
        fastest.setdefault(id(one.run), one)
    guess = next(iter(fastest.values()))

    def end(one: Candidate) -> tuple[bool, float]:
        found = whole[one]
        shift = None if one.run is guess.run else clocks.shift(one.run, guess.run)
        found = ratio(found, shift, paired=True) if shift else found
        apart = 1 if shift or one.run is guess.run else 1 + BETWEEN_RUNS
        interval = found.interval()
        return interval is None, apart * (interval[1] if interval else found.value)

    return min(fastest.values(), key=end)


def _beside(
    one: Candidate, best: Candidate, clocks: Clocks, rays: float | None
) -> tuple[Estimate, float | None, bool]:
    """Return one over the best, how sure it is to be slower, and whether no clock is shared.

    The ratio is that of the medians; what is judged gives its preparation the benefit of doubt.
    """

    def over(own: float, other: float) -> Estimate | None:
        mine, its = _with_preparation(one, rays, own), _with_preparation(best, rays, other)
        if one.run is best.run:
            return paired_ratio(mine, its, seed_of(one.run.name))
        return ratio(_estimate(one, mine), _estimate(best, its))

    shift, alone = None, False
    if one.run is not best.run:
        shift = clocks.shift(one.run, best.run)
        alone = shift is None
    found, judged = over(1.0, 1.0), over(1 - PREPARATION, 1 + PREPARATION)
    if found is None:  # no round has both
        return Estimate(float(np.median(one.times.ns) / np.median(best.times.ns))), None, alone
    if shift is not None:
        found, judged = (ratio(each, shift, paired=True) for each in (found, judged))
    if judged.value <= 1 and judged.draws is not None:
        return found, 1.0, alone
    return found, p_value(judged, 1 + BETWEEN_RUNS if alone else 1.0), alone


def _estimate(one: Candidate, times: Times) -> Estimate:
    return median(times, seed_of(one.run.name))


def _with_preparation(one: Candidate, rays: float | None, factor: float = 1.0) -> Times:
    share = 0.0 if rays is None else factor * (one.preparation or 0.0) / rays
    return replace(one.times, ns=one.times.ns + share)
