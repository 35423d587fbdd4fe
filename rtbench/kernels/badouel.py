"""Badouel's test: the plane's stored normal, then barycentric coordinates in a projection.

Badouel 1990, Graphics Gems; listing: Blecha 2007, section 4.5.2. alpha is the weight of v1,
beta that of v2. As in the listing, t is there before it is known whether the triangle is hit,
and is returned with codes 2, 3 and 4 too. A bare string names the stage that ends there.
"""

from rtbench.kernels.contract import EPSILON, HIT, NO_T, ONE, ZERO, kernel
from rtbench.kernels.stored_plane import stored_plane


@kernel(
    title="Badouel, stored plane and projection along the dominant axis",
    method="Badouel",
    domain="line",
    outcomes=(
        "hit",
        "parallel",
        "u1 = 0, beta outside",
        "beta outside",
        "alpha outside",
    ),
    outputs=("t", "u", "v"),
    source="Badouel 1990; Blecha 2007, 4.5.2",
    prepare=stored_plane,
)
def badouel(tri, ray):
    dot = ray.dir[0] * tri.normal[0] + ray.dir[1] * tri.normal[1] + ray.dir[2] * tri.normal[2]
    "N . D"
    if dot > -EPSILON and dot < EPSILON:
        return 1, NO_T, NO_T, NO_T
    "condition: parallel"

    dot2 = ray.orig[0] * tri.normal[0] + ray.orig[1] * tri.normal[1] + ray.orig[2] * tri.normal[2]
    "N . O"
    t = -(tri.d + dot2) / dot
    "t (division)"

    pointa = ray.orig[tri.i1] + ray.dir[tri.i1] * t
    pointb = ray.orig[tri.i2] + ray.dir[tri.i2] * t
    "point"

    uu0 = pointa - tri.v0[tri.i1]
    uu1 = tri.v1[tri.i1] - tri.v0[tri.i1]
    uu2 = tri.v2[tri.i1] - tri.v0[tri.i1]
    vv0 = pointb - tri.v0[tri.i2]
    vv1 = tri.v1[tri.i2] - tri.v0[tri.i2]
    vv2 = tri.v2[tri.i2] - tri.v0[tri.i2]
    "differences"

    if uu1 == ZERO:
        "condition: u1 = 0"
        beta = uu0 / uu2
        "beta (division)"
        if beta < ZERO or beta > ONE:
            return 2, t, NO_T, NO_T
        "condition: beta"
        alpha = (vv0 - beta * vv2) / vv1
        "alpha (division)"
    else:
        "condition: u1 = 0"
        beta = (vv0 * uu1 - uu0 * vv1) / (vv2 * uu1 - uu2 * vv1)
        "beta (division)"
        if beta < ZERO or beta > ONE:
            return 3, t, NO_T, NO_T
        "condition: beta"
        alpha = (uu0 - beta * uu2) / uu1
        "alpha (division)"

    if alpha < ZERO or alpha + beta > ONE:
        return 4, t, NO_T, NO_T
    "condition: alpha"

    return HIT, t, alpha, beta
