"""Random triangles and rays about a centre, at a chosen hit ratio.

The construction has one parameter, the spread s:

- a triangle: three points drawn in the unit ball, moved so that their centroid is s times a
  fourth point of the ball;
- a ray: aimed at s times a point of the ball, in the direction of another point of the ball, from
  a place 0 to 2 before its target, so that some triangles lie behind it.

Nothing prefers a direction. With s = 0 all rays meet all triangles in the centre, and the hit
ratio falls from 1 to 0 as s grows. All float32 arithmetic is numpy's, one operation at a time, so
that a seed gives the same bytes everywhere.
"""

from collections.abc import Callable

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.workloads import safety
from rtbench.workloads.nearest import PORTION

SPREADS = (
    *((0.02, 1.61), (0.0371, 1.2), (0.0536, 1.0), (0.0823, 0.8), (0.1, 0.72), (0.1197, 0.65)),
    *((0.1374, 0.6), (0.1587, 0.55), (0.1847, 0.5), (0.2167, 0.45), (0.2562, 0.4), (0.3051, 0.35)),
    *((0.3655, 0.3), (0.4083, 0.27), (0.4562, 0.24), (0.5, 0.215), (0.5685, 0.18), (0.6324, 0.15)),
    *((0.7012, 0.12), (0.7989, 0.08), (0.8991, 0.04), (0.95, 0.0195)),
)
"""Hit ratio and spread: means over twelve seeds of a million pairs each, within 0.002.

Between two of them the spread is interpolated."""

FLATTEST = 0.1
"""Least quotient of twice a triangle's area and the square of its longest edge."""
SHORTEST_EDGE = 2.0**-6
"""Least magnitude of each component of each edge: Badouel divides by one."""
SHORTEST_AIM = 1e-4
"""Least square of the length of the point of the ball that becomes a direction."""
FARTHEST = 2
"""Greatest distance of an origin from its target."""

Draw = Callable[[tuple[int, int]], np.ndarray]


def spread_at(ratio: float) -> float:
    """Return the spread of a hit ratio.

    Parameters
    ----------
    ratio : float
        Within SPREADS.

    Returns
    -------
    float
        A float32 number.

    Raises
    ------
    RtbenchError
        For a ratio outside SPREADS.
    """
    ratios = [each for each, _ in SPREADS]
    if not ratios[0] <= ratio <= ratios[-1]:
        raise RtbenchError(
            f"hit ratio {ratio:g} is not allowed (allowed: {ratios[0]} to {ratios[-1]})"
        )
    return float(np.float32(np.interp(ratio, ratios, [spread for _, spread in SPREADS])))


def stream(seed: int, k: int) -> Draw:
    """Return a source of coordinates.

    Parameters
    ----------
    seed : int
        Not negative.
    k : int
        Which of the seed's streams: what is drawn from one has nothing to do with another.

    Returns
    -------
    callable
        ``draw((n, m))`` returns the next n items, an (n, m) float32 array in [-1, 1).
    """
    source = np.random.Generator(np.random.PCG64([int(seed), k]))
    return lambda shape: 2 * source.random(shape, dtype=np.float32) - 1


def draw_triangles(draw: Draw, n: int, spread: float) -> np.ndarray:
    """Draw triangles; one that is too flat or has too short an edge component is drawn again.

    Parameters
    ----------
    draw : callable
        As `stream` returns it.
    n : int
        How many.
    spread : float
        The parameter s.

    Returns
    -------
    (n, 3, 3) float32 array
        Vertices.
    """

    def accept(items: np.ndarray) -> np.ndarray:
        points = items.reshape(-1, 4, 3)
        points = points[_in_ball(points).all(axis=1)]
        a, b, c, place = (points[:, k] for k in range(4))
        moved = np.float32(spread) * place - (a + b + c) / np.float32(3)
        corners = points[:, :3] + moved[:, None]
        return corners[_well_shaped(corners)]

    return _accepted(draw, n, 12, accept)


def draw_rays(draw: Draw, n: int, spread: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw rays.

    Parameters
    ----------
    draw, n, spread
        As for `draw_triangles`.

    Returns
    -------
    targets, directions : (n, 3) float32 arrays
        Directions are of length 1.
    distances : (n,) float32 array
        How far before its target a ray begins.
    """

    def accept(items: np.ndarray) -> np.ndarray:
        points = items[:, :6].reshape(-1, 2, 3)
        aims = points[:, 1] * points[:, 1]
        long = aims[:, 0] + aims[:, 1] + aims[:, 2] >= np.float32(SHORTEST_AIM)
        return items[_in_ball(points).all(axis=1) & long]

    items = _accepted(draw, n, 7, accept)
    targets = np.float32(spread) * items[:, :3]
    # From [-1, 1) to [0, FARTHEST), without rounding.
    distances = (items[:, 6] + 1) * np.float32(FARTHEST / 2)
    return targets, safety.normalise(items[:, 3:6]), distances


def _accepted(
    draw: Draw, n: int, width: int, accept: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return what is made of the first items of so many coordinates, n of those accepted."""
    found, missing = [], n
    while missing > 0:
        found.append(accept(draw((min(PORTION, max(1024, 16 * missing)), width)))[:missing])
        missing -= len(found[-1])
    return np.concatenate(found)


def _in_ball(points: np.ndarray) -> np.ndarray:
    """Tell which (..., 3) points lie in the unit ball."""
    squares = points * points
    return squares[..., 0] + squares[..., 1] + squares[..., 2] <= 1


def _well_shaped(corners: np.ndarray) -> np.ndarray:
    """Tell which triangles are neither too flat nor have an edge along a coordinate plane."""
    a, b, c = (corners[:, k].astype(np.float64) for k in range(3))
    e, f, g = b - a, c - a, c - b
    longest = np.maximum.reduce([x[:, 0] ** 2 + x[:, 1] ** 2 + x[:, 2] ** 2 for x in (e, f, g)])
    cross = [e[:, i] * f[:, j] - e[:, j] * f[:, i] for i, j in ((1, 2), (2, 0), (0, 1))]
    wide = cross[0] ** 2 + cross[1] ** 2 + cross[2] ** 2 >= (FLATTEST * longest) ** 2
    return wide & np.all([np.abs(x).min(axis=1) >= SHORTEST_EDGE for x in (e, f, g)], axis=0)
