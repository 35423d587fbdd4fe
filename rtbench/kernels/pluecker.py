"""Plücker's test: on which side of each edge's line the ray's line passes.

Havel 2008, section 3.2.4. Corrected against the text there: the last of a line's six coordinates
is B_y - A_y (as printed, A_y - B_y, 2,316 of 2,349 hits of random pairs are lost). The ray's line
goes through O and O + D. Three sides of one sign hit; they add up to the determinant -(N . D).
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.vectors import corners, cross, difference, dot


@method(
    title="Plücker's side operator",
    method="Plücker",
    source="Havel 2008, 3.2.4",
)
def pluecker(tri, ray):
    # the ray's coordinates
    r0 = ray.orig[0] * ray.dir[1] - ray.dir[0] * ray.orig[1]
    r1 = ray.orig[0] * ray.dir[2] - ray.dir[0] * ray.orig[2]
    r3 = ray.orig[1] * ray.dir[2] - ray.dir[1] * ray.orig[2]

    # the edges' coordinates: BC, CA, AB
    bc0 = tri.v1[0] * tri.v2[1] - tri.v2[0] * tri.v1[1]
    bc1 = tri.v1[0] * tri.v2[2] - tri.v2[0] * tri.v1[2]
    bc2 = tri.v1[0] - tri.v2[0]
    bc3 = tri.v1[1] * tri.v2[2] - tri.v2[1] * tri.v1[2]
    bc4 = tri.v1[2] - tri.v2[2]
    bc5 = tri.v2[1] - tri.v1[1]
    ca0 = tri.v2[0] * tri.v0[1] - tri.v0[0] * tri.v2[1]
    ca1 = tri.v2[0] * tri.v0[2] - tri.v0[0] * tri.v2[2]
    ca2 = tri.v2[0] - tri.v0[0]
    ca3 = tri.v2[1] * tri.v0[2] - tri.v0[1] * tri.v2[2]
    ca4 = tri.v2[2] - tri.v0[2]
    ca5 = tri.v0[1] - tri.v2[1]
    ab0 = tri.v0[0] * tri.v1[1] - tri.v1[0] * tri.v0[1]
    ab1 = tri.v0[0] * tri.v1[2] - tri.v1[0] * tri.v0[2]
    ab2 = tri.v0[0] - tri.v1[0]
    ab3 = tri.v0[1] * tri.v1[2] - tri.v1[1] * tri.v0[2]
    ab4 = tri.v0[2] - tri.v1[2]
    ab5 = tri.v1[1] - tri.v0[1]

    # side(R, BC), side(R, CA), side(R, AB); the ray's own r2, r4, r5 are -D_x, -D_z, D_y
    a = r0 * bc4 + r1 * bc5 - ray.dir[0] * bc3 + r3 * bc2 - ray.dir[2] * bc0 + ray.dir[1] * bc1
    b = r0 * ca4 + r1 * ca5 - ray.dir[0] * ca3 + r3 * ca2 - ray.dir[2] * ca0 + ray.dir[1] * ca1
    c = r0 * ab4 + r1 * ab5 - ray.dir[0] * ab3 + r3 * ab2 - ray.dir[2] * ab0 + ray.dir[1] * ab1
    denominator = a + b + c

    # N = AB x AC, from the same differences
    nx = ab5 * ca4 - ab4 * ca5
    ny = ab2 * ca4 - ab4 * ca2
    nz = ab2 * ca5 - ab5 * ca2
    t = (
        nx * (ray.orig[0] - tri.v0[0])
        + ny * (ray.orig[1] - tri.v0[1])
        + nz * (ray.orig[2] - tri.v0[2])
    )
    return pieces(denominator, t, b, c, a=a, normal=(nx, ny, nz))


def coordinates(tri):
    """Compute the Plücker coordinates of the three edges, and the triangle's plane.

    Returns
    -------
    dict
        ``bc, ca, ab``: six each; ``n`` = AB x AC and ``nd`` = N . A.

    Source
    ------
    Havel 2008, section 3.2.4, the last coordinate corrected.
    """
    a, b, c = corners(tri)
    normal = cross(difference(b, a), difference(c, a))
    return {
        "bc": line(b, c),
        "ca": line(c, a),
        "ab": line(a, b),
        "n": normal,
        "nd": dot(normal, a),
    }


def line(p, q):
    """Return the Plücker coordinates of the line from p to q."""
    return (
        p[0] * q[1] - q[0] * p[1],
        p[0] * q[2] - q[0] * p[2],
        p[0] - q[0],
        p[1] * q[2] - q[1] * p[2],
        p[2] - q[2],
        q[1] - p[1],
    )


@method(
    title="Plücker's side operator, with stored edges and plane",
    method="Plücker",
    source="Havel 2008, 3.2.4",
    prepare=coordinates,
    stored="precomputed",
)
def pluecker_stored(tri, ray):
    # the ray's coordinates
    r0 = ray.orig[0] * ray.dir[1] - ray.dir[0] * ray.orig[1]
    r1 = ray.orig[0] * ray.dir[2] - ray.dir[0] * ray.orig[2]
    r3 = ray.orig[1] * ray.dir[2] - ray.dir[1] * ray.orig[2]
    a = (
        r0 * tri.bc[4]
        + r1 * tri.bc[5]
        - ray.dir[0] * tri.bc[3]
        + r3 * tri.bc[2]
        - ray.dir[2] * tri.bc[0]
        + ray.dir[1] * tri.bc[1]
    )
    b = (
        r0 * tri.ca[4]
        + r1 * tri.ca[5]
        - ray.dir[0] * tri.ca[3]
        + r3 * tri.ca[2]
        - ray.dir[2] * tri.ca[0]
        + ray.dir[1] * tri.ca[1]
    )
    c = (
        r0 * tri.ab[4]
        + r1 * tri.ab[5]
        - ray.dir[0] * tri.ab[3]
        + r3 * tri.ab[2]
        - ray.dir[2] * tri.ab[0]
        + ray.dir[1] * tri.ab[1]
    )
    denominator = a + b + c
    t = tri.n[0] * ray.orig[0] + tri.n[1] * ray.orig[1] + tri.n[2] * ray.orig[2] - tri.nd
    return pieces(denominator, t, b, c, a=a, normal=(tri.n[0], tri.n[1], tri.n[2]))
