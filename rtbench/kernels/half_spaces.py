"""Half-spaces: the point lies on the inner side of three planes through the edges.

Havel 2008, section 3.4.4.2, names two planes that make sense: those through the ray's origin and
those perpendicular to the triangle. The sides are compared by sign, b + c never with 1.
"""

from rtbench.kernels.pieces import method, pieces


@method(
    title="Half-spaces of planes through the ray's origin",
    method="Half-spaces",
    source="Havel 2008, 3.4.4.2",
)
def half_spaces_origin(tri, ray):
    # OA, OB, OC
    ax = tri.v0[0] - ray.orig[0]
    ay = tri.v0[1] - ray.orig[1]
    az = tri.v0[2] - ray.orig[2]
    bx = tri.v1[0] - ray.orig[0]
    by = tri.v1[1] - ray.orig[1]
    bz = tri.v1[2] - ray.orig[2]
    cx = tri.v2[0] - ray.orig[0]
    cy = tri.v2[1] - ray.orig[1]
    cz = tri.v2[2] - ray.orig[2]

    # the planes' normals OB x OC, OC x OA, OA x OB, and D on each: together D . N
    nax = by * cz - bz * cy
    nay = bz * cx - bx * cz
    naz = bx * cy - by * cx
    nbx = cy * az - cz * ay
    nby = cz * ax - cx * az
    nbz = cx * ay - cy * ax
    ncx = ay * bz - az * by
    ncy = az * bx - ax * bz
    ncz = ax * by - ay * bx
    a = ray.dir[0] * nax + ray.dir[1] * nay + ray.dir[2] * naz
    b = ray.dir[0] * nbx + ray.dir[1] * nby + ray.dir[2] * nbz
    c = ray.dir[0] * ncx + ray.dir[1] * ncy + ray.dir[2] * ncz
    denominator = a + b + c
    t = ax * nax + ay * nay + az * naz
    return pieces(
        denominator, t, b, c, a=a, normal=(nax + nbx + ncx, nay + nby + ncy, naz + nbz + ncz)
    )


@method(
    title="Half-spaces of planes perpendicular to the triangle",
    method="Half-spaces",
    source="Havel 2008, 3.4.4.2",
)
def half_spaces_perpendicular(tri, ray, along, scale):
    # AB, AC, BC
    abx = tri.v1[0] - tri.v0[0]
    aby = tri.v1[1] - tri.v0[1]
    abz = tri.v1[2] - tri.v0[2]
    acx = tri.v2[0] - tri.v0[0]
    acy = tri.v2[1] - tri.v0[1]
    acz = tri.v2[2] - tri.v0[2]
    bcx = tri.v2[0] - tri.v1[0]
    bcy = tri.v2[1] - tri.v1[1]
    bcz = tri.v2[2] - tri.v1[2]

    # N = AB x AC and the point of the plane, from A and from B
    nx = aby * acz - abz * acy
    ny = abz * acx - abx * acz
    nz = abx * acy - aby * acx
    aox = ray.orig[0] - tri.v0[0]
    aoy = ray.orig[1] - tri.v0[1]
    aoz = ray.orig[2] - tri.v0[2]
    denominator = nx * ray.dir[0] + ny * ray.dir[1] + nz * ray.dir[2]
    t = -(nx * aox + ny * aoy + nz * aoz)
    apx = aox * scale + ray.dir[0] * along
    apy = aoy * scale + ray.dir[1] * along
    apz = aoz * scale + ray.dir[2] * along
    bpx = (ray.orig[0] - tri.v1[0]) * scale + ray.dir[0] * along
    bpy = (ray.orig[1] - tri.v1[1]) * scale + ray.dir[1] * along
    bpz = (ray.orig[2] - tri.v1[2]) * scale + ray.dir[2] * along

    # inner sides: (AC x N) . AP, (N x AB) . AP, (N x BC) . BP
    b = (acy * nz - acz * ny) * apx + (acz * nx - acx * nz) * apy + (acx * ny - acy * nx) * apz
    c = (ny * abz - nz * aby) * apx + (nz * abx - nx * abz) * apy + (nx * aby - ny * abx) * apz
    a = (ny * bcz - nz * bcy) * bpx + (nz * bcx - nx * bcz) * bpy + (nx * bcy - ny * bcx) * bpz
    area = nx * nx + ny * ny + nz * nz
    return pieces(denominator, t, b, c, a=a, area=area, normal=(nx, ny, nz))
