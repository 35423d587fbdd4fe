"""Rays against all triangles: the exact nearest hit of each, and what the distance test would see.

Every comparison is decided in float64 where the bounds of ``accuracy`` prove it, else by rationals.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rtbench.accuracy import certified, exact

PORTION = 1 << 16
"""Pairs handled at once: their arrays fit in a cache, and no result depends on it."""


class Nearest(NamedTuple):
    """What a loop of every ray over all triangles, in the order of their indices, comes to.

    Attributes
    ----------
    triangle : (R,) int64 array
        The triangle of the smallest t > 0, of equal ones the first; -1 for none.
    t, u, v : (R,) float64 arrays
        Where, by `certified.reference`; NaN for none.
    hits : int
        Pairs in which the ray, t > 0, meets the closed triangle.
    within : int
        Pairs with 0 < t < tmax, tmax being the t of the nearest hit so far, infinity before one;
        a ray parallel to the plane has no t and does not count.
    """

    triangle: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    hits: int
    within: int


def nearest(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    progress: Callable[[float], None] | None = None,
) -> Nearest:
    """Test every ray against all triangles, exactly.

    Parameters
    ----------
    triangles : (T, 3, 3) array
        Vertices, float32 or float64; T at least 1.
    origins, directions : (R, 3) arrays
        Rays; directions of any length.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Nearest

    Raises
    ------
    ValueError
        As `certified.filtered`.
    """
    rays = len(origins)
    triangle = np.full(rays, -1, np.int64)
    t, u, v = (np.full(rays, np.nan) for _ in range(3))
    hits = within = 0
    step = max(1, PORTION // len(triangles))
    for start in range(0, rays, step):
        part = slice(start, min(start + step, rays))
        found = _portion(triangles, origins[part], directions[part])
        for out, values in zip((triangle, t, u, v), found[:4], strict=True):
            out[part] = values
        hits += found.hits
        within += found.within
        if progress is not None:
            progress(part.stop / rays)
    return Nearest(triangle, t, u, v, hits, within)


def _portion(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> Nearest:
    """Return what `nearest` does, all pairs at once."""
    shape = len(origins), len(triangles)

    def t_of(i: int, j: int) -> exact.Fraction:
        vectors = (*triangles[j].tolist(), origins[i].tolist(), directions[i].tolist())
        return exact.line_hit(*vectors).t

    pairs = (
        np.broadcast_to(triangles, (shape[0], *triangles.shape)).reshape(-1, 3, 3),
        np.repeat(origins, shape[1], axis=0),
        np.repeat(directions, shape[1], axis=0),
    )
    found = certified.reference(*pairs)
    t, u, v, error = (a.reshape(shape) for a in (*found[:3], found.t_error))
    error = 2 * error  # so that the roundings of t - error and t + error need no thought
    ahead = t > error
    for i, j in np.argwhere(np.abs(t) <= error):
        ahead[i, j] = t_of(i, j) > 0
    meets = certified.line_hits(*pairs).reshape(shape) & ahead

    low, high = np.where(meets, t - error, np.inf), np.where(meets, t + error, np.inf)
    within = ahead & (t + error < _before(low))
    doubtful = ahead & ~within & (t - error < _before(high))
    for i, j in np.argwhere(doubtful):
        rivals = np.flatnonzero(low[i, :j] <= t[i, j] + error[i, j])
        own = t_of(i, j)
        within[i, j] = all(own < t_of(i, k) for k in rivals)

    # A hit within tmax becomes the nearest: the last one of a row stays it.
    taken = meets & within
    last = shape[1] - 1 - np.argmax(taken[:, ::-1], axis=1)
    some = taken.any(axis=1)
    rows = np.arange(shape[0])
    values = (np.where(some, a[rows, last], np.nan) for a in (t, u, v))
    triangle = np.where(some, last, -1)
    return Nearest(triangle, *values, int(meets.sum()), int(within.sum()))


def _before(values: np.ndarray) -> np.ndarray:
    """Return the least of the values before each one of its row; infinity before the first."""
    least = np.full(values.shape, np.inf)
    np.minimum.accumulate(values[:, :-1], axis=1, out=least[:, 1:])
    return least
