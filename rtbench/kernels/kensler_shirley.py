"""Kensler and Shirley's test: signed volumes, arranged so that few operations are left.

Kensler & Shirley 2006; Havel 2008, sections 3.3.2 and 4.3.1, right as printed, signs and all:
N = AB x CA, I = OA x D, t = N . OA, b = I . CA, c = I . AB, over D . N. The normal can be stored
beside the vertices, or with vertex A and the two edges in their place.
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.vectors import corners, cross, difference


@method(
    title="Kensler-Shirley, from the vertices",
    method="Kensler-Shirley",
    source="Kensler & Shirley 2006; Havel 2008, 3.3.2",
)
def kensler_shirley(tri, ray):
    # AB and CA
    abx = tri.v1[0] - tri.v0[0]
    aby = tri.v1[1] - tri.v0[1]
    abz = tri.v1[2] - tri.v0[2]
    cax = tri.v0[0] - tri.v2[0]
    cay = tri.v0[1] - tri.v2[1]
    caz = tri.v0[2] - tri.v2[2]

    # N = AB x CA
    nx = aby * caz - abz * cay
    ny = abz * cax - abx * caz
    nz = abx * cay - aby * cax
    denominator = ray.dir[0] * nx + ray.dir[1] * ny + ray.dir[2] * nz

    # OA
    sx = tri.v0[0] - ray.orig[0]
    sy = tri.v0[1] - ray.orig[1]
    sz = tri.v0[2] - ray.orig[2]
    t = nx * sx + ny * sy + nz * sz

    # I = OA x D
    ix = sy * ray.dir[2] - sz * ray.dir[1]
    iy = sz * ray.dir[0] - sx * ray.dir[2]
    iz = sx * ray.dir[1] - sy * ray.dir[0]
    b = ix * cax + iy * cay + iz * caz
    c = ix * abx + iy * aby + iz * abz
    return pieces(denominator, t, b, c, normal=(nx, ny, nz))


def edge_normal(tri):
    """Compute ``normal`` = AB x CA, of the length that the cross product has.

    Source
    ------
    Havel 2008, section 3.3.2.
    """
    a, b, c = corners(tri)
    return {"normal": cross(difference(b, a), difference(a, c))}


@method(
    title="Kensler-Shirley, with the stored normal",
    method="Kensler-Shirley",
    source="Kensler & Shirley 2006; Havel 2008, 4.3.1",
    prepare=edge_normal,
    stored="normal",
)
def kensler_shirley_with_normal(tri, ray):
    denominator = (
        ray.dir[0] * tri.normal[0] + ray.dir[1] * tri.normal[1] + ray.dir[2] * tri.normal[2]
    )

    # OA
    sx = tri.v0[0] - ray.orig[0]
    sy = tri.v0[1] - ray.orig[1]
    sz = tri.v0[2] - ray.orig[2]
    t = tri.normal[0] * sx + tri.normal[1] * sy + tri.normal[2] * sz

    # I = OA x D
    ix = sy * ray.dir[2] - sz * ray.dir[1]
    iy = sz * ray.dir[0] - sx * ray.dir[2]
    iz = sx * ray.dir[1] - sy * ray.dir[0]

    # I . CA and I . AB
    cax = tri.v0[0] - tri.v2[0]
    cay = tri.v0[1] - tri.v2[1]
    caz = tri.v0[2] - tri.v2[2]
    b = ix * cax + iy * cay + iz * caz
    abx = tri.v1[0] - tri.v0[0]
    aby = tri.v1[1] - tri.v0[1]
    abz = tri.v1[2] - tri.v0[2]
    c = ix * abx + iy * aby + iz * abz
    return pieces(denominator, t, b, c, normal=(tri.normal[0], tri.normal[1], tri.normal[2]))


def edges(tri):
    """Compute what the precomputed form keeps: ``normal`` = AB x CA, ``a``, ``ab`` and ``ca``.

    In float32 48 bytes, 64 in rows of 16.

    Source
    ------
    Havel 2008, section 4.3.1.
    """
    a, b, c = corners(tri)
    ab, ca = difference(b, a), difference(a, c)
    return {"normal": cross(ab, ca), "a": a, "ab": ab, "ca": ca}


@method(
    title="Kensler-Shirley, with stored normal, vertex and edges",
    method="Kensler-Shirley",
    source="Kensler & Shirley 2006; Havel 2008, 4.3.1",
    prepare=edges,
    stored="precomputed",
)
def kensler_shirley_stored(tri, ray):
    denominator = (
        ray.dir[0] * tri.normal[0] + ray.dir[1] * tri.normal[1] + ray.dir[2] * tri.normal[2]
    )

    # OA
    sx = tri.a[0] - ray.orig[0]
    sy = tri.a[1] - ray.orig[1]
    sz = tri.a[2] - ray.orig[2]
    t = tri.normal[0] * sx + tri.normal[1] * sy + tri.normal[2] * sz

    # I = OA x D
    ix = sy * ray.dir[2] - sz * ray.dir[1]
    iy = sz * ray.dir[0] - sx * ray.dir[2]
    iz = sx * ray.dir[1] - sy * ray.dir[0]
    b = ix * tri.ca[0] + iy * tri.ca[1] + iz * tri.ca[2]
    c = ix * tri.ab[0] + iy * tri.ab[1] + iz * tri.ab[2]
    return pieces(denominator, t, b, c, normal=(tri.normal[0], tri.normal[1], tri.normal[2]))
