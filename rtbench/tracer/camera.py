"""Rays from the camera, and the colour of a pixel.

Sources: Cook, Porter & Carpenter 1984 (lens, shutter, places in the pixel); Welford 1962 (mean and
spread while they grow).
"""

from __future__ import annotations

import math

import numpy as np

from rtbench.tracer.sampling import DIMENSIONS, on_disc, seed_of, uniform
from rtbench.tracer.tracing import radiance
from rtbench.tracer.waiting import wait

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
ANTIALIASING = DEPTH_OF_FIELD = MOTION_BLUR = INDIRECT = FIRST_HIT = False
INFINITY = REAL(np.inf)
PRIMARY = 0
DIMENSION_ANTIALIASING = DIMENSIONS["antialiasing"]
DIMENSION_DEPTH_OF_FIELD = DIMENSIONS["depth_of_field"]
DIMENSION_MOTION_BLUR = DIMENSIONS["motion_blur"]
ONE_MORE = np.uint64(1)
FEWEST = 16  # samples before a pixel's noise is believed


def from_camera(camera, seed, x, y):
    """Return where a ray through the picture's point (x, y), in pixels, starts, and its way."""
    right = x * camera.per_column - 1.0
    up = 1.0 - y * camera.per_row
    dx = camera.forward[0] + right * camera.right[0] + up * camera.up[0]
    dy = camera.forward[1] + right * camera.right[1] + up * camera.up[1]
    dz = camera.forward[2] + right * camera.right[2] + up * camera.up[2]
    ox, oy, oz = camera.position[0], camera.position[1], camera.position[2]
    if DEPTH_OF_FIELD:
        if camera.lens_radius > 0.0:
            a, b = on_disc(
                uniform(seed, DIMENSION_DEPTH_OF_FIELD),
                uniform(seed, DIMENSION_DEPTH_OF_FIELD + ONE_MORE),
            )
            a, b = a * camera.lens_radius, b * camera.lens_radius
            lx = a * camera.across[0] + b * camera.upward[0]
            ly = a * camera.across[1] + b * camera.upward[1]
            lz = a * camera.across[2] + b * camera.upward[2]
            ox, oy, oz = ox + lx, oy + ly, oz + lz
            dx, dy, dz = dx * camera.focus - lx, dy * camera.focus - ly, dz * camera.focus - lz
    scale = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
    return (ox, oy, oz), (dx * scale, dy * scale, dz * scale)


def sample(world, x, y, number, side):
    """Return what one sample of a pixel brings."""
    camera = world.camera[0]
    pixel = np.uint64(y) * np.uint64(camera.width) + np.uint64(x)
    seed = seed_of(pixel, np.uint64(number))
    across, down = 0.5, 0.5
    if ANTIALIASING:
        if side > 1:
            # Cells in no order of place, so that the first ones are everywhere in the pixel.
            cell = number * world.settings[0].stride % (side * side)
            u = uniform(seed, DIMENSION_ANTIALIASING)
            v = uniform(seed, DIMENSION_ANTIALIASING + ONE_MORE)
            across = (REAL(cell % side) + u) / REAL(side)
            down = (REAL(cell // side) + v) / REAL(side)
    time = 0.0
    if MOTION_BLUR:
        time = uniform(seed, DIMENSION_MOTION_BLUR)
        if side > 1 and not world.settings[0].noise > 0.0:
            # Where all samples are taken, each has its own part of the time the shutter is open.
            time = (REAL(number) + time) / REAL(side * side)
    orig, dir = from_camera(camera, seed, REAL(x) + across, REAL(y) + down)
    if FIRST_HIT:
        known = world.last.shape[0] - 1
        world.last[known, 0] = -1
        if x < world.first.shape[1] and y < world.first.shape[0]:
            world.last[known, 0], world.last[known, 1] = world.first[y, x, 0], world.first[y, x, 1]
    world.counts[PRIMARY] += 1
    none = np.int64(0)
    wait(world, none, PRIMARY, none, np.int32(-1), orig, dir, INFINITY, (1.0, 1.0, 1.0), 0.0)
    return radiance(world, seed, time)


def pixel(world, x, y):
    """Return the colour of a pixel: the mean of its samples."""
    settings = world.settings[0]
    red, green, blue = 0.0, 0.0, 0.0
    taken, mean, spread = np.int64(0), 0.0, 0.0
    while taken < settings.samples:
        r, g, b = sample(world, x, y, taken, settings.side)
        red, green, blue = red + r, green + g, blue + b
        taken += 1
        if INDIRECT:
            if settings.noise > 0.0:
                bright = 0.2126 * r + 0.7152 * g + 0.0722 * b
                change = bright - mean
                mean += change / REAL(taken)
                spread += change * (bright - mean)
                if taken >= FEWEST:
                    # As if the next sample were off by all the mean: what is rare and bright may
                    # not have been seen yet.
                    error = math.sqrt(spread + mean * mean) / REAL(taken)
                    if error < settings.noise:
                        break
    share = 1.0 / REAL(taken)
    return red * share, green * share, blue * share


CALLEES = (from_camera, sample, pixel)
NUMBERS = {"FEWEST": FEWEST}
