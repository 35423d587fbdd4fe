"""The compiled part of `rtbench.trees.builders.per_node`: cells are cut until something is full.

Plain functions that go into compiled code, but for the builder's own ``find_plane`` and the
overlap test ``fit``, which stand here by name only.
"""

import numpy as np

from rtbench.trees.builders.planes import extents
from rtbench.trees.cost import area, leaf_cost

NONE, UNFINISHED = -1, -2
# What a step ends with.
DONE, WORKED, ARENA_FULL, NODES_FULL, REFS_FULL = 0, 1, 2, 3, 4
# The state: cells that wait, nodes and leaf references written, depth of the deepest leaf.
WAITING, NODES, REFS, DEPTH = 0, 1, 2, 3
PLANAR_IN_BOTH = False


def find_plane(held, begin, count, depth, cell, choice, model, floats, doubles, unfinished):
    return 0.0, -1, np.float32(0), 0  # a stand-in for the builder


def fit(triangle, own, cell, room):
    return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # a stand-in for the overlap test


def corner(corners, base, i):
    """Return a triangle's local corners."""
    x, y, z = base[0], base[1], base[2]
    return (
        np.float64(corners[i, 0, 0]) - x,
        np.float64(corners[i, 0, 1]) - y,
        np.float64(corners[i, 0, 2]) - z,
        np.float64(corners[i, 1, 0]) - x,
        np.float64(corners[i, 1, 1]) - y,
        np.float64(corners[i, 1, 2]) - z,
        np.float64(corners[i, 2, 0]) - x,
        np.float64(corners[i, 2, 1]) - y,
        np.float64(corners[i, 2, 2]) - z,
    )


def six(boxes, i):
    """Return a box as six float64."""
    return (
        np.float64(boxes[i, 0]),
        np.float64(boxes[i, 1]),
        np.float64(boxes[i, 2]),
        np.float64(boxes[i, 3]),
        np.float64(boxes[i, 4]),
        np.float64(boxes[i, 5]),
    )


def bounds(boxes, i):
    """Return a box as six float32."""
    return boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3], boxes[i, 4], boxes[i, 5]


def wait(cells, at, begin, count, node, depth):
    """Write a cell that is to be cut."""
    cells[at, 0], cells[at, 1], cells[at, 2], cells[at, 3] = begin, count, node, depth


def place(ids, held, at, i, box):
    """Write a reference whose box a fit returned."""
    ids[at] = i
    for k in range(6):
        held[at, k] = np.float32(box[k])


def part(corners, base, ids, held, begin, count, axis, plane, side, left_cell, right_cell, room):
    """Part a cell's references: the right ones from ``begin`` on, then the left; both in order.

    ``held`` has room for as many again after the cell's. Returns how many are left and right.
    """
    left = right = 0
    top = begin + count
    for at in range(begin, top):
        i = ids[at]
        low, high = held[at, axis], held[at, axis + 3]
        goes_left, goes_right = low < plane, high > plane
        if not (goes_left | goes_right):
            goes_left, goes_right = PLANAR_IN_BOTH | (side == 0), PLANAR_IN_BOTH | (side != 0)
        if (low < plane) & (high > plane):
            own = six(held, at)
            triangle = corner(corners, base, i)
            for k in range(2):
                cell = left_cell if k == 0 else right_cell
                inside, lx, ly, lz, ux, uy, uz = fit(triangle, own, cell, room)
                if inside:
                    to = top + left if k == 0 else begin + right
                    place(ids, held, to, i, (lx, ly, lz, ux, uy, uz))
                    left += 1 - k
                    right += k
        else:
            if goes_left:
                ids[top + left] = i
                for k in range(6):
                    held[top + left, k] = held[at, k]
                left += 1
            if goes_right:
                if at != begin + right:
                    ids[begin + right] = i
                    for k in range(6):
                        held[begin + right, k] = held[at, k]
                right += 1
    if top != begin + right:
        for at in range(left):
            ids[begin + right + at] = ids[top + at]
            for k in range(6):
                held[begin + right + at, k] = held[top + at, k]
    return left, right


def step(
    corners,
    base,
    ids,
    held,
    cells,
    boxes,
    shares,
    links,
    splits,
    refs,
    state,
    done,
    choice,
    ending,
    model,
    floats,
    doubles,
    unfinished,
    room,
    work,
):
    """Cut cells until there are none or an array is full or much was done; see `build`."""
    by_cost, max_leaf, deepest = ending[0] != 0, ending[1], ending[2]
    costs = (model[0], model[1], model[2], model[3])
    while state[WAITING] > 0:
        top = state[WAITING] - 1
        begin, count, node, depth = cells[top, 0], cells[top, 1], cells[top, 2], cells[top, 3]
        if state[NODES] + 2 > links.shape[0]:
            return NODES_FULL
        if state[REFS] + count > refs.shape[0]:
            return REFS_FULL
        if begin + 2 * count > ids.shape[0]:
            return ARENA_FULL
        if work < 0:
            return WORKED
        work -= count + 8
        cell = bounds(boxes, top)
        axis, side, plane = NONE, 0, np.float32(0)
        x, y, z = extents(cell)
        leaf = leaf_cost(count, costs)
        # No cut costs less than K_T.
        may_pay = leaf > costs[0] or not by_cost
        if count > max_leaf and depth < deepest and may_pay and area(x, y, z) > 0.0:
            cost, axis, plane, side = find_plane(
                held, begin, count, depth, cell, choice, costs, floats, doubles, unfinished
            )
            if axis == UNFINISHED:
                return WORKED
            if axis >= 0 and by_cost and not cost < leaf:
                axis = NONE
        if axis < 0:
            links[node, 0] = np.uint32(state[REFS]) << np.uint32(2) | np.uint32(3)
            splits[node, 1] = np.float32(count)
            for i in range(count):
                refs[state[REFS] + i] = ids[begin + i]
            state[REFS] += count
            state[DEPTH] = max(state[DEPTH], depth)
            state[WAITING] -= 1
            done[0] += shares[top]
            continue
        plane += np.float32(0)  # -0.0 and 0.0 are one plane: they are to be one tree
        child = state[NODES]
        state[NODES] += 2
        links[node, 0] = np.uint32(child) << np.uint32(2) | np.uint32(axis)
        splits[node, 1] = plane
        for k in range(6):
            boxes[top + 1, k] = boxes[top, k]
        boxes[top, axis] = plane
        boxes[top + 1, axis + 3] = plane
        left_cell, right_cell = six(boxes, top + 1), six(boxes, top)
        left, right = part(
            corners, base, ids, held, begin, count, axis, plane, side, left_cell, right_cell, room
        )
        wait(cells, top, begin, right, child + 1, depth + 1)
        wait(cells, top + 1, begin + right, left, child, depth + 1)
        share = shares[top] * np.float64(left + 1) / np.float64(left + right + 2)
        shares[top + 1], shares[top] = share, shares[top] - share
        state[WAITING] += 1
    return DONE


CALLEES = (corner, six, bounds, wait, place, part)
# The types of a step's arguments, but for that of the corners.
ARGUMENTS = (
    "float64[::1], int32[::1], float32[:, ::1], int64[:, ::1], float32[:, ::1], float64[::1], "
    "uint32[:, ::1], float32[:, ::1], int32[::1], int64[::1], float64[::1], int64[::1], "
    "int64[::1], float64[::1], float32[::1], float64[::1], float64[::1], float64[:, :, ::1], int64"
)
CONSTANTS = {
    name: repr(globals()[name])
    for name in (
        *("NONE", "UNFINISHED", "DONE", "WORKED", "ARENA_FULL", "NODES_FULL", "REFS_FULL"),
        *("WAITING", "NODES", "REFS", "DEPTH"),
    )
}
