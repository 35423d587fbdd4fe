"""What is done in a leaf: its triangles one by one, or W at a time, by the kernel of the walk.

A walk visits leaves in some order; the answer does not depend on it. Every triangle is asked with
the ray's own tmax, and of two hits that of the lesser t counts, then that of the lower index.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.vector_functions import (
    any_lane,
    choose,
    first_lane,
    lane,
    least,
    spread,
)
from rtbench.kernels.contract import HIT, ZERO

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
WIDTH = 8
TAKES_TMAX = RETURNS_THREE = False
NO_INDEX = np.int32(0x7FFFFFFF)


def test(tri, ray, tmax):  # the kernel
    return 0, 0.0, 0.0, 0.0


def ask(tri, ray):
    if TAKES_TMAX:
        return test(tri, ray, ray.tmax)
    return test(tri, ray)


def nearest_one_by_one(refs, triangles, begin, end, ray, index, t, u, v):
    """Return index, t, u, v of the nearest hit after triangles refs[begin:end] were asked."""
    for k in range(begin, end):
        i = refs[k]
        result = ask(triangles[i], ray)
        hit = (result[0] == HIT) & (result[1] > ZERO) & (result[1] < ray.tmax)
        if hit and (result[1] < t or (result[1] == t and i < index)):
            index, t = i, result[1]
            if RETURNS_THREE:
                u, v = result[2], result[3]
    return index, t, u, v


def any_one_by_one(refs, triangles, begin, end, ray):
    """Return whether any of the triangles refs[begin:end] is hit."""
    for k in range(begin, end):
        result = ask(triangles[refs[k]], ray)
        if (result[0] == HIT) & (result[1] > ZERO) & (result[1] < ray.tmax):
            return True
    return False


def nearest_in_blocks(refs, triangles, begin, end, ray, index, t, u, v):
    """Return index, t, u, v of the nearest hit after blocks begin to end were asked."""
    for k in range(begin, end):
        tri = triangles[k]
        result = test(tri, ray, spread(ray.tmax, WIDTH))
        near = result[0] & (result[1] > ZERO) & (result[1] < ray.tmax) & (result[1] <= t)
        if any_lane(near):
            nearest = least(choose(near, result[1], ray.tmax))
            near = near & (result[1] == nearest)
            i = least(choose(near, tri.index, NO_INDEX))
            if nearest < t or i < index:
                index, t = i, nearest
                if RETURNS_THREE:
                    place = first_lane(near & (tri.index == i))
                    u, v = lane(result[2], place), lane(result[3], place)
    return index, t, u, v


def any_in_blocks(refs, triangles, begin, end, ray):
    """Return whether any triangle of the blocks begin to end is hit."""
    for k in range(begin, end):
        result = test(triangles[k], ray, spread(ray.tmax, WIDTH))
        if any_lane(result[0] & (result[1] > ZERO) & (result[1] < ray.tmax)):
            return True
    return False
