"""Where a ray meets a triangle that it is known to hit: t, u and v as good as the problem allows.

With determinants by the unit in float64, t = N.(u e + v f - s) / N.d as in `reached`: errors of u
and v lie in the plane, where N does not see them, as far as N is perpendicular to the plane. By as
much as it is not, and by as much as u and v are wrong, it sees them after all: the product of the
two. Both grow with |d||e||f| / |det|, in which the triangle's slenderness and its slant are taken
together. Below SLENDER that product is below u 2^24 u, a rounding in float32 and nothing in
float64. The others come from exact sums (`exact_signs.exact_value`), to 46 bits; where data and
result are float32 float64 does for them up to SLENDER_32.
"""

from rtbench.kernels.contract import ROUNDOFF
from rtbench.kernels.exact_signs import (
    ALL,
    THIRD,
    determinant,
    double,
    exact_value,
    length_1,
    scaled,
)
from rtbench.kernels.vectors import cross, difference, dot

SLENDER = 4096.0
SLENDER_32 = 2.0**22
SINGLE = 1e-10  # an arithmetic that rounds more than this
LEAST, MOST = 1e-280, 1e280  # outside of these products lose bits
FAR = 4000  # a power of two beyond all numbers


def doubles(x):
    """Return a vector in float64."""
    return double(x[0]), double(x[1]), double(x[2])


def ratio(above, below):
    """Return the quotient of two numbers m 2^e."""
    return scaled(above[0] / below[0], min(max(above[1] - below[1], -FAR), FAR))


def inside(x):
    """Return a weight brought into [0, 1]."""
    return min(max(x, 0.0), 1.0)


def where(a, b, c, o, d):
    """Return t, u, v of the ray o + t d with the triangle a, b, c, all in float64.

    Weights are brought into [0, 1]. NaN where the triangle has no area or is seen edge-on.
    """
    e, f, s = difference(b, a), difference(c, a), difference(o, a)
    normal = cross(e, f)
    across = dot(normal, d)
    size = length_1(d) * length_1(e) * length_1(f)
    if ROUNDOFF > SINGLE and LEAST < size < MOST and size < SLENDER_32 * abs(across):
        u = inside(determinant(d, s, f)[0] / across)
        v = inside(determinant(d, e, s)[0] / across)
        point = (
            u * e[0] + v * f[0] - s[0],
            u * e[1] + v * f[1] - s[1],
            u * e[2] + v * f[2] - s[2],
        )
        t = dot(normal, point) / across
        if LEAST < abs(t) < MOST:
            return t, u, v

    at_a = exact_value(d, b, c, o, THIRD)
    at_b = exact_value(d, c, a, o, THIRD)
    at_c = exact_value(d, a, b, o, THIRD)
    level = max(at_a[1], at_b[1], at_c[1])
    across = (
        scaled(at_a[0], max(at_a[1] - level, -FAR))
        + scaled(at_b[0], max(at_b[1] - level, -FAR))
        + scaled(at_c[0], max(at_c[1] - level, -FAR))
    )
    whole = across, level
    t = ratio(exact_value(a, b, c, o, ALL), whole)
    return t, inside(ratio(at_b, whole)), inside(ratio(at_c, whole))
