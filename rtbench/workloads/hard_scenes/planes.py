"""Scenes whose triangles lie in the planes that a tree splits by, and rays that run in these."""

from __future__ import annotations

import itertools

import numpy as np

from rtbench.workloads.generated_models import stairs
from rtbench.workloads.hard_scenes.scene import (
    Scene,
    aimed,
    along_axes,
    held,
    made,
    quads,
)
from rtbench.workloads.solids import cube, icosphere


def flat_in_planes(random: np.random.Generator) -> Scene:
    """Return squares in planes of the axes, some lying in them; rays in, on and through these."""
    triangles = np.concatenate([_squares(axis, range(5), (0.0, 2.0), 2.0) for axis in range(3)])
    origins, directions = _in_grid(random, 1200, 4)
    return made(
        "flat triangles lie in the split planes, and so do rays, or they start on them: cells "
        "without thickness, tmin = tmax, 0 times infinity",
        triangles,
        [(origins, directions), aimed(random, triangles, 400)],
    )


def coplanar(random: np.random.Generator) -> Scene:
    """Return triangles all in z = 0."""
    triangles = random.integers(-64, 64, (300, 3, 3)) / 8.0
    triangles[:, :, 2] = np.where(random.random((300, 3)) < 0.5, 0.0, -0.0)
    within = random.integers(-64, 64, (400, 3)) / 8.0
    within[:, 2] = 0
    along = random.integers(-3, 4, (400, 3)).astype(float)
    along[::2, 2] = np.where(random.random(200) < 0.5, 0.0, -0.0)
    rays = [(within, along), aimed(random, triangles, 1200)]
    return made("all triangles in one plane: the box of the scene is flat", triangles, rays)


def coplanar_slanted(random: np.random.Generator) -> Scene:
    """Return triangles all in x + y + z = 0."""
    flat = random.integers(-64, 64, (300, 3, 2)) / 8.0
    triangles = np.concatenate([flat, -flat.sum(axis=2, keepdims=True)], axis=2)
    rays = [aimed(random, triangles)]
    return made("all triangles in one slanted plane: every box holds many", triangles, rays)


def grid(random: np.random.Generator) -> Scene:
    """Return the walls of 5 x 5 x 5 rooms; rays along them, from and through their corners."""
    triangles = np.concatenate([_squares(axis, range(6), range(5), 1.0) for axis in range(3)])
    return made(
        "rays run exactly in the split planes of a grid and along its edges",
        triangles,
        [_in_grid(random, 1600, 5)],
    )


def abutting(random: np.random.Generator) -> Scene:
    """Return rows of triangles, each ending in the plane where the next one begins."""
    x, y = (a.ravel().astype(float) for a in np.mgrid[:12, :12])
    zero, one = np.zeros(144), np.ones(144)
    sheet = quads(np.stack([x, y, zero], 1), np.stack([one, zero, zero], 1), (0.0, 1.0, 0.0))
    tilt = random.integers(-2, 3, (144, 2)).astype(float)
    corner = np.stack([x, y, 3 + zero], axis=1)
    slanted = quads(corner, np.stack([one, zero, tilt[:, 0]], 1), np.stack([zero, one, zero], 1))
    triangles = np.concatenate([sheet, slanted])
    origins = np.stack([*random.integers(0, 25, (2, 800)) / 2, random.integers(-2, 7, 800)], 1)
    directions = np.where(
        np.arange(800)[:, None] % 2, along_axes(random, 800, None), (0.0, -0.0, -1.0)
    )
    return made(
        "where one triangle ends another begins, in the split plane: ends before starts "
        "(pbrt-v3, issue 244)",
        triangles,
        [(origins, directions), aimed(random, triangles, 800)],
    )


def staircase(random: np.random.Generator) -> Scene:
    """Return stairs in planes of the axes; rays straight down and along, on edges and between."""
    triangles = stairs(1000).triangles
    origins = np.stack([random.integers(0, 65, 1200) / 4 for _ in range(3)], axis=1)
    directions = np.where(np.arange(1200)[:, None] % 3, (0.0, -1.0, 0.0), along_axes(random, 1200))
    origins[np.arange(1200) % 3 == 1, 1] = 32
    return made(
        "stairs of triangles in planes of the axes, vertical rays (Mitsuba's k-d tree)",
        triangles,
        [(origins, directions), aimed(random, triangles, 400)],
    )


def integer_grid(random: np.random.Generator) -> Scene:
    """Return a sphere snapped to whole coordinates; rays parallel to axes on whole ones."""
    triangles = np.round(10 * icosphere(3).triangles)
    origins = random.integers(-12, 13, (1200, 3)).astype(float)
    directions = along_axes(random, 1200)
    outside = np.arange(1200) % 2 == 0
    origins[outside] = np.where(directions != 0, -16 * directions, origins)[outside]
    return made(
        "a mesh snapped to an integer grid, rays parallel to axes on the grid, triangles without "
        "area (tinybvh, issue 168)",
        triangles,
        [(origins, directions), aimed(random, triangles, 400)],
    )


def layers(random: np.random.Generator) -> Scene:
    """Return squares one unit in the last place apart, as seen from above, below and between."""
    height = 1 + np.arange(-32, 33) * 2.0**-23
    corner = np.stack([np.full(65, -1.0), np.full(65, -1.0), height], axis=1)
    triangles = held(quads(corner, (2.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    triangles = triangles[random.permutation(len(triangles))]
    origins = random.integers(-5, 6, (800, 3)) / 4
    origins[::2, 2] = height[random.integers(65, size=400)]
    directions = np.where(np.arange(800)[:, None] % 3, along_axes(random, 800, None), (0, 0, 1.0))
    return made(
        "layers 1 ulp apart: t is equal for many of them, cells are as thin as floats get",
        triangles,
        [(origins, directions), aimed(random, triangles, 800)],
    )


def box(random: np.random.Generator) -> Scene:
    """Return a cube; origins in, on and around it, in 26 directions each."""
    around = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=3)))
    ways = around[around.any(axis=1)]
    # On its faces, edges and corners; in it; outside, seeing it straight or past a corner.
    starts = np.concatenate([around, [(0.25, 0.5, -0.375)], 2 * ways])
    origins, directions = np.repeat(starts, len(ways), axis=0), np.tile(ways, (len(starts), 1))
    sign = np.where(random.random(directions.shape) < 0.5, 0.0, -0.0)
    directions = np.where(directions == 0, sign, directions)
    return made(
        "origins inside a box, on its faces, edges and corners: 0 times infinity is NaN at the "
        "slabs (embree, issue 589; warp, 1530; madmann/bvh, 9, 21, 60)",
        cube().triangles,
        [(origins, directions)],
    )


def _squares(axis: int, planes, places, side: float) -> np.ndarray:
    """Return squares in planes of one axis, at all pairs of places along the two others."""
    others = [a for a in range(3) if a != axis]
    corners = np.zeros((0, 3))
    for plane in planes:
        for one, two in itertools.product(places, repeat=2):
            corner = np.zeros((1, 3))
            corner[0, axis], corner[0, others] = plane, (one, two)
            corners = np.concatenate([corners, corner])
    return quads(corners, side * np.eye(3)[others[0]], side * np.eye(3)[others[1]])


def _in_grid(random: np.random.Generator, n: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return rays from whole and half coordinates, parallel to axes, to planes, or diagonal."""
    origins = random.integers(-2, 2 * size + 3, (n, 3)) / 2.0
    whole = np.arange(n) % 4 != 0
    origins[whole] = np.round(origins[whole])
    directions = along_axes(random, n, None)
    directions[::5] = random.integers(-2, 3, (len(directions[::5]), 3))
    return origins, directions
