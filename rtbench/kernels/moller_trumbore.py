"""Möller and Trumbore's test as its formula, without an absolute epsilon.

Möller & Trumbore 1997; Havel 2008, section 3.3.1. The denominator is compared with 0: the thesis's
listing, with its EPSILON of 1e-6, calls small triangles parallel to every ray. The listings as
Blecha 2007 prints them are in `moller`.
"""

from rtbench.kernels.pieces import method, pieces


@method(
    title="Möller-Trumbore",
    method="Möller-Trumbore",
    order="uvt",
    source="Möller & Trumbore 1997; Havel 2008, 3.3.1",
)
def moller_trumbore(tri, ray):
    # AB and AC
    e1x = tri.v1[0] - tri.v0[0]
    e1y = tri.v1[1] - tri.v0[1]
    e1z = tri.v1[2] - tri.v0[2]
    e2x = tri.v2[0] - tri.v0[0]
    e2y = tri.v2[1] - tri.v0[1]
    e2z = tri.v2[2] - tri.v0[2]

    # P = D x AC
    px = ray.dir[1] * e2z - ray.dir[2] * e2y
    py = ray.dir[2] * e2x - ray.dir[0] * e2z
    pz = ray.dir[0] * e2y - ray.dir[1] * e2x
    denominator = e1x * px + e1y * py + e1z * pz

    # b = AO . P
    sx = ray.orig[0] - tri.v0[0]
    sy = ray.orig[1] - tri.v0[1]
    sz = ray.orig[2] - tri.v0[2]
    b = sx * px + sy * py + sz * pz

    # Q = AO x AB
    qx = sy * e1z - sz * e1y
    qy = sz * e1x - sx * e1z
    qz = sx * e1y - sy * e1x
    c = ray.dir[0] * qx + ray.dir[1] * qy + ray.dir[2] * qz
    t = e2x * qx + e2y * qy + e2z * qz
    return pieces(denominator, t, b, c)
