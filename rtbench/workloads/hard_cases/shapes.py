"""Families of badly shaped triangles: needles, caps, and corners a few ulps off a line."""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    aimed,
    alone,
    at,
    normals,
    reordered,
    rotations,
    spread,
    ways,
    weights,
)


def _flat(random: Random, form: Format, third: np.ndarray, k: np.ndarray) -> Geometry:
    """Return cases of triangles from (0, 0) to (1, 0) to (third, 10^-k), turned and moved."""
    n = len(k)
    corners = np.zeros((n, 3, 3))
    corners[:, 1, 0] = 1
    corners[:, 2, 0] = third
    corners[:, 2, 1] = 10**-k
    size = random.uniform(0.5, 2, (n, 1, 1))
    triangles = form.round(size * (corners @ rotations(random, n)) + 0.5 * ways(random, n, 1))
    targets = at(weights(random, n), triangles)
    rays = aimed(random, form, targets, normals(triangles), random.uniform(1, 4, n))
    return alone(reordered(random, triangles), *rays, k)


def needle(random: Random, form: Format, n: int) -> Geometry:
    """Two long edges and one of 10^-k: the third corner is at the end."""
    k = spread(range(form.digits + 1), n)
    return _flat(random, form, 1 + random.uniform(-0.5, 0.5, n) * 10**-k, k)


def cap(random: Random, form: Format, n: int) -> Geometry:
    """One angle of almost 180 degrees: the third corner is 10^-k above the middle."""
    return _flat(random, form, random.uniform(0.3, 0.7, n), spread(range(form.digits + 1), n))


def near_degenerate(random: Random, form: Format, n: int) -> Geometry:
    """Corners on a line but for 1024 to 1 ulps in one coordinate."""
    ulps = 2.0 ** spread(range(10, -1, -1), n)
    first, last = form.round(ways(random, 2, n))
    share = random.uniform(0.2, 0.8, (n, 1))
    third = form.round(first + share * (last - first))
    rows, axis = np.arange(n), random.integers(3, size=n)
    third[rows, axis] += (
        random.choice([-1, 1], n) * ulps * np.spacing(form.dtype(third[rows, axis]))
    )
    triangles = np.stack([first, last, third], axis=1)
    targets = at(weights(random, n), triangles)
    rays = aimed(random, form, targets, normals(triangles), random.uniform(1, 4, n))
    return alone(reordered(random, triangles), *rays, 0 - np.log2(ulps))
