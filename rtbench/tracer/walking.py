"""One ray walks through the scene's tree: to the nearest hit, or until something is in the way.

Sources: Wald, Benthin & Boulos 2008 (wide nodes); Wald 2004 (k-d tree); Šilhavý 2010, 2.3.1 (the
leaf that was last in a light's way is asked first; what rasterising found is asked alone).
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.vector_bits import bits_of, descending, how_many, lowest_bit, told_apart
from rtbench.compiled.vector_functions import choose, greater, lesser, row, spread
from rtbench.compiled.vector_memory import save
from rtbench.tracer.in_leaves import (
    BLOCKED,
    FREE,
    leaf_in_the_way,
    nearest_in_leaf,
    nearest_one,
    one_in_the_way,
)
from rtbench.trees.traversal.entering import (
    GREATEST_T,
    LEAST_T,
    SLOWEST,
    enter,
    limit_of,
    not_greater,
)
from rtbench.trees.traversal.stack import descend

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
TRIANGLES = BOUNDED = PLANES = COUNTED = FIRST_HIT = False
SHADOW_CACHE = BVH = True
BEFORE, START, LESS = np.float32(-1), np.float32(0), np.float32(1 - 2**-20)
STACK = 640
STEPS = 14


def come_in(orig, dir, tmax, scene, line):
    """Do what `enter` does, with less work for a ray that starts in the scene's box, as most do.

    Such a ray walks from its origin on, and how far it may be off is known beforehand: scene[10]
    is the pad and scene[11] the slack of the farthest origin in the box.
    """
    x = np.float64(orig[0]) - scene[0]
    y = np.float64(orig[1]) - scene[1]
    z = np.float64(orig[2]) - scene[2]
    inside = (x >= scene[3]) & (x <= scene[6]) & (y >= scene[4]) & (y <= scene[7])
    if not (inside & (z >= scene[5]) & (z <= scene[8])):
        return enter(orig, dir, tmax, scene, line)
    dx, dy, dz = np.float64(dir[0]), np.float64(dir[1]), np.float64(dir[2])
    finite = abs(dx) + abs(dy) + abs(dz) < np.inf
    size = max(abs(dx), abs(dy), abs(dz))
    ix = not_greater(size / dx, 1.0 / SLOWEST)
    iy = not_greater(size / dy, 1.0 / SLOWEST)
    iz = not_greater(size / dz, 1.0 / SLOWEST)
    line[0], line[1], line[2] = np.float32(x), np.float32(y), np.float32(z)
    line[3], line[4], line[5] = np.float32(ix), np.float32(iy), np.float32(iz)
    pad, slack = scene[10], scene[11] + LEAST_T * size
    line[6] = np.float32(pad * abs(ix))
    line[7] = np.float32(pad * abs(iy))
    line[8] = np.float32(pad * abs(iz))
    limit = np.float32(np.float64(tmax) * size + slack)
    slack = slack if GREATEST_T * size >= scene[12] else np.inf
    return finite & (size > 0.0), limit, 0.0, size, slack, pad


def met(world, at, line, low_x, low_y, low_z, limit):
    """Return from where on a ray is in each box of a node, and which of them it meets."""
    node = world.nodes[at]
    near_x = (row(node.boxes, 0, low_x, 8) - line[9]) * line[3]
    near_y = (row(node.boxes, 0, low_y, 8) - line[10]) * line[4]
    near_z = (row(node.boxes, 0, low_z, 8) - line[11]) * line[5]
    far_x = (row(node.boxes, 0, 24 - low_x, 8) - line[12]) * line[3]
    far_y = (row(node.boxes, 0, 40 - low_y, 8) - line[13]) * line[4]
    far_z = (row(node.boxes, 0, 56 - low_z, 8) - line[14]) * line[5]
    near = greater(greater(START, near_z), greater(near_x, near_y))
    far = lesser(lesser(far_x, far_y), lesser(far_z, limit))
    return near, near <= far


def widen(line, pad):
    """Move the origin against the ray for planes that it enters by, along it for the others."""
    for axis in range(3):
        wider = np.float32(pad if line[3 + axis] > START else -pad)
        line[9 + axis] = line[axis] + wider
        line[12 + axis] = line[axis] - wider


def low_sides(line):
    """Return which rows of a node's boxes a ray enters by."""
    return (
        0 if line[3] > START else 24,
        8 if line[4] > START else 32,
        16 if line[5] > START else 40,
    )


def nearest_in_bvh(world, ray, time, start, index, t, u, v):
    line, state, words = world.line, world.state, world.words
    enters, limit, begin, size, slack, pad = come_in(ray.orig, ray.dir, t, world.scene, line)
    if not enters:
        return index, t, u, v
    widen(line, pad)
    low_x, low_y, low_z = low_sides(line)
    at, top = np.int64(0), 0
    while True:
        if COUNTED:
            world.counts[STEPS] += 1
        near, boxes = met(world, at, line, low_x, low_y, low_z, limit)
        bits = bits_of(boxes)
        child, count = np.int32(0), np.int32(0)
        only = bits != np.uint32(0) and bits & (bits - np.uint32(1)) == np.uint32(0)
        if only:
            place = lowest_bit(bits)
            child, count = world.nodes[at].child[place], world.nodes[at].count[place]
        elif bits:
            # Beforehand a little less, so that no box seems to begin later than it does. What is
            # not met comes last, beyond the nearest.
            save(state, top, descending(choose(boxes, told_apart(near * LESS), BEFORE)))
            save(words, top + STACK, spread(np.int32(at), 8))
            top += how_many(boxes)
        # To the only box or back to the nearest: leaves are asked, a node is the next step.
        while True:
            if not only:
                if top == 0:
                    return index, t, u, v
                top -= 1
                if state[top] > limit:
                    continue
                parent = world.nodes[words[top + STACK]]
                place = words[top] & 7
                child, count = parent.child[place], parent.count[place]
            only = False
            if count == 0:
                at = child
                break
            found = nearest_in_leaf(world, child, child + count, ray, time, start, index, t, u, v)
            if found[0] != index:
                index, t, u, v = found
                limit = limit_of(t, begin, size, slack)


def bvh_in_the_way(world, ray, time, start, light):
    line, words = world.line, world.words
    entered = come_in(ray.orig, ray.dir, ray.tmax, world.scene, line)
    if not entered[0]:
        return FREE
    widen(line, entered[5])
    low_x, low_y, low_z = low_sides(line)
    limit = entered[1]
    found = FREE
    at, top = np.int64(0), 0
    while True:
        if COUNTED:
            world.counts[STEPS] += 1
        boxes = bits_of(met(world, at, line, low_x, low_y, low_z, limit)[1])
        node = world.nodes[at]
        while boxes:
            place = lowest_bit(boxes)
            boxes &= boxes - np.uint32(1)
            child, count = np.int64(node.child[place]), node.count[place]
            if count == 0:
                words[top] = child
                top += 1
                continue
            leaf = leaf_in_the_way(world, child, child + count, ray, time, start)
            if leaf == BLOCKED:
                if SHADOW_CACHE:
                    world.last[light, 0], world.last[light, 1] = child, child + count
                return BLOCKED
            found = max(found, leaf)
        if top == 0:
            return found
        top -= 1
        at = words[top]


def nearest_in_kd(world, ray, time, start, index, t, u, v):
    line = world.line
    far_nodes, nears, fars = world.far_nodes, world.nears, world.fars
    enters, limit, begin, size, slack, _ = enter(ray.orig, ray.dir, t, world.scene, line)
    if not enters:
        return index, t, u, v
    node, near, far, top = np.uint32(0), START, limit, 0
    while True:
        node, top, steps = descend(world.nodes, line, node, near, far, far_nodes, nears, fars, top)
        if COUNTED:
            world.counts[STEPS] += steps
        count = world.nodes[node].split
        if count > 0:
            child = np.int64(world.nodes[node].link >> np.uint32(2))
            found = nearest_in_leaf(
                world, child, child + np.int64(count), ray, time, start, index, t, u, v
            )
            if found[0] != index:
                index, t, u, v = found
                limit = limit_of(t, begin, size, slack)
        while top > 0 and nears[top - 1] > limit:
            top -= 1
        if top == 0:
            return index, t, u, v
        top -= 1
        node, near, far = far_nodes[top], nears[top], min(fars[top], limit)


def kd_in_the_way(world, ray, time, start, light):
    line = world.line
    far_nodes, nears, fars = world.far_nodes, world.nears, world.fars
    entered = enter(ray.orig, ray.dir, ray.tmax, world.scene, line)
    if not entered[0]:
        return FREE
    found = FREE
    node, near, far, top = np.uint32(0), START, entered[1], 0
    while True:
        node, top, steps = descend(world.nodes, line, node, near, far, far_nodes, nears, fars, top)
        if COUNTED:
            world.counts[STEPS] += steps
        count = world.nodes[node].split
        if count > 0:
            child = np.int64(world.nodes[node].link >> np.uint32(2))
            end = child + np.int64(count)
            leaf = leaf_in_the_way(world, child, end, ray, time, start)
            if leaf == BLOCKED:
                if SHADOW_CACHE:
                    world.last[light, 0], world.last[light, 1] = child, end
                return BLOCKED
            found = max(found, leaf)
        if top == 0:
            return found
        top -= 1
        node, near, far = far_nodes[top], nears[top], fars[top]


def nearest(world, time, start, primary):
    """Return the primitive that ray 0 hits first, -1: none, and t, u, v there.

    ``primary``: whether it comes from the camera, so that what it hits may be known beforehand.
    """
    ray = world.rays[0]
    index, t, u, v = np.int32(-1), ray.tmax, 0.0, 0.0
    if PLANES:
        count = world.faces.shape[0] + world.shapes.shape[0]
        for i in range(count - world.settings[0].planes, count):
            index, t, u, v = nearest_one(world, np.int32(i), ray, time, start, index, t, u, v)
    if TRIANGLES or BOUNDED:
        if FIRST_HIT:
            known = world.last.shape[0] - 1
            if primary and world.last[known, 0] >= 0:
                begin, end = world.last[known, 0], world.last[known, 1]
                if begin < end:
                    return nearest_in_leaf(world, begin, end, ray, time, start, index, t, u, v)
                return index, t, u, v
        if BVH:
            return nearest_in_bvh(world, ray, time, start, index, t, u, v)
        return nearest_in_kd(world, ray, time, start, index, t, u, v)
    return index, t, u, v


def in_the_way(world, time, start, light):
    """Return whether ray 0 meets anything: FREE, BLOCKED, or THROUGH what lets light through."""
    ray = world.rays[0]
    found = FREE
    if PLANES:
        count = world.faces.shape[0] + world.shapes.shape[0]
        for i in range(count - world.settings[0].planes, count):
            one = one_in_the_way(world, np.int32(i), ray, time, start)
            if one == BLOCKED:
                return BLOCKED
            found = max(found, one)
    if TRIANGLES or BOUNDED:
        if SHADOW_CACHE:
            begin, end = world.last[light, 0], world.last[light, 1]
            if end > begin:
                if leaf_in_the_way(world, begin, end, ray, time, start) == BLOCKED:
                    return BLOCKED
                # The shadow has ended: points in the light need not ask for it again.
                world.last[light, 1] = 0
        if BVH:
            return max(found, bvh_in_the_way(world, ray, time, start, light))
        return max(found, kd_in_the_way(world, ray, time, start, light))
    return found


CALLEES = (
    *(come_in, met, widen, low_sides, nearest_in_bvh, bvh_in_the_way, nearest_in_kd, kd_in_the_way),
    *(nearest, in_the_way),
)
NUMBERS = {"STACK": STACK, "STEPS": STEPS}
IN_DOUBLE = (come_in,)
