"""Shapes of all sizes, and rays at them, for tests."""

from __future__ import annotations

import numpy as np

from rtbench.shapes import records


def directions(draw: np.random.Generator, n: int) -> np.ndarray:
    found = draw.normal(size=(n, 3))
    return found / np.linalg.norm(found, axis=1)[:, None]


def sizes(draw: np.random.Generator, n: int, low: float = -3, high: float = 5) -> np.ndarray:
    return 10 ** draw.uniform(low, high, n)


def shapes(draw: np.random.Generator, kind: str, n: int, real: type, spread=(-3, 5)) -> np.ndarray:
    """Shapes of sizes and at distances from 0 of the decades ``spread``."""
    point = directions(draw, n) * sizes(draw, n, *spread)[:, None]
    axis = directions(draw, n)
    axis[: n // 4] = np.eye(3)[draw.integers(0, 3, n // 4)]
    radius = sizes(draw, n, *spread)
    if kind == "spheres":
        return records.sphere(point, radius, real)
    if kind == "discs":
        return records.disc(point, axis, radius, real)
    if kind == "planes":
        return records.plane(point, axis, real)
    height = radius * sizes(draw, n, -1.5, 1.5)
    other = radius * draw.choice([0.0, 0.5, 1.0, 1.0, 2.0], n)
    other = np.where(draw.random(n) < 0.5, other, radius * draw.uniform(0, 2, n))
    turned = draw.random(n) < 0.3
    base, apex = point, point + axis * height[:, None]
    base, apex = np.where(turned[:, None], apex, base), np.where(turned[:, None], base, apex)
    first, second = np.where(turned, other, radius), np.where(turned, radius, other)
    return records.cone(base, apex, first, second, real)


def surface_points(
    draw: np.random.Generator, shape: np.ndarray, extent: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Points of shapes in float64, by a parametrisation, and unit normals by another formula."""
    point, axis = shape["point"].astype(float), shape["axis"].astype(float)
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    radius, height, slope = (shape[each].astype(float) for each in ("radius", "height", "slope"))
    n = len(shape)
    around = np.cross(axis, directions(draw, n))
    around /= np.linalg.norm(around, axis=1)[:, None]
    along = draw.random(n) * height
    flat = np.sqrt(draw.random(n)) * np.where(shape["kind"] == records.PLANE, extent, radius)
    flat[: n // 10] = radius[: n // 10]
    ball = directions(draw, n)
    on_cone = around * (radius + slope * along)[:, None] + axis * along[:, None]
    lean = np.arctan(slope)[:, None]
    kinds = [shape["kind"][:, None] == each for each in (records.SPHERE, records.CONE)]
    offset = np.select(kinds, [ball * radius[:, None], on_cone], around * flat[:, None])
    normal = np.select(kinds, [ball, around * np.cos(lean) - axis * np.sin(lean)], axis)
    return point + offset, normal


def middles(shape: np.ndarray) -> np.ndarray:
    return shape["point"] + shape["axis"] * shape["height"][:, None] * 0.5


def extents(shape: np.ndarray) -> np.ndarray:
    least = np.where(shape["kind"] == records.PLANE, 1.0, 0.0)
    return np.maximum(shape["radius"] + shape["height"] * 0.5, least).astype(float)


def rays_from_outside(draw, shape):
    """From up to 10^4 sizes away, to somewhere near the shape; directions of any length."""
    n = len(shape)
    extent = extents(shape)
    away = directions(draw, n) * (extent * sizes(draw, n, 0.1, 4))[:, None]
    target = draw.uniform(-0.8, 0.8, (n, 3)) * extent[:, None]
    orig = middles(shape) + away
    dir = target - away
    dir *= (sizes(draw, n, -3, 3) / np.linalg.norm(dir, axis=1))[:, None]
    return orig, dir


def rays_from_inside(draw, shape):
    n = len(shape)
    orig = middles(shape) + draw.uniform(-0.5, 0.5, (n, 3)) * shape["radius"][:, None]
    return orig, directions(draw, n) * sizes(draw, n, -3, 3)[:, None]


def rays_that_graze(draw, shape):
    """Through a point of the surface, or just beside it, across the normal there."""
    n = len(shape)
    target, normal = surface_points(draw, shape)
    dir = np.cross(normal, directions(draw, n))
    dir /= np.linalg.norm(dir, axis=1)[:, None]
    beside = sizes(draw, n, -9, -1) * draw.choice([-1.0, 0.0, 1.0], n) * extents(shape)
    far = extents(shape) * sizes(draw, n, -2, 3)
    return target + normal * beside[:, None] - dir * far[:, None], dir


def rays_on_the_surface(draw, shape):
    orig, normal = surface_points(draw, shape)
    n = len(shape)
    dir = directions(draw, n)
    # Some nearly along the surface.
    shallow = np.where(draw.random(n) < 0.3, sizes(draw, n, -5, 0), 1.0)
    dir += normal * ((shallow - 1) * np.sum(dir * normal, axis=1))[:, None]
    return orig, dir * sizes(draw, n, -3, 3)[:, None]


def rays_along(draw, shape):
    """Along the axis, or along a side of a cone: its own or the one opposite; or nearly so."""
    n = len(shape)
    axis = shape["axis"].astype(float)
    start, normal = surface_points(draw, shape)
    around = normal - axis * np.sum(normal * axis, axis=1)[:, None]
    around /= np.linalg.norm(around, axis=1)[:, None]
    lean = shape["slope"].astype(float) * draw.choice([-1.0, 0.0, 1.0], n)
    dir = axis + around * lean[:, None]
    nearly = sizes(draw, n, -8, -2) * draw.choice([0.0, 1.0], n)
    dir += directions(draw, n) * nearly[:, None]
    dir *= draw.choice([-1.0, 1.0], n)[:, None]
    start += (
        draw.uniform(-0.5, 0.5, (n, 3)) * (shape["radius"] * draw.choice([0.0, 1.0], n))[:, None]
    )
    return start - dir * (draw.uniform(-1, 5, n) * shape["height"])[:, None], dir


def rays_at_the_rim(draw, shape):
    """Just inside or outside the edge of a disc, or of a cone's base."""
    n = len(shape)
    axis = shape["axis"].astype(float)
    around = np.cross(axis, directions(draw, n))
    around /= np.linalg.norm(around, axis=1)[:, None]
    beside = (extents(shape) * sizes(draw, n, -9, -1) * draw.choice([-1.0, 1.0], n))[:, None]
    side = axis + around * shape["slope"].astype(float)[:, None]
    offset = around * shape["radius"].astype(float)[:, None]
    offset += np.where(shape["kind"][:, None] == records.CONE, side, around) * beside
    dir = directions(draw, n)
    far = extents(shape) * sizes(draw, n, -1, 2)
    return shape["point"] + offset - dir * far[:, None], dir


def rays_near_a_tip(draw, shape):
    """To the narrower end of a cone, nearly along its own side there."""
    n = len(shape)
    axis, slope = shape["axis"].astype(float), shape["slope"].astype(float)
    around = np.cross(axis, directions(draw, n))
    around /= np.linalg.norm(around, axis=1)[:, None]
    side = axis + around * slope[:, None]
    near = sizes(draw, n, -6, 0)
    along = shape["height"] * np.where(slope < 0, 1 - near, near)
    target = around * shape["radius"].astype(float)[:, None] + side * along[:, None]
    dir = side + directions(draw, n) * sizes(draw, n, -6, -1)[:, None]
    dir *= np.where(slope < 0, 1.0, -1.0)[:, None]
    return shape["point"] + target - dir * (shape["height"] * draw.uniform(1, 2, n))[:, None], dir


def rays_along_their_own_side(draw, shape):
    n = len(shape)
    axis, slope = shape["axis"].astype(float), shape["slope"].astype(float)[:, None]
    around = np.cross(axis, directions(draw, n))
    around /= np.linalg.norm(around, axis=1)[:, None]
    side = axis + around * slope
    along = shape["height"] * draw.uniform(0.1, 0.9, n)
    orig = shape["point"] + around * shape["radius"].astype(float)[:, None] + side * along[:, None]
    return orig, side * draw.choice([-1.0, 1.0], n)[:, None]
