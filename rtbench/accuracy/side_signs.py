"""Rays and triangles by signs of side products: the first of the oracle's two formulations.

Every vertex is used as given: the products are formed about the coordinates' origin, and no
difference of two points is taken. Where the ray lies in the triangle's plane, or the triangle has
no plane, all side products with its edges are zero or sum up to zero; the sides are then told by
auxiliary lines through the vertices, perpendicular to a plane that holds the ray.

See ``elimination`` for the second formulation, and ``cases`` for the classes.
"""

from collections.abc import Iterable
from typing import NamedTuple

from rtbench.accuracy import cases
from rtbench.accuracy.exact import _cross, _dot, _sides, _volume
from rtbench.accuracy.rationals import Ratio, Vector, over_one_denominator


class Decision(NamedTuple):
    """Class of a ray and a triangle, and where its line meets the plane (None: it does not)."""

    cls: int
    t: Ratio | None = None
    u: Ratio | None = None
    v: Ratio | None = None


def decide(v0: Vector, v1: Vector, v2: Vector, orig: Vector, dir: Vector) -> Decision:
    """Decide exactly how a ray, t > 0, meets a triangle.

    Parameters
    ----------
    v0, v1, v2 : three numbers
        The triangle; u is the weight of v1, v of v2.
    orig, dir : three numbers
        The ray, its direction used as given.

    Returns
    -------
    Decision
        A class of ``cases``; t, u and v as ratios, also for lines that miss. A ray in the plane
        touches the triangle also where only its origin does, as one that starts on it is a tie.

    Source
    ------
    Plücker coordinates as in Shevtsov, Soupikov and Kapustin 2007.
    """
    try:
        (v0, v1, v2, o), points = over_one_denominator(v0, v1, v2, orig)
        (d,), scale = over_one_denominator(dir)
    except (ValueError, OverflowError):  # infinite or not a number
        return Decision(cases.INVALID)
    if not any(d):
        return Decision(cases.INVALID)
    sides = _sides(v0, v1, v2, o, d)
    total = sum(sides)
    if total == 0:
        return Decision(_without_crossing(v0, v1, v2, o, d))
    volume = _volume(v0, v1, v2, o)
    t = volume * scale, total * points
    return Decision(_crossing(sides, total, volume), t, (sides[1], total), (sides[2], total))


def _crossing(sides: tuple[int, int, int], total: int, volume: int) -> int:
    """Return the class where the line crosses the plane in one point."""
    if min(sides) < 0 < max(sides):
        return cases.MISS
    if volume == 0:
        return cases.ORIGIN_ON
    if (volume > 0) != (total > 0):
        return cases.BEHIND
    return (cases.HIT_INTERIOR, cases.HIT_EDGE, cases.HIT_VERTEX)[sides.count(0)]


def _without_crossing(v0: list, v1: list, v2: list, o: list, d: list) -> int:
    """Return the class where the direction lies in the plane, or the triangle has none."""
    faces = zip(_cross(v0, v1), _cross(v1, v2), _cross(v2, v0), strict=True)
    normal = [sum(face) for face in faces]
    if any(normal):
        if _volume(v0, v1, v2, o) != 0:
            return cases.PARALLEL
        touched = _touched(((v0, v1), (v1, v2), (v2, v0)), normal, o, d)
        return cases.COPLANAR_TOUCH if touched else cases.COPLANAR_MISS
    touched = _segment_touched(min(v0, v1, v2), max(v0, v1, v2), o, d)
    return cases.DEGENERATE_TOUCH if touched else cases.DEGENERATE_MISS


def _touched(edges: Iterable[tuple[list, list]], normal: list, o: list, d: list) -> bool:
    """Tell whether a ray, t >= 0, meets edges in its plane; the normal is not 0.

    The edges form a closed polygon, or one edge of which neither end lies on the ray's line.
    """
    moment = _cross(o, d)
    start = _dot(d, o)
    for p, q in edges:
        # Side products with the lines through p and q along the normal: on which side they lie.
        of_p = _dot(d, _cross(p, normal)) + _dot(normal, moment)
        of_q = _dot(d, _cross(q, normal)) + _dot(normal, moment)
        ahead_p, ahead_q = _dot(d, p) - start, _dot(d, q) - start
        if of_p == 0 and ahead_p >= 0:  # q is another edge's p
            return True
        if min(of_p, of_q) < 0 < max(of_p, of_q):
            # The edge crosses the line where p and q have these weights, of one sign.
            ahead = ahead_p * of_q - ahead_q * of_p
            if ahead == 0 or (ahead > 0) == (of_q > 0):
                return True
    return False


def _segment_touched(p: list, q: list, o: list, d: list) -> bool:
    """Tell whether a ray, t >= 0, meets the segment from p to q, which may be a point."""
    moment = _cross(o, d)
    on_p, on_q = _cross(p, d) == moment, _cross(q, d) == moment
    start = _dot(d, o)
    if on_p and on_q:
        return max(_dot(d, p), _dot(d, q)) >= start
    if on_p or on_q:
        return _dot(d, p if on_p else q) >= start
    # Lines that meet have side product 0, those that are skew have not.
    if _dot(d, _cross(p, q)) + _dot(q, moment) - _dot(p, moment) != 0:
        return False
    along = [b - a for a, b in zip(p, q, strict=True)]
    normal = _cross(d, along)
    return any(normal) and _touched(((p, q),), normal, o, d)
