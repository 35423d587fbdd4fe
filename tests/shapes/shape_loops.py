"""Shapes compiled in a loop over rays, for tests."""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled import syntax
from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.compiled.sources import dtype_source, named
from rtbench.shapes import any_shape
from rtbench.shapes.any_shape import hit_shape, onto_shape, shape_normal
from rtbench.shapes.records import KINDS, shape_type

ALL = tuple(KINDS)


def ray_type(real: type) -> np.dtype:
    return np.dtype([("orig", real, 3), ("dir", real, 3), ("itself", np.int32)], align=True)


def hit_all(shapes, rays, t):
    for k in range(rays.shape[0]):
        t[k] = hit_shape(shapes[k], rays[k].orig, rays[k].dir, rays[k].itself != 0)


def hit_all_by_tuples(shapes, rays, t):
    for k in range(rays.shape[0]):
        o, d = rays[k].orig, rays[k].dir
        t[k] = hit_shape(shapes[k], (o[0], o[1], o[2]), (d[0], d[1], d[2]), rays[k].itself != 0)


def surface_all(shapes, points, normals, moved):
    for k in range(points.shape[0]):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        result = shape_normal(shapes[k], x, y, z)
        normals[k, 0], normals[k, 1], normals[k, 2] = result[0], result[1], result[2]
        result = onto_shape(shapes[k], x, y, z)
        moved[k, 0], moved[k, 1], moved[k, 2] = result[0], result[1], result[2]


RAYS = "void(SHAPE[::1], RAY[::1], {0}[::1])"
POINTS = "void(SHAPE[::1], {0}[:, ::1], {0}[:, ::1], {0}[:, ::1])"
ENTRIES = {hit_all: RAYS, hit_all_by_tuples: RAYS, surface_all: POINTS}


@functools.cache
def compiled(entry, real: type, kinds: tuple[str, ...] = ALL) -> Instance:
    name = np.dtype(real).name
    return instantiate(
        named(syntax.typed(syntax.parse(entry)), entry.__name__),
        signature=ENTRIES[entry].format(name),
        callees=tuple(
            named(syntax.typed(syntax.parse(each)), each.__name__) for each in any_shape.CALLEES
        ),
        constants={
            "REAL": f"np.{name}",
            "SHAPE": dtype_source(shape_type(real)),
            "RAY": dtype_source(ray_type(real)),
            **any_shape.constants(kinds),
        },
    )


def rays_of(orig, dir, itself, real: type) -> np.ndarray:
    rays = np.zeros(len(orig), ray_type(real))
    rays["orig"], rays["dir"], rays["itself"] = orig, dir, itself
    return rays


def hits(shapes, rays, kinds: tuple[str, ...] = ALL, entry=hit_all) -> np.ndarray:
    real = rays.dtype["orig"].base.type
    t = np.full(len(rays), np.nan, real)
    compiled(entry, real, kinds).call(shapes, rays, t)
    return t


def surface(shapes, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    normals, moved = np.empty_like(points), np.empty_like(points)
    compiled(surface_all, points.dtype.type).call(shapes, points, normals, moved)
    return normals, moved
