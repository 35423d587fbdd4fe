"""Wald's test: Badouel's, with the solved equations kept in place of the triangle.

Wald 2004; Havel 2008, sections 3.4.2 and 4.3.4, right as printed but for 3.2.1: where the normal is
divided by its component along w, d is divided too, and S there is the origin O. Two lines in the
plane of projection give b and c as distances from them. Twelve numbers a triangle, with all three
axes stored in the room that a row of 16 bytes leaves (section 4.2.5).
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.projection import along, axes
from rtbench.kernels.vectors import corners, cross, difference


def lines(tri):
    """Compute the plane divided by its component along w, and the lines of b and c.

    Returns
    -------
    dict
        ``nu, nv, nd, w``: N_u / N_w, N_v / N_w, N . A / N_w and the dominant axis; ``bu, bv, bd,
        u`` and ``cu, cv, cd, v``: b = bu P_u + bv P_v + bd, c likewise, and the axes after w.

    Source
    ------
    Havel 2008, section 3.4.2 and the struct of 4.2.5.
    """
    a, b, c = corners(tri)
    ab, ac = difference(b, a), difference(c, a)
    normal = cross(ab, ac)
    w, u, v = axes(normal)
    nw = along(normal, w)
    nu, nv = along(normal, u) / nw, along(normal, v) / nw
    au, av, aw = along(a, u), along(a, v), along(a, w)
    abu, abv, acu, acv = along(ab, u), along(ab, v), along(ac, u), along(ac, v)
    area = abu * acv - acu * abv
    return {
        "nu": nu,
        "nv": nv,
        "nd": nu * au + nv * av + aw,
        "w": w,
        "bu": acv / area,
        "bv": -acu / area,
        "bd": (av * acu - au * acv) / area,
        "u": u,
        "cu": -abv / area,
        "cv": abu / area,
        "cd": (au * abv - av * abu) / area,
        "v": v,
    }


@method(
    title="Wald, two lines in the plane of projection",
    method="Wald",
    source="Wald 2004; Havel 2008, 3.4.2",
    prepare=lines,
    stored="precomputed",
)
def wald(tri, ray, along, scale):
    denominator = tri.nu * ray.dir[tri.u] + tri.nv * ray.dir[tri.v] + ray.dir[tri.w]
    t = tri.nd - tri.nu * ray.orig[tri.u] - tri.nv * ray.orig[tri.v] - ray.orig[tri.w]

    # the point P in the plane of projection
    pu = ray.orig[tri.u] * scale + ray.dir[tri.u] * along
    pv = ray.orig[tri.v] * scale + ray.dir[tri.v] * along
    b = tri.bu * pu + tri.bv * pv + tri.bd * scale
    c = tri.cu * pu + tri.cv * pv + tri.cd * scale
    return pieces(denominator, t, b, c)
