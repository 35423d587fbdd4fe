"""The exact SAH in O(N²), as first written: at every candidate all triangles are counted.

Šilhavý 2010, section 4.1.2, gave it up for its "extreme times" (equal positions are counted anew
too, as he does). It is what the faster builders are checked against, and what they save.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.trees.builders import per_node, planes, sorting
from rtbench.trees.builders.cells import UNFINISHED
from rtbench.trees.builders.nlog2n import bounds_of, nearer_bounds
from rtbench.trees.builders.planes import extents, judge, wanted_axes
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import KdTree
from rtbench.trees.options import Options

NEVER = planes.NEVER
MOST = 100_000
SECONDS_PER_SQUARE = 5e-9  # of the number of triangles: 25 s for 69,451 on one core of 2023
PAIRS = np.int64(1) << 29  # counted in a call: some tenths of a second


def count_all(floats, room, count, plane):
    """Return how many references begin below a plane, end beyond it, and lie in it."""
    below = beyond = planar = np.int32(0)
    for i in range(count):
        low, high = floats[i], floats[room + i]
        # Numbers of 32 bits, so that twice as many are added at once.
        below = np.int32(below + np.int32(low < plane))
        beyond = np.int32(beyond + np.int32(high > plane))
        planar = np.int32(planar + np.int32((low >= plane) & (high <= plane)))
    return np.int64(below), np.int64(beyond), np.int64(planar)


def find_plane(held, begin, count, depth, cell, choice, model, floats, doubles, unfinished):
    """Find the best plane of a cell: see `rtbench.trees.builders.per_node`."""
    room = floats.shape[0] // 5
    first, last = wanted_axes(cell, depth, choice[0])
    size, half, work = extents(cell), choice[1] != 0, PAIRS
    if unfinished[0] == 0.0:
        unfinished[0], unfinished[1], unfinished[2] = 1.0, first, 0.0
        unfinished[3], unfinished[4] = NEVER, -1.0
    axis, at = np.int64(unfinished[1]), np.int64(unfinished[2])
    best, best_axis = unfinished[3], np.int64(unfinished[4])
    position, best_side = np.float32(unfinished[5]), np.int64(unfinished[6])
    while axis < last:
        low, high = cell[axis], cell[axis + 3]
        if at == 0:
            bounds_of(held, begin, count, axis, floats, room)
            if half:
                nearer_bounds(count, floats, room, doubles)
        while at < 2 * count and low < high:
            if work < 0:
                unfinished[1], unfinished[2], unfinished[3] = axis, at, best
                unfinished[4], unfinished[5], unfinished[6] = best_axis, position, best_side
                return NEVER, UNFINISHED, np.float32(0), 0
            i = at if at < count else at - count
            plane = floats[i] if at < count else floats[room + i]
            at += 1
            if half and floats[3 * room + i] != plane:
                continue
            work -= count
            below, beyond, planar = count_all(floats, room, count, plane)
            cost, side = judge(
                low, high, size, axis, plane, below, beyond, planar, count, choice[2] != 0, model
            )
            lower = best_axis == axis and cost == best and plane < position
            if cost < best or lower:
                best, best_axis, position, best_side = cost, axis, plane, side
        axis += 1
        at = 0
    unfinished[0] = 0.0
    return best, best_axis, position, best_side


CALLEES = (*sorting.CALLEES, *planes.CALLEES, bounds_of, nearer_bounds, count_all)


def build(
    geometry: Geometry, options: Options, progress: Callable[[float], None] | None = None
) -> KdTree:
    """Build a k-d tree by counting all triangles at all planes: see `rtbench.trees.building.build`.

    Raises
    ------
    RtbenchError
        For more than MOST triangles.
    """
    count = len(geometry)
    if count > MOST:
        minutes = SECONDS_PER_SQUARE * count**2 / 60
        raise RtbenchError(
            f"builder n2 counts {count:,} triangles at {6 * count:,} planes in the first cell alone"
            f", about {minutes:,.0f} minutes in all (allowed: {MOST:,} triangles); "
            "nlogn gives the same tree"
        )
    return per_node.build(find_plane, CALLEES, geometry, options, progress)
