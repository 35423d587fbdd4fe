"""Rays that wait to be traced, and the arithmetic of points, directions and colours."""

from __future__ import annotations

import numpy as np

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
READS_END = False  # whether the kernel reads a second point of the ray


def wait(world, top, kind, depth, start, orig, dir, far, weight, wave):
    """Put a ray on the stack of waiting rays; return the stack's height."""
    ray = world.waiting[top]
    for axis in range(3):
        ray.orig[axis], ray.dir[axis], ray.weight[axis] = orig[axis], dir[axis], weight[axis]
    ray.far, ray.wave = far, wave
    ray.kind, ray.depth, ray.start = kind, depth, start
    return top + 1


def aim(ray, orig, dir, far):
    """Make ray 0, which the kernels read, start and go there."""
    for axis in range(3):
        ray.orig[axis], ray.dir[axis] = orig[axis], dir[axis]
        if READS_END:
            ray.end[axis] = orig[axis] + dir[axis]
    ray.tmax = far


def off(point, normal, margin):
    """Return a point moved along a normal by more than its error."""
    return (
        point[0] + normal[0] * margin,
        point[1] + normal[1] * margin,
        point[2] + normal[2] * margin,
    )


def cosine(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def times(a, b):
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def by(a, scale):
    return a[0] * scale, a[1] * scale, a[2] * scale


def greatest(a):
    return max(a[0], a[1], a[2])


def colour(a):
    return a[0], a[1], a[2]


CALLEES = (wait, aim, off, cosine, times, by, greatest, colour)
