"""Möller and Trumbore's test in the four places where its division can stand.

Möller & Trumbore 1997; the variants are those of Löfstedt & Akenine-Möller 2005 that
Blecha 2007 compares in section 4.1. Listing of moller1: Blecha 2007, section 4.5.1.
(The scanned listing's ppx, ppy, ppz and pvx, pvy, pvz are one vector, P.)

u and v leave at the end: without them (section 4.1 to 4.5) each is the listing as printed,
with them (section 4.6) its ``_uv`` variant. A bare string names the stage that ends there.
"""

from rtbench.kernels.contract import EPSILON, HIT, NO_T, ONE, ZERO, kernel

BY_DIVISION = ("hit", "u outside", "v outside", "code not used", "code not used", "parallel")
BY_SIGN = (
    "hit",
    "det > 0, u outside",
    "det > 0, v outside",
    "det < 0, u outside",
    "det < 0, v outside",
    "parallel",
)


@kernel(
    title="Möller-Trumbore, division at once",
    method="Möller-Trumbore",
    domain="line",
    outcomes=BY_DIVISION,
    outputs=("t", "u", "v"),
    source="Möller & Trumbore 1997; Blecha 2007, 4.1 (Möller0)",
)
def moller0(tri, ray):
    e1x = tri.v1[0] - tri.v0[0]
    e1y = tri.v1[1] - tri.v0[1]
    e1z = tri.v1[2] - tri.v0[2]
    e2x = tri.v2[0] - tri.v0[0]
    e2y = tri.v2[1] - tri.v0[1]
    e2z = tri.v2[2] - tri.v0[2]
    "edges"

    px = ray.dir[1] * e2z - ray.dir[2] * e2y
    py = ray.dir[2] * e2x - ray.dir[0] * e2z
    pz = ray.dir[0] * e2y - ray.dir[1] * e2x
    "P = D x E2"

    det = e1x * px + e1y * py + e1z * pz
    "det = E1 . P"

    if det > -EPSILON and det < EPSILON:
        return 5, NO_T, NO_T, NO_T
    "condition: parallel"

    inv_det = ONE / det
    "division"

    tx = ray.orig[0] - tri.v0[0]
    ty = ray.orig[1] - tri.v0[1]
    tz = ray.orig[2] - tri.v0[2]
    "T = O - V0"

    u = (tx * px + ty * py + tz * pz) * inv_det
    "u = T . P"
    if u < ZERO or u > ONE:
        return 1, NO_T, NO_T, NO_T
    "condition: u"

    qx = ty * e1z - tz * e1y
    qy = tz * e1x - tx * e1z
    qz = tx * e1y - ty * e1x
    "Q = T x E1"

    v = (ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz) * inv_det
    "v = D . Q"
    if v < ZERO or u + v > ONE:
        return 2, NO_T, NO_T, NO_T
    "condition: v"

    t = (e2x * qx + e2y * qy + e2z * qz) * inv_det
    return HIT, t, u, v


@kernel(
    title="Möller-Trumbore, tests by the sign of det, division last",
    method="Möller-Trumbore",
    domain="line",
    outcomes=BY_SIGN,
    outputs=("t", "u", "v"),
    source="Möller & Trumbore 1997; Blecha 2007, 4.5.1 (Möller1)",
)
def moller1(tri, ray):
    e1x = tri.v1[0] - tri.v0[0]
    e1y = tri.v1[1] - tri.v0[1]
    e1z = tri.v1[2] - tri.v0[2]
    e2x = tri.v2[0] - tri.v0[0]
    e2y = tri.v2[1] - tri.v0[1]
    e2z = tri.v2[2] - tri.v0[2]
    "edges"

    px = ray.dir[1] * e2z - ray.dir[2] * e2y
    py = ray.dir[2] * e2x - ray.dir[0] * e2z
    pz = ray.dir[0] * e2y - ray.dir[1] * e2x
    "P = D x E2"

    det = e1x * px + e1y * py + e1z * pz
    "det = E1 . P"

    if det > EPSILON:
        "condition: sign of det"
        tx = ray.orig[0] - tri.v0[0]
        ty = ray.orig[1] - tri.v0[1]
        tz = ray.orig[2] - tri.v0[2]
        "T = O - V0"

        u = tx * px + ty * py + tz * pz
        "u = T . P"
        if u < ZERO or u > det:
            return 1, NO_T, NO_T, NO_T
        "condition: u"

        qx = ty * e1z - tz * e1y
        qy = tz * e1x - tx * e1z
        qz = tx * e1y - ty * e1x
        "Q = T x E1"

        v = ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz
        "v = D . Q"
        if v < ZERO or u + v > det:
            return 2, NO_T, NO_T, NO_T
        "condition: v"
    elif det < -EPSILON:
        "condition: sign of det"
        tx = ray.orig[0] - tri.v0[0]
        ty = ray.orig[1] - tri.v0[1]
        tz = ray.orig[2] - tri.v0[2]
        "T = O - V0"

        u = tx * px + ty * py + tz * pz
        "u = T . P"
        if u > ZERO or u < det:
            return 3, NO_T, NO_T, NO_T
        "condition: u"

        qx = ty * e1z - tz * e1y
        qy = tz * e1x - tx * e1z
        qz = tx * e1y - ty * e1x
        "Q = T x E1"

        v = ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz
        "v = D . Q"
        if v > ZERO or u + v < det:
            return 4, NO_T, NO_T, NO_T
        "condition: v"
    else:
        return 5, NO_T, NO_T, NO_T

    inv_det = ONE / det
    "division"
    t = (e2x * qx + e2y * qy + e2z * qz) * inv_det
    return HIT, t, u * inv_det, v * inv_det


@kernel(
    title="Möller-Trumbore, tests by the sign of det, division straight after it",
    method="Möller-Trumbore",
    domain="line",
    outcomes=BY_SIGN,
    outputs=("t", "u", "v"),
    source="Löfstedt & Akenine-Möller 2005, variant 2; not in Blecha 2007, table 4.1",
)
def moller2(tri, ray):
    e1x = tri.v1[0] - tri.v0[0]
    e1y = tri.v1[1] - tri.v0[1]
    e1z = tri.v1[2] - tri.v0[2]
    e2x = tri.v2[0] - tri.v0[0]
    e2y = tri.v2[1] - tri.v0[1]
    e2z = tri.v2[2] - tri.v0[2]
    "edges"

    px = ray.dir[1] * e2z - ray.dir[2] * e2y
    py = ray.dir[2] * e2x - ray.dir[0] * e2z
    pz = ray.dir[0] * e2y - ray.dir[1] * e2x
    "P = D x E2"

    det = e1x * px + e1y * py + e1z * pz
    "det = E1 . P"

    tx = ray.orig[0] - tri.v0[0]
    ty = ray.orig[1] - tri.v0[1]
    tz = ray.orig[2] - tri.v0[2]
    "T = O - V0"

    inv_det = ONE / det
    "division"

    if det > EPSILON:
        "condition: sign of det"
        u = tx * px + ty * py + tz * pz
        "u = T . P"
        if u < ZERO or u > det:
            return 1, NO_T, NO_T, NO_T
        "condition: u"

        qx = ty * e1z - tz * e1y
        qy = tz * e1x - tx * e1z
        qz = tx * e1y - ty * e1x
        "Q = T x E1"

        v = ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz
        "v = D . Q"
        if v < ZERO or u + v > det:
            return 2, NO_T, NO_T, NO_T
        "condition: v"
    elif det < -EPSILON:
        "condition: sign of det"
        u = tx * px + ty * py + tz * pz
        "u = T . P"
        if u > ZERO or u < det:
            return 3, NO_T, NO_T, NO_T
        "condition: u"

        qx = ty * e1z - tz * e1y
        qy = tz * e1x - tx * e1z
        qz = tx * e1y - ty * e1x
        "Q = T x E1"

        v = ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz
        "v = D . Q"
        if v > ZERO or u + v < det:
            return 4, NO_T, NO_T, NO_T
        "condition: v"
    else:
        return 5, NO_T, NO_T, NO_T

    t = (e2x * qx + e2y * qy + e2z * qz) * inv_det
    return HIT, t, u * inv_det, v * inv_det


@kernel(
    title="Möller-Trumbore, tests by the sign, division and Q = T x E1 in front of the branches",
    method="Möller-Trumbore",
    domain="line",
    outcomes=BY_SIGN,
    outputs=("t", "u", "v"),
    source="Löfstedt & Akenine-Möller 2005, variant 3; Blecha 2007, 4.1 (Möller3)",
)
def moller3(tri, ray):
    e1x = tri.v1[0] - tri.v0[0]
    e1y = tri.v1[1] - tri.v0[1]
    e1z = tri.v1[2] - tri.v0[2]
    e2x = tri.v2[0] - tri.v0[0]
    e2y = tri.v2[1] - tri.v0[1]
    e2z = tri.v2[2] - tri.v0[2]
    "edges"

    px = ray.dir[1] * e2z - ray.dir[2] * e2y
    py = ray.dir[2] * e2x - ray.dir[0] * e2z
    pz = ray.dir[0] * e2y - ray.dir[1] * e2x
    "P = D x E2"

    det = e1x * px + e1y * py + e1z * pz
    "det = E1 . P"

    tx = ray.orig[0] - tri.v0[0]
    ty = ray.orig[1] - tri.v0[1]
    tz = ray.orig[2] - tri.v0[2]
    "T = O - V0"

    inv_det = ONE / det
    "division"

    qx = ty * e1z - tz * e1y
    qy = tz * e1x - tx * e1z
    qz = tx * e1y - ty * e1x
    "Q = T x E1"

    if det > EPSILON:
        "condition: sign of det"
        u = tx * px + ty * py + tz * pz
        "u = T . P"
        if u < ZERO or u > det:
            return 1, NO_T, NO_T, NO_T
        "condition: u"

        v = ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz
        "v = D . Q"
        if v < ZERO or u + v > det:
            return 2, NO_T, NO_T, NO_T
        "condition: v"
    elif det < -EPSILON:
        "condition: sign of det"
        u = tx * px + ty * py + tz * pz
        "u = T . P"
        if u > ZERO or u < det:
            return 3, NO_T, NO_T, NO_T
        "condition: u"

        v = ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz
        "v = D . Q"
        if v > ZERO or u + v < det:
            return 4, NO_T, NO_T, NO_T
        "condition: v"
    else:
        return 5, NO_T, NO_T, NO_T

    t = (e2x * qx + e2y * qy + e2z * qz) * inv_det
    return HIT, t, u * inv_det, v * inv_det
