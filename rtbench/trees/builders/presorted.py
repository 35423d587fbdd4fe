"""A cell cut with presorted events: its plane found, its references and events parted.

Cells are cut depth first. The events of all cells that wait lie one behind the other, those of
the cell being cut at the end; its right part stays in place, its left part goes behind it and is
cut next. Boxes are kept by triangle: those of references across the plane are written over for
the left part, and those for the right part are kept aside until its turn comes. A part that is
certain to be a leaf gets no events.

Plain functions that go into compiled code; `rtbench.trees.builders.nlogn` has the arrays.
"""

import numpy as np

from rtbench.trees.builders.cells import corner, six
from rtbench.trees.builders.event_sweep import NEVER, sweep, sweep_half
from rtbench.trees.builders.events import (
    END,
    TRIANGLE,
    ZERO,
    ascend,
    fate_in,
    merged,
    parted,
    pass_on,
    pass_on_both,
    position,
    renewed,
)
from rtbench.trees.builders.planes import extent, extents, wanted_axes
from rtbench.trees.cost import area, leaf_cost

HALF = False  # a constant of the generated module, as those of events.py
# What a step ends with.
DONE, WORKED, FULL_EVENTS, FULL_NODES, FULL_REFS, FULL_ASIDE = 0, 1, 2, 3, 4, 5
# The state: cells that wait, nodes and references written, depth of the deepest leaf, and how
# long the array that is full has to be.
WAITING, NODES, REFS, DEPTH, NEEDED = 0, 1, 2, 3, 4
# Of a cell that waits: its node, depth and references; where its events begin (3) and end (3);
# where those references that were kept aside for it begin and end, and whether it is a leaf,
# all of whose references were kept aside.
NODE_OF, DEPTH_OF, COUNT, BEGIN, STOP, ASIDE, ASIDE_STOP, IS_LEAF = 0, 1, 2, 3, 6, 9, 10, 11
CONSTANTS = {
    name: repr(globals()[name])
    for name in (
        *("DONE", "WORKED", "FULL_EVENTS", "FULL_NODES", "FULL_REFS", "FULL_ASIDE", "WAITING"),
        *("NODES", "REFS", "DEPTH", "NEEDED", "NODE_OF", "DEPTH_OF", "COUNT", "BEGIN", "STOP"),
        *("ASIDE", "ASIDE_STOP", "IS_LEAF"),
    )
}


def fit(triangle, own, cell, room):
    return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # a stand-in for the overlap test


def write_leaf(nodes, refs, state, node, depth, n):
    """Make a leaf of the n references last written, and sort them."""
    begin = state[REFS]
    ascend(refs, begin, n)
    nodes[node, 0] = np.uint32(begin) << np.uint32(2) | np.uint32(3)
    nodes[node, 1] = np.float32(n).view(np.uint32)
    state[REFS] = begin + n
    state[DEPTH] = max(state[DEPTH], depth)


def listed(events, axis, begin, end, fates, bits, to, at):
    """Write the triangles that have all these bits of fate."""
    for i in range(begin, end):
        key = events[axis, i]
        to[at] = np.int32(key & TRIANGLE)
        wanted = fates[key & TRIANGLE] & bits == bits
        at += wanted & (key >> np.uint64(30) & np.uint64(3) != END)


def write_box(boxes, i, box):
    """Write a box that a fit returned."""
    for k in range(6):
        boxes[i, k] = np.float32(box[k])


def fitted_to_both(corners, base, boxes, fates, triangle, left_cell, right_cell, kept, to, room):
    """Fit a triangle to both parts of its cell: return 1 or 0 for whether it belongs to each.

    Its new box on the left goes to ``boxes``, that on the right to row ``to`` of ``kept``.
    """
    own = six(boxes, triangle)
    points = corner(corners, base, triangle)
    fate = np.uint32(0)
    in_left, lx, ly, lz, ux, uy, uz = fit(points, own, left_cell, room)
    if in_left:
        fate |= fate_in(0, own, (lx, ly, lz, ux, uy, uz))
        write_box(boxes, triangle, (lx, ly, lz, ux, uy, uz))
    in_right, lx, ly, lz, ux, uy, uz = fit(points, own, right_cell, room)
    if in_right:
        fate |= fate_in(1, own, (lx, ly, lz, ux, uy, uz))
        write_box(kept, to, (lx, ly, lz, ux, uy, uz))
    fates[triangle] = np.uint16(fate)
    return np.int64(in_left), np.int64(in_right)


def step(
    corners,
    base,
    boxes,
    events,
    fates,
    aside,
    kept,
    fresh,
    nodes,
    refs,
    waiting,
    cells,
    state,
    choice,
    model,
    middles,
    room,
    work,
):
    """Cut cells until there are none or an array is full or much was done; see `build`."""
    axes, flat, by_cost, few, deepest = choice[0], choice[1] != 0, choice[2], choice[3], choice[4]
    ceiling, costs = (choice[5], choice[6]), (model[0], model[1], model[2], model[3])
    while state[WAITING] > 0:
        if work < 0:
            return WORKED
        top = state[WAITING] - 1
        cell = waiting[top]
        node, depth, count, first = cell[NODE_OF], cell[DEPTH_OF], cell[COUNT], cell[ASIDE]
        if state[NODES] + 2 > nodes.shape[0]:
            state[NEEDED] = state[NODES] + 2
            return FULL_NODES
        if state[REFS] + count >= refs.shape[0]:
            state[NEEDED] = state[REFS] + count + 1
            return FULL_REFS
        work -= count + 8
        if cell[IS_LEAF]:
            for k in range(count):
                refs[state[REFS] + k] = aside[first + k]
            write_leaf(nodes, refs, state, node, depth, count)
            state[WAITING] = top
            continue
        for k in range(first, cell[ASIDE_STOP]):
            for axis in range(6):
                boxes[aside[k], axis] = kept[k, axis]
        cell[ASIDE_STOP] = first  # done, should this be the second attempt
        sides = six(cells, top)
        x, y, z = extents(sides)
        best = (NEVER, np.int64(-1), ZERO, ZERO, False)
        if by_cost:
            best = (leaf_cost(count, costs), np.int64(-1), ZERO, ZERO, False)
        if count > few and depth < deepest and area(x, y, z) > 0.0:
            some, after = wanted_axes(sides, depth, axes)
            for axis in range(some, after):
                begin, stop = np.uint64(cell[BEGIN + axis]), np.uint64(cell[STOP + axis])
                low, high = sides[axis], sides[axis + 3]
                if HALF:
                    best = sweep_half(
                        *(events, axis, begin, stop, count, low, high, x, y, z, costs, flat, best),
                        *(boxes, middles),
                    )
                else:
                    best = sweep(
                        *(events, axis, begin, stop, count, low, high, x, y, z, costs, flat, best),
                        ceiling,
                    )
        axis, where, leftward = best[1], best[2], best[4]
        if axis < 0:
            begin, stop = np.uint64(cell[BEGIN]), np.uint64(cell[STOP])
            listed(events, 0, begin, stop, fates, np.uint16(0), refs, state[REFS])
            write_leaf(nodes, refs, state, node, depth, count)
            state[WAITING] = top
            continue

        begin, stop = np.uint64(cell[BEGIN + axis]), np.uint64(cell[STOP + axis])
        across, left = parted(
            events, axis, begin, stop, where, best[3], leftward, fates, aside, first
        )
        right = count - left - across
        depth += 1
        needed = across + 1
        if right <= few or depth >= deepest:
            needed += across + right
        if left < 0 or first + needed > aside.shape[0]:
            state[NEEDED] = first + max(needed, across + 1)
            return FULL_ASIDE
        for k in range(3):
            needed = min(2 * (left + across), cell[STOP + k] - cell[BEGIN + k]) + cell[STOP + k] + 1
            if needed > events.shape[1]:
                state[NEEDED] = needed
                return FULL_EVENTS

        plane = position(where)
        for k in range(6):
            cells[top + 1, k] = cells[top, k]
        cells[top + 1, axis + 3] = plane
        cells[top, axis] = plane
        for k in range(first, first + across):
            in_left, in_right = fitted_to_both(
                *(corners, base, boxes, fates, np.int64(aside[k])),
                *(six(cells, top + 1), six(cells, top), kept, k, room),
            )
            left += in_left
            right += in_right
        child = state[NODES]
        state[NODES] = child + 2
        nodes[node, 0] = np.uint32(child) << np.uint32(2) | np.uint32(axis)
        nodes[node, 1] = np.float32(plane).view(np.uint32)
        left_leaf = left <= few or depth >= deepest
        right_leaf = right <= few or depth >= deepest
        cell[NODE_OF], cell[DEPTH_OF], cell[COUNT], cell[IS_LEAF] = child + 1, depth, right, 0
        cell[ASIDE_STOP] = first + across
        if left_leaf:
            listed(events, axis, begin, stop, fates, np.uint16(1 << 12), refs, state[REFS])
            write_leaf(nodes, refs, state, child, depth, left)
        if right_leaf:
            last = first + across
            cell[ASIDE], cell[ASIDE_STOP], cell[IS_LEAF] = last, last + right, 1
            listed(events, axis, begin, stop, fates, np.uint16(1 << 13), aside, last)
        if not (left_leaf and right_leaf):
            behind = waiting[top + 1]
            behind[NODE_OF], behind[DEPTH_OF] = child, depth
            behind[COUNT], behind[IS_LEAF] = left, 0
            behind[ASIDE] = behind[ASIDE_STOP] = cell[ASIDE_STOP]
            for k in range(3):
                begin, stop = np.uint64(cell[BEGIN + k]), np.uint64(cell[STOP + k])
                ends = end = begin
                if left_leaf:
                    end = pass_on(events, k, begin, stop, fates, 1)
                elif right_leaf:
                    ends = pass_on(events, k, begin, stop, fates, 0)
                else:
                    ends, end = pass_on_both(events, k, begin, stop, fates)
                    begin = stop
                if across > 0 and not left_leaf:
                    n = renewed(k, 0, aside, first, across, fates, boxes, kept, fresh)
                    merged(events, k, begin, ends, fresh, n)
                    ends += np.uint64(n)
                if across > 0 and not right_leaf:
                    n = renewed(k, 1, aside, first, across, fates, boxes, kept, fresh)
                    merged(events, k, np.uint64(cell[BEGIN + k]), end, fresh, n)
                    end += np.uint64(n)
                cell[STOP + k] = np.int64(end)
                behind[BEGIN + k], behind[STOP + k] = np.int64(begin), np.int64(ends)
        if not left_leaf:
            state[WAITING] = top + 2
    return DONE


CALLEES = (
    *(write_leaf, listed, corner, six, extent, extents, wanted_axes, write_box, fitted_to_both),
)
