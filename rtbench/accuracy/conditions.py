"""How far an answer is from another one, and how far its values move: in exact arithmetic.

eta, the perturbation that would change the answer
--------------------------------------------------
The ray hits (t > 0) where the side volumes s_i = dir.((p - orig) x (q - orig)) of the three edges
and the origin volume vol = (v0 - orig).((v1 - orig) x (v2 - orig)) have one sign. Each is affine
in each of the fifteen numbers x_j, so that if each moves by at most r |x_j|, then f moves at first
order by at most r sum_j |df/dx_j| |x_j|, and by just that in the worst case. Hence

    r_f = |f| / sum_j |df/dx_j| |x_j|      (0 where f = 0)

is the least relative, componentwise perturbation that makes f zero, at first order. It is at most
1/3, since f is homogeneous of degree 3 (Euler).

* Where the four have one sign: eta = min r_f. This is the distance to the border itself.
* Where they have not: to hit, all must come to one sign; eta is the smaller, over the two signs,
  of the largest r_f among those that have to change. This is a lower bound: what changes one of
  them need not change another. It is 0 for a ray in the plane that passes beside the triangle,
  and for some others that touch a degenerate triangle's line: their four volumes are 0, and
  that no common movement gives them one sign is not seen. So eta holds nothing against a kernel
  that says hit there; that such an answer is wrong is counted apart.

Ties (edge, vertex, t = 0, in the plane) have eta = 0.

Condition of t, u, v
--------------------
    c = |M^-1| (|orig| + |t| |dir| + |w| |v0| + |u| |v1| + |v| |v2|),  M = [-dir, v1 - v0, v2 - v0]

with absolute values componentwise and w = 1 - u - v: if each number moves by at most eps of
itself, t, u and v move at first order by at most eps c. See `errors.conditions` for the same in
float64.
"""

from functools import cmp_to_key
from typing import NamedTuple

from rtbench.accuracy.exact import _cross, _dot, _minus
from rtbench.accuracy.rationals import Ratio, Vector, over_one_denominator


class Sensitivity(NamedTuple):
    """eta, and the conditions of t, u and v: ratios, None where undefined."""

    eta: Ratio
    t: Ratio | None
    u: Ratio | None
    v: Ratio | None


def _size(*products: tuple[list[int], list[int]]) -> int:
    """Return the sum of |df/dx_j| |x_j| over pairs of a gradient and the vector it belongs to."""
    return sum(abs(_dot(list(map(abs, g)), list(map(abs, x)))) for g, x in products)


def _side(p: list[int], q: list[int], o: list[int], d: list[int]) -> tuple[int, int]:
    """Return an edge's side volume and its greatest first-order change by parts of the numbers."""
    to_p, to_q = _minus(p, o), _minus(q, o)
    by_d, by_p, by_q = _cross(to_p, to_q), _cross(to_q, d), _cross(d, to_p)
    by_o = _cross(_minus(p, q), d)
    return _dot(d, by_d), _size((by_d, d), (by_p, p), (by_q, q), (by_o, o))


def _origin_volume(a: list[int], b: list[int], c: list[int], o: list[int]) -> tuple[int, int]:
    """Return the origin's volume and its greatest first-order change, likewise."""
    to_a, to_b, to_c = _minus(a, o), _minus(b, o), _minus(c, o)
    by_a, by_b, by_c = _cross(to_b, to_c), _cross(to_c, to_a), _cross(to_a, to_b)
    by_o = _cross(_minus(b, a), _minus(c, a))
    return _dot(to_a, by_a), _size((by_a, a), (by_b, b), (by_c, c), (by_o, o))


def _compare(a: Ratio, b: Ratio) -> int:
    """Return a number with the sign of a - b, of ratios with positive denominators."""
    return a[0] * b[1] - b[0] * a[1]


_ORDER = cmp_to_key(_compare)


def _distance(volumes: list[tuple[int, int]]) -> Ratio:
    """Return eta from the four volumes and their changes."""
    border = [(abs(value), change) if value else (0, 1) for value, change in volumes]
    signs = {(value > 0) - (value < 0) for value, _ in volumes}
    if signs in ({1}, {-1}):
        return min(border, key=_ORDER)
    largest = []
    for sign in (1, -1):
        change = [b for b, (value, _) in zip(border, volumes, strict=True) if value * sign <= 0]
        largest.append(max(change, key=_ORDER))
    return min(largest, key=_ORDER)


def sensitivity(v0: Vector, v1: Vector, v2: Vector, orig: Vector, dir: Vector) -> Sensitivity:
    """Return how far the answer is from changing, and how far t, u and v move, exactly.

    Parameters
    ----------
    v0, v1, v2 : three finite numbers
        The triangle.
    orig, dir : three finite numbers
        The ray; its direction is not zero.

    Returns
    -------
    Sensitivity
        Ratios with positive denominators: eta as in the module's text, without a unit; the
        conditions in the units of t, u and v, None where the line has no point of the plane.

    Source
    ------
    Componentwise condition of a linear system: Skeel 1979; Higham 2002, section 7.2.
    """
    (a, b, c, o), points = over_one_denominator(v0, v1, v2, orig)
    (d,), scale = over_one_denominator(dir)
    sides = [_side(p, q, o, d) for p, q in ((b, c), (c, a), (a, b))]
    volume = _origin_volume(a, b, c, o)
    eta = _distance([*sides, volume])
    det = sum(value for value, _ in sides)
    if det == 0:
        return Sensitivity(eta, None, None, None)
    # The right side times |det|: the weights of v0, v1, v2 are the side volumes over det, and
    # t = volume / det in units of d.
    weights = [(abs(det), o), (abs(volume[0]), d)]
    weights += [(abs(value), vertex) for (value, _), vertex in zip(sides, (a, b, c), strict=True)]
    right = [sum(weight * abs(vector[k]) for weight, vector in weights) for k in range(3)]
    e1, e2 = _minus(b, a), _minus(c, a)
    below = det * det
    t, u, v = (_size((row, right)) for row in (_cross(e1, e2), _cross(e2, d), _cross(d, e1)))
    return Sensitivity(eta, (t * scale, below * points), (u, below), (v, below))
