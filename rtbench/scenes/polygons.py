"""Planar polygons cut into triangles: convex ones as a fan, others by clipping ears.

Which way three vertices turn is decided exactly, in the plane of two axes, so that vertices on a
line, or there twice, lead nobody astray. No vertex is added, and none that counts is left out: what
meets a neighbour in an edge meets it still.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from rtbench.scenes.model import GREATEST, SceneError

PLANAR = 1e-4  # of its size, how far a polygon may leave its plane
DIGITS = 5e-6  # of its coordinates: files round these to six digits
LEAST_AREA = 1e-14  # of the square of its size: what rounding alone brings
SLIVER = 1e-12  # of its size, how high triangles are that are rather not made ...
ROUNDING = 2.0**-50  # ... or of its coordinates, some of their roundings
CHECKED = 4096  # vertices, up to which every edge is held against every other
TURN_ERROR = 3.3306690738754716e-16  # (3 + 16 e) e with e = 2^-53: Shewchuk 1997, ccwerrboundA

Point = tuple[float, float]


def triangulated(vertices: np.ndarray) -> np.ndarray:
    """Cut a planar polygon into triangles.

    Parameters
    ----------
    vertices : (n, 3) array
        In their order round the polygon; some may be on a line with their neighbours, or equal to
        them.

    Returns
    -------
    (k, 3) int64 array
        Numbers of the vertices, turning as the polygon does. k is n - 2 unless vertices are equal
        to neighbours.

    Raises
    ------
    SceneError
        ``vertices``: fewer than 3, not finite, without area, in no plane, or where edges cross.

    Source
    ------
    Meisters 1975, Polygons have ears; the normal by Newell (Sutherland, Sproull & Schumacker 1974).
    """
    points = np.asarray(vertices, dtype=np.float64).tolist()
    if len(points) < 3:
        raise SceneError("vertices", f"a polygon of {len(points)} vertices (allowed: 3 or more)")
    if not all(abs(each) <= GREATEST for point in points for each in point):
        raise SceneError("vertices", f"vertices are not all finite and up to {GREATEST:g}")
    kept = [i for i in range(len(points)) if points[i] != points[i - 1]]
    along = _flattened([points[i] for i in kept])
    turns = [_turn(along[i - 2], along[i - 1], along[i]) for i in range(len(along))]
    turns = turns[1:] + turns[:1]  # of the vertex itself, not of the one before it
    if min(turns) > 0 and _reversals(along) == 2:
        cut = [(0, i, i + 1) for i in range(1, len(along) - 1)]
    else:
        _refuse_crossing(np.array(along))
        cut = _clipped(along, turns)
    return np.array(kept, dtype=np.int64)[np.array(cut, dtype=np.int64)]


def _flattened(points: list[list[float]]) -> list[Point]:
    """Return a polygon in the plane of the two axes it fills most, turning left."""
    if len(points) < 3:
        raise SceneError("vertices", "the polygon has no area")
    lower = [min(column) for column in zip(*points, strict=True)]
    upper = [max(column) for column in zip(*points, strict=True)]
    size = math.dist(lower, upper)
    normal = [0.0, 0.0, 0.0]
    x0, y0, z0 = points[0]
    ax, ay, az = (b - a for a, b in zip(points[0], points[-1], strict=True))
    for x, y, z in points:
        bx, by, bz = x - x0, y - y0, z - z0
        normal[0] += ay * bz - az * by
        normal[1] += az * bx - ax * bz
        normal[2] += ax * by - ay * bx
        ax, ay, az = bx, by, bz
    length = math.hypot(*normal)
    if not length > LEAST_AREA * size * size:
        raise SceneError("vertices", "the polygon has no area (or crosses itself)")
    nx, ny, nz = (each / length for each in normal)
    if len(points) > 3:
        heights = [(x - x0) * nx + (y - y0) * ny + (z - z0) * nz for x, y, z in points]
        off = (max(heights) - min(heights)) / 2
        largest = max(map(abs, (*lower, *upper)))
        if not off <= PLANAR * size + DIGITS * largest:
            raise SceneError(
                "vertices",
                f"the polygon is not flat: vertices lie {off:g} off its plane (allowed: "
                f"{PLANAR:g} of its size, {size:g})",
            )
    axis = max(range(3), key=lambda i: abs(normal[i]))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    if normal[axis] < 0:
        first, second = second, first
    return [(point[first], point[second]) for point in points]


def _turn(a: Point, b: Point, c: Point) -> float:
    """Return twice the area of a, b, c, above 0 if they turn left; its sign is exact."""
    one = (b[0] - a[0]) * (c[1] - a[1])
    other = (b[1] - a[1]) * (c[0] - a[0])
    if abs(one - other) > TURN_ERROR * (abs(one) + abs(other)):
        return one - other
    if one == other == 0.0:
        return 0.0
    ax, ay, bx, by, cx, cy = (Fraction(each) for point in (a, b, c) for each in point)
    exact = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return float(exact)


def _reversals(along: list[Point]) -> int:
    """Return how often the way round changes between to the right and to the left: 2 if convex.

    A star whose corners all turn left goes round twice and more.
    """
    rightwards = [a < b for a, b in zip(along, along[1:] + along[:1], strict=True)]
    return sum(rightwards[i] != rightwards[i - 1] for i in range(len(rightwards)))


def _refuse_crossing(along: np.ndarray) -> None:
    """Raise SceneError where an edge crosses another one clearly; touching is not crossing."""
    count = len(along)
    if count > CHECKED:
        return
    ways = np.roll(along, -1, axis=0) - along
    bound = SLIVER * np.ptp(along, axis=0).max() ** 2
    parted = np.empty((count, count), bool)  # whether the line of an edge parts another's ends
    rows = max(1, 1_000_000 // count)
    for first in range(0, count, rows):
        start, way = along[first : first + rows, None], ways[first : first + rows, None]
        side = way[..., 0] * (along[:, 1] - start[..., 1])
        side -= way[..., 1] * (along[:, 0] - start[..., 0])
        sign = (side > bound).astype(np.int8) - (side < -bound)
        parted[first : first + rows] = sign * np.roll(sign, -1, axis=1) < 0
    if (parted & parted.T).any():
        raise SceneError("vertices", "the polygon crosses itself")


def _clipped(along: list[Point], turns: list[float]) -> list[tuple[int, int, int]]:
    """Return the triangles of any polygon that turns left: ear after ear is cut off."""
    count = len(along)
    before = [i - 1 for i in range(count)]
    before[0] = count - 1
    after = [*range(1, count), 0]
    x, y = np.array(along).T
    size = float(max(np.ptp(x), np.ptp(y)))
    margin = max(SLIVER * size, ROUNDING * float(max(np.abs(x).max(), np.abs(y).max())))
    thin = margin * size
    # Only where the polygon does not turn left can a vertex lie in a triangle of others.
    blocking = np.array(turns) <= thin

    def is_free(a: int, b: int, c: int, border: bool) -> bool:
        """Whether no vertex lies in the triangle; nor near its border, unless that is allowed."""
        (ax, ay), (bx, by), (cx, cy) = corners = (along[a], along[b], along[c])
        near = blocking & (x >= min(ax, bx, cx) - margin) & (x <= max(ax, bx, cx) + margin)
        near &= (y >= min(ay, by, cy) - margin) & (y <= max(ay, by, cy) + margin)
        for i in np.flatnonzero(near).tolist():
            point = along[i]
            if point in corners:
                continue
            least = min(_turn(corners[k - 1], corners[k], point) for k in range(3))
            if least > 0 or (least >= -thin and not border):
                return False
        return True

    cut: list[tuple[int, int, int]] = []
    here, left, misses, border = 0, count, 0, False
    while left > 2:
        a, c = before[here], after[here]
        ear = turns[here] > (0.0 if border else thin) and is_free(a, here, c, border)
        # A spike, or what is left of one, has no inside: it goes without a triangle.
        spike = border and turns[here] == 0
        if not (ear or spike):
            here, misses = c, misses + 1
            if misses > left:
                if border:
                    raise SceneError("vertices", "the polygon crosses itself")
                border, misses = True, 0
            continue
        if ear:
            cut.append((a, here, c))
        after[a], before[c] = c, a
        blocking[here] = False
        for each in (a, c):
            turns[each] = _turn(along[before[each]], along[each], along[after[each]])
            blocking[each] = turns[each] <= thin
        here, left, misses, border = after[c], left - 1, 0, False
    return cut
