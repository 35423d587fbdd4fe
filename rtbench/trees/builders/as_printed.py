"""Šilhavý's algorithm 3 as printed, a labelled baseline: no triangle lies in a plane.

Read literally, at one position it takes starts first, then ends; it takes the ends from the right,
asks for the cost, and adds the starts to the left. In which order it takes them is harmless, since
the cost is asked for between: triangles that merely abut on a plane are counted right, and where
none is flat this is the tree of nlog2n. But one that lies in the plane is counted on neither side,
so planes full of triangles look free; and as it has no side, his test of boxes puts it into both
cells. Planes in the sides of a cell (flat_cells) it does not know.

Source: Šilhavý 2010, section 4.1.2, algorithm 3
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtbench.trees.builders import per_node, planes, sorting
from rtbench.trees.builders.nlog2n import bounds_of, nearer_bounds
from rtbench.trees.builders.planes import extents, judge, wanted_axes
from rtbench.trees.builders.sorting import sort_numbers
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import KdTree
from rtbench.trees.options import Options

NEVER = planes.NEVER


def sweep_as_printed(low, high, size, axis, count, floats, room, half, model):
    """Return cost and position of the best plane of one axis."""
    best, position = NEVER, np.float32(0)
    left, right = 0, count
    i = j = c = 0
    while j < count:
        plane = floats[room + j]
        if i < count and floats[i] < plane:
            plane = floats[i]
        starts = ends = 0
        while i < count and floats[i] == plane:
            starts += 1
            i += 1
        while j < count and floats[room + j] == plane:
            ends += 1
            j += 1
        right -= ends
        asked = True
        if half:
            while c < count and floats[3 * room + c] < plane:
                c += 1
            asked = c < count and floats[3 * room + c] == plane
        if asked:
            cost, _ = judge(low, high, size, axis, plane, left, right, 0, count, False, model)
            if cost < best:
                best, position = cost, plane
        left += starts
    return best, position


def find_plane(held, begin, count, depth, cell, choice, model, floats, doubles, unfinished):
    """Find the best plane of a cell: see `rtbench.trees.builders.per_node`."""
    room = floats.shape[0] // 5
    best, best_axis, position = NEVER, -1, np.float32(0)
    first, last = wanted_axes(cell, depth, choice[0])
    size, half = extents(cell), choice[1] != 0
    for axis in range(first, last):
        bounds_of(held, begin, count, axis, floats, room)
        if half:
            nearer_bounds(count, floats, room, doubles)
            sort_numbers(floats, 3 * room, count, 4 * room)
        sort_numbers(floats, 0, count, 4 * room)
        sort_numbers(floats, room, count, 4 * room)
        low, high = cell[axis], cell[axis + 3]
        cost, plane = sweep_as_printed(low, high, size, axis, count, floats, room, half, model)
        if cost < best:
            best, best_axis, position = cost, axis, plane
    return best, best_axis, position, 0


CALLEES = (*sorting.CALLEES, *planes.CALLEES, bounds_of, nearer_bounds, sweep_as_printed)


def build(
    geometry: Geometry, options: Options, progress: Callable[[float], None] | None = None
) -> KdTree:
    """Build a k-d tree as printed: see `rtbench.trees.building.build`; flat_cells has no effect."""
    return per_node.build(find_plane, CALLEES, geometry, options, progress, planar_in_both=True)
