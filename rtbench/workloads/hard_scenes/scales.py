"""Scenes far away, very small in very large ones, and rays of extreme directions."""

from __future__ import annotations

import itertools

import numpy as np

from rtbench.workloads.hard_scenes.scene import (
    RAYS,
    Scene,
    aimed,
    along_axes,
    held,
    made,
    quads,
)
from rtbench.workloads.solids import icosphere


def offset(random: np.random.Generator) -> Scene:
    """Return a sphere of radius 20 some 1e6 away, where floats are 1/16 apart."""
    triangles = 20 * icosphere(2).triangles + (1e6, -1e6, 1e6)
    return made(
        "an offset of 1e6: boxes and split planes are rounded, hits lie outside of cells",
        triangles,
        [aimed(random, triangles, 1200), aimed(random, triangles, 400, far=100.0)],
    )


def small_in_large(random: np.random.Generator) -> Scene:
    """Return 1280 triangles within 1e-3 on a field of 2e5: the teapot in the stadium."""
    small = 5e-4 * (icosphere(3).triangles + np.array([0.0, 0.0, 1.0]))
    x, y = (a.ravel().astype(float) for a in np.mgrid[-5:5, -5:5])
    corner = 2e4 * np.stack([x, y, np.zeros(100)], axis=1)
    field = quads(corner, (2e4, 0.0, 0.0), (0.0, 2e4, 0.0))
    triangles = np.concatenate([field[:100], small, field[100:]])
    origins = held(random.uniform(-1, 1, (500, 3)) * (1e5, 1e5, 1e3))
    origins[::5, 2] = 0  # in the plane of the field
    targets = small[random.integers(len(small), size=500), 0]
    level = np.stack([*random.normal(size=(2, 200)), np.zeros(200)], axis=1)
    return made(
        "a teapot in a stadium: 1e-3 of 2e5; a spatial median never gets there, and depth is "
        "limited",
        triangles,
        [
            aimed(random, small, 500),
            (origins, targets - origins),
            (origins[:200], level),
            aimed(random, field, 400),
        ],
    )


def tiny_and_huge(random: np.random.Generator) -> Scene:
    """Return tiny triangles in a cube, and four huge ones."""
    places = random.random((2000, 1, 3))
    triangles = places + 1e-3 * random.normal(size=(2000, 3, 3))
    triangles[::500] = 1e3 * random.normal(size=(4, 3, 3))
    small = np.delete(triangles, slice(None, None, 500), axis=0)
    return made(
        "tiny triangles, every 500th huge: these are in every cell (oxideav)",
        triangles,
        [aimed(random, small, 1200), aimed(random, triangles[::500], 200)],
    )


def direction_scale(random: np.random.Generator) -> Scene:
    """Return a sphere; rays whose directions are 1e-18 to 1e18 long."""
    triangles = icosphere(2).triangles
    origins, directions = aimed(random, triangles, RAYS)
    directions[::7] = along_axes(random, len(directions[::7]), None)
    power = random.integers(-18, 19, len(directions))
    return made(
        "directions 1e-18 to 1e18 long: their reciprocals, and t, take all of the range",
        triangles,
        [(origins, directions * 10.0 ** power[:, None])],
        10.0**-power,
    )


def signed_zeros(random: np.random.Generator) -> Scene:
    """Return a sphere; rays of every pattern of 1, -1, 0 and -0, and of nearly 0."""
    triangles = icosphere(2).triangles
    values = (1.0, -1.0, 0.0, -0.0, 2.0**-140, -(2.0**-120))
    patterns = np.array(list(itertools.product(values, repeat=3)))
    directions = np.concatenate([patterns] * 6)
    origins = held(random.uniform(-1.5, 1.5, directions.shape))
    vertices = held(triangles)[random.integers(len(triangles), size=len(directions)), 0]
    through = random.random(directions.shape) < 0.6
    origins[through] = vertices[through]
    origins[::9] = 0
    return made(
        "direction components of 0 and -0, and denormal ones whose reciprocal is infinite "
        "(tinybvh, issue 286; embree, 589)",
        triangles,
        [(origins, directions)],
    )


def on_box_faces(random: np.random.Generator) -> Scene:
    """Return a sphere; origins exactly on the faces, edges and corners of its box."""
    triangles = held(icosphere(2).triangles * (1.0, 0.7, 0.4) + (0.3, 0.0, -5.0))
    lower, upper = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    origins = random.uniform(lower, upper, (RAYS, 3))
    which = np.argsort(random.random((RAYS, 3)), axis=1) <= random.integers(0, 3, (RAYS, 1))
    side = np.where(random.random((RAYS, 3)) < 0.5, lower, upper)
    origins = held(np.where(which, side, origins))
    targets = triangles[random.integers(len(triangles), size=RAYS), 0]
    directions = targets - origins
    directions[::3] = along_axes(random, len(directions[::3]), None)
    return made(
        "origins on a face of the scene's box: 0 times infinity (madmann/bvh, issues 9, 21, 60)",
        triangles,
        [(origins, directions)],
    )
