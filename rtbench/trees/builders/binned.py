"""The SAH for speed: a histogram of starts and ends in large cells, sorted bounds in small ones.

In a large cell the planes between 32 bins per axis are compared, and the two ends of what is in
it; the bins lie between these ends. The bounds in the two bins beside the best plane are then
sorted and compared exactly; and, where none of them would pay, and in small cells, all bounds.

Source: Hunt, Mark & Stoll 2006; Popov et al. 2006; Shevtsov, Soupikov & Kapustin 2007
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtbench.trees.builders import nlog2n, per_node, planes
from rtbench.trees.builders.nlog2n import sorted_plane, sweep
from rtbench.trees.builders.planes import extents, judge, wanted_axes
from rtbench.trees.builders.sorting import sort_numbers
from rtbench.trees.cost import leaf_cost
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import KdTree
from rtbench.trees.options import Options

NEVER = planes.NEVER
BINS = np.int64(32)
SMALL = 32  # cells of so few references are small


def reach_of(held, begin, count, axis):
    """Return the least begin and the greatest end along an axis."""
    low, high = held[begin, axis], held[begin, axis + 3]
    for at in range(begin + 1, begin + count):
        low, high = min(low, held[at, axis]), max(high, held[at, axis + 3])
    return low, high


def fill_bins(held, begin, count, axis, least, scale, bins):
    """Count in ``bins[:BINS]`` where boxes begin, in ``bins[BINS:]`` where they end."""
    for k in range(2 * BINS):
        bins[k] = 0
    last = BINS - np.int64(1)
    for at in range(begin, begin + count):
        low, high = held[at, axis], held[at, axis + 3]
        bins[min(np.int64((low - least) * scale), last)] += 1
        bins[BINS + min(np.int64((high - least) * scale), last)] += 1


def between_bins(least, wide, k):
    """Return where the k-th bin begins, float32."""
    return np.float32(np.float64(least) + wide * (np.float64(k) / np.float64(BINS)))


def binned_plane(held, begin, count, depth, cell, choice, model, bins):
    """Return the axis of the best plane between bins (-1: none), and the bins beside it."""
    best, best_axis, lower, upper = NEVER, -1, np.float32(0), np.float32(0)
    first, last = wanted_axes(cell, depth, choice[0])
    size = extents(cell)
    for axis in range(first, last):
        low, high = cell[axis], cell[axis + 3]
        least, most = reach_of(held, begin, count, axis)
        if not least < most:
            continue
        wide = np.float64(most) - np.float64(least)
        fill_bins(held, begin, count, axis, least, np.float32(np.float64(BINS) / wide), bins)
        below, beyond = 0, count
        for k in range(BINS + 1):
            plane = between_bins(least, wide, k) if k < BINS else most
            if k == BINS:
                beyond = 0
            cost, _ = judge(low, high, size, axis, plane, below, beyond, 0, count, False, model)
            if cost < best:
                best, best_axis = cost, axis
                lower = between_bins(least, wide, max(k - 1, 0))
                upper = between_bins(least, wide, k + 1) if k + 1 < BINS else most
            if k < BINS:
                below += bins[k]
                beyond -= bins[BINS + k]
    return best_axis, lower, upper


def refined_plane(held, begin, count, cell, axis, lower, upper, flat, model, floats):
    """Return cost, position and side of the best plane from ``lower`` to ``upper``."""
    room = floats.shape[0] // 5
    starts = ends = flats = below = 0
    beyond = count
    for at in range(begin, begin + count):
        low, high = held[at, axis], held[at, axis + 3]
        below += low < lower
        beyond -= high < lower
        if lower <= low and low <= upper:
            floats[starts] = low
            starts += 1
            if low == high:
                floats[2 * room + flats] = low
                flats += 1
        if lower <= high and high <= upper:
            floats[room + ends] = high
            ends += 1
    sort_numbers(floats, 0, starts, 4 * room)
    sort_numbers(floats, room, ends, 4 * room)
    sort_numbers(floats, 2 * room, flats, 4 * room)
    size, low, high = extents(cell), cell[axis], cell[axis + 3]
    return sweep(
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
        False,
        flat,
        model,
    )


def find_plane(held, begin, count, depth, cell, choice, model, floats, doubles, unfinished):
    """Find a good plane of a cell: see `rtbench.trees.builders.per_node`."""
    if count > choice[3]:
        axis, lower, upper = binned_plane(held, begin, count, depth, cell, choice, model, doubles)
        if axis >= 0:
            flat = choice[2] != 0
            cost, position, side = refined_plane(
                held, begin, count, cell, axis, lower, upper, flat, model, floats
            )
            if cost < leaf_cost(count, model):
                return cost, axis, position, side
    return sorted_plane(held, begin, count, depth, cell, choice, model, floats, doubles)


CALLEES = (*nlog2n.CALLEES, reach_of, fill_bins, between_bins, binned_plane, refined_plane)


def build(
    geometry: Geometry, options: Options, progress: Callable[[float], None] | None = None
) -> KdTree:
    """Build a k-d tree with bins in large cells: see `rtbench.trees.building.build`.

    Half of the candidates are meant in small cells only.
    """
    return per_node.build(find_plane, CALLEES, geometry, options, progress, own=SMALL)
