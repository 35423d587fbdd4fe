"""The best plane of a cell whose events are in order: one pass over each axis, nothing sorted.

Plain functions that go into compiled code; what they take and return, see `sweep`.
"""

import numpy as np

from rtbench.trees.builders.events import END, ONE, PLANAR, START, TRIANGLE, ordered, position
from rtbench.trees.builders.sorting import lower_median
from rtbench.trees.cost import split_cost

NEVER = np.float64(np.inf)
CONSTANTS = {"NEVER": "float64(np.inf)"}  # of the generated module


def bound(cost, size, model):
    """Return a sum of area times blocks from which on no plane costs less than ``cost``."""
    return (cost - model[0]) / model[1] * size * (1.0 + 1e-12)


def sweep(events, axis, begin, end, count, low, high, x, y, z, model, flat, best, ceiling):
    """Return the cheapest plane of an axis, or the best one so far if none is cheaper.

    Every event is judged as if it were the only one at its place, with what ends there taken off
    and what starts there not yet added: events of one place cost the more the fewer of them were
    counted, so the least of them is what the place costs, and needs no look ahead. Only planar
    events are gathered. The cost itself, with its division, is computed where the sum in it is
    less than any before.

    Parameters
    ----------
    events : (3, capacity) uint64 array
    axis : int
    begin, end : uint64
        The cell's events on this axis.
    count : int64
        How many references it has.
    low, high, x, y, z : float64
        Where it begins and ends on this axis, and its three extents; of some surface.
    model : tuple of 4 float64
        See `rtbench.trees.cost`.
    flat : bool
        Whether planar references in a side of the cell may be cut off.
    best : (float64, int64, uint64, uint64, bool)
        What the best plane so far costs, its axis, place, an event no later than its first
        planar one and no earlier than the last before, and whether planar ones go left.
    ceiling : tuple of 2 int64
        a and m with blocks(n) = (n + a) * m >> 36.

    Returns
    -------
    The same of the best plane now.
    """
    cost, found, where, at, leftward = best
    pad, times = ceiling
    # Area of a part of extent e: e * p + c + e * q, where area() adds c last on axis 1.
    p, q, c, last = y, z, y * z, 0.0
    if axis == 1:
        p, q, c, last = x, z, 0.0, z * x
    elif axis == 2:
        p, q, c = y, x, x * y
    size = x * y + y * z + z * x
    extent = high - low
    limit = bound(cost, size, model)
    left, right = np.int64(0), count
    i = begin
    first, stop = ordered(low) << np.uint64(32), ordered(high) << np.uint64(32)
    if events[axis, i] < first | START << np.uint64(30):  # planar in the lower side
        while i < end and events[axis, i] < first | START << np.uint64(30):
            left += 1
            i += ONE
        right -= left
        if flat and left < count and extent > 0.0:
            judged = split_cost(x, y, z, axis, 0.0, left, right, model)
            if judged < cost:
                cost, found, where, at, leftward = judged, axis, ordered(low), begin, True
                limit = bound(cost, size, model)
    while i < end and events[axis, i] < first + (ONE << np.uint64(32)):
        left += 1
        i += ONE
    while i < end:
        key = events[axis, i]
        if key >= stop:
            break
        kind = key >> np.uint64(30) & np.uint64(3)
        below = position(key >> np.uint64(32)) - low
        if kind == PLANAR:
            planar = np.int64(0)
            start = i
            while i < end and events[axis, i] >> np.uint64(30) == key >> np.uint64(30):
                planar += 1
                i += ONE
            right -= planar
            judged = split_cost(x, y, z, axis, below, left + planar, right, model)
            other = split_cost(x, y, z, axis, below, left, right + planar, model)
            # What ends here may have been taken for a plane already, as if planar went right.
            same = found == axis and where == key >> np.uint64(32)
            left += planar
            if judged < cost or (judged == cost and same):
                cost, found, where, at, leftward = judged, axis, key >> np.uint64(32), start, True
                limit = bound(cost, size, model)
            if other < cost:
                cost, found, where, at, leftward = other, axis, key >> np.uint64(32), start, False
                limit = bound(cost, size, model)
            continue
        starts = np.int64(kind >> ONE)
        right -= 1 - starts
        beyond = extent - below
        lower = below * p + c + below * q + last
        upper = beyond * p + c + beyond * q + last
        tests = lower * np.float64((left + pad) * times >> 36)
        tests += upper * np.float64((right + pad) * times >> 36)
        if tests < limit or left == 0 or right == 0:
            judged = split_cost(x, y, z, axis, below, left, right, model)
            if judged < cost:
                cost, found, where, at = judged, axis, key >> np.uint64(32), i
                leftward = starts != 0
                limit = bound(cost, size, model)
            if left > 0 and right > 0 and tests < limit:
                limit = tests
        left += starts
        i += ONE
    if flat and i < end and extent > 0.0:
        planar = np.int64(0)
        i = end
        while i > begin and events[axis, i - ONE] >= stop | PLANAR << np.uint64(30):
            planar += 1  # in the upper side
            i -= ONE
        if planar > 0 and planar < count:
            judged = split_cost(x, y, z, axis, extent, count - planar, planar, model)
            if judged < cost:
                cost, found, where, at, leftward = judged, axis, ordered(high), i, False
    return cost, found, where, at, leftward


def nearer_median(boxes, triangle, axis, median):
    """Return 0 if a box's lower side is the nearer to the median, or as near; 1 if its upper."""
    low, high = np.float64(boxes[triangle, axis]), np.float64(boxes[triangle, axis + 3])
    return 0 if abs(low - median) <= abs(high - median) else 1


def object_median(events, axis, begin, end, boxes, middles):
    """Return the lower median of the middles of a cell's boxes on an axis, by a selection."""
    n = 0
    for i in range(begin, end):
        key = events[axis, i]
        if key >> np.uint64(30) & np.uint64(3) != END:
            low, high = boxes[key & TRIANGLE, axis], boxes[key & TRIANGLE, axis + 3]
            middles[n] = (np.float64(low) + np.float64(high)) * 0.5
            n += 1
    return lower_median(middles, n)


def sweep_half(
    events, axis, begin, end, count, low, high, x, y, z, model, flat, best, boxes, middles
):
    """Do what `sweep` does for half of the candidates: of each box one side.

    Source: Havran 2000, section 4.2; Šilhavý 2010, section 3.3.3
    """
    cost, found, where, at, leftward = best
    median = object_median(events, axis, begin, end, boxes, middles)
    left, right = np.int64(0), count
    i = begin
    while i < end:
        start, place = i, events[axis, i] >> np.uint64(32)
        planar, starts, wanted = np.int64(0), np.int64(0), False
        while i < end and events[axis, i] >> np.uint64(32) == place:
            kind = events[axis, i] >> np.uint64(30) & np.uint64(3)
            nearer = nearer_median(boxes, events[axis, i] & TRIANGLE, axis, median)
            wanted |= kind == PLANAR or (kind == START) == (nearer == 0)
            planar += kind == PLANAR
            starts += kind == START
            right -= kind != START
            i += ONE
        plane = position(place)
        inner = low < plane and plane < high
        in_side = flat and planar > 0 and planar < count and low < high and not inner
        if wanted and (inner or (in_side and plane == low)):
            judged = split_cost(x, y, z, axis, plane - low, left + planar, right, model)
            if judged < cost:
                cost, found, where, at, leftward = judged, axis, place, start, True
        if wanted and ((inner and planar > 0) or (in_side and plane == high)):
            judged = split_cost(x, y, z, axis, plane - low, left, right + planar, model)
            if judged < cost:
                cost, found, where, at, leftward = judged, axis, place, start, False
        left += planar + starts
    return cost, found, where, at, leftward


CALLEES = (bound, sweep, lower_median, nearer_median, object_median, sweep_half)
