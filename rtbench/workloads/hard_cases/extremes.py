"""Families at the ends of the formats: underflow, overflow, no number, no direction."""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    alone,
    at,
    normals,
    spread,
    unit,
    well_shaped,
)
from rtbench.workloads.hard_cases.scales import ordinary

BAD = (np.nan, np.inf, -np.inf)
VECTORS = 5
INVALID_KINDS = 2 * len(BAD) * VECTORS


def _scaled(random: Random, form: Format, k: np.ndarray) -> Geometry:
    """Return clear cases with triangle and origin times 10^k, the half of directions too."""
    n = len(k)
    triangles, origins, directions = ordinary(random, form, n)
    scale = 10.0 ** k[:, None]
    with_ray = np.where(random.random((n, 1)) < 0.5, scale, 1)
    with np.errstate(over="ignore", under="ignore"):
        triangles = form.round(scale[:, None] * triangles)
        origins = form.round(scale * origins)
        directions = form.round(with_ray * directions)
    directions[(directions == 0).all(axis=1)] = [0, 0, 1]
    return alone(triangles, origins, directions, np.abs(k))


def subnormal(random: Random, form: Format, n: int) -> Geometry:
    """Everything times 10^-k: products underflow, then the numbers themselves lose bits."""
    levels = range(14, 45, 3) if form.bits == 24 else range(80, 323, 22)
    return _scaled(random, form, -spread(levels, n))


def overflow(random: Random, form: Format, n: int) -> Geometry:
    """Everything times 10^k: products overflow, the numbers themselves do not."""
    levels = range(11, 38, 2) if form.bits == 24 else range(80, 307, 20)
    return _scaled(random, form, spread(levels, n))


def inf_nan(random: Random, form: Format, n: int) -> Geometry:
    """Clear hits with NaN or an infinity in one coordinate or in all three of a vector.

    The kind counts NaN, +inf, -inf within the vector (v0, v1, v2, origin, direction) within
    one coordinate or three.
    """
    kind = spread(range(INVALID_KINDS), n)
    triangles, rays = _hits(random, form, n)
    rows = np.concatenate([triangles, np.stack(rays, axis=1)], axis=1)
    number = kind.astype(int)
    places = np.arange(n), number // len(BAD) % VECTORS
    bad = np.take(BAD, number % len(BAD))
    whole = number >= INVALID_KINDS // 2
    rows[(*places, random.integers(3, size=n))] = bad
    rows[places[0][whole], places[1][whole]] = bad[whole, None]
    return alone(rows[:, :3], rows[:, 3], rows[:, 4], kind)


def zero_dir(random: Random, form: Format, n: int) -> Geometry:
    """Directions of zeros: 0 all +0, 1 all -0, 2 of either sign; origin anywhere; or 3 on it.

    Kind 3 starts in a corner of the triangle, where t = 0 for every t.
    """
    kind = spread(range(4), n)
    triangles, (origins, _) = _hits(random, form, n)
    signs = random.choice([-1.0, 1.0], (n, 3))
    signs[kind == 0], signs[kind == 1] = 1, -1
    origins[kind == 3] = triangles[kind == 3, 0]
    return alone(triangles, origins, 0.0 * signs, kind)


def _hits(random: Random, form: Format, n: int):
    """Return triangles and rays to their middles."""
    triangles = form.round(well_shaped(random, n))
    middle = at(np.full((n, 3), 1 / 3), triangles)
    origins = form.round(middle + random.uniform(1, 4, (n, 1)) * normals(triangles))
    return triangles, (origins, form.round(unit(middle - origins)))
