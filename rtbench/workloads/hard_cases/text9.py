"""The borders of Havel's Text 9, which compares sign bits: where one of its numbers is a zero.

t is tested by the sign bits of T and det tmax - T, the point by those of U, V and det - U - V. So a
-0 counts as negative, a triangle whose numerators are all 0 is "hit", and a tmax of infinity times
a determinant of 0 is NaN, of either sign.
"""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    alone,
    reordered,
    spread,
)
from rtbench.workloads.hard_cases.symmetry import signed_zeros, turned

SOURCE = "Havel 2008, Text 9"
KINDS = (
    "zero weight: the ray meets an edge",
    "two zero weights: the ray meets a corner",
    "zero T: the ray starts in the plane",
    "zero determinant: the ray is parallel to the plane",
    "zero determinant and T: the ray lies in the plane",
    "all zero: the triangle is a line",
    "all zero: the triangle is a point",
)
EDGE, CORNER, START, PARALLEL, COPLANAR, LINE, POINT = range(len(KINDS))


def text9(random: Random, form: Format, n: int) -> Geometry:
    """Zeros of either sign among T, U, V and the determinant; small numbers, all exact.

    Float64's own are the same times 1 + 2^-30, which no float32 holds.
    """
    kind = spread(range(len(KINDS)), n).astype(int)
    triangles = np.zeros((n, 3, 3))
    triangles[:, 1, 0], triangles[:, 2, 1] = 4, 4
    triangles[:, :, 2] = random.integers(-1, 2, (n, 1))
    # On u = 0, v = 0, w = 0; in a corner; inside.
    edge = np.array([[0, 2], [1, 0], [3, 1]])[random.integers(3, size=n)]
    corner = np.array([[0, 0], [4, 0], [0, 4]])[random.integers(3, size=n)]
    inside = np.array([[1, 1], [2, 1], [1, 2]])[random.integers(3, size=n)]
    spot = np.where((kind == EDGE)[:, None], edge, inside)
    spot = np.where((kind == CORNER)[:, None], corner, spot)
    height = random.choice([-3.0, -2, 2, 3], n)
    height[np.isin(kind, (START, COPLANAR))] = 0
    origins = np.column_stack([spot, triangles[:, 0, 2] + height])
    directions = np.zeros((n, 3))
    directions[:, 2] = -np.sign(height) * random.choice([1, 2], n)
    directions[kind == START, 2] = random.choice([-1, 1], (kind == START).sum())
    flat = np.isin(kind, (PARALLEL, COPLANAR))
    ways = np.array([[1.0, 0, 0], [0, 1, 0], [1, 1, 0], [-1, 2, 0]])
    directions[flat] = ways[random.integers(len(ways), size=flat.sum())]
    line = kind == LINE
    triangles[line, 2] = triangles[line, 0] + (triangles[line, 1] - triangles[line, 0]) * 2
    triangles[kind == POINT] = triangles[kind == POINT, :1]
    # Through the line, past it, or through its extension; through the point or past it.
    place = random.integers(3, size=n)
    origins[line, :2] = np.array([[4, 0], [4, 1], [12, 0]])[place[line]]
    point = kind == POINT
    origins[point, :2] = np.array([[0, 0], [1, 0], [1, 2]])[place[point]]
    if form.bits > 24:
        triangles, origins, directions = (
            (1 + 2.0**-30) * each for each in (triangles, origins, directions)
        )
    triangles, origins, directions = turned(random, triangles, origins, directions)
    triangles = reordered(random, triangles)
    cases = alone(
        *(signed_zeros(random, each) for each in (triangles, origins, directions)), kind, SOURCE
    )
    return cases._replace(name=np.array(KINDS)[kind])
