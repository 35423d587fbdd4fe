"""Keidy's test: barycentric coordinates from dot products, no axis and no stored data.

From the Mr Gamemaker forum, in Fauerby 2003; Havel 2008, sections 3.4.3 and 4.3.5, right as
printed. Its dot products hide the normal's square: a c - b b = |AB x AC|^2. Completed to a ray's
test with the plane and the barycentric coordinates, as 4.3.5 says; `keidy_inside` is the point in
triangle alone, its real use (6.1.2). The point is brought into the plane along the normal.
"""

from rtbench.kernels.pieces import method, pieces


@method(
    title="Keidy, dot products",
    method="Keidy",
    source="Keidy, in Fauerby 2003; Havel 2008, 3.4.3 and 4.3.5",
)
def keidy(tri, ray, along, scale):
    # AB and AC
    abx = tri.v1[0] - tri.v0[0]
    aby = tri.v1[1] - tri.v0[1]
    abz = tri.v1[2] - tri.v0[2]
    acx = tri.v2[0] - tri.v0[0]
    acy = tri.v2[1] - tri.v0[1]
    acz = tri.v2[2] - tri.v0[2]

    # the plane: N = AB x AC
    nx = aby * acz - abz * acy
    ny = abz * acx - abx * acz
    nz = abx * acy - aby * acx
    aox = ray.orig[0] - tri.v0[0]
    aoy = ray.orig[1] - tri.v0[1]
    aoz = ray.orig[2] - tri.v0[2]
    denominator = nx * ray.dir[0] + ny * ray.dir[1] + nz * ray.dir[2]
    t = -(nx * aox + ny * aoy + nz * aoz)

    # AP, and the dot products of Text 1
    apx = aox * scale + ray.dir[0] * along
    apy = aoy * scale + ray.dir[1] * along
    apz = aoz * scale + ray.dir[2] * along
    ab_ab = abx * abx + aby * aby + abz * abz
    ab_ac = abx * acx + aby * acy + abz * acz
    ac_ac = acx * acx + acy * acy + acz * acz
    area = ab_ab * ac_ac - ab_ac * ab_ac
    ap_ab = apx * abx + apy * aby + apz * abz
    ap_ac = apx * acx + apy * acy + apz * acz
    b = ap_ab * ac_ac - ap_ac * ab_ac
    c = ap_ac * ab_ab - ap_ab * ab_ac
    return pieces(denominator, t, b, c, area=area, normal=(nx, ny, nz))
