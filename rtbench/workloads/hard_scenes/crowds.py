"""Scenes whose triangles no plane separates, and triangles of bad shape."""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_scenes.scene import (
    RAYS,
    Scene,
    aimed,
    along_axes,
    held,
    made,
)
from rtbench.workloads.solids import icosphere

ONE = np.array([[[0.0, 0.0, 0.0], [1.0, 0.25, 0.0], [0.25, 1.0, 0.5]]])


def empty(random: np.random.Generator) -> Scene:
    """Return no triangles, and rays."""
    origins = random.integers(-2, 3, (100, 3)).astype(float)
    origins[0] = 0
    rays = [(origins, along_axes(random, 100, None))]
    return made("no triangles: nothing to build of, nothing to hit", np.zeros((0, 3, 3)), rays)


def single_triangle(random: np.random.Generator) -> Scene:
    """Return one triangle."""
    beside = random.uniform(-2, 2, (2, 200, 3))
    rays = [aimed(random, ONE, 800), tuple(beside)]
    return made("one triangle: the root is a leaf", ONE, rays)


def single_flat_triangle(random: np.random.Generator) -> Scene:
    """Return one triangle in a plane of the axes, and rays in that."""
    flat = np.array([[[0.0, 0.5, 0.0], [1.0, 0.5, 0.0], [0.0, 0.5, 1.0]]])
    origins = random.integers(-4, 9, (400, 3)) / 4
    origins[::2, 1] = 0.5
    rays = [(origins, along_axes(random, 400, None)), aimed(random, flat, 400)]
    return made("one triangle in a plane of the axes: a box without thickness", flat, rays)


def duplicates(random: np.random.Generator) -> Scene:
    """Return a triangle 40 times, and 20 times turned, among others."""
    turned = ONE[:, [1, 2, 0]]
    others = random.uniform(-1, 2, (20, 3, 3))
    triangles = np.concatenate([others[:10], np.repeat(ONE, 40, 0), others[10:]])
    triangles = np.concatenate([triangles, np.repeat(turned, 20, 0)])
    return made(
        "40 times the same triangle: no plane separates them, building must end; of equal t the "
        "lowest index",
        triangles,
        [aimed(random, ONE, 1000), aimed(random, triangles, 600)],
    )


def identical_centroids(random: np.random.Generator) -> Scene:
    """Return triangles whose centroids are all exactly (0, 0, 0)."""
    first, second = random.integers(-32, 33, (2, 200, 3)) / 16.0
    triangles = np.stack([first, second, -first - second], axis=1)
    triangles *= 2.0 ** random.integers(-6, 7, (200, 1, 1))
    return made(
        "equal centroids: who sorts or splits by them never ends",
        triangles,
        [aimed(random, triangles, 1200), (np.zeros((200, 3)), random.normal(size=(200, 3)))],
    )


def slivers(random: np.random.Generator) -> Scene:
    """Return long thin triangles along the diagonals of a box."""
    ends = np.where(random.random((300, 3)) < 0.5, 1.0, -1.0) * random.uniform(0.8, 1, (300, 3))
    start, end = ends, -ends + random.uniform(-0.1, 0.1, (300, 3))
    width = 10.0 ** random.uniform(-6, -2, (300, 1)) * random.normal(size=(300, 3))
    triangles = np.stack([start, end, end + width], axis=1)
    return made(
        "diagonal slivers: the boxes are large, the triangles are nearly lines, each in many cells",
        triangles,
        [aimed(random, triangles)],
    )


def with_degenerate(random: np.random.Generator) -> Scene:
    """Return a sphere among whose triangles are points, lines and folded ones."""
    sphere = icosphere(2).triangles
    points = np.repeat(sphere[:40, :1], 3, axis=1)
    lines = sphere[40:80].copy()
    lines[:, 2] = lines[:, 1]
    a, b = random.integers(-16, 17, (2, 40, 3)) / 16.0
    collinear = np.stack([a, a + (b - a) / 4, b], axis=1)
    large = np.array([[[-2.0, 0, 0], [2.0, 0, 0], [0, 0, 0]], [[0, -2, -2], [0, 2, 2], [0, 1, 1]]])
    triangles = np.concatenate([sphere, points, lines, collinear, large])
    triangles = triangles[random.permutation(len(triangles))]
    return made(
        "triangles without area among others: 0/0 in the kernels, and boxes of points",
        triangles,
        [aimed(random, triangles)],
    )


def vertex_fan(random: np.random.Generator) -> Scene:
    """Return 256 triangles around one vertex; rays through it, from it and along the spokes."""
    apex = held(np.array([0.1, 0.2, 0.3]))
    angle = 2 * np.pi * np.arange(256) / 256
    height = 0.3 * np.sin(7 * angle)
    rim = held(apex + np.stack([np.cos(angle), np.sin(angle), height], axis=1))
    triangles = np.stack([np.broadcast_to(apex, (256, 3)), rim, np.roll(rim, -1, axis=0)], axis=1)
    origins = held(apex + random.normal(size=(600, 3)))
    spokes = rim[random.integers(256, size=300)] - apex
    return made(
        "many triangles around one vertex: all of them in the cells about it",
        triangles,
        [
            (origins, apex - origins),
            (np.broadcast_to(apex, (300, 3)), spokes),
            aimed(random, triangles, RAYS - 900),
        ],
    )
