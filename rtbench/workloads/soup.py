"""Random rays, each tested against all of some random triangles: the workload of Havel's chapter 5.

How they are drawn is in ``scattered``, how they are decided in ``nearest``, and how far a kernel's
own rounding may lead it astray in ``rounding``.
"""

import hashlib
import numbers
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.workloads import rounding
from rtbench.workloads.nearest import nearest
from rtbench.workloads.scattered import draw_rays, draw_triangles, spread_at, stream

SETS = {"sparse": 0.1, "dense": 0.5}
"""The two fixed sets and their hit ratios, over all triangles and rays that could be drawn."""


@dataclass(frozen=True, eq=False)
class Soup:
    """T triangles and R rays, each ray to be tested against all triangles.

    Attributes
    ----------
    v0, v1, v2 : (T, 3) float32 arrays
        Vertices.
    orig, dir : (R, 3) float32 arrays
        Rays, directions of length 1.
    nearest : (R,) int64 array
        The triangle of the smallest t > 0, of equal ones the first; -1 for none; exact.
    t, u, v : (R,) float64 arrays
        Where the nearest is hit, by `certified.reference`; NaN for none.
    pairs_hit : int
        How many of the R T pairs the ray, t > 0, hits; exact.
    distance_share : float
        Share of the R T tests that end at a distance test 0 < t < tmax that comes first, the
        triangles taken in the order of their indices and tmax being the t of the nearest hit so
        far (infinity before one); counted exactly.
    name, spread, seed
        What they were drawn by.
    """

    v0: np.ndarray
    v1: np.ndarray
    v2: np.ndarray
    orig: np.ndarray
    dir: np.ndarray
    nearest: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    pairs_hit: int
    distance_share: float
    name: str
    spread: float
    seed: int

    @property
    def triangles(self) -> np.ndarray:
        """The vertices as one (T, 3, 3) float32 array; a copy."""
        return np.stack([self.v0, self.v1, self.v2], axis=1)

    @property
    def hit_ratio(self) -> float:
        """Share of the R T pairs that hit."""
        return self.pairs_hit / (len(self.orig) * len(self.v0))

    @cached_property
    def digest(self) -> str:
        """SHA-256 (hex) of the bytes of v0, v1, v2, orig, dir, nearest.

        Each array whole, in this order, in C order and little-endian.
        """
        sha = hashlib.sha256()
        for name in ("v0", "v1", "v2", "orig", "dir", "nearest"):
            array = getattr(self, name)
            sha.update(np.ascontiguousarray(array, array.dtype.newbyteorder("<")))
        return sha.hexdigest()

    def unsafe(
        self, ray: np.ndarray, triangle: np.ndarray, precision: str = "float32"
    ) -> np.ndarray:
        """Tell of which pairs a kernel's own rounding may well decide otherwise.

        A kernel whose nearest triangle is not the exact one is wrong only if neither of the two
        is unsafe.

        Parameters
        ----------
        ray, triangle : int arrays of one shape
            Indices of pairs; triangle -1 (none) is never unsafe.
        precision : str
            The kernel's arithmetic: float32, float64 or mixed.

        Returns
        -------
        bool array of that shape
            True where one of u, v, w or t lies within its rounding band of 0 and none clearly
            misses, or the triangle may be hit and its t lies within the bands of that of the
            ray's nearest triangle, which is another.
        """
        if precision not in rounding.ROUNDOFF:
            raise RtbenchError(unknown("precision", str(precision), list(rounding.ROUNDOFF)))
        ray, triangle = np.broadcast_arrays(np.asarray(ray), np.asarray(triangle))
        unsafe = np.zeros(ray.shape, bool)
        asked = triangle >= 0
        ray, triangle = ray[asked], triangle[asked]
        found, band, weight_band = self._bands(ray, triangle, precision)
        near, misses = rounding.doubtful(found, band, weight_band)
        first = self.nearest[ray]
        rivals = np.flatnonzero((first >= 0) & (first != triangle) & ~misses)
        best, best_band, _ = self._bands(ray[rivals], first[rivals], precision)
        near[rivals] |= np.abs(found.t[rivals] - best.t) <= band[rivals] + best_band
        unsafe[asked] = near
        return unsafe

    def _bands(self, ray: np.ndarray, triangle: np.ndarray, precision: str) -> tuple:
        corners = np.stack([v[triangle] for v in (self.v0, self.v1, self.v2)], axis=1)
        return rounding.bands(corners, self.orig[ray], self.dir[ray], precision)


def soup(
    name: str | float,
    triangles: int = 512,
    rays: int = 1024,
    seed: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Soup:
    """Return random rays and triangles of a hit ratio, decided exactly.

    Parameters
    ----------
    name : str or float
        One of SETS, or the hit ratio itself. It is that of all triangles and rays that could be
        drawn; the soup's own, `Soup.hit_ratio`, varies about it by chance.
    triangles, rays : int
        How many, at least 1. More of them begin with the same ones.
    seed : int
        Not negative.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Soup

    Raises
    ------
    RtbenchError
        If an argument is not allowed.

    Source
    ------
    Havel 2008, chapter 5, after Kensler and Shirley 2006. Neither says how the triangles and rays
    were drawn; this construction is ours.
    """
    for what, n in (("triangles", triangles), ("rays", rays)):
        if n < 1:
            raise RtbenchError(f"number of {what} {n} is not allowed (allowed: 1 or more)")
    if not isinstance(seed, numbers.Integral) or seed < 0:
        raise RtbenchError(f"seed {seed!r} is not allowed (allowed: 0 or greater)")
    if isinstance(name, str):
        if name not in SETS:
            raise RtbenchError(unknown("soup", name, list(SETS)))
        ratio = SETS[name]
    else:
        ratio, name = float(name), f"soup-{name:g}"
    spread = spread_at(ratio)
    corners = draw_triangles(stream(seed, 2), triangles, spread)
    targets, directions, distances = draw_rays(stream(seed, 3), rays, spread)
    origins = targets - distances[:, None] * directions
    return decided(corners, origins, directions, name, spread, int(seed), progress)


def decided(
    corners: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    name: str,
    spread: float,
    seed: int,
    progress: Callable[[float], None] | None = None,
) -> Soup:
    """Decide given triangles and rays.

    Parameters
    ----------
    corners : (T, 3, 3) float32 array
        Vertices.
    origins, directions : (R, 3) float32 arrays
        Rays.
    name, spread, seed
        What they were drawn by; only kept.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Soup
    """
    found = nearest(corners, origins, directions, progress)
    v0, v1, v2 = (np.ascontiguousarray(corners[:, k]) for k in range(3))
    share = 1 - found.within / (len(corners) * len(origins))
    values = found.triangle, found.t, found.u, found.v, found.hits, share
    return Soup(v0, v1, v2, origins, directions, *values, name, spread, seed)
