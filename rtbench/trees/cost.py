"""The cost model: what a ray is expected to pay for a cell, split or not.

Plain functions that every builder compiles in. All in float64, of float32 coordinates: builders
that find the same counts find the same cost, bit for bit, and so the same tree. ``model`` is
(K_T, K_I, bonus, block) as float64, see `model`: given when a tree is built, not compiled in.

Source: MacDonald & Booth 1990; Šilhavý 2010, section 3.3.3, equations 3.3 to 3.8; Wald & Havran
2006 for planar triangles and the bonus for empty sides.
"""

from __future__ import annotations

import math

from rtbench.trees.options import Options


def area(x, y, z):
    """Return half the surface of a box of these extents (equation 3.4: halves cancel)."""
    return x * y + y * z + z * x


def blocks(count, model):
    """Return how many tests at a time it takes to test so many triangles."""
    if model[3] == 1.0:
        return float(count)
    return math.ceil(float(count) / model[3])


def leaf_cost(count, model):
    """Return what a leaf costs (equation 3.8, right side)."""
    return model[1] * blocks(count, model)


def split_cost(x, y, z, axis, below, left, right, model):
    """Return what a cell of extents x, y, z costs when it is cut (equation 3.7).

    ``below`` is the extent of the left cell along ``axis``; ``left`` and ``right`` are how many
    triangles lie on either side. All extents are float64; the cell's area must not be 0.
    """
    if axis == 0:
        a, b = area(below, y, z), area(x - below, y, z)
    elif axis == 1:
        a, b = area(x, below, z), area(x, y - below, z)
    else:
        a, b = area(x, y, below), area(x, y, z - below)
    tests = (a * blocks(left, model) + b * blocks(right, model)) / area(x, y, z)
    if left == 0 or right == 0:
        tests *= model[2]
    return model[0] + model[1] * tests


CALLEES = (area, blocks, leaf_cost, split_cost)


def model(options: Options) -> tuple[float, float, float, float]:
    """Return K_T, K_I, the bonus and the block of these options as the functions above take it."""
    return (
        float(options.traversal_cost),
        float(options.intersection_cost),
        float(options.empty_bonus),
        float(options.block),
    )
