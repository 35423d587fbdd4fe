"""Families whose determinant is 0 or nearly: rays along planes, triangles without area.

Exactly singular cases are whole numbers, so that they are singular as stored; their determinants
have more bits than a float, so that floating point need not find 0.
"""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.boundaries import bit_levels
from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    alone,
    at,
    flatness,
    normals,
    reordered,
    spread,
    unit,
    until,
    ways,
    weights,
    well_shaped,
    whole,
)

QUARTERS = 4
"""Edges are so many steps long, so that whole steps lead into the triangle."""


def in_plane(random: Random, bits: np.ndarray):
    """Return triangles, and a point and a direction in each one's plane, exactly.

    Parameters
    ----------
    random : Generator
    bits : (N,) array
        Of the numbers, at least 6.

    Returns
    -------
    triangles, points, directions : arrays
        Whole numbers of at most these bits.
    """
    corner = whole(random, bits - 2, 3)
    first, second = whole(random, bits - 5, 2, 3).swapaxes(0, 1)
    steps = random.integers(-2, 4, (2, len(bits), 1))
    ahead = random.integers(-3, 4, (2, len(bits), 1))
    ahead[0][(ahead == 0).all(axis=0)] = 1
    triangles = np.stack([corner, corner + QUARTERS * first, corner + QUARTERS * second], axis=1)
    points = corner + steps[0] * first + steps[1] * second
    return triangles, points, ahead[0] * first + ahead[1] * second


def across(triangles: np.ndarray) -> np.ndarray:
    """Return how far from parallel two edges of each triangle are: 0 to 1."""
    first, second = (unit(triangles[:, k] - triangles[:, 0]) for k in (1, 2))
    return np.linalg.norm(np.cross(first, second), axis=1)


def parallel_offplane(random: Random, form: Format, n: int) -> Geometry:
    """Rays parallel to the plane, at a height of 2^-k of the triangle's size."""
    bits = np.full(n, form.bits - 3.0)
    # Of the greatest heights the ray is about as far away as the triangle is long.
    levels = range(0, form.bits - 7) if form.bits == 24 else range(0, form.bits - 8, 3)
    k = spread(levels, n)

    def draw(n: int):
        triangles, points, directions = in_plane(random, bits[:n])
        lifts = np.rint(2.0 ** (bits[:n] - 3 - k[:n])[:, None] * ways(random, n))
        return triangles, points, directions, lifts, k[:n]

    def good(triangles, points, directions, lifts, k):
        edges = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        return (across(triangles) > 0.1) & (np.abs(flatness(*edges, lifts)) > 0.03)

    triangles, points, directions, lifts, k = until(draw, good, n)
    return alone(reordered(random, triangles), points + lifts, directions, k)


def coplanar(random: Random, form: Format, n: int) -> Geometry:
    """Rays in the plane of the triangle."""
    bits = spread([max(level, 6) for level in bit_levels(form)], n)
    triangles, points, directions, bits = until(
        lambda n: (*in_plane(random, bits[:n]), bits[:n]), lambda t, *_: across(t) > 0.1, n
    )
    return alone(reordered(random, triangles), points, directions, bits)


def grazing(random: Random, form: Format, n: int) -> Geometry:
    """Rays at an angle of 10^-k to the plane."""
    k = spread(range(form.digits + 1), n)
    triangles = form.round(well_shaped(random, n))
    normal = normals(triangles)
    along = unit(np.cross(normal, ways(random, n)))
    angle = random.choice([-1, 1], (n, 1)) * 10 ** -k[:, None]
    target = at(weights(random, n), triangles)
    ray = np.cos(angle) * along + np.sin(angle) * normal
    origins = form.round(target - random.uniform(1, 4, (n, 1)) * ray)
    directions = 2.0 ** random.uniform(-1, 1, (n, 1)) * unit(target - origins)
    return alone(triangles, origins, form.round(directions), k)


def degenerate_collinear(random: Random, form: Format, n: int) -> Geometry:
    """Triangles whose corners lie on a line, rays through it, past it and along it."""
    bits = spread(bit_levels(form), n)
    corner = whole(random, bits - 1, 3)
    step = whole(random, bits - 4, 3)
    none = (step == 0).all(axis=1)
    step[none] = 1
    places = random.permuted(np.tile([0, 1, 3], (n, 1)), axis=1) * random.choice([-1, 1], (n, 1))
    triangles = corner[:, None] + places[:, :, None] * step[:, None]
    origins = whole(random, bits - 1, 3)
    # To a point of the segment; to one of the line, perhaps beyond; anywhere; along the line.
    kind = np.arange(n) // len(bit_levels(form)) % 4
    which = np.where(kind == 0, places[:, 1], random.integers(-3, 4, n))
    directions = corner + which[:, None] * step - origins
    directions[kind == 2] = whole(random, bits[kind == 2] - 1, 3)
    origins[kind == 3] = (corner + random.choice([-2, 2], (n, 1)) * step)[kind == 3]
    directions[kind == 3] = (step * random.choice([-1, 1], (n, 1)))[kind == 3]
    directions[(directions == 0).all(axis=1)] = 1
    return alone(triangles, origins, directions, bits)


def degenerate_coincident(random: Random, form: Format, n: int) -> Geometry:
    """Triangles of which two corners are one, or all three."""
    pairs = ((0, 1), (1, 2), (2, 0), (0, 1, 2))
    kind = spread(range(len(pairs)), n)
    bits = random.choice(np.array(bit_levels(form)), n)
    triangles = whole(random, bits - 1, 3, 3)
    for number, equal in enumerate(pairs):
        for corner in equal[1:]:
            triangles[kind == number, corner] = triangles[kind == number, equal[0]]
    origins = whole(random, bits - 1, 3)
    directions = triangles[np.arange(n), random.integers(3, size=n)] - origins
    past = random.random(n) < 0.4
    directions[past] = whole(random, bits[past] - 1, 3)
    directions[(directions == 0).all(axis=1)] = 1
    return alone(triangles, origins, directions, kind)
