"""Exact answers at nearly the price of rounded ones: a filter with proven bounds, and exact signs.

Three stages, each of which passes on what it cannot decide:

1. Kensler and Shirley's determinants in the kernel's own arithmetic. Each is a sum of six products
   d.(a x b), a and b differences rounded once. With unit roundoff u its error is at most gamma_7
   (gamma_8 where all three are differences) times the permanent of absolute values, which is at
   most |d|_1 |a|_1 |b|_1. Computed norms and products fall short of that by (1 - u)^10 at most, so

       8 u |d||e||f|   for det = d.(e x f)         8 u |d||f||s|   for b = -f.(s x d)
       8 u |d||e||s|   for c = e.(s x d)          10 u |e||f||s|   for -s.(e x f), t det

   bound the errors, rounding of the bounds included: gamma_8 (1 - u)^-10 < 9 u. |det| - b - c takes
   two more roundings, of c one: 9/8, 9/8 and 8/8 of the three bounds, 1.25 of their sum is enough.
   b - |det| takes one: where it exceeds the sum of both bounds, a or c is negative.
   TINY (1 + |d| + |e| + |f| + |s|) covers underflow: an operation that underflows errs by u TINY
   at most and is multiplied by at most one vector afterwards. Where a product of norms overflows,
   the bound is infinite and nothing is decided. A determinant that overflows where that product
   just does not has a partial sum of its whole permanent, and so the sign of that; its inverse is
   0, and so is t: not a hit. Comparisons with NaN fail and decide nothing.
2. The three sides d.((p - o) x (q - o)) and the volume (a - o).((b - o) x (c - o)) in float64, with
   a bound by the permanent: `rtbench.kernels.exact_signs`.
3. The same, summed exactly. A ray that touches an edge or a vertex is a tie, decided as if its
   origin were moved by (e, e^2, e^3), e infinitely small: the two triangles of an edge see opposite
   signs, so of the triangles of a closed fan exactly one is hit. A ray in the triangle's plane, one
   that starts in it (t = 0) and a triangle without area are misses, NaN and infinity too.

No bound assumes an order of the sums or that nothing is fused, but stage 3 wants products rounded
once: no reassociation. Subnormal numbers must not be flushed to zero.

t is N.(u e + v f - s) / N.d with the N that was computed: its error cancels, and what errs in u and
v lies in the plane. That holds to first order: where a slender triangle is hit, |det| below
|d||e||f| / SLENDER, `rtbench.kernels.where` says where, and likewise if its first vertex is so much
farther away than the point and the coordinates' origin that s does not hold these any more. t
beyond the floats of the arithmetic becomes the outermost one inside.

Source: the filter's form is that of Shewchuk 1997, the test Kensler and Shirley 2006, the ties'
rule Edelsbrunner and Mücke 1990.
"""

import math

from rtbench.kernels.contract import (
    HIT,
    LARGEST,
    NO_T,
    ONE,
    ROUNDOFF,
    SMALLEST,
    TINY,
    UNDECIDED,
    ZERO,
    kernel,
)
from rtbench.kernels.endings import INFINITY, flipped
from rtbench.kernels.exact_signs import (
    ALL,
    THIRD,
    certain_sign,
    double,
    exact_value,
    sign,
    tie_sign,
)
from rtbench.kernels.vectors import difference
from rtbench.kernels.where import SLENDER, doubles, where

DISTANT = 256.0  # how much farther away the first vertex may be


def side(p, q, orig, dir):
    """Return the exact sign of dir . ((p - orig) x (q - orig))."""
    found = certain_sign(dir, difference(p, orig), difference(q, orig))
    if found != 0:
        return found
    return sign(exact_value(dir, p, q, orig, THIRD)[0])


def finite(x):
    """Tell whether three numbers are."""
    return abs(x[0]) < math.inf and abs(x[1]) < math.inf and abs(x[2]) < math.inf


def exactly(v0, v1, v2, orig, dir, tmax):
    """Decide what the filter could not, and say where."""
    a, b, c, o, d = doubles(v0), doubles(v1), doubles(v2), doubles(orig), doubles(dir)
    if not (finite(a) and finite(b) and finite(c) and finite(o) and finite(d)):
        return 1, math.nan, math.nan, math.nan

    # Which side of each edge the ray passes on; ties as if the origin were moved.
    at_a, at_b, at_c = side(b, c, o, d), side(c, a, o, d), side(a, b, o, d)
    if at_a == 0 and at_b == 0 and at_c == 0:  # in the plane, or no area
        return 1, math.nan, math.nan, math.nan
    at_a = at_a if at_a != 0 else tie_sign(b, c, d)
    at_b = at_b if at_b != 0 else tie_sign(c, a, d)
    at_c = at_c if at_c != 0 else tie_sign(a, b, d)
    if at_a == 0 or at_a != at_b or at_a != at_c:
        return 2, math.nan, math.nan, math.nan

    # Whether the plane lies ahead.
    ahead = certain_sign(difference(a, o), difference(b, o), difference(c, o))
    if ahead == 0:
        ahead = sign(exact_value(a, b, c, o, ALL)[0])
    if ahead != at_a:
        return 4, math.nan, math.nan, math.nan

    t, u, v = where(a, b, c, o, d)
    t = min(max(t, double(SMALLEST)), double(LARGEST))
    return HIT if t < tmax else 4, t, u, v


CLAIMS = ("S1", "S2", "S3", "S4", "S5", "S6", "R1", "X1", "X2")


@kernel(
    title="Adaptive exact, ties by simulation of simplicity",
    method="adaptive exact",
    domain="ray",
    outcomes=("hit", "no plane or outside", "b outside", "c outside", "t outside (0, tmax)"),
    outputs=("t", "u", "v"),
    source="Kensler & Shirley 2006; Shewchuk 1997; Edelsbrunner & Mücke 1990; bounds: ours",
    fallback=exactly,
    claims=CLAIMS,
)
def adaptive_exact(tri, ray, tmax):
    # edges e, f, and s from vertex to origin
    ex = tri.v1[0] - tri.v0[0]
    ey = tri.v1[1] - tri.v0[1]
    ez = tri.v1[2] - tri.v0[2]
    fx = tri.v2[0] - tri.v0[0]
    fy = tri.v2[1] - tri.v0[1]
    fz = tri.v2[2] - tri.v0[2]
    sx = ray.orig[0] - tri.v0[0]
    sy = ray.orig[1] - tri.v0[1]
    sz = ray.orig[2] - tri.v0[2]
    e1 = abs(ex) + abs(ey) + abs(ez)
    f1 = abs(fx) + abs(fy) + abs(fz)
    s1 = abs(sx) + abs(sy) + abs(sz)
    d1 = abs(ray.dir[0]) + abs(ray.dir[1]) + abs(ray.dir[2])
    tiny = TINY * (ONE + (d1 + e1 + f1 + s1))

    # N = e x f, det = N.d
    nx = ey * fz - ez * fy
    ny = ez * fx - ex * fz
    nz = ex * fy - ey * fx
    nd = ray.dir[0] * nx + ray.dir[1] * ny + ray.dir[2] * nz
    ef = e1 * f1
    det_error = 8.0 * ROUNDOFF * (d1 * ef) + tiny
    size = abs(nd)
    sure = size > det_error

    # b = -f.(s x d), the weight of v1 times |det|
    ix = sy * ray.dir[2] - sz * ray.dir[1]
    iy = sz * ray.dir[0] - sx * ray.dir[2]
    iz = sx * ray.dir[1] - sy * ray.dir[0]
    ds = d1 * s1
    b = flipped(-(fx * ix + fy * iy + fz * iz), nd)
    b_error = 8.0 * ROUNDOFF * (ds * f1) + tiny
    if sure & ((b < -b_error) | (b - size > b_error + det_error)):
        return 2, NO_T, NO_T, NO_T
    "b"

    # c = e.(s x d), a = |det| - b - c
    c = flipped(ex * ix + ey * iy + ez * iz, nd)
    c_error = 8.0 * ROUNDOFF * (ds * e1) + tiny
    a = size - b - c
    a_error = 1.25 * (det_error + b_error + c_error)
    if sure & ((c < -c_error) | (a < -a_error)):
        return 3, NO_T, NO_T, NO_T
    "c"

    # whether the plane lies ahead: s.N against the side of d
    ahead = flipped(-(sx * nx + sy * ny + sz * nz), nd)
    ahead_error = 10.0 * ROUNDOFF * (s1 * ef) + tiny
    if sure & (ahead < -ahead_error):
        return 4, NO_T, NO_T, NO_T

    # t = N.(u e + v f - s) / N.d
    inverse = ONE / size
    u = b * inverse
    v = c * inverse
    px = u * ex + v * fx - sx
    py = u * ey + v * fy - sy
    pz = u * ez + v * fz - sz
    t = flipped(nx * px + ny * py + nz * pz, nd) * inverse
    inside = (b > b_error) & (c > c_error) & (a > a_error)
    good = sure & inside & (ahead > ahead_error) & (t > ZERO) & (t < INFINITY)
    near = abs(ray.orig[0]) + abs(ray.orig[1]) + abs(ray.orig[2]) + t * d1
    good = good & (d1 * ef < SLENDER * size) & (s1 < DISTANT * near)
    if good & (t >= tmax):
        return 4, NO_T, NO_T, NO_T
    return HIT if good else UNDECIDED, t, u, v
