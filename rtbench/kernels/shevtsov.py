"""Shevtsov, Soupikov and Kapustin's test: Plücker's, projected into one plane.

Shevtsov et al. 2007; Havel 2008, sections 3.3.3 and 4.3.2. Against the text there: N_u, N_v and d
are divided by N_w, while the N_w under the edges is the undivided one; and the sign (-1)^w holds
for axes in ascending order only: with u and v following w in a circle (4.2.5) it is left out.
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.projection import along, axes
from rtbench.kernels.vectors import corners, cross, difference


def projected(tri):
    """Compute the plane divided by its component along w, and vertex and edges in projection.

    Returns
    -------
    dict
        ``nu, nv, nd``: N_u / N_w, N_v / N_w, N . A / N_w; ``au, av``: A; ``eou, eov``: AB / N_w;
        ``eiu, eiv``: AC / N_w; ``w, u, v``: the axes.

    Source
    ------
    Havel 2008, section 3.3.3.
    """
    a, b, c = corners(tri)
    ab, ac = difference(b, a), difference(c, a)
    normal = cross(ab, ac)
    w, u, v = axes(normal)
    nw = along(normal, w)
    nu, nv = along(normal, u) / nw, along(normal, v) / nw
    au, av = along(a, u), along(a, v)
    return {
        "nu": nu,
        "nv": nv,
        "nd": nu * au + nv * av + along(a, w),
        "au": au,
        "av": av,
        "eou": along(ab, u) / nw,
        "eov": along(ab, v) / nw,
        "eiu": along(ac, u) / nw,
        "eiv": along(ac, v) / nw,
        "w": w,
        "u": u,
        "v": v,
    }


@method(
    title="Shevtsov-Soupikov-Kapustin, Plücker in the plane of projection",
    method="Shevtsov-Soupikov-Kapustin",
    source="Shevtsov, Soupikov & Kapustin 2007; Havel 2008, 3.3.3",
    prepare=projected,
    stored="precomputed",
)
def shevtsov(tri, ray, along, scale):
    denominator = ray.dir[tri.u] * tri.nu + ray.dir[tri.v] * tri.nv + ray.dir[tri.w]
    t = tri.nd - (ray.orig[tri.u] * tri.nu + ray.orig[tri.v] * tri.nv + ray.orig[tri.w])

    # T: from A to the point of the plane
    tu = ray.dir[tri.u] * along - (tri.au - ray.orig[tri.u]) * scale
    tv = ray.dir[tri.v] * along - (tri.av - ray.orig[tri.v]) * scale
    b = tri.eiv * tu - tri.eiu * tv
    c = tri.eou * tv - tri.eov * tu
    return pieces(denominator, t, b, c)
