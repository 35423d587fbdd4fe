"""Families of rays that start on the triangle, next to it, or beyond it: t = 0 and its sign."""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.boundaries import bit_levels, not_flat
from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    aimed,
    alone,
    aside,
    at,
    normals,
    reordered,
    spread,
    until,
    ways,
    well_shaped,
    whole,
)

QUARTERS = 4


def origin_on(random: Random, form: Format, n: int) -> Geometry:
    """Rays that start exactly in the triangle, on its edges or in its corners; whole numbers."""
    bits = spread(bit_levels(form), n)

    def draw(n: int):
        corner, direction = whole(random, bits[:n] - 1, 2, 3).swapaxes(0, 1)
        first, second = whole(random, bits[:n] - 3, 2, 3).swapaxes(0, 1)
        steps = random.integers(QUARTERS + 1, size=n)
        others = random.integers(QUARTERS + 1 - steps)
        corners = np.stack([0 * first, QUARTERS * first, QUARTERS * second], axis=1)
        origin = corner + steps[:, None] * first + others[:, None] * second
        return corner[:, None] + corners, origin, direction, bits[:n]

    triangles, *rays = until(draw, not_flat, n)
    return alone(reordered(random, triangles), *rays)


def _inside(random: Random, n: int) -> np.ndarray:
    return 0.1 + 0.7 * random.dirichlet((1, 1, 1), n)


def self_intersection(random: Random, form: Format, n: int) -> Geometry:
    """Rays spawned at a hit point, rounded as it was found, 10^k from the coordinates' origin.

    The rounded point lies in front of the triangle, behind it or on it.
    """
    k = spread(range(form.digits - 1), n)
    triangles = form.round(well_shaped(random, n) + 10 ** k[:, None, None] * ways(random, n, 1))
    origins = form.round(at(_inside(random, n), triangles))
    directions = form.round(aside(random, normals(triangles)))
    return alone(triangles, origins, directions, k)


def near_origin(random: Random, form: Format, n: int) -> Geometry:
    """Rays that start 10^-k away from the triangle, in front of it or behind it."""
    k = spread(range(1, form.digits + 1), n)
    triangles = form.round(well_shaped(random, n))
    target = at(_inside(random, n), triangles)
    ray = aside(random, normals(triangles))
    side = random.choice([-1, 1], (n, 1))
    origins = form.round(target + side * 10 ** -k[:, None] * ray)
    return alone(triangles, origins, form.round(ray), k)


def behind(random: Random, form: Format, n: int) -> Geometry:
    """Rays that look away from a triangle 10^k behind them."""
    k = spread(range(-3, form.digits - 1), n)
    triangles = form.round(well_shaped(random, n))
    target = at(_inside(random, n), triangles)
    origins, directions = aimed(random, form, target, normals(triangles), 10**k)
    return alone(triangles, origins, -directions, k)
