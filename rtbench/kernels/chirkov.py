"""Chirkov's test: signs of three products in the plane of projection, one division at the end.

Chirkov 2005, journal of graphics tools 10(3); listing: Blecha 2007, section 4.5.3. Its inside
test uses the ray's origin and end, its t the direction. A bare string names the stage that
ends there.
"""

from rtbench.kernels.contract import HIT, NO_T, ONE, ZERO, kernel
from rtbench.kernels.stored_plane import stored_plane


@kernel(
    title="Chirkov, signs of areas in the projection along the dominant axis",
    method="Chirkov",
    domain="line",
    outcomes=("hit", "miss"),
    outputs=("t", "u", "v"),
    source="Chirkov 2005; Blecha 2007, 4.5.3",
    prepare=stored_plane,
)
def chirkov(tri, ray):
    sign_src = (
        tri.normal[0] * ray.orig[0]
        + tri.normal[1] * ray.orig[1]
        + tri.normal[2] * ray.orig[2]
        + tri.d
    )
    sign_dst = (
        tri.normal[0] * ray.end[0] + tri.normal[1] * ray.end[1] + tri.normal[2] * ray.end[2] + tri.d
    )
    "sides of origin and end"

    dd = sign_src - sign_dst

    ay = tri.v1[tri.i1] - tri.v0[tri.i1]
    az = tri.v1[tri.i2] - tri.v0[tri.i2]
    by = tri.v2[tri.i1] - tri.v0[tri.i1]
    bz = tri.v2[tri.i2] - tri.v0[tri.i2]

    dely = ray.end[tri.i1] - ray.orig[tri.i1]
    delz = ray.end[tri.i2] - ray.orig[tri.i2]

    basey = ray.orig[tri.i1] - tri.v0[tri.i1]
    basez = ray.orig[tri.i2] - tri.v0[tri.i2]
    "differences"

    adelxbase = sign_src * (ay * delz - az * dely) + dd * (ay * basez - az * basey)
    bdelxbase = sign_src * (dely * bz - delz * by) + dd * (basey * bz - basez * by)
    "areas at edges a and b"

    if adelxbase * bdelxbase >= ZERO:
        "condition: edges a and b"
        cy = tri.v2[tri.i1] - tri.v1[tri.i1]
        cz = tri.v2[tri.i2] - tri.v1[tri.i2]
        basey = ray.orig[tri.i1] - tri.v1[tri.i1]
        basez = ray.orig[tri.i2] - tri.v1[tri.i2]
        "differences of edge c"
        cdelxbase = sign_src * (dely * cz - delz * cy) + dd * (basey * cz - basez * cy)
        "area at edge c"
        if adelxbase * cdelxbase < ZERO:
            "condition: edge c"
            t = -sign_src / (
                ray.dir[0] * tri.normal[0] + ray.dir[1] * tri.normal[1] + ray.dir[2] * tri.normal[2]
            )
            "t (division)"
            inv_area = ONE / (dd * (ay * bz - az * by))
            return HIT, t, bdelxbase * inv_area, adelxbase * inv_area
    return 1, NO_T, NO_T, NO_T
