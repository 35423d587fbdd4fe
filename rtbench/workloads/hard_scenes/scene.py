"""A hard scene, and the rays that most of them share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RAYS = 1600


@dataclass(frozen=True, eq=False)
class Scene:
    """Triangles and rays; all numbers are such that float32 can hold them.

    The right answer of a tree is that of brute force with the same kernel, bit for bit: the nearest
    hit with 0 < t < tmax, of equal t the one of the lowest index.

    Attributes
    ----------
    triangles : (M, 3, 3) float64 array
        M may be 0.
    origins, directions : (N, 3) float64 arrays
        No direction is 0.
    tmax : (N,) float64 array
        Infinite, but of every fourth ray.
    why : str
        What is hard here, and who ran into it.
    """

    triangles: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    tmax: np.ndarray
    why: str


def made(
    why: str,
    triangles: np.ndarray,
    rays: list[tuple[np.ndarray, np.ndarray]],
    unit: np.ndarray | float = 1.0,
) -> Scene:
    """Return a scene of parts, rounded to float32.

    Parameters
    ----------
    why : str
    triangles : (M, 3, 3) array
    rays : list of pairs of (N, 3) arrays
        Origins and directions; those whose direction is 0 are left out.
    unit : (N,) array or float
        Every fourth ray ends at this t, at half of it or at twice it, in turn.
    """
    origins, directions = (np.concatenate(part) for part in zip(*rays, strict=True))
    unit = np.broadcast_to(np.asarray(unit, dtype=np.float64), len(origins))
    tmax = np.full(len(origins), np.inf)
    tmax[3::4] = (unit * np.resize((1.0, 0.5, 2.0), len(unit)))[3::4]
    arrays = np.asarray(triangles).reshape(-1, 3, 3), origins, directions, tmax
    corners, origins, directions, tmax = (
        np.ascontiguousarray(a).astype(np.float32).astype(np.float64) for a in arrays
    )
    kept = directions.any(axis=1)
    return Scene(corners, origins[kept], directions[kept], tmax[kept], why)


def held(points: np.ndarray) -> np.ndarray:
    """Return points rounded to float32, as float64."""
    return np.asarray(points).astype(np.float32).astype(np.float64)


def aimed(
    random: np.random.Generator, triangles: np.ndarray, n: int = RAYS, far: float = 1.5
) -> tuple[np.ndarray, np.ndarray]:
    """Return rays at vertices, at middles of edges and at random points of triangles, by turns.

    Parameters
    ----------
    random : Generator
    triangles : (M, 3, 3) array
    n : int
        How many rays.
    far : float
        Origins lie in the box of the triangles made so many times larger, a fifth of the rays
        starting on a triangle.

    Returns
    -------
    origins, directions : (n, 3) float64 arrays
        Directions are target - origin, so t is 1 at the target.
    """
    triangles = held(triangles)
    targets = points_on(random, triangles, n)
    lower, upper = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    half = np.maximum((upper - lower) / 2, (upper - lower).max() / 4)
    origins = (lower + upper) / 2 + far * half * random.uniform(-1, 1, (n, 3))
    origins[::5] = points_on(random, triangles, n)[::5]
    origins = held(origins)
    return origins, targets - origins


def points_on(random: np.random.Generator, triangles: np.ndarray, n: int) -> np.ndarray:
    """Return vertices, middles of edges and random points of triangles by turns, (n, 3)."""
    corners = triangles[random.integers(len(triangles), size=n)]
    weights = random.dirichlet((1.0, 1.0, 1.0), n)
    weights[0::3] = (1, 0, 0)
    weights[1::3] = (0.5, 0.5, 0)
    turned = np.argsort(random.random((n, 3)), axis=1)
    corners = np.take_along_axis(corners, turned[:, :, None], axis=1)
    return (weights[:, :, None] * corners).sum(axis=1)


def along_axes(random: np.random.Generator, n: int, zeros: int | None = 2) -> np.ndarray:
    """Return directions of components 1, -1 and so many zeros of either sign, (n, 3).

    ``None``: one or two zeros.
    """
    count = random.integers(1, 3, size=n) if zeros is None else np.full(n, zeros)
    rank = np.argsort(np.argsort(random.random((n, 3)), axis=1), axis=1)
    sign = np.where(random.random((n, 3)) < 0.5, 1.0, -1.0)
    return np.where(rank < count[:, None], np.copysign(0.0, sign), sign)


def quads(corner: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return parallelograms as two triangles each, (2 N, 3, 3), of (N, 3) corners and sides."""
    a, b, c = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (corner, first, second)))
    return np.stack([a, a + b, a + b + c, a, a + b + c, a + c], axis=-2).reshape(-1, 3, 3)
