"""Badouel's test with b and c by Cramer's rule: no branch, one division fewer.

Havel 2008, sections 3.4.1 and 4.3.3, right as printed. `badouel` is the listing of Blecha 2007.
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.stored_plane import stored_plane


@method(
    title="Badouel by Cramer's rule, stored plane and projection",
    method="Badouel",
    source="Badouel 1990; Havel 2008, 3.4.1 and 4.3.3",
    prepare=stored_plane,
    stored="normal",
)
def badouel_cramer(tri, ray, along, scale):
    denominator = (
        tri.normal[0] * ray.dir[0] + tri.normal[1] * ray.dir[1] + tri.normal[2] * ray.dir[2]
    )
    t = -(
        tri.normal[0] * ray.orig[0]
        + tri.normal[1] * ray.orig[1]
        + tri.normal[2] * ray.orig[2]
        + tri.d
    )

    # AP, AB, AC in the plane of projection
    apu = (ray.orig[tri.i1] - tri.v0[tri.i1]) * scale + ray.dir[tri.i1] * along
    apv = (ray.orig[tri.i2] - tri.v0[tri.i2]) * scale + ray.dir[tri.i2] * along
    abu = tri.v1[tri.i1] - tri.v0[tri.i1]
    abv = tri.v1[tri.i2] - tri.v0[tri.i2]
    acu = tri.v2[tri.i1] - tri.v0[tri.i1]
    acv = tri.v2[tri.i2] - tri.v0[tri.i2]
    area = abu * acv - acu * abv
    b = apu * acv - acu * apv
    c = abu * apv - apu * abv
    return pieces(
        denominator, t, b, c, area=area, normal=(tri.normal[0], tri.normal[1], tri.normal[2])
    )
