"""The compiled part of `rtbench.trees.bvh.build`: cells of boxes are cut in two until they are few.

A box is 8 numbers: its least x, y, z, and its greatest with their signs changed, so that the box
around two is one least of each of 8; in the fourth and last are its triangle, or a node's links.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.vector_bits import halves_swapped, truncated
from rtbench.compiled.vector_functions import lane, lesser, spread
from rtbench.compiled.vector_memory import load, save
from rtbench.trees.cost import area, blocks, leaf_cost

BINS = 32
DONE, WORKED = 0, 1
# The state: cells that wait, nodes written, triangles in leaves.
WAITING, NODES, IN_LEAVES, STATE = 0, 1, 2, 3
NOTHING = np.float32(np.inf)
HALF = np.float32(0.5)
FINEST = np.float32(1e30)  # a greater scale, or none, cuts nothing
ZERO32 = np.float32(0)


def row_of(rows, k):
    """Return row ``k`` of rows of 8."""
    return load(rows, np.int64(k) * 8, 8)


def put(rows, k, lanes):
    """Write row ``k`` of rows of 8."""
    save(rows, np.int64(k) * 8, lanes)


def size_of(box):
    """Return half the surface of a box in lanes, float64."""
    sides = box + halves_swapped(box)  # negative
    x, y, z = lane(sides, 0), lane(sides, 1), lane(sides, 2)
    return area(np.float64(x), np.float64(y), np.float64(z))


def middle_of(box):
    """Return half the sum of both ends of a box, in the lower half of the lanes."""
    return (box - halves_swapped(box)) * HALF


def scales(least, bins, scale):
    """Write how many bins there are to a unit, of each axis; 0 where nothing can be told apart.

    ``least`` is the box of the middles.
    """
    sides = least + halves_swapped(least)
    for axis in range(3):
        wide = -lane(sides, axis)
        scale[0, axis] = ZERO32
        if wide > ZERO32:
            fit = np.float32(bins) / wide
            if fit < FINEST:
                scale[0, axis] = fit


def place_of(box, least, scale, last):
    """Return the bins in which a box's middle lies, a lane an axis."""
    return truncated(lesser(last, (middle_of(box) - least) * scale))


def fill(held, begin, end, least, scale, bins, around, counts):
    """Put boxes into bins: what is around those of each, and how many they are."""
    nothing = spread(NOTHING, 8)
    last = spread(np.float32(bins - 1), 8)
    factors = row_of(scale, 0)
    for k in range(3 * BINS):
        put(around, k, nothing)
        counts[k] = 0
    for k in range(begin, end):
        box = row_of(held, k)
        place = place_of(box, least, factors, last)
        for axis in range(3):
            at = np.int64(lane(place, axis)) + axis * BINS
            put(around, at, lesser(row_of(around, at), box))
            counts[at] += 1


def best_cut(bins, around, counts, beyond, model):
    """Return the cost of the best cut in area times tests, its axis (-1: none) and first bin."""
    best, best_axis, best_bin = np.inf, -1, 0
    for axis in range(3):
        base = axis * BINS
        box, count = spread(NOTHING, 8), 0
        for k in range(bins - 1, 0, -1):
            box = lesser(box, row_of(around, base + k))
            count += counts[base + k]
            beyond[k] = size_of(box) * blocks(count, model) if count > 0 else -1.0
        box, count = spread(NOTHING, 8), 0
        for k in range(1, bins):
            box = lesser(box, row_of(around, base + k - 1))
            count += counts[base + k - 1]
            if count > 0 and beyond[k] >= 0.0:
                found = size_of(box) * blocks(count, model) + beyond[k]
                if found < best:
                    best, best_axis, best_bin = found, axis, k
    return best, best_axis, best_bin


def part(held, begin, end, axis, first, least, scale, found):
    """Put boxes whose bin is before ``first`` to the front; return where the others begin.

    Writes to ``found`` what is around the boxes and around their middles, left and right.
    """
    left = left_middle = right = right_middle = spread(NOTHING, 8)
    low, high = begin, end
    origin, factor, limit = lane(least, axis), scale[0, axis], np.float32(first)
    while low < high:
        box = row_of(held, low)
        middle = middle_of(box)
        if (lane(middle, axis) - origin) * factor < limit:
            left, left_middle = lesser(left, box), lesser(left_middle, middle)
            low += 1
        else:
            right, right_middle = lesser(right, box), lesser(right_middle, middle)
            high -= 1
            put(held, low, row_of(held, high))
            put(held, high, box)
    put(found, 0, left)
    put(found, 1, left_middle)
    put(found, 2, right)
    put(found, 3, right_middle)
    return low


def bound(held, begin, end, found, at):
    """Write what is around boxes and around their middles to ``found[at]`` and the next row."""
    whole = middles = spread(NOTHING, 8)
    for k in range(begin, end):
        box = row_of(held, k)
        whole, middles = lesser(whole, box), lesser(middles, middle_of(box))
    put(found, at, whole)
    put(found, at + 1, middles)


def wait(cells, at, begin, end, node, depth):
    """Write a cell that is to be cut."""
    cells[at, 0], cells[at, 1], cells[at, 2], cells[at, 3] = begin, end, node, depth


def step(held, tree, links, cells, middles, state, ending, costs, work):
    """Cut cells until there are none or much was done.

    Parameters
    ----------
    held : (M, 8) float32 array
        The triangles' boxes, which change places.
    tree, links : (2M, 8) float32 array, and the same as int32
        A node's box; in the fourth lane the first of its two children, which is followed by the
        other, or where a leaf begins; in the last how many a leaf holds, 0 in a node.
    cells : (n, 4) int64 array
        Cells that wait: begin, end, node, depth.
    middles : (n, 8) float32 array
        What is around the middles of their boxes.
    state : (3,) int64 array
        Zeros at first.
    ending : (5,) int64 array
        Whether cost ends it, of how many triangles a cell is a leaf at any rate, and at most if
        that costs less, at which depth cells are leaves, and from which they are halved.
    costs : (4,) float64 array, see `rtbench.trees.cost`.
    work : int64
    """
    around, counts = np.empty((3 * BINS, 8), np.float32), np.empty(3 * BINS, np.int64)
    beyond, scale = np.empty(BINS), np.zeros((1, 8), np.float32)
    found = np.empty((4, 8), np.float32)
    model = (costs[0], costs[1], costs[2], costs[3])
    if state[NODES] == 0:
        bound(held, 0, held.shape[0], found, 0)
        put(tree, 0, row_of(found, 0))
        put(middles, 0, row_of(found, 1))
        wait(cells, 0, 0, held.shape[0], 0, 0)
        state[WAITING], state[NODES] = 1, 1
    while state[WAITING] > 0:
        if work < 0:
            return WORKED
        top = state[WAITING] - 1
        begin, end, node, depth = cells[top, 0], cells[top, 1], cells[top, 2], cells[top, 3]
        count = end - begin
        work -= count + 8
        is_leaf = count <= ending[1] or depth >= ending[3]
        cut, axis, first = np.inf, -1, 0
        if not is_leaf:
            if depth < ending[4]:
                least = row_of(middles, top)
                scales(least, BINS, scale)
                fill(held, begin, end, least, scale, BINS, around, counts)
                cut, axis, first = best_cut(BINS, around, counts, beyond, model)
            if count <= ending[2]:
                whole = size_of(row_of(tree, node))
                dear = not model[0] * whole + model[1] * cut < leaf_cost(count, model) * whole
                is_leaf = axis < 0 or (ending[0] != 0 and dear)
        state[WAITING] -= 1
        if is_leaf:
            links[node, 3], links[node, 7] = begin, count
            state[IN_LEAVES] += count
            continue
        if axis >= 0:
            between = part(held, begin, end, axis, first, row_of(middles, top), scale, found)
        else:
            between = begin + count // 2
            bound(held, begin, between, found, 0)
            bound(held, between, end, found, 2)
        child = state[NODES]
        state[NODES] += 2
        links[node, 3], links[node, 7] = child, 0
        put(tree, child, row_of(found, 0))
        put(tree, child + 1, row_of(found, 2))
        put(middles, top, row_of(found, 3))
        put(middles, top + 1, row_of(found, 1))
        wait(cells, top, between, end, child + 1, depth + 1)
        wait(cells, top + 1, begin, between, child, depth + 1)
        state[WAITING] += 2
    return DONE


CALLEES = (row_of, put, size_of, middle_of, scales, place_of, fill, best_cut, part, bound, wait)
CONSTANTS = {
    "BINS": repr(BINS),
    "DONE": repr(DONE),
    "WORKED": repr(WORKED),
    "WAITING": repr(WAITING),
    "NODES": repr(NODES),
    "IN_LEAVES": repr(IN_LEAVES),
    "NOTHING": "np.float32(np.inf)",
    "HALF": "np.float32(0.5)",
    "FINEST": "np.float32(1e30)",
    "ZERO32": "np.float32(0)",
}
