"""What the builders share in judging a plane: which are allowed, and what each costs.

Plain functions that go into compiled code. ``cell`` is the six bounds of a cell, float32. A plane's
side says where triangles that lie in it go: 0 left, 1 right.
"""

import numpy as np

from rtbench.trees.cost import split_cost

ALL, LONGEST, ROUND_ROBIN = 0, 1, 2  # of axes
NEVER = np.float64(np.inf)

CONSTANTS = {"NEVER": "float64(np.inf)", "BINS": "int64(32)", "PAIRS": "int64(1 << 29)"}


def extent(cell, axis):
    """Return a cell's extent along an axis, float64."""
    if axis == 0:
        return np.float64(cell[3]) - np.float64(cell[0])
    if axis == 1:
        return np.float64(cell[4]) - np.float64(cell[1])
    return np.float64(cell[5]) - np.float64(cell[2])


def extents(cell):
    """Return a cell's extents, three float64."""
    return extent(cell, 0), extent(cell, 1), extent(cell, 2)


def wanted_axes(cell, depth, axes):
    """Return the first axis to look at, and the one after the last."""
    if axes == 0:
        return 0, 3
    if axes == 2:
        return depth % 3, depth % 3 + 1
    x, y, z = extents(cell)
    longest = 0
    if y > x:
        longest = 1
    if z > max(x, y):
        longest = 2
    return longest, longest + 1


def judge(low, high, size, axis, plane, below, beyond, planar, count, flat, model):
    """Return what a plane costs, and on which side what lies in it goes.

    Parameters
    ----------
    low, high : float32
        The cell's bounds along the axis.
    size : tuple of 3 float64
        The cell's extents.
    axis : int
    plane : float32
    below, beyond, planar : int
        How many references begin below it, end beyond it, lie in it.
    count : int
        How many references the cell has.
    flat : bool
        Whether what lies in a side of the cell may be cut off.
    model : tuple of 4 float64
        See `rtbench.trees.cost`.

    Returns
    -------
    cost : float64
        NEVER for a plane that is not allowed.
    side : int
    """
    x, y, z = size
    left = np.float64(plane) - np.float64(low)
    within = low < plane and plane < high
    at_side = flat and planar > 0 and planar < count and low < high
    cost, side = NEVER, 0
    if within or (at_side and plane == low):
        cost = split_cost(x, y, z, axis, left, below + planar, beyond, model)
    if planar > 0 and (within or (at_side and plane == high)):
        other = split_cost(x, y, z, axis, left, below, beyond + planar, model)
        if other < cost:
            cost, side = other, 1
    return cost, side


def count_at(held, begin, count, axis, plane):
    """Return how many references begin below a plane, end beyond it, and lie in it."""
    below = beyond = planar = 0
    for i in range(begin, begin + count):
        low, high = held[i, axis], held[i, axis + 3]
        below += low < plane
        beyond += high > plane
        planar += (low == plane) & (high == plane)
    return below, beyond, planar


CALLEES = (extent, extents, wanted_axes, judge, count_at)
