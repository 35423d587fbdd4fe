"""Families at the border of a triangle: near its edges and corners, and exactly on them."""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    aimed,
    alone,
    at,
    flatness,
    normals,
    reordered,
    spread,
    weights,
    well_shaped,
    whole,
)
from rtbench.workloads.hard_cases.geometry import until as drawn_until


def control_random(random: Random, form: Format, n: int) -> Geometry:
    """Well-shaped triangles, clear hits and clear misses, nothing hard."""
    triangles = form.round(well_shaped(random, n))
    targets = at(weights(random, n), triangles)
    rays = aimed(random, form, targets, normals(triangles), random.uniform(1, 4, n))
    return alone(triangles, *rays, 0)


def toward_edge(random: Random, form: Format, n: int):
    """Return triangles, rays that pass an edge at a distance of 10^-k, and k.

    Returns
    -------
    triangles : (n, 3, 3) array
    rays : tuple of two (n, 3) arrays
    k : (n,) array
        From 1 to where rounding alone decides; on both sides of the edge.
    """
    k = spread(range(1, form.digits + 3), n)
    triangles = form.round(well_shaped(random, n))
    along = random.uniform(0.2, 0.8, n)
    apart = random.choice([-1, 1], n) * 10**-k
    placed = np.stack([apart, along * (1 - apart), (1 - along) * (1 - apart)], axis=1)
    placed = random.permuted(placed, axis=1)
    rays = aimed(random, form, at(placed, triangles), normals(triangles), random.uniform(1, 4, n))
    return triangles, rays, k


def near_edge(random: Random, form: Format, n: int) -> Geometry:
    """Rays whose points have one weight of plus or minus 10^-k."""
    triangles, rays, k = toward_edge(random, form, n)
    return alone(triangles, *rays, k)


def near_vertex(random: Random, form: Format, n: int) -> Geometry:
    """Rays whose points have two weights of up to 10^-k, of any signs."""
    k = spread(range(1, form.digits + 3), n)
    triangles = form.round(well_shaped(random, n))
    two = random.uniform(0.3, 1, (n, 2)) * random.choice([-1, 1, 1], (n, 2)) * 10 ** -k[:, None]
    placed = random.permuted(np.column_stack([two, 1 - two.sum(axis=1)]), axis=1)
    rays = aimed(random, form, at(placed, triangles), normals(triangles), random.uniform(1, 4, n))
    return alone(triangles, *rays, k)


def bit_levels(form: Format) -> range:
    """Return bits of whole coordinates: few of float32's; more than float32 has of float64's."""
    return range(4, form.bits - 1, 2) if form.bits == 24 else range(28, form.bits - 2, 3)


def edge_through(random: Random, bits: np.ndarray):
    """Return an edge, a point on it and a ray to that point, in whole numbers.

    Parameters
    ----------
    random : Generator
    bits : (N,) array
        Of the coordinates; those of the edge and the direction have one more.

    Returns
    -------
    first, last, point, origin : (N, 3) arrays
        Ends of the edge; a point between them, exactly; where the ray starts.
    """
    point, origin = whole(random, bits - 1, 2, 3).swapaxes(0, 1)
    step = whole(random, bits - 3, 3)
    before, behind = random.integers(1, 4, (2, len(bits), 1))
    return point - before * step, point + behind * step, point, origin


def exact_edge(random: Random, form: Format, n: int) -> Geometry:
    """Rays that meet an edge exactly, between its ends; whole numbers."""
    bits = spread(bit_levels(form), n)

    def draw(n: int):
        first, last, point, origin = edge_through(random, bits[:n])
        corners = np.stack([first, last, whole(random, bits[:n], 3)], axis=1)
        return corners, origin, point - origin, bits[:n]

    # A case that is refused changes which bits the later ones have, not how many bits there are.
    kept = drawn_until(draw, not_flat, n)
    return alone(reordered(random, kept[0]), *kept[1:])


def exact_vertex(random: Random, form: Format, n: int) -> Geometry:
    """Rays that meet a corner exactly; whole numbers."""
    bits = spread(bit_levels(form), n)

    def draw(n: int):
        corners = whole(random, bits[:n] - 1, 3, 3)
        origin = whole(random, bits[:n] - 1, 3)
        return corners, origin, corners[:, 0] - origin, bits[:n]

    kept = drawn_until(draw, not_flat, n)
    return alone(reordered(random, kept[0]), *kept[1:])


def not_flat(triangles, origins, directions, bits) -> np.ndarray:
    """Whether rays are clearly not in the planes, and the triangles have an area.

    Float64 decides this even for numbers of 52 bits: the bound is far above its errors.
    """
    edges = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return np.abs(flatness(*edges, directions)) > 0.01
