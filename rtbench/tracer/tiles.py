"""The compiled entry: tiles of the picture."""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from rtbench.tracer.camera import pixel
from rtbench.tracer.subsampling import CORNERS, subsampled

# What all parts of the compiled tracer read, and the room that they work in: a thread's own.
FIELDS = (
    *("nodes", "refs", "triangles", "leaves", "scene", "faces", "normals", "coordinates"),
    *("shapes", "material_of", "velocities", "materials", "lights", "textures", "texels"),
    *("camera", "settings", "first", "counts", "rays", "waiting", "last", "line", "state", "words"),
    *("far_nodes", "nears", "fars"),
)
World = namedtuple("World", FIELDS)

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
RAY = WAITING = np.dtype([("t", np.float64)])
ROOM, DEPTH, CELLS = 1280, 64, 64
COUNTED = SUBSAMPLED = False
STEPS, TESTS, OF_TILE = 14, 15, 16


def traced(
    nodes,
    refs,
    triangles,
    leaves,
    scene,
    faces,
    normals,
    coordinates,
    shapes,
    material_of,
    velocities,
    materials,
    lights,
    textures,
    texels,
    camera,
    settings,
    first,
    rays,
    waiting,
    counts,
    image,
    heat,
    tiles,
    begin,
    end,
):
    state = np.empty(ROOM, np.float32)
    world = World(
        nodes,
        refs,
        triangles,
        leaves,
        scene,
        faces,
        normals,
        coordinates,
        shapes,
        material_of,
        velocities,
        materials,
        lights,
        textures,
        texels,
        camera,
        settings,
        first,
        counts,
        rays,
        waiting,
        np.zeros((lights.shape[0] + 1, 2), np.int64),
        np.empty(15, np.float32),
        state,
        state.view(np.int32),
        np.empty(DEPTH, np.uint32),
        np.empty(DEPTH, np.float32),
        np.empty(DEPTH, np.float32),
    )
    corners = np.empty((CORNERS, CORNERS, 3), REAL)
    known = np.empty((CORNERS, CORNERS), np.uint8)
    cells = np.empty((CELLS, 4), np.int64)
    for k in range(begin, end):
        # Nothing of a tile depends on those before it.
        world.last[:] = 0
        left, upper, right, lower = tiles[k, 0], tiles[k, 1], tiles[k, 2], tiles[k, 3]
        if SUBSAMPLED:
            known[:] = 0
            subsampled(world, corners, known, cells, image, left, upper, right, lower)
            continue
        for y in range(upper, lower):
            for x in range(left, right):
                if COUNTED:
                    steps, tests = counts[STEPS], counts[TESTS]
                red, green, blue = pixel(world, x, y)
                image[y, x, 0], image[y, x, 1], image[y, x, 2] = red, green, blue
                if COUNTED:
                    heat[y, x, 0], heat[y, x, 1] = counts[STEPS] - steps, counts[TESTS] - tests


NUMBERS = {"ROOM": ROOM, "DEPTH": DEPTH, "CELLS": CELLS}
