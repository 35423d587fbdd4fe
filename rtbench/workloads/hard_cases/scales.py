"""Families of unusual sizes and places: far from the coordinates' origin, tiny, huge, mixed."""

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
    spread,
    unit,
    ways,
    weights,
    well_shaped,
)


def far_triangle(random: Random, form: Format, n: int) -> Geometry:
    """Triangle and ray both 10^k away from the coordinates' origin, clear hits and misses."""
    k = spread(range(form.digits - 1), n)
    triangles = form.round(well_shaped(random, n) + 10 ** k[:, None, None] * ways(random, n, 1))
    targets = at(weights(random, n), triangles)
    rays = aimed(random, form, targets, normals(triangles), random.uniform(1, 4, n))
    return alone(triangles, *rays, k)


def far_origin(random: Random, form: Format, n: int) -> Geometry:
    """Rays that start 10^k away from the triangle."""
    k = spread(range(form.digits), n)
    triangles = form.round(well_shaped(random, n))
    targets = at(weights(random, n), triangles)
    rays = aimed(random, form, targets, normals(triangles), 10**k)
    return alone(triangles, *rays, k)


def sizes(form: Format, n: int) -> np.ndarray:
    """Return powers of ten such that products of four lengths stay in the format's range."""
    return spread(range(10) if form.bits == 24 else range(0, 61, 4), n)


def tiny_triangle(random: Random, form: Format, n: int) -> Geometry:
    """Edges of 10^-k, rays that start about as near, with directions of length about 1."""
    k = sizes(form, n)
    triangles = form.round(10 ** -k[:, None, None] * well_shaped(random, n))
    targets = at(weights(random, n), triangles)
    away = random.uniform(1, 4, n) * 10**-k
    return alone(triangles, *aimed(random, form, targets, normals(triangles), away), k)


def huge_triangle(random: Random, form: Format, n: int) -> Geometry:
    """Edges of 10^k, rays that start between that and its square root away."""
    k = sizes(form, n)
    triangles = well_shaped(random, n)
    share = weights(random, n)
    # The point that is aimed at lies near the coordinates' origin: there is room for the ray.
    triangles = form.round(10 ** k[:, None, None] * (triangles - at(share, triangles)[:, None]))
    targets = at(share, triangles)
    away = 10 ** (k * random.uniform(0.5, 1, n))
    return alone(triangles, *aimed(random, form, targets, normals(triangles), away), k)


def log_uniform(random: Random, form: Format, n: int) -> Geometry:
    """Every coordinate plus or minus 10 to a power between -k and k.

    The half of rays go to points far from the middle of the triangle, near its smaller corners.
    """
    k = spread(range(1, 9) if form.bits == 24 else range(2, 21, 2), n)
    power = random.uniform(-1, 1, (n, 4, 3)) * k[:, None, None]
    points = form.round(random.choice([-1, 1], power.shape) * 10**power)
    triangles, origins = points[:, :3], points[:, 3]
    share = weights(random, n)
    near = share / np.abs(triangles).max(axis=2)
    near /= near.sum(axis=1, keepdims=True)
    share = np.where(random.random((n, 1)) < 0.5, share, near)
    directions = unit(at(share, triangles) - origins)
    return alone(triangles, origins, form.round(directions), k)


def dir_scale(random: Random, form: Format, n: int) -> Geometry:
    """Clear hits and misses with directions of length 10^k."""
    k = spread(range(-12, 13, 2) if form.bits == 24 else range(-60, 61, 10), n)
    triangles, origins, directions = ordinary(random, form, n)
    return alone(triangles, origins, form.round(10 ** k[:, None] * directions), k)


def ordinary(random: Random, form: Format, n: int):
    """Return well-shaped triangles, origins 1 to 4 away and unit directions, none near an edge."""
    triangles = form.round(well_shaped(random, n))
    targets = at(weights(random, n), triangles)
    away = random.uniform(1, 4, n)
    origins, directions = aimed(random, form, targets, normals(triangles), away)
    return reordered(random, triangles), origins, unit(directions)
