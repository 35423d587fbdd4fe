"""Families in which triangles share an edge, a corner or a closed surface: nothing may leak.

A group is one ray against all triangles that could meet it. Together they cover a neighbourhood
of the ray on all sides, so at least one is met, and exactly one owns the ray where ties are broken.
"""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.boundaries import bit_levels, edge_through
from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    flatness,
    grouped,
    reordered,
    rotations,
    spread,
    unit,
    until,
    ways,
    whole,
)

FAR = np.array([148376.0, 1234.0, -223423.0])
"""Where Embree's own tests put their closed spheres."""


def both_sides(first, last, one, other, origin, direction, *_) -> np.ndarray:
    """Whether the corners lie on both sides of the plane through edge and ray, clear of it."""
    edge = last - first
    sides = [flatness(edge, direction, corner - first) for corner in (one, other)]
    tilt = np.abs(triple_of_planes(edge, direction, one - first, other - first))
    return (sides[0] * sides[1] < 0) & (np.minimum(*np.abs(sides)) > 0.1) & (tilt > 0.1)


def triple_of_planes(edge, direction, one, other) -> np.ndarray:
    """Return the lesser of the two planes' tilts against the ray."""
    return np.minimum(
        np.abs(flatness(edge, one, direction)), np.abs(flatness(edge, other, direction))
    )


def pairs_of(random: Random, first, last, one, other) -> np.ndarray:
    """Return the two triangles at each edge, one after the other, corners in any order."""
    corners = [np.stack([first, last, third], axis=1) for third in (one, other)]
    return reordered(random, np.stack(corners, axis=1).reshape(-1, 3, 3))


def shared_edge_exact(random: Random, form: Format, n: int) -> Geometry:
    """A ray that meets the common edge of two triangles exactly; whole numbers."""
    bits = spread(bit_levels(form), n)

    def draw(n: int):
        first, last, point, origin = edge_through(random, bits[:n])
        one, other = whole(random, bits[:n], 2, 3).swapaxes(0, 1)
        return first, last, one, other, origin, point - origin, bits[:n]

    *corners, origins, directions, bits = until(draw, both_sides, n)
    triangles = pairs_of(random, *corners)
    return grouped(triangles, origins, directions, bits, np.full(n, 2))


def offsets(form: Format) -> range:
    """Return powers of ten at which a scene of size 1 has still some digits left."""
    return range(form.digits - 1)


def shared_edge_near(random: Random, form: Format, n: int) -> Geometry:
    """A ray aimed at the common edge of two triangles, 10^k away from the coordinates' origin."""
    k = spread(offsets(form), n)

    def draw(n: int):
        place = 10 ** k[:n, None] * ways(random, n)
        corners = form.round(place + random.uniform(-2, 2, (5, n, 3)))
        first, last, one, other, origin = corners
        target = first + random.uniform(0.2, 0.8, (n, 1)) * (last - first)
        direction = form.round(2.0 ** random.uniform(-1, 1, (n, 1)) * (target - origin))
        return first, last, one, other, origin, direction, k[:n]

    def good(first, last, one, other, origin, direction, k):
        lengths = [np.linalg.norm(last - first, axis=1), np.linalg.norm(direction, axis=1)]
        fine = both_sides(first, last, one, other, origin, direction)
        return fine & (np.minimum(*lengths) > 0.5)

    *corners, origins, directions, k = until(draw, good, n)
    triangles = pairs_of(random, *corners)
    return grouped(triangles, origins, directions, k, np.full(n, 2))


def ring(random: Random, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return corners around rays along the directions, about 1 away, and how many each ray has.

    Returns
    -------
    corners : (sum of sizes, 3) array
        As seen along the ray they go once around it, no two neighbours more than 160 degrees apart.
    sizes : (N,) int array
        3 to 8.
    """
    sizes = random.integers(3, 9, len(direction))
    ray = np.repeat(np.arange(len(sizes)), sizes)
    place = np.arange(len(ray)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    angle = 2 * np.pi * (place + random.uniform(-0.15, 0.15, len(ray))) / sizes[ray]
    axis = unit(direction)
    across = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)]))
    along = np.cross(axis, across)
    radius, height = random.uniform(0.6, 1, len(ray)), random.uniform(-0.4, 0.4, len(ray))
    corners = (
        (radius * np.cos(angle))[:, None] * across[ray]
        + (radius * np.sin(angle))[:, None] * along[ray]
        + height[:, None] * axis[ray]
    )
    return corners, sizes


def fan(random: Random, centre: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the triangles from each centre to neighbours of its ring, corners in any order."""
    ends = np.cumsum(sizes)
    following = np.arange(1, len(corners) + 1)
    following[ends - 1] = ends - sizes
    middle = np.repeat(centre, sizes, axis=0)
    return reordered(random, np.stack([middle, corners, corners[following]], axis=1))


def vertex_fan_exact(random: Random, form: Format, n: int) -> Geometry:
    """A ray that meets the common corner of 3 to 8 triangles exactly; whole numbers."""
    bits = spread([level for level in bit_levels(form) if level > 4], n)
    size = 2.0 ** (bits[:, None] - 1)
    centre, origin = whole(random, bits - 1, 2, 3).swapaxes(0, 1)
    near = np.abs(centre - origin).max(axis=1) < size[:, 0] / 4
    origin[near] = centre[near] - np.sign(centre[near] + 0.5) * size[near] // 2
    direction = centre - origin
    corners, sizes = ring(random, direction)
    corners = np.repeat(centre, sizes, axis=0) + np.rint(np.repeat(size, sizes, axis=0) * corners)
    return grouped(fan(random, centre, corners, sizes), origin, direction, bits, sizes)


def vertex_fan_near(random: Random, form: Format, n: int) -> Geometry:
    """A ray aimed at the common corner of 3 to 8 triangles, 10^k from the coordinates' origin."""
    k = spread(offsets(form), n)
    place = 10 ** k[:, None] * ways(random, n)
    centre = form.round(place)
    origin = form.round(centre + random.uniform(1, 4, (n, 1)) * ways(random, n))
    direction = form.round(2.0 ** random.uniform(-1, 1, (n, 1)) * (centre - origin))
    corners, sizes = ring(random, direction)
    corners = form.round(np.repeat(centre, sizes, axis=0) + corners)
    return grouped(fan(random, centre, corners, sizes), origin, direction, k, sizes)


def icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Return the (12, 3) corners, 1 from the middle, and the (20, 3) faces of an icosahedron."""
    golden = (1 + 5**0.5) / 2
    corners = np.array(
        [[0, a, b * golden] for a in (-1, 1) for b in (-1, 1)]
        + [[a, b * golden, 0] for a in (-1, 1) for b in (-1, 1)]
        + [[b * golden, 0, a] for a in (-1, 1) for b in (-1, 1)]
    )
    apart = np.linalg.norm(corners[:, None] - corners, axis=2)
    beside = np.isclose(apart, 2)  # the length of its edges
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if beside[i, j] and beside[j, k] and beside[i, k]
    ]
    return unit(corners), np.array(faces)


def closed_mesh_far(random: Random, form: Format, n: int) -> Geometry:
    """A closed icosahedron far away, and a ray from inside to a corner, an edge or a face."""
    corners, faces = icosahedron()
    far = np.log10(np.linalg.norm(FAR))
    levels = [*range(6), far] if form.bits == 24 else [*range(0, 13, 2), far]
    k = spread(levels, n)
    place = FAR * (10 ** (k - far))[:, None]
    place[k == far] = FAR
    vertices = random.uniform(1, 3, (n, 1, 1)) * (corners @ rotations(random, n))
    vertices = form.round(place[:, None] + vertices)
    origin = form.round(place + 0.3 * random.random((n, 1)) * ways(random, n))
    picked = faces[random.integers(len(faces), size=n)]
    share = random.dirichlet((2, 2, 2), n)
    kind = np.arange(n) % 3
    share[kind == 0] = [1, 0, 0]
    share[kind == 1, 2] = 0
    share /= share.sum(axis=1, keepdims=True)
    target = np.einsum("nk,nkc->nc", share, vertices[np.arange(n)[:, None], picked])
    # The difference to a corner is often exact; a factor takes that away from the half of them.
    length = np.where(random.random((n, 1)) < 0.5, 1, 2.0 ** random.uniform(-1, 1, (n, 1)))
    direction = form.round(length * (target - origin))
    triangles = reordered(random, vertices[:, faces].reshape(-1, 3, 3))
    return grouped(triangles, origin, direction, k, np.full(n, len(faces)))
