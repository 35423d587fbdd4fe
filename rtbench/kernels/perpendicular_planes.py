"""Perpendicular planes: Wald's test without projection, Havel's own.

Havel 2008, section 3.5, right as printed: b is the distance from the plane through AC that is
perpendicular to the triangle and from which B has the distance 1; c likewise. Twelve numbers a
triangle, as many as rows of 16 bytes make of Wald's ten (4.3.6), and no axis to choose.
"""

from rtbench.kernels.pieces import method, pieces
from rtbench.kernels.vectors import corners, cross, difference, dot, quotient


def planes(tri):
    """Compute the triangle's plane and the two perpendicular to it.

    Returns
    -------
    dict
        ``n`` = AB x AC and ``nd`` = -N . A; ``nb`` = AC x N / N.N, ``bd`` = -N_b . A; ``nc`` =
        N x AB / N.N, ``cd`` = -N_c . A.

    Source
    ------
    Havel 2008, section 3.5.
    """
    a, b, c = corners(tri)
    ab, ac = difference(b, a), difference(c, a)
    normal = cross(ab, ac)
    square = dot(normal, normal)
    nb = quotient(cross(ac, normal), square)
    nc = quotient(cross(normal, ab), square)
    return {
        "n": normal,
        "nd": -dot(normal, a),
        "nb": nb,
        "bd": -dot(nb, a),
        "nc": nc,
        "cd": -dot(nc, a),
    }


@method(
    title="Perpendicular planes",
    method="Perpendicular planes",
    source="Havel 2008, 3.5",
    prepare=planes,
    stored="precomputed",
)
def perpendicular_planes(tri, ray, along, scale):
    denominator = tri.n[0] * ray.dir[0] + tri.n[1] * ray.dir[1] + tri.n[2] * ray.dir[2]
    t = -(tri.n[0] * ray.orig[0] + tri.n[1] * ray.orig[1] + tri.n[2] * ray.orig[2] + tri.nd)

    # the point P
    px = ray.orig[0] * scale + ray.dir[0] * along
    py = ray.orig[1] * scale + ray.dir[1] * along
    pz = ray.orig[2] * scale + ray.dir[2] * along
    b = tri.nb[0] * px + tri.nb[1] * py + tri.nb[2] * pz + tri.bd * scale
    c = tri.nc[0] * px + tri.nc[1] * py + tri.nc[2] * pz + tri.cd * scale
    return pieces(denominator, t, b, c, normal=(tri.n[0], tri.n[1], tri.n[2]))
