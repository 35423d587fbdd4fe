"""Angle sum: seen from a point inside, the three vertices span 360 degrees.

Havel 2008, section 3.4.4.1, where it is named as slow and prone to error. It needs roots and
arccos, hence has no exact form; and no fixed tolerance is right: near an edge the sum falls short
of a full turn by as much as the point is outside, while rounding makes it short inside too.
"""

import math

from rtbench.kernels.contract import HIT, NO_T, ONE, ZERO, kernel

FULL_TURN = 2 * math.pi
TOLERANCE = 1e-3  # radians; an arccos near -1 turns a rounding of 6e-8 into 3e-4


@kernel(
    title="Angle sum, roots and arccos",
    method="Angle sum",
    domain="ray",
    outcomes=("hit", "t outside (0, tmax)", "angles below 360 degrees"),
    source="Havel 2008, 3.4.4.1",
    exact=False,
)
def angle_sum(tri, ray, tmax):
    abx = tri.v1[0] - tri.v0[0]
    aby = tri.v1[1] - tri.v0[1]
    abz = tri.v1[2] - tri.v0[2]
    acx = tri.v2[0] - tri.v0[0]
    acy = tri.v2[1] - tri.v0[1]
    acz = tri.v2[2] - tri.v0[2]
    nx = aby * acz - abz * acy
    ny = abz * acx - abx * acz
    nz = abx * acy - aby * acx
    "normal"

    sx = tri.v0[0] - ray.orig[0]
    sy = tri.v0[1] - ray.orig[1]
    sz = tri.v0[2] - ray.orig[2]
    t = (nx * sx + ny * sy + nz * sz) / (nx * ray.dir[0] + ny * ray.dir[1] + nz * ray.dir[2])
    "t (division)"
    if not ((t > ZERO) & (t < tmax)):
        return 1, NO_T
    "condition: t"

    # PA, PB, PC and their lengths
    ax = sx - ray.dir[0] * t
    ay = sy - ray.dir[1] * t
    az = sz - ray.dir[2] * t
    bx = ax + abx
    by = ay + aby
    bz = az + abz
    cx = ax + acx
    cy = ay + acy
    cz = az + acz
    a = math.sqrt(ax * ax + ay * ay + az * az)
    b = math.sqrt(bx * bx + by * by + bz * bz)
    c = math.sqrt(cx * cx + cy * cy + cz * cz)
    "lengths"

    # Rounding may bring a cosine beyond 1, of which there is no angle.
    cos_a = max(-ONE, min(ONE, (bx * cx + by * cy + bz * cz) / (b * c)))
    cos_b = max(-ONE, min(ONE, (cx * ax + cy * ay + cz * az) / (c * a)))
    cos_c = max(-ONE, min(ONE, (ax * bx + ay * by + az * bz) / (a * b)))
    if not math.acos(cos_a) + math.acos(cos_b) + math.acos(cos_c) > FULL_TURN - TOLERANCE:
        return 2, NO_T
    "condition: angles"
    return HIT, t
