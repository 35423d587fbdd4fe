"""Rays and triangles by elimination: the second of the oracle's two formulations.

The ray meets the plane where [-dir, v1 - v0, v2 - v0] (t, u, v) = orig - v0. The system is solved
in whole numbers with full pivoting; where it is singular, what is left of the geometry is solved in
fewer unknowns: the plane of the ray, the line of a degenerate triangle, a point. Nothing is shared
with ``side_signs`` but the meaning of the classes, not even the common denominator: here each of
the three equations has its own.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from rtbench.accuracy import cases, rationals
from rtbench.accuracy.rationals import Vector
from rtbench.accuracy.side_signs import Decision

Rows = list[list[int]]


class Solution(NamedTuple):
    """A linear system in whole numbers, eliminated.

    Attributes
    ----------
    rank : int
        Of the columns of unknowns.
    pivot : Integer
        Common denominator of all solutions; 1 where the rank is 0.
    values : list of list
        A list for each right-hand side: numerators of the unknowns, 0 for those left free.
    consistent : list of bool
        For each right-hand side, whether there is a solution at all.
    """

    rank: int
    pivot: int
    values: list[list[int]]
    consistent: list[bool]


def eliminate(rows: Rows, unknowns: int) -> Solution:
    """Solve a linear system exactly, by elimination with full pivoting and without fractions.

    Parameters
    ----------
    rows : list of list of Integer
        Equations; the first columns belong to the unknowns, each other is a right-hand side.
    unknowns : int
        How many.

    Returns
    -------
    Solution

    Source
    ------
    Bareiss 1968: each division by the preceding pivot leaves no rest.
    """
    rows = list(rows)
    columns: list[int] = []
    pivot = before = rationals.Integer(1)
    for step in range(min(len(rows), unknowns)):
        free = [c for c in range(unknowns) if c not in columns]
        places = [(r, c) for r in range(step, len(rows)) for c in free]
        r, c = max(places, key=lambda place: abs(rows[place[0]][place[1]]))
        if rows[r][c] == 0:
            break
        rows[step], rows[r] = rows[r], rows[step]
        top = rows[step]
        pivot = top[c]
        for k, row in enumerate(rows):
            if k != step:
                factor = row[c]
                rows[k] = [
                    (pivot * x - factor * y) // before for x, y in zip(row, top, strict=True)
                ]
        before = pivot
        columns.append(c)
    rank = len(columns)
    sides = range(unknowns, len(rows[0]))
    values = [[rationals.Integer(0)] * unknowns for _ in sides]
    for row, c in zip(rows, columns, strict=False):
        for side, value in zip(sides, values, strict=True):
            value[c] = row[side]
    consistent = [all(row[side] == 0 for row in rows[rank:]) for side in sides]
    return Solution(rank, pivot, values, consistent)


def _equation(v0: float, v1: float, v2: float, o: float, d: float) -> list[int]:
    """Return one axis's equation times a common denominator: -d, e1, e2 and the right side."""
    ratios = [x.as_integer_ratio() for x in (v0, v1, v2, o, d)]
    common = math.lcm(*[below for _, below in ratios])
    v0, v1, v2, o, d = (rationals.Integer(above * (common // below)) for above, below in ratios)
    return [-d, v1 - v0, v2 - v0, o - v0]


def decide(v0: Vector, v1: Vector, v2: Vector, orig: Vector, dir: Vector) -> Decision:
    """Decide exactly how a ray, t > 0, meets a triangle; as `side_signs.decide`.

    Parameters
    ----------
    v0, v1, v2 : three numbers
        The triangle; u is the weight of v1, v of v2.
    orig, dir : three numbers
        The ray, its direction used as given.

    Returns
    -------
    Decision
        A class of ``cases``; t, u and v as ratios.
    """
    try:
        rows = [_equation(*axis) for axis in zip(v0, v1, v2, orig, dir, strict=True)]
    except (ValueError, OverflowError):  # infinite or not a number
        return Decision(cases.INVALID)
    if all(row[0] == 0 for row in rows):
        return Decision(cases.INVALID)
    found = eliminate(rows, 3)
    if found.rank < 3:
        return Decision(_singular(rows, found.consistent[0]))
    below, (t, u, v) = found.pivot, found.values[0]
    if below < 0:
        below, t, u, v = -below, -t, -u, -v
    return Decision(_regular(t, u, v, below), (t, below), (u, below), (v, below))


def _regular(t: int, u: int, v: int, below: int) -> int:
    """Return the class of a point of the plane; t, u and v over a positive denominator."""
    if u < 0 or v < 0 or u + v > below:
        return cases.MISS
    if t <= 0:
        return cases.BEHIND if t < 0 else cases.ORIGIN_ON
    if u == below or v == below or u == v == 0:
        return cases.HIT_VERTEX
    if u == 0 or v == 0 or u + v == below:
        return cases.HIT_EDGE
    return cases.HIT_INTERIOR


def _singular(rows: Rows, consistent: bool) -> int:
    """Return the class where direction and edges span no more than a plane."""
    # In the plane's own coordinates: where is the origin, and where does the direction point?
    plane = eliminate([[e1, e2, s, -minus_d] for minus_d, e1, e2, s in rows], 2)
    if plane.rank == 2:
        if not consistent:
            return cases.PARALLEL
        origin, direction = plane.values
        if plane.pivot < 0:
            origin, direction = ([-x for x in vector] for vector in (origin, direction))
        touched = _clipped(origin, direction, abs(plane.pivot))
        return cases.COPLANAR_TOUCH if touched else cases.COPLANAR_MISS
    return cases.DEGENERATE_TOUCH if _on_line(rows) else cases.DEGENERATE_MISS


def _clipped(origin: Sequence[int], direction: Sequence[int], one: int) -> bool:
    """Tell whether a ray, t >= 0, meets the triangle u >= 0, v >= 0, u + v <= one > 0."""
    (u, v), (du, dv) = origin, direction
    # The interval of t as ratios with positive denominators; (1, 0) is infinity.
    near, far = (0, 1), (1, 0)
    for inside, change in ((u, du), (v, dv), (one - u - v, -du - dv)):
        if change == 0:
            if inside < 0:
                return False
        elif change > 0:
            near = near if near[0] * change >= -inside * near[1] else (-inside, change)
        else:
            far = far if far[0] * -change <= inside * far[1] else (inside, -change)
    return near[0] * far[1] <= far[0] * near[1]


def _on_line(rows: Rows) -> bool:
    """Tell whether a ray, t >= 0, touches the segment or point that the triangle has become."""
    span = 1 if any(row[1] for row in rows) else 2  # the edge from v0 that is not zero, if one is
    if not any(row[span] for row in rows):
        point = eliminate([[minus_d, s] for minus_d, _, _, s in rows], 1)
        return point.consistent[0] and point.values[0][0] * point.pivot >= 0

    # The vertices lie at 0, at 1 and where the other edge ends, in units of the one that spans.
    edges = eliminate([[row[span], row[3 - span]] for row in rows], 1)
    one, end = abs(edges.pivot), edges.values[0][0] * (1 if edges.pivot > 0 else -1)
    low, high = min(0, end), max(one, end)

    found = eliminate([[row[0], row[span], row[3]] for row in rows], 2)
    if not found.consistent[0]:
        return False
    t, place = found.values[0]
    if found.rank == 2:
        below = abs(found.pivot)
        if found.pivot < 0:
            t, place = -t, -place
        return t >= 0 and low * below <= place * one <= high * below

    # The ray runs along the line: it misses only what lies behind it.
    line = eliminate([[row[span], row[3], -row[0]] for row in rows], 1)
    (start,), (direction,) = line.values
    if line.pivot < 0:
        start, direction = -start, -direction
    start *= one
    below = abs(line.pivot)
    return start <= high * below if direction > 0 else start >= low * below
