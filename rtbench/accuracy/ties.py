"""The answer with ties broken: exactly one triangle of a closed fan is hit by a line through it.

Simulation of simplicity: the ray's origin is moved to orig + (e, e^2, e^3), where e is positive and
smaller than anything it is compared with. The side product with an edge is then a polynomial in e,
whose sign is that of its first coefficient that is not 0. One movement of one ray answers for all
triangles, so that they agree which side of a shared edge it passes.

Source: Edelsbrunner and Mücke 1990.
"""

from collections.abc import Sequence

from rtbench.accuracy.exact import _sides, _volume
from rtbench.accuracy.rationals import Vector, over_one_denominator

UNDEFINED = -1


def _sign(coefficients: Sequence[int]) -> int:
    """Return the sign of a polynomial in e, lowest power first, for e just above 0."""
    leading = next((c for c in coefficients if c != 0), 0)
    return (leading > 0) - (leading < 0)


def sos_hit(v0: Vector, v1: Vector, v2: Vector, orig: Vector, dir: Vector) -> int:
    """Decide exactly whether a ray hits a triangle, with ties at edges and vertices broken.

    Parameters
    ----------
    v0, v1, v2 : three numbers
        The triangle.
    orig, dir : three numbers
        The ray, t > 0. Only what side of an edge it passes is decided after the movement: where
        t = 0 the answer is a miss.

    Returns
    -------
    int
        1 or 0; 0 for a triangle without area and a ray in or parallel to its plane; -1 where a
        number is not finite or the direction is zero.
    """
    try:
        # The movement may be in units of any size: the common denominator's will do.
        (v0, v1, v2, o), _ = over_one_denominator(v0, v1, v2, orig)
        (d,), _ = over_one_denominator(dir)
    except (ValueError, OverflowError):
        return UNDEFINED
    if not any(d):
        return UNDEFINED
    sides = _sides(v0, v1, v2, o, d)
    if min(sides) < 0 < max(sides) or sum(sides) == 0:
        return 0
    if 0 in sides:
        # A side product is affine in the origin, so a step of one along each axis gives the
        # coefficients of e, e^2 and e^3.
        moved = []
        for axis in range(3):
            step = [o[k] + (k == axis) for k in range(3)]
            moved.append(_sides(v0, v1, v2, step, d))
        signs = [_sign([s, *(m[k] - s for m in moved)]) for k, s in enumerate(sides)]
    else:
        signs = [1 if s > 0 else -1 for s in sides]
    # None is 0 now: that takes an edge parallel to dir, for which the sum is 0.
    if not signs[0] == signs[1] == signs[2]:
        return 0
    return int(_volume(v0, v1, v2, o) * signs[0] > 0)
