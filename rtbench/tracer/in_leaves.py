"""What is asked in a leaf: triangles by the kernel, in blocks or one by one, and shapes.

``start`` is the primitive on which a ray begins, -1: none. A flat one is not asked again; of a
curved one only the other root is a hit (see `rtbench.shapes`).
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.vector_bits import bits_of, lowest_bit
from rtbench.compiled.vector_functions import any_lane, choose, first_lane, lane, least, spread
from rtbench.kernels.contract import HIT
from rtbench.shapes.any_shape import hit_shape
from rtbench.trees.traversal.leaf_tests import ask

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
WIDTH = 8
TRIANGLES = BLOCKS = SHAPES = BOUNDED = MOTION = REFRACTION = COUNTED = False
RETURNS_THREE = True
READS_END = False
NO_INDEX = np.int32(0x7FFFFFFF)
FREE, BLOCKED, THROUGH = np.int64(0), np.int64(1), np.int64(2)
TESTS = 15


def test(tri, ray, tmax):  # the kernel
    return 0, 0.0, 0.0, 0.0


def nearest_in_blocks(triangles, begin, end, ray, start, index, t, u, v):  # in lanes
    for k in range(begin, end):
        tri = triangles[k]
        result = test(tri, ray, spread(ray.tmax, WIDTH))
        near = result[0] & (result[1] > 0.0) & (result[1] < ray.tmax) & (result[1] <= t)
        near = near & (tri.index != start)
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


def hits_in_block(tri, ray, start):  # in lanes: a bit for each triangle that is hit
    result = test(tri, ray, spread(ray.tmax, WIDTH))
    hit = result[0] & (result[1] > 0.0) & (result[1] < ray.tmax)
    return bits_of(hit & (tri.index != start))


def lets_through(world, primitive):
    return world.materials[world.material_of[primitive]].transmits


def moved(world, primitive, time):
    """Return the ray as a primitive that moves sees it: its origin goes the other way."""
    ray, seen = world.rays[0], world.rays[1]
    for axis in range(3):
        seen.orig[axis] = ray.orig[axis] - time * world.velocities[primitive, axis]
        seen.dir[axis] = ray.dir[axis]
        if READS_END:
            seen.end[axis] = seen.orig[axis] + seen.dir[axis]
    seen.tmax = ray.tmax
    return seen


def nearest_one(world, i, ray, time, start, index, t, u, v):
    """Return index, t, u, v of the nearest hit after primitive i was asked."""
    seen = ray
    if MOTION:
        seen = moved(world, i, time)
    if TRIANGLES and not BLOCKS and (not SHAPES or i < world.faces.shape[0]):
        if i != start:
            result = ask(world.triangles[i], seen)
            hit = (result[0] == HIT) & (result[1] > 0.0) & (result[1] < seen.tmax)
            if hit and (result[1] < t or (result[1] == t and i < index)):
                index, t = i, result[1]
                if RETURNS_THREE:
                    u, v = result[2], result[3]
    elif SHAPES:
        shape = world.shapes[i - world.faces.shape[0]]
        at = hit_shape(shape, seen.orig, seen.dir, i == start)
        if at > 0.0 and at < seen.tmax and (at < t or (at == t and i < index)):
            index, t, u, v = i, at, 0.0, 0.0
    return index, t, u, v


def one_in_the_way(world, i, ray, time, start):
    """Return whether primitive i is in the way: FREE, BLOCKED, or THROUGH."""
    seen = ray
    if MOTION:
        seen = moved(world, i, time)
    hit = False
    if TRIANGLES and not BLOCKS and (not SHAPES or i < world.faces.shape[0]):
        if i != start:
            result = ask(world.triangles[i], seen)
            hit = (result[0] == HIT) & (result[1] > 0.0) & (result[1] < seen.tmax)
    elif SHAPES:
        shape = world.shapes[i - world.faces.shape[0]]
        at = hit_shape(shape, seen.orig, seen.dir, i == start)
        hit = at > 0.0 and at < seen.tmax
    if not hit:
        return FREE
    if REFRACTION:
        if lets_through(world, i):
            return THROUGH
    return BLOCKED


def nearest_in_leaf(world, begin, end, ray, time, start, index, t, u, v):
    """Return index, t, u, v of the nearest hit after a leaf was asked."""
    first, last = begin, end
    if BLOCKS:
        if BOUNDED:
            leaf = world.leaves[begin]
            begin, end, first, last = leaf.begin, leaf.end, leaf.first, leaf.last
        index, t, u, v = nearest_in_blocks(world.triangles, begin, end, ray, start, index, t, u, v)
    if BOUNDED or not BLOCKS:
        for k in range(first, last):
            index, t, u, v = nearest_one(world, world.refs[k], ray, time, start, index, t, u, v)
    if COUNTED:
        world.counts[TESTS] += end - begin
        if BLOCKS and BOUNDED:
            world.counts[TESTS] += last - first
    return index, t, u, v


def leaf_in_the_way(world, begin, end, ray, time, start):
    """Return whether what a leaf holds is in the way: FREE, BLOCKED, or THROUGH."""
    first, last = begin, end
    found = FREE
    if BLOCKS:
        if BOUNDED:
            leaf = world.leaves[begin]
            begin, end, first, last = leaf.begin, leaf.end, leaf.first, leaf.last
        for k in range(begin, end):
            bits = hits_in_block(world.triangles[k], ray, start)
            if bits:
                if not REFRACTION:
                    return BLOCKED
                while bits:
                    place = lowest_bit(bits)
                    bits &= bits - np.uint32(1)
                    if not lets_through(world, world.triangles[k].index[place]):
                        return BLOCKED
                found = THROUGH
    if COUNTED:
        world.counts[TESTS] += end - begin
    if BOUNDED or not BLOCKS:
        for k in range(first, last):
            one = one_in_the_way(world, world.refs[k], ray, time, start)
            if one == BLOCKED:
                return BLOCKED
            found = max(found, one)
    return found


IN_LANES = (nearest_in_blocks, hits_in_block)
CALLEES = (
    *IN_LANES,
    *(lets_through, moved, nearest_one, one_in_the_way, nearest_in_leaf, leaf_in_the_way),
)
NUMBERS = {"FREE": FREE, "BLOCKED": BLOCKED, "THROUGH": THROUGH, "TESTS": TESTS}
