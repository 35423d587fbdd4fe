"""Baldwin and Weber's test: the affine map that takes the triangle to the unit triangle.

Baldwin & Weber 2016, sections 2 and 3. The map takes A, B, C to (0, 0, 0), (1, 0, 0), (0, 1, 0);
its rows give b, c and the height above the plane. One of its columns is free: along the axis on
which the normal is greatest it becomes (0, 0, 1), so that nine numbers and that axis are stored.
The three axes stand in the room that a row of 16 bytes leaves, as in `wald`, whose equations these
become; what differs is how the constants of the map are rounded.
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.projection import along, axes
from rtbench.kernels.vectors import corners, cross, difference, dot


def transformation(tri):
    """Compute the rows of the map to the unit triangle, without the column that is (0, 0, 1).

    Returns
    -------
    dict
        ``bu, bv, bd`` and ``cu, cv, cd``: b = bu P_u + bv P_v + bd, c likewise; ``nu, nv, nd``:
        the height is nu P_u + nv P_v + P_w + nd; ``w, u, v``: the axis on which the normal is
        greatest, and those after it.

    Source
    ------
    Baldwin & Weber 2016, section 3.
    """
    a, b, c = corners(tri)
    ab, ac = difference(b, a), difference(c, a)
    normal = cross(ab, ac)
    w, u, v = axes(normal)
    nw = along(normal, w)
    au, av = along(a, u), along(a, v)
    return {
        "bu": along(ac, v) / nw,
        "bv": -along(ac, u) / nw,
        "bd": (along(c, u) * av - along(c, v) * au) / nw,
        "cu": -along(ab, v) / nw,
        "cv": along(ab, u) / nw,
        "cd": (along(b, v) * au - along(b, u) * av) / nw,
        "nu": along(normal, u) / nw,
        "nv": along(normal, v) / nw,
        "nd": -dot(a, normal) / nw,
        "w": w,
        "u": u,
        "v": v,
    }


@method(
    title="Baldwin-Weber, transformation to the unit triangle",
    method="Baldwin-Weber",
    source="Baldwin & Weber 2016",
    prepare=transformation,
    stored="precomputed",
)
def baldwin_weber(tri, ray, along, scale):
    # the ray's heights above the plane: of O, and per unit of t
    denominator = ray.dir[tri.w] + tri.nu * ray.dir[tri.u] + tri.nv * ray.dir[tri.v]
    t = -(ray.orig[tri.w] + tri.nu * ray.orig[tri.u] + tri.nv * ray.orig[tri.v] + tri.nd)

    # the point P of the plane, transformed
    pu = ray.orig[tri.u] * scale + ray.dir[tri.u] * along
    pv = ray.orig[tri.v] * scale + ray.dir[tri.v] * along
    b = tri.bu * pu + tri.bv * pv + tri.bd * scale
    c = tri.cu * pu + tri.cv * pv + tri.cd * scale
    return pieces(denominator, t, b, c)
