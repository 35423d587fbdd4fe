"""Which line hits which triangle, in exact rational arithmetic.

Floating-point numbers are rationals, so the sign of every quantity below is decided, not estimated.
Two formulations that share no intermediate value are kept side by side, so that one can be tested
against the other: Cramer's numerators about the first vertex (Möller & Trumbore 1997) and the side
products of the line with the three edges, formed about the origin of the coordinates.

Each function takes three-vectors (any sequence of three finite floats, integers or Fractions) of
one triangle and one line. About 20 microseconds a line; a million pairs are for ``certified``.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

HIT, MISS, NEAR_EDGE, GRAZING = 1, 0, 2, 3
"""Classes of a pair. NEAR_EDGE and GRAZING exist only where a margin is asked for."""

Vector = Sequence[float] | Sequence[Fraction]


class Numerators(NamedTuple):
    """Cramer's numerators: u/det, v/det and t/det belong to the point of the plane."""

    det: Fraction
    u: Fraction
    v: Fraction
    t: Fraction


class LineHit(NamedTuple):
    """Whether the line meets the closed triangle, and where it meets the plane (None: parallel)."""

    hit: bool
    t: Fraction | None
    u: Fraction | None
    v: Fraction | None


def _over_one_denominator(*vectors: Vector) -> tuple[list[list[int]], int]:
    """Return the vectors as integers over one common denominator, and the denominator."""
    ratios = [[x.as_integer_ratio() for x in vector] for vector in vectors]
    common = math.lcm(*(below for vector in ratios for _, below in vector))
    return [[above * (common // below) for above, below in vector] for vector in ratios], common


def _minus(a: list[int], b: list[int]) -> list[int]:
    return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]


def _cross(a: list[int], b: list[int]) -> list[int]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Vector, b: Vector) -> int | Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def numerators(v0: Vector, v1: Vector, v2: Vector, orig: Vector, dir: Vector) -> Numerators:
    """Return the exact determinant and numerators of u, v and t for the line orig + t dir.

    Parameters
    ----------
    v0, v1, v2 : three finite numbers
        The triangle; u is the weight of v1, v of v2.
    orig, dir : three finite numbers
        A point of the line and its direction, used as given.

    Returns
    -------
    Numerators
        ``det = e1.(dir x e2)``, ``u = s.(dir x e2)``, ``v = dir.(s x e1)``, ``t = e2.(s x e1)``
        with e1 = v1 - v0, e2 = v2 - v0, s = orig - v0.

    Raises
    ------
    ValueError, OverflowError
        If a number is not finite.

    Source
    ------
    Möller and Trumbore 1997, equation 6.
    """
    # Integers: a Fraction reduces after every operation, which takes five times as long.
    (a, b, c, o), points = _over_one_denominator(v0, v1, v2, orig)
    (d,), scale = _over_one_denominator(dir)
    e1, e2, s = _minus(b, a), _minus(c, a), _minus(o, a)
    p, q = _cross(d, e2), _cross(s, e1)
    squared = points * points
    return Numerators(
        Fraction(_dot(e1, p), scale * squared),
        Fraction(_dot(s, p), scale * squared),
        Fraction(_dot(d, q), scale * squared),
        Fraction(_dot(e2, q), points * squared),
    )


def line_hit(v0: Vector, v1: Vector, v2: Vector, orig: Vector, dir: Vector) -> LineHit:
    """Decide whether a line meets the closed triangle, and where.

    Parameters
    ----------
    v0, v1, v2, orig, dir : three finite numbers
        As for `numerators`.

    Returns
    -------
    LineHit
        Edges and vertices belong to the triangle. A line parallel to the plane, or in it, and a
        triangle without area are misses with t, u, v None; t may be negative.

    Raises
    ------
    ValueError, OverflowError
        If a number is not finite.
    """
    det, u, v, t = numerators(v0, v1, v2, orig, dir)
    if det == 0:
        return LineHit(False, None, None, None)
    u, v, t = u / det, v / det, t / det
    return LineHit(u >= 0 and v >= 0 and u + v <= 1, t, u, v)


def classify(
    v0: Vector,
    v1: Vector,
    v2: Vector,
    orig: Vector,
    dir: Vector,
    margin: float = 0.0,
    grazing: float = 0.0,
) -> int:
    """Return the class of a pair: hit or miss, or too near an edge or too flat to count as either.

    Parameters
    ----------
    v0, v1, v2, orig, dir : three finite numbers
        As for `numerators`.
    margin : float
        NEAR_EDGE if a barycentric coordinate of the plane's point lies nearer than this to 0 or 1.
    grazing : float
        GRAZING (which goes first) if the cosine between direction and normal is at most this.

    Returns
    -------
    int
        HIT, MISS, NEAR_EDGE or GRAZING.

    Raises
    ------
    ValueError, OverflowError
        If a number is not finite.
    """
    det, u, v, _ = numerators(v0, v1, v2, orig, dir)
    if grazing > 0:
        v0, v1, v2, dir = ([Fraction(x) for x in vector] for vector in (v0, v1, v2, dir))
        normal = _cross(_minus(v1, v0), _minus(v2, v0))
        if det**2 <= Fraction(grazing) ** 2 * _dot(normal, normal) * _dot(dir, dir):
            return GRAZING
    if det < 0:
        det, u, v = -det, -u, -v
    w = det - u - v
    if margin > 0:
        least = Fraction(margin) * det
        if any(abs(x) < least or abs(det - x) < least for x in (u, v, w)):
            return NEAR_EDGE
    return HIT if det > 0 and u >= 0 and v >= 0 and w >= 0 else MISS


def side_products(
    v0: Vector, v1: Vector, v2: Vector, orig: Vector, dir: Vector
) -> tuple[Fraction, Fraction, Fraction]:
    """Return the exact side products of the line with the edges opposite v0, v1 and v2.

    Parameters
    ----------
    v0, v1, v2, orig, dir : three finite numbers
        As for `numerators`.

    Returns
    -------
    tuple of Fraction
        The line's Plücker product with the edges v1 v2, v2 v0 and v0 v1: -(det - u - v), -u and -v
        of `numerators`, of which no intermediate value is shared. Their sum is dir.(e1 x e2).

    Source
    ------
    Plücker coordinates as in Shevtsov, Soupikov and Kapustin 2007; every vertex is used as given,
    no difference is formed.
    """
    return _sides(*([Fraction(x) for x in vector] for vector in (v0, v1, v2, orig, dir)))


def _sides(v0, v1, v2, o, d) -> tuple:
    """Return the side products in whatever exact numbers the vectors are made of."""
    moment = _cross(o, d)
    # Line (d, o x d) with the edge's line (q - p, p x q): the products of direction and moment.
    return tuple(
        _dot(d, _cross(p, q)) + _dot(q, moment) - _dot(p, moment)
        for p, q in ((v1, v2), (v2, v0), (v0, v1))
    )


def origin_volume(v0: Vector, v1: Vector, v2: Vector, orig: Vector) -> Fraction:
    """Return six times the signed volume between the triangle and a point.

    Parameters
    ----------
    v0, v1, v2, orig : three finite numbers
        The triangle and the line's origin.

    Returns
    -------
    Fraction
        Minus the t of `numerators`, by the volumes of the four faces about the coordinates' origin.
    """
    return _volume(*([Fraction(x) for x in vector] for vector in (v0, v1, v2, orig)))


def _volume(v0, v1, v2, o):
    """Return the volume in whatever exact numbers the vectors are made of."""
    faces = ((v1, v2), (v2, v0), (v0, v1))
    return _dot(v0, _cross(v1, v2)) - sum(_dot(o, _cross(p, q)) for p, q in faces)


def crosses(side: tuple[Fraction, Fraction, Fraction]) -> bool:
    """Decide from side products whether the line meets the closed triangle.

    Parameters
    ----------
    side : tuple of three Fraction
        What `side_products` returned.

    Returns
    -------
    bool
        True if no two differ in sign and not all are zero.
    """
    return any(side) and (min(side) >= 0 or max(side) <= 0)
