"""What a kernel got wrong of a set of hard cases: decisions, groups, and t, u, v.

A decision is wrong where the case must be hit and is missed, or must be missed and is hit; ties
(an edge, a vertex, an origin on the triangle) never count for a single triangle. It is unstable
where its eta is above UNSTABLE roundoffs: then no perturbation of the input by a few roundings
explains it. C* is the greatest eta of a wrong decision, in roundoffs.

An error of t, u or v counts in roundoff (c + |x|), c the condition of the case, see `errors`, over
hits that the case allows and whose roundoff c is below 1 %: of 1 for u and v, of |t| for t, so that
it does not depend on units. Elsewhere the first order says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rtbench.accuracy.cases import EITHER, MUST_HIT, MUST_MISS, Cases
from rtbench.compiled.layout import REAL_TYPE

UNSTABLE = 16.0  # roundoffs
FIRST_ORDER = 0.01  # of roundoff c: beyond it the condition is no bound
KNEE = 0.01  # of the decided cases wrong
QUANTITIES = ("t", "u", "v")

RANGE_FAMILIES = ("subnormal", "overflow")
INVALID_FAMILIES = ("inf_nan", "zero_dir")
OUTSIDE_CORE = (*RANGE_FAMILIES, *INVALID_FAMILIES, "field_range")

TWO_SIDED = ("dir_scale",)  # families of which both ends are hard

ONCE, ODD, SAME = 1, 2, 3  # the rules of groups, see `cases.Cases`


class Answered(NamedTuple):
    """What somebody says of N rays and triangles, for the ray 0 < t < infinity.

    Attributes
    ----------
    hit : (N,) bool array
    t, u, v : (N,) float64 arrays or None
        None where it is never computed.
    strange : (N,) bool array
        Said to be a hit, and t, u or v is no finite number.
    """

    hit: np.ndarray
    t: np.ndarray | None
    u: np.ndarray | None
    v: np.ndarray | None
    strange: np.ndarray

    def part(self, rows: slice | np.ndarray) -> Answered:
        """Return the answers to some of the cases."""
        return Answered(*(None if each is None else each[rows] for each in self))


def clipped(
    said: np.ndarray,
    t: np.ndarray | None = None,
    u: np.ndarray | None = None,
    v: np.ndarray | None = None,
) -> Answered:
    """Return the answers for a line as answers for the ray: nobody is failed for t < 0.

    Parameters
    ----------
    said : (N,) bool array
        What the test itself calls a hit.
    t, u, v : (N,) float arrays, optional
        What it computed.

    Returns
    -------
    Answered
        A hit whose t is NaN or infinite is none, and is strange.
    """
    said = np.asarray(said, dtype=bool)
    values = [None if x is None else np.asarray(x, dtype=np.float64) for x in (t, u, v)]
    hit, strange = said.copy(), np.zeros(len(said), dtype=bool)
    if values[0] is not None:
        said = said & ~(values[0] <= 0)
        hit &= (values[0] > 0) & np.isfinite(values[0])
    for x in values:
        if x is not None:
            strange |= said & ~np.isfinite(x)
    return Answered(hit, *values, strange)


def seen_in(cases: Cases, precision: str) -> Cases:
    """Return the cases that a precision's data can hold; a group of which some are lost is none."""
    if precision == "float64":
        return cases
    lost = np.unique(cases.group[~cases.f32_ok])
    kept = cases.take(cases.f32_ok)
    kept.group[np.isin(kept.group, lost)] = -1
    return kept


def roundoff(precision: str) -> float:
    """Return the unit roundoff of a precision's arithmetic: 2^-24, or 2^-53 (mixed too)."""
    return float(np.finfo(REAL_TYPE[precision]).eps) / 2


class Groups(NamedTuple):
    """What happened to G groups of cases; arrays (G,).

    Attributes
    ----------
    first : int array
        A case of the group.
    rule : int array
        ONCE, ODD or SAME.
    leak, double : bool arrays
        Hit less, or more often than exactly once (an odd group: than the exact answer with ties
        broken says; once where that is unknown).
    differs : bool array
        A group that must be answered alike and is not.
    """

    first: np.ndarray
    rule: np.ndarray
    leak: np.ndarray
    double: np.ndarray
    differs: np.ndarray


@dataclass(frozen=True, eq=False)
class Scored:
    """Answers beside the exact ones.

    Attributes
    ----------
    cases : Cases
        Those that the precision can hold, see `seen_in`.
    answered : Answered
        As many answers.
    precision : str
        float32, float64 or mixed.
    """

    cases: Cases
    answered: Answered
    precision: str

    def __post_init__(self) -> None:
        if len(self.cases) != len(self.answered.hit):
            raise ValueError(f"{len(self.answered.hit)} answers to {len(self.cases)} cases")

    @cached_property
    def roundoff(self) -> float:
        return roundoff(self.precision)

    @cached_property
    def accepted(self) -> np.ndarray:
        """Where it claims a hit, one with no finite t too: (N,) bool."""
        return self.answered.hit | self.answered.strange

    @cached_property
    def wrong(self) -> np.ndarray:
        """Where the decision is wrong: (N,) bool; an invalid input may not even seem accepted."""
        hit = np.where(self.of(INVALID_FAMILIES), self.accepted, self.answered.hit)
        must = self.cases.expect
        return ((must == MUST_HIT) & ~hit) | ((must == MUST_MISS) & hit)

    @cached_property
    def unstable(self) -> np.ndarray:
        """Where it is wrong by more than UNSTABLE roundoffs: (N,) bool."""
        return self.wrong & (self.cases.eta > UNSTABLE * self.roundoff)

    @cached_property
    def core(self) -> np.ndarray:
        """Which cases are of the core families: (N,) bool."""
        return ~self.of(OUTSIDE_CORE)

    def of(self, names: tuple[str, ...]) -> np.ndarray:
        """Return which cases are of some families: (N,) bool."""
        numbers = [i for i, name in enumerate(self.cases.family_names) if name in names]
        return np.isin(self.cases.family, numbers)

    @cached_property
    def first_order(self) -> np.ndarray:
        """Where a hit is allowed and the conditions bound its errors: (N,) bool."""
        cases = self.cases
        allowed = (cases.expect != MUST_MISS) & (cases.t > 0)
        for name, unit in (("t", cases.t), ("u", 1.0), ("v", 1.0)):
            allowed &= self.roundoff * getattr(cases, f"cond_{name}") < FIRST_ORDER * unit
        return allowed

    @cached_property
    def errors(self) -> dict[str, np.ndarray]:
        """Errors of t, u, v by measure: ``over_t``, ``relative_t``, ``ulps_t`` ...: (N,) float64.

        ``over``: in roundoffs of condition and value; ``ulps``: in steps of the precision at the
        exact value. NaN where the error does not count.
        """
        found = {}
        cases, real = self.cases, REAL_TYPE[self.precision]
        may = self.answered.hit & self.first_order
        for name in QUANTITIES:
            x, exact = getattr(self.answered, name), getattr(cases, name)
            condition = getattr(cases, f"cond_{name}")
            error = np.full(len(cases), np.nan)
            if x is not None:
                counts = may & np.isfinite(x)
                error[counts] = np.abs(x[counts] - exact[counts])
            with np.errstate(all="ignore"):
                size = np.abs(exact)
                over = error / (self.roundoff * (condition + size))
                found[f"over_{name}"] = np.where(error == 0, 0.0, over)
                found[f"relative_{name}"] = np.where(size > 0, error / size, np.nan)
                step = np.spacing(size.astype(real)).astype(np.float64)
                found[f"ulps_{name}"] = error / step
        return found

    @cached_property
    def groups(self) -> Groups:
        """What happened to the groups of cases."""
        cases, hit = self.cases, self.answered.hit
        rows = np.flatnonzero(cases.group >= 0)
        _, first, place = np.unique(cases.group[rows], return_index=True, return_inverse=True)
        count = len(first)
        first = rows[first]
        rule = cases.group_rule[cases.family[first]].astype(np.int64)
        size = np.bincount(place, minlength=count)
        hits = np.bincount(place, hit[rows], count)
        known = np.bincount(place, cases.sos_hit[rows] >= 0, count) == size
        owned = np.bincount(place, cases.sos_hit[rows] == 1, count)
        needed = np.where((rule == ODD) & known, np.maximum(owned, 1), 1)
        counted = (rule == ONCE) | (rule == ODD)
        return Groups(
            first,
            rule,
            counted & (hits < needed),
            counted & (hits > needed),
            (rule == SAME) & (hits > 0) & (hits < size),
        )


def tally(scored: Scored, which: np.ndarray | None = None) -> dict[str, object]:
    """Return counts and errors over some of the cases.

    Parameters
    ----------
    scored : Scored
    which : (N,) bool array, optional
        Which cases; the core families if not given.

    Returns
    -------
    dict
        ``cases``, ``decided`` (no tie), ``wrong``, ``unstable``, ``leaks`` of ``groups``,
        ``doubles``, ``permutation`` (groups answered differently), ``strange`` and ``accepted``:
        counts; ``c_star``, and ``p50_t``, ``p99_t``, ``max_t`` (over condition), ``relative_t``,
        ``ulps_t`` (99th percentiles) and those of u and v: numbers, None where there is none.
    """
    which = scored.core if which is None else which
    wrong = scored.wrong & which
    groups, inside = scored.groups, which[scored.groups.first]
    counted = inside & ((groups.rule == ONCE) | (groups.rule == ODD))
    etas = scored.cases.eta[wrong]
    found = {
        "cases": which,
        "decided": which & (scored.cases.expect != EITHER),
        "wrong": wrong,
        "unstable": scored.unstable & which,
        "leaks": groups.leak & inside,
        "groups": counted,
        "doubles": groups.double & inside,
        "permutation": groups.differs & inside,
        "strange": scored.answered.strange & which,
        "accepted": scored.accepted & which & scored.of(INVALID_FAMILIES),
    }
    found = {name: int(np.count_nonzero(mask)) for name, mask in found.items()}
    found["c_star"] = _greatest(etas / scored.roundoff)
    for name in QUANTITIES:
        over = _counted(scored.errors[f"over_{name}"][which])
        found[f"p50_{name}"] = _quantile(over, 0.5)
        found[f"p99_{name}"] = _quantile(over, 0.99)
        found[f"max_{name}"] = _greatest(over)
        for measure in ("relative", "ulps"):
            values = _counted(scored.errors[f"{measure}_{name}"][which])
            found[f"{measure}_{name}"] = _quantile(values, 0.99)
    return found


def by_family(scored: Scored) -> list[dict[str, object]]:
    """Return the tally of each family that has cases, with its ``family`` and its ``knee``."""
    found = []
    for number, name in enumerate(scored.cases.family_names):
        which = scored.cases.family == number
        if which.any():
            knee = first_knee(curve(scored, which), both_ends=name in TWO_SIDED)
            found.append({"family": name, **tally(scored, which), "knee": knee})
    return found


def curve(scored: Scored, which: np.ndarray, most: int = 24) -> list[dict[str, object]]:
    """Return how often cases are wrong, and the errors of their t, over their difficulty.

    Parameters
    ----------
    scored : Scored
    which : (N,) bool array
        The cases of one family.
    most : int
        Of more difficulties than these, those of one whole number are taken together.

    Returns
    -------
    list of dict
        By rising difficulty: ``difficulty``, ``decided``, ``wrong``, ``wrong_share`` (None where
        all are ties), ``p99_t``, ``p99_u``, ``p99_v`` (over condition, None without a hit).
    """
    rows = np.flatnonzero(which & np.isfinite(scored.cases.difficulty))
    level = scored.cases.difficulty[rows]
    if len(np.unique(level)) > most:
        level = np.rint(level)
    found = []
    for value in np.unique(level):
        there = rows[level == value]
        decided = int(np.count_nonzero(scored.cases.expect[there] != EITHER))
        wrong = int(np.count_nonzero(scored.wrong[there]))
        point = {"difficulty": float(value), "decided": decided, "wrong": wrong}
        point["wrong_share"] = wrong / decided if decided else None
        for name in QUANTITIES:
            over = _counted(scored.errors[f"over_{name}"][there])
            point[f"p99_{name}"] = _quantile(over, 0.99)
        found.append(point)
    return found


def first_knee(points: list[dict[str, object]], both_ends: bool = False) -> float | None:
    """Return the first difficulty of a curve with more than KNEE of the decided cases wrong.

    Where both ends of the curve are hard, the one nearest to zero.
    """
    over = [p["difficulty"] for p in points if (p["wrong_share"] or 0) > KNEE]
    return min(over, key=abs if both_ends else None, default=None)


def _counted(values: np.ndarray) -> np.ndarray:
    return values[~np.isnan(values)]


def _quantile(values: np.ndarray, part: float) -> float | None:
    if not len(values):
        return None
    with np.errstate(invalid="ignore"):
        found = float(np.quantile(values, part))
    return found if found == found else float("inf")  # between two infinities


def _greatest(values: np.ndarray) -> float | None:
    values = _counted(values)
    return float(values.max()) if len(values) else None
