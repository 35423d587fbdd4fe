"""The exact SAH in O(N log² N): the bounds of a cell's triangles are sorted in each node.

Instead of one list of events of three kinds there are sorted lists of where boxes begin, where
they end, and where flat ones lie: what a plane has on either side is how far each has been read.

Source: Wald & Havran 2006, section 4.2; MacDonald & Booth 1990
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtbench.trees.builders import per_node, planes, sorting
from rtbench.trees.builders.planes import extents, judge, wanted_axes
from rtbench.trees.builders.sorting import lower_median, sort_numbers
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import KdTree
from rtbench.trees.options import Options

NEVER = planes.NEVER


def bounds_of(held, begin, count, axis, floats, room):
    """Write a cell's begins to floats[:], ends to floats[room:], flat ones to floats[2 * room:].

    Returns how many are flat; nothing is sorted yet.
    """
    flats = 0
    for i in range(count):
        low, high = held[begin + i, axis], held[begin + i, axis + 3]
        floats[i] = low
        floats[room + i] = high
        if low == high:
            floats[2 * room + flats] = low
            flats += 1
    return flats


def nearer_bounds(count, floats, room, doubles):
    """Write to floats[3 * room:] of each box the side nearer to the object median.

    Source: Havran 2000, section 4.2: half of the candidates
    """
    for i in range(count):
        doubles[i] = (np.float64(floats[i]) + np.float64(floats[room + i])) * 0.5
    median = lower_median(doubles, count)
    for i in range(count):
        low, high = np.float64(floats[i]), np.float64(floats[room + i])
        nearer = abs(low - median) <= abs(high - median)
        floats[3 * room + i] = floats[i] if nearer else floats[room + i]


def sweep(
    low,
    high,
    size,
    axis,
    count,
    starts,
    ends,
    flats,
    below,
    beyond,
    floats,
    room,
    half,
    flat,
    model,
):
    """Return cost, position and side of the best plane of one axis; the lowest of equal ones.

    Parameters
    ----------
    low, high, size, axis, count, flat, model
        See `rtbench.trees.builders.planes.judge`.
    starts, ends, flats : int
        How many there are in ``floats``, sorted: starts first, ends from ``room`` on, flat boxes
        from ``2 * room`` on.
    below, beyond : int
        How many references begin below them all, and how many do not end below them all.
    half : bool
        Whether only planes from ``3 * room`` on are meant, ``count`` sorted ones.
    """
    best, position, best_side = NEVER, np.float32(0), 0
    i = j = k = c = 0
    while i < starts or j < ends:
        plane = floats[i] if i < starts else floats[room + j]
        if j < ends and floats[room + j] < plane:
            plane = floats[room + j]
        planar = 0
        while j < ends and floats[room + j] == plane:
            j += 1
        while k < flats and floats[2 * room + k] == plane:
            k += 1
            planar += 1
        asked = True
        if half:
            while c < count and floats[3 * room + c] < plane:
                c += 1
            asked = c < count and floats[3 * room + c] == plane
        if asked:
            cost, side = judge(
                low, high, size, axis, plane, below + i, beyond - j, planar, count, flat, model
            )
            if cost < best:
                best, position, best_side = cost, plane, side
        while i < starts and floats[i] == plane:
            i += 1
    return best, position, best_side


def sorted_plane(held, begin, count, depth, cell, choice, model, floats, doubles):
    """Return cost, axis (-1: none), position and side of a cell's best plane."""
    room = floats.shape[0] // 5
    best, best_axis, position, best_side = NEVER, -1, np.float32(0), 0
    first, last = wanted_axes(cell, depth, choice[0])
    size, half = extents(cell), choice[1] != 0
    for axis in range(first, last):
        low, high = cell[axis], cell[axis + 3]
        if low < high:
            flats = bounds_of(held, begin, count, axis, floats, room)
            if half:
                nearer_bounds(count, floats, room, doubles)
                sort_numbers(floats, 3 * room, count, 4 * room)
            sort_numbers(floats, 0, count, 4 * room)
            sort_numbers(floats, room, count, 4 * room)
            sort_numbers(floats, 2 * room, flats, 4 * room)
            flat = choice[2] != 0
            cost, plane, side = sweep(
                low,
                high,
                size,
                axis,
                count,
                count,
                count,
                flats,
                0,
                count,
                floats,
                room,
                half,
                flat,
                model,
            )
            if cost < best:
                best, best_axis, position, best_side = cost, axis, plane, side
    return best, best_axis, position, best_side


CALLEES: tuple[Callable, ...] = (
    *sorting.CALLEES,
    *planes.CALLEES,
    bounds_of,
    nearer_bounds,
    sweep,
    sorted_plane,
)


def find_plane(held, begin, count, depth, cell, choice, model, floats, doubles, unfinished):
    """Find the best plane of a cell: see `rtbench.trees.builders.per_node`."""
    return sorted_plane(held, begin, count, depth, cell, choice, model, floats, doubles)


def build(
    geometry: Geometry, options: Options, progress: Callable[[float], None] | None = None
) -> KdTree:
    """Build a k-d tree with sorting in each node: see `rtbench.trees.building.build`."""
    return per_node.build(find_plane, CALLEES, geometry, options, progress)
