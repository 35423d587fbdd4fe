"""How far a computed t, u, v lies from the exact one: relatively, and over the pair's condition.

The condition of a pair is how far its exact t, u, v move at first order, at worst, if each of the
15 numbers it is made of moves by a part eps of itself. From M (t, u, v) = orig - v0 with the
columns M = [-dir, v1 - v0, v2 - v0] follows, absolute values componentwise and w = 1 - u - v,

    |change of (t, u, v)| <= eps |M^-1| (|orig| + |t dir| + |w v0| + |u v1| + |v v2|) = eps c

so that an error of eps (c + |x|) is what rounding the input once and the result once may do to x:
an error is counted in these. A few are a good method's; hundreds are the method's own doing.
"""

from typing import NamedTuple

import numpy as np

from rtbench.accuracy import exact

QUANTITIES = ("t", "u", "v")
RESAMPLES = 2000
LEVEL = 0.95


class Values(NamedTuple):
    """t, u, v of N pairs to twice the digits of float64.

    Attributes
    ----------
    value : (N, 3) float64 array
        Rounded; NaN where the line is parallel to the plane.
    rest : (N, 3) float64 array
        What rounding left, rounded; 0 for a reference that has no more digits.
    """

    value: np.ndarray
    rest: np.ndarray


class Means(NamedTuple):
    """Means of K errors and the ends of their 95 % intervals, (K,); NaN where there is none."""

    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray


def exact_values(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> Values:
    """Return where each line meets the plane of its triangle, by rationals.

    Parameters
    ----------
    triangles : (N, 3, 3) array
        Vertices v0, v1, v2, finite, at most float64.
    origins, directions : (N, 3) arrays
        Lines, one a triangle; directions as given, t in units of them.

    Returns
    -------
    Values
    """
    value, rest = np.full((2, len(triangles), 3), np.nan)
    lines = zip(triangles.tolist(), origins.tolist(), directions.tolist(), strict=True)
    for i, (corners, origin, direction) in enumerate(lines):
        found = exact.line_hit(*corners, origin, direction)
        if found.t is None:
            continue
        for k, x in enumerate(found[1:]):
            value[i, k] = float(x)
            rest[i, k] = float(x - exact.Fraction(value[i, k]))
    return Values(value, rest)


def absolute_errors(computed: np.ndarray, reference: Values) -> np.ndarray:
    """Return |computed - reference|, (N, 3), of computed t, u, v, (N, 3) of any float dtype."""
    # The first difference is exact wherever the two are near: Sterbenz 1974.
    return np.abs((computed.astype(np.float64) - reference.value) - reference.rest)


def conditions(
    triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """Return the condition c of t, u, v of each pair; see the module's text.

    Parameters
    ----------
    triangles, origins, directions
        As for `exact_values`.
    values : (N, 3) array
        t, u, v.

    Returns
    -------
    (N, 3) float64 array
        In the units of t, u and v; computed in float64, to the digits that its use needs.

    Source
    ------
    Componentwise condition of a linear system: Skeel 1979; Higham 2002, section 7.2.
    """
    v0, v1, v2 = (triangles[:, k].astype(np.float64) for k in range(3))
    o, d = origins.astype(np.float64), directions.astype(np.float64)
    t, u, v = (values[:, k, None] for k in range(3))
    matrix = np.stack([-d, v1 - v0, v2 - v0], axis=2)
    sizes = [o, t * d, (1 - u - v) * v0, u * v1, v * v2]
    moved = np.sum([np.abs(size) for size in sizes], axis=0)
    return np.einsum("nij,nj->ni", np.abs(np.linalg.inv(matrix)), moved)


def mean_errors(
    errors: np.ndarray,
    used: np.ndarray,
    units: np.ndarray,
    seed: int = 0,
    resamples: int = RESAMPLES,
) -> Means:
    """Return means over pairs with bootstrap intervals.

    Parameters
    ----------
    errors : (K, N) float array
        K measures of the same N pairs.
    used : (K, N) bool array
        Which pairs a mean is over.
    units : (N,) int array
        What is drawn together: pairs of one triangle share the errors of what is stored of it, so
        that the triangle is the unit of replication. All different: plain resampling of pairs.
    seed : int
        All K are resampled alike, so that their means may be compared.
    resamples : int
        How many.

    Returns
    -------
    Means
        Percentile intervals; none from fewer than two units.
    """
    names, place = np.unique(units, return_inverse=True)
    m = len(names)
    kept = np.where(used, errors, 0.0)
    sums = np.array([np.bincount(place, row, m) for row in kept]).reshape(len(errors), m)
    counts = np.array([np.bincount(place, row, m) for row in used]).reshape(len(errors), m)
    with np.errstate(invalid="ignore"):  # 0 / 0: no pair is used
        mean = sums.sum(axis=1) / counts.sum(axis=1)
        if m < 2:
            return Means(mean, np.full(len(mean), np.nan), np.full(len(mean), np.nan))
        draw = np.random.default_rng(seed).multinomial
        weights = draw(m, np.full(m, 1 / m), resamples).astype(np.float64).T
        drawn = (sums @ weights) / (counts @ weights)
    low, high = np.quantile(drawn, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=1)
    return Means(mean, low, high)


def over_condition(
    errors: np.ndarray, values: np.ndarray, condition: np.ndarray, roundoff: float
) -> np.ndarray:
    """Return absolute errors in units of roundoff (condition + |value|), all arrays (N, 3)."""
    return errors / (roundoff * (condition + np.abs(values)))
