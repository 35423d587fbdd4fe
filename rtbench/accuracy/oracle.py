"""Exact answers for batches of rays (t > 0) and triangles.

Two formulations, ``side_signs`` and ``elimination``, decide each case and must agree. For millions
of pairs a float64 filter with a proven bound settles what is clear, and one formulation the rest.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rtbench.accuracy import elimination, side_signs
from rtbench.accuracy.bounds import UNDECIDED
from rtbench.accuracy.cases import EXPECT, INVALID
from rtbench.accuracy.certified import _pairs
from rtbench.accuracy.conditions import sensitivity
from rtbench.accuracy.rationals import Ratio, nearest_float, same
from rtbench.accuracy.ray_filter import filtered_rays
from rtbench.accuracy.side_signs import Decision
from rtbench.accuracy.ties import sos_hit

Progress = Callable[[float], None]
REPORT_EVERY = 256  # cases between two reports of progress
CHUNK = 1 << 20  # pairs that the filter takes at a time


class Disagreement(AssertionError):
    """The two formulations contradict each other: a defect of the oracle itself."""


class Answers(NamedTuple):
    """What exact arithmetic says of N rays and triangles; every field is (N,).

    Attributes
    ----------
    cls, expect, sos_hit : int8 array
        As in `cases.Cases`.
    t, u, v : float64 array
        Rounded once; also for lines that miss, NaN where the line has no point of the plane.
    eta, cond_t, cond_u, cond_v : float64 array
        As in ``conditions``, rounded once; NaN for invalid cases and where undefined.
    """

    cls: np.ndarray
    expect: np.ndarray
    sos_hit: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    eta: np.ndarray
    cond_t: np.ndarray
    cond_u: np.ndarray
    cond_v: np.ndarray


def decide(*case: Sequence) -> Decision:
    """Return what both formulations say of one ray and one triangle.

    Parameters
    ----------
    *case : v0, v1, v2, orig, dir
        Three numbers each: floats, integers or Fractions.

    Returns
    -------
    Decision

    Raises
    ------
    Disagreement
        If they contradict each other.
    """
    first, second = side_signs.decide(*case), elimination.decide(*case)
    alike = first.cls == second.cls and all(
        (a is None) == (b is None) and (a is None or same(a, b))
        for a, b in zip(first[1:], second[1:], strict=True)
    )
    if not alike:
        raise Disagreement(f"{first} by side signs, {second} by elimination, of {case}")
    return first


def answers(
    v0: np.ndarray,
    v1: np.ndarray,
    v2: np.ndarray,
    org: np.ndarray,
    dir: np.ndarray,
    progress: Progress | None = None,
) -> Answers:
    """Return the exact answers to a batch of cases; about 0.1 ms a case.

    Parameters
    ----------
    v0, v1, v2 : (N, 3) array
        Vertices, real, at most float64, any values.
    org, dir : (N, 3) array
        Rays, one a triangle; directions as given, t in units of them.
    progress : callable, optional
        Called now and then with the fraction that is done, 0 to 1.

    Returns
    -------
    Answers

    Raises
    ------
    ValueError
        For wrong shapes or dtypes.
    Disagreement
        If the two formulations contradict each other.
    """
    vectors = [np.asarray(a) for a in (v0, v1, v2, org, dir)]
    if len({a.shape for a in vectors}) != 1:
        shapes = ", ".join(str(a.shape) for a in vectors)
        raise ValueError(f"v0, v1, v2, org and dir must have one shape, not {shapes}")
    arrays, _ = _pairs(np.stack(vectors[:3], axis=1), *vectors[3:])
    n = len(arrays[0])
    cls, sos = np.empty(n, np.int8), np.empty(n, np.int8)
    numbers = np.full((7, n), np.nan)
    for i, case in enumerate(_cases(arrays, range(n))):
        decision = decide(*case)
        cls[i], sos[i] = decision.cls, sos_hit(*case)
        if decision.cls != INVALID:
            ratios = (*decision[1:], *sensitivity(*case))
            numbers[:, i] = [_rounded(ratio) for ratio in ratios]
        if progress is not None and (i + 1) % REPORT_EVERY == 0:
            progress((i + 1) / n)
    if progress is not None:
        progress(1.0)
    return Answers(cls, EXPECT[cls], sos, *numbers)


def _rounded(ratio: Ratio | None) -> float:
    return np.nan if ratio is None else nearest_float(*ratio)


def _cases(arrays: Sequence[np.ndarray], rows: Sequence[int]):
    """Yield v0, v1, v2, orig and dir as Python floats, of the rows."""
    triangles, origins, directions = arrays
    for i in rows:
        yield (*triangles[i].tolist(), origins[i].tolist(), directions[i].tolist())


def _settled(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    settle: Callable[..., int],
    progress: Progress | None,
) -> np.ndarray:
    """Return the filter's 1 and 0 where they are proven, and settle(*case) of the others."""
    arrays, _ = _pairs(triangles, origins, directions)
    n = len(arrays[0])
    out = np.empty(n, np.int8)
    for start in range(0, n, CHUNK):
        part = slice(start, min(start + CHUNK, n))
        chunk = [a[part] for a in arrays]
        found = filtered_rays(*chunk)
        open_ = np.flatnonzero(found == UNDECIDED)
        for k, (i, case) in enumerate(zip(open_, _cases(chunk, open_), strict=True)):
            found[i] = settle(*case)
            if progress is not None and (k + 1) % REPORT_EVERY == 0:
                progress((start + (part.stop - start) * (k + 1) / len(open_)) / n)
        out[part] = found
        if progress is not None:
            progress(part.stop / n)
    return out


def expectations(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    progress: Progress | None = None,
) -> np.ndarray:
    """Return what a kernel owes for each of millions of pairs.

    Parameters
    ----------
    triangles : (N, 3, 3) array
        Vertices, real, at most float64, any values.
    origins, directions : (N, 3) array
        Rays, t > 0, one a triangle.
    progress : callable, optional
        Called now and then with the fraction that is done, 0 to 1.

    Returns
    -------
    (N,) int8 array
        `cases.EXPECT` of the exact class: 1 a hit, 0 a miss, 2 either.

    Raises
    ------
    ValueError
        For wrong shapes or dtypes.
    """

    def settle(*case: Sequence[float]) -> int:
        return EXPECT[side_signs.decide(*case).cls]

    return _settled(triangles, origins, directions, settle, progress)


def owned(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    progress: Progress | None = None,
) -> np.ndarray:
    """Return the answer with ties broken for each of millions of pairs.

    Parameters
    ----------
    triangles, origins, directions, progress
        As for `expectations`.

    Returns
    -------
    (N,) int8 array
        `ties.sos_hit`: 1, 0, or -1 where a number is not finite or the direction is zero.

    Raises
    ------
    ValueError
        For wrong shapes or dtypes.
    """
    return _settled(triangles, origins, directions, sos_hit, progress)
