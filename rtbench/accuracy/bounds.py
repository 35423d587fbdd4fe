"""What float64 can prove of a line and a triangle: the compiled filter and its error bounds.

Derivation of the bounds
------------------------
u = 2^-53; arithmetic rounds to nearest, underflows gradually and may or may not be contracted.
e = v1 - v0, f = v2 - v0 and s = orig - v0 are rounded once; d is the direction, exact.
|.|_1 is the sum of absolute components.

A determinant d.(a x b) of three-vectors sums six products. In the order written below, each passes
through 1 rounding of a difference for each of a and b (and d) that is one, 1 of a_j b_k, 1 of the
subtraction, 1 of the multiplication by d_i and 2 of the sum: 7 roundings with two rounded
differences, 8 with three. Its error is at most gamma_7 (gamma_8) times the permanent of absolute
values, and that is at most |d|_1 |a|_1 |b|_1. The computed norms and their products fall short of
this by at most a factor (1 - u)^10, so with gamma_7 (1 - u)^-10 < 7.001 u

    B_det = 8u |d||e||f|   B_u = 8u |d||s||f|   B_v = 8u |d||s||e|   B_t = 10u |s||e||f|

(each + a) bound the errors of det = e.(d x f), u = s.(d x f), v = d.(s x e), t = f.(s x e), with
room for the rounding of the bounds. The filter decides only if the norms' sum is below 2^150, so
that nothing overflows; a = 2^-1022 (1 + |d| + |e| + |f| + |s|) covers underflow: an operation that
underflows errs by at most 2^-1075 and is multiplied by at most one norm afterwards. A comparison
with NaN is false and leaves the pair to exact arithmetic.

w = det - u - v takes 2 more roundings, for v 1, of values below 1.01 of the norms' products:
B_w = 1.25 (B_det + B_u + B_v), where 9/8, 9/8 and 8/8 are needed. det - u and u + v take 1 more:
8/8 of the sum of two bounds. A margin |x| - c |det| adds at most 1/8 of x's bounds and 2/8 of
c B_det: B = 1.25 (B_x + c B_det), where at most 10/8 and 9/8 are needed.

The computed normal n = e x f errs by at most gamma_4 |e||f| in any norm, the lengths of it and of
d and their product relatively by less than 7u, so that c |n||d| errs by less than
c (4.01u + 7u) |e||f||d| < 2c B_det, and |det| - c |n||d| by less than
(7.01/8 + 2c + (1 + 2c)/8) B_det, which is below 1.25 B_det for c <= 0.1. Squares of lengths do not
underflow harmfully where |n||d| >= 2^-180: with the limit above, |n| and |d| exceed 2^-480.

No bound relies on a cancellation being exact, and none on the order of a sum.

Source: the bounds' form is that of Shewchuk 1997 (error at most a constant times the permanent).
"""

from functools import cache

import numpy as np

from rtbench.accuracy.exact import GRAZING, HIT, MISS, NEAR_EDGE
from rtbench.compiled.instantiate import Instance, instantiate

UNDECIDED = -1

GRAZING_LIMIT = 0.1
"""Largest cosine for which the derivation's bound of the grazing test holds."""

ROUNDOFF = 2.0**-53
UNDERFLOW = 2.0**-1022
LARGEST = 2.0**150
SMALLEST = 2.0**-180


def bounded(triangles, origins, directions, i):
    """Return det, u, v, t in float64, their bounds, |n||d|, and the sum of the four 1-norms."""
    v0x = np.float64(triangles[i, 0, 0])
    v0y = np.float64(triangles[i, 0, 1])
    v0z = np.float64(triangles[i, 0, 2])
    ex = np.float64(triangles[i, 1, 0]) - v0x
    ey = np.float64(triangles[i, 1, 1]) - v0y
    ez = np.float64(triangles[i, 1, 2]) - v0z
    fx = np.float64(triangles[i, 2, 0]) - v0x
    fy = np.float64(triangles[i, 2, 1]) - v0y
    fz = np.float64(triangles[i, 2, 2]) - v0z
    sx = np.float64(origins[i, 0]) - v0x
    sy = np.float64(origins[i, 1]) - v0y
    sz = np.float64(origins[i, 2]) - v0z
    dx = np.float64(directions[i, 0])
    dy = np.float64(directions[i, 1])
    dz = np.float64(directions[i, 2])

    px = dy * fz - dz * fy
    py = dz * fx - dx * fz
    pz = dx * fy - dy * fx
    qx = sy * ez - sz * ey
    qy = sz * ex - sx * ez
    qz = sx * ey - sy * ex
    det = ex * px + ey * py + ez * pz
    u = sx * px + sy * py + sz * pz
    v = dx * qx + dy * qy + dz * qz
    t = fx * qx + fy * qy + fz * qz

    d1 = abs(dx) + abs(dy) + abs(dz)
    e1 = abs(ex) + abs(ey) + abs(ez)
    f1 = abs(fx) + abs(fy) + abs(fz)
    s1 = abs(sx) + abs(sy) + abs(sz)
    norms = d1 + e1 + f1 + s1
    tiny = UNDERFLOW * (1.0 + norms)
    det_error = 8.0 * ROUNDOFF * (d1 * e1 * f1) + tiny
    u_error = 8.0 * ROUNDOFF * (d1 * s1 * f1) + tiny
    v_error = 8.0 * ROUNDOFF * (d1 * s1 * e1) + tiny
    t_error = 10.0 * ROUNDOFF * (s1 * e1 * f1) + tiny

    nx = ey * fz - ez * fy
    ny = ez * fx - ex * fz
    nz = ex * fy - ey * fx
    lengths = np.sqrt(nx * nx + ny * ny + nz * nz) * np.sqrt(dx * dx + dy * dy + dz * dz)
    return det, u, v, t, det_error, u_error, v_error, t_error, lengths, norms


def _beyond(x, x_error, det, det_error, margin):
    """Tell whether |x| >= margin |det|: 1 yes, 0 no, -1 not decided."""
    rest = abs(x) - margin * abs(det)
    error = 1.25 * (x_error + margin * det_error)
    if rest > error:
        return 1
    if rest < -error:
        return 0
    return -1


def _clear(det, u, v, det_error, u_error, v_error, margin):
    """Tell whether u, v and w are that far from 0 and from det: 1 yes, 0 no, -1 not decided."""
    both = u_error + v_error
    w_error = 1.25 * (det_error + both)
    worst = 1
    for x, x_error in (
        (u, u_error),
        (v, v_error),
        (det - u - v, w_error),
        (det - u, det_error + u_error),
        (det - v, det_error + v_error),
        (u + v, both),
    ):
        far = _beyond(x, x_error, det, det_error, margin)
        if far == 0:
            return 0
        if far < 0:
            worst = -1
    return worst


def _same_sign(det, u, v, det_error, u_error, v_error):
    """Tell whether u, v, w = det - u - v have one sign, and so the line hits: 1, 0 or -1."""
    w = det - u - v
    w_error = 1.25 * (det_error + u_error + v_error)
    above = (u > u_error) + (v > v_error) + (w > w_error)
    below = (u < -u_error) + (v < -v_error) + (w < -w_error)
    if above > 0 and below > 0:
        return MISS
    if above == 3 or below == 3:
        return HIT
    return UNDECIDED


def _filter(triangles, origins, directions, margin, grazing, out):
    """Write the class of each pair: HIT, MISS, NEAR_EDGE, GRAZING or UNDECIDED."""
    for i in range(out.shape[0]):
        det, u, v, _, det_error, u_error, v_error, _, lengths, norms = bounded(
            triangles, origins, directions, i
        )
        out[i] = UNDECIDED
        if not norms < LARGEST:
            continue
        if grazing > 0.0:
            rest = abs(det) - grazing * lengths
            if not abs(rest) > 1.25 * det_error or lengths < SMALLEST:
                continue
            if rest < 0.0:
                out[i] = GRAZING
                continue
        if margin > 0.0:
            clear = _clear(det, u, v, det_error, u_error, v_error, margin)
            if clear <= 0:
                if clear == 0:
                    out[i] = NEAR_EDGE
                continue
        out[i] = _same_sign(det, u, v, det_error, u_error, v_error)


def _reference(triangles, origins, directions, out):
    """Write t, u, v and their bounds in rows of six; NaN where the sign of det is not certain."""
    for i in range(out.shape[0]):
        det, u, v, t, det_error, u_error, v_error, t_error, _, norms = bounded(
            triangles, origins, directions, i
        )
        certain = abs(det) - det_error
        if not (norms < LARGEST and certain > det_error):
            out[i, 0] = np.nan
            continue
        t, u, v = t / det, u / det, v / det
        out[i, 0] = t
        out[i, 1] = u
        out[i, 2] = v
        # |x/d - X/D| <= (B_x + |x/d| B_d) / |D|; 4u |x/d| and 1.01 for the roundings here.
        for k, x, x_error in ((3, t, t_error), (4, u, u_error), (5, v, v_error)):
            own = 4.0 * ROUNDOFF * abs(x) + UNDERFLOW
            out[i, k] = 1.01 * (x_error + abs(x) * det_error) / certain + own


CONSTANTS = {
    "ROUNDOFF": repr(ROUNDOFF),
    "UNDERFLOW": repr(UNDERFLOW),
    "LARGEST": repr(LARGEST),
    "SMALLEST": repr(SMALLEST),
    "HIT": repr(HIT),
    "MISS": repr(MISS),
    "NEAR_EDGE": repr(NEAR_EDGE),
    "GRAZING": repr(GRAZING),
    "UNDECIDED": repr(UNDECIDED),
}
PAIRS = "{0}[:,:,::1], {0}[:,::1], {0}[:,::1]"


@cache
def compiled_filter(dtype: str) -> Instance:
    """Return the filter for float32 or float64 arrays.

    Parameters
    ----------
    dtype : str
        ``"float32"`` or ``"float64"``, of the three arrays of pairs.

    Returns
    -------
    Instance
        ``call(triangles, origins, directions, margin, grazing, out)`` writes classes as int8.
    """
    return instantiate(
        _filter,
        signature=f"void({PAIRS.format(dtype)}, float64, float64, int8[::1])",
        callees=(bounded, _beyond, _clear, _same_sign),
        constants=CONSTANTS,
        title=f"Classes of {dtype} line/triangle pairs, as far as float64 proves them.",
    )


@cache
def compiled_reference(dtype: str) -> Instance:
    """Return the computation of t, u, v and their bounds for float32 or float64 arrays.

    Parameters
    ----------
    dtype : str
        ``"float32"`` or ``"float64"``, of the three arrays of pairs.

    Returns
    -------
    Instance
        ``call(triangles, origins, directions, out)`` writes rows of six float64.
    """
    return instantiate(
        _reference,
        signature=f"void({PAIRS.format(dtype)}, float64[:,::1])",
        callees=(bounded,),
        constants=CONSTANTS,
        title=f"t, u, v of {dtype} line/triangle pairs with error bounds.",
    )
