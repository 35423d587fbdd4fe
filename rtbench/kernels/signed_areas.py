"""Signed areas: the point lies on the same side of AB, BC and CA.

Havel 2008, section 3.4.4.3, right as printed: N . (AB x AP), N . (BC x BP), N . (CA x CP) have one
sign. The normal keeps its length: N . N is then what the three add up to.
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.vectors import corners, cross, difference


def normal(tri):
    """Compute ``normal`` = AB x AC, of the length that the cross product has.

    Source
    ------
    Havel 2008, section 3.2.
    """
    a, b, c = corners(tri)
    return {"normal": cross(difference(b, a), difference(c, a))}


@method(
    title="Signed areas, with the stored normal",
    method="Signed areas",
    source="Havel 2008, 3.4.4.3",
    prepare=normal,
    stored="normal",
)
def signed_areas(tri, ray, along, scale):
    # the point of the plane, from A, B and C
    aox = ray.orig[0] - tri.v0[0]
    aoy = ray.orig[1] - tri.v0[1]
    aoz = ray.orig[2] - tri.v0[2]
    denominator = (
        tri.normal[0] * ray.dir[0] + tri.normal[1] * ray.dir[1] + tri.normal[2] * ray.dir[2]
    )
    t = -(tri.normal[0] * aox + tri.normal[1] * aoy + tri.normal[2] * aoz)
    apx = aox * scale + ray.dir[0] * along
    apy = aoy * scale + ray.dir[1] * along
    apz = aoz * scale + ray.dir[2] * along
    bpx = (ray.orig[0] - tri.v1[0]) * scale + ray.dir[0] * along
    bpy = (ray.orig[1] - tri.v1[1]) * scale + ray.dir[1] * along
    bpz = (ray.orig[2] - tri.v1[2]) * scale + ray.dir[2] * along
    cpx = (ray.orig[0] - tri.v2[0]) * scale + ray.dir[0] * along
    cpy = (ray.orig[1] - tri.v2[1]) * scale + ray.dir[1] * along
    cpz = (ray.orig[2] - tri.v2[2]) * scale + ray.dir[2] * along

    # N . (CA x CP), N . (AB x AP), N . (BC x BP)
    cax = tri.v0[0] - tri.v2[0]
    cay = tri.v0[1] - tri.v2[1]
    caz = tri.v0[2] - tri.v2[2]
    b = (
        tri.normal[0] * (cay * cpz - caz * cpy)
        + tri.normal[1] * (caz * cpx - cax * cpz)
        + tri.normal[2] * (cax * cpy - cay * cpx)
    )
    abx = tri.v1[0] - tri.v0[0]
    aby = tri.v1[1] - tri.v0[1]
    abz = tri.v1[2] - tri.v0[2]
    c = (
        tri.normal[0] * (aby * apz - abz * apy)
        + tri.normal[1] * (abz * apx - abx * apz)
        + tri.normal[2] * (abx * apy - aby * apx)
    )
    bcx = tri.v2[0] - tri.v1[0]
    bcy = tri.v2[1] - tri.v1[1]
    bcz = tri.v2[2] - tri.v1[2]
    a = (
        tri.normal[0] * (bcy * bpz - bcz * bpy)
        + tri.normal[1] * (bcz * bpx - bcx * bpz)
        + tri.normal[2] * (bcx * bpy - bcy * bpx)
    )
    area = (
        tri.normal[0] * tri.normal[0]
        + tri.normal[1] * tri.normal[1]
        + tri.normal[2] * tri.normal[2]
    )
    return pieces(
        denominator,
        t,
        b,
        c,
        a=a,
        area=area,
        normal=(tri.normal[0], tri.normal[1], tri.normal[2]),
    )
