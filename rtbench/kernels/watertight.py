"""Woop, Benthin and Wald's watertight test, as published and made safe.

Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1). The vertices are moved
by the ray's origin and sheared until the ray runs along its dominant axis; what is left are edge
functions in two dimensions. A vertex has the same sheared coordinates in all its triangles, and an
edge function changes nothing but its sign where the edge's ends are swapped, so two triangles never
disagree about the edge they share. Rounded products compare as exact ones do unless they are equal:
only an edge function that is 0 is computed again, in float64 (it needs no more in float32).

`watertight` accepts NaN, as the published listing does. `watertight_safe` differs in this:

- comparisons fail on NaN, and the determinant must be finite;
- t is N.(u e + v f - s) / N.d, in which the error of the normal N cancels, instead of the sum of
  weighted depths, and t, u and v of slender triangles come from `rtbench.kernels.where`; a point
  inside lies between the depths of the vertices, and so does its t: a triangle ahead is not lost.
"""

import math

from rtbench.kernels.contract import HIT, NO_T, ONE, UNDECIDED, ZERO, kernel
from rtbench.kernels.endings import INFINITY, flipped
from rtbench.kernels.exact_signs import double
from rtbench.kernels.projection import axes
from rtbench.kernels.vectors import difference
from rtbench.kernels.where import SLENDER, doubles, where


def sheared(vertex, orig, dir, kx, ky, kz):
    """Return a vertex moved by the origin and sheared along the ray."""
    p = difference(vertex, orig)
    x = p[kx] - dir[kx] / dir[kz] * p[kz]
    y = p[ky] - dir[ky] / dir[kz] * p[kz]
    return x, y, ONE / dir[kz] * p[kz]


def edge_function(p, q):
    """Return p.y q.x - p.x q.y in float64, of which the sign is right."""
    return double(p[1]) * double(q[0]) - double(p[0]) * double(q[1])


def in_double(v0, v1, v2, orig, dir):
    """Return the sheared vertices, and the three edge functions computed in float64."""
    kz, kx, ky = axes(dir)
    a = sheared(v0, orig, dir, kx, ky, kz)
    b = sheared(v1, orig, dir, kx, ky, kz)
    c = sheared(v2, orig, dir, kx, ky, kz)
    return a, b, c, edge_function(b, c), edge_function(c, a), edge_function(a, b)


def again(v0, v1, v2, orig, dir, tmax):
    """Decide by edge functions in float64, as published."""
    a, b, c, at_a, at_b, at_c = in_double(v0, v1, v2, orig, dir)
    below = at_a < 0.0 or at_b < 0.0 or at_c < 0.0
    above = at_a > 0.0 or at_b > 0.0 or at_c > 0.0
    det = at_a + at_b + at_c
    if (below and above) or det == 0.0:
        return 1, math.nan, math.nan, math.nan
    along = at_a * a[2] + at_b * b[2] + at_c * c[2]
    t = -along if det < 0.0 else along
    if t < 0.0 or t > tmax * abs(det):
        return 2, math.nan, math.nan, math.nan
    inverse = 1.0 / det
    return HIT, along * inverse, at_b * inverse, at_c * inverse


@kernel(
    title="Watertight, as published",
    method="watertight",
    domain="ray",
    outcomes=("hit", "outside", "t outside (0, tmax)"),
    outputs=("t", "u", "v"),
    source="Woop, Benthin & Wald 2013, appendix A",
    fallback=again,
    claims=("S2", "S6"),
)
def watertight(tri, ray, tmax):
    # the axis of the greatest component of the direction, and the two that follow it
    dx, dy, dz = abs(ray.dir[0]), abs(ray.dir[1]), abs(ray.dir[2])
    kz = 0 if (dx >= dy) & (dx >= dz) else (1 if dy >= dz else 2)
    kx = 0 if kz == 2 else kz + 1
    ky = 0 if kx == 2 else kx + 1

    # the shear
    sx = ray.dir[kx] / ray.dir[kz]
    sy = ray.dir[ky] / ray.dir[kz]
    sz = ONE / ray.dir[kz]

    # the vertices, moved and sheared
    az = tri.v0[kz] - ray.orig[kz]
    bz = tri.v1[kz] - ray.orig[kz]
    cz = tri.v2[kz] - ray.orig[kz]
    ax = tri.v0[kx] - ray.orig[kx] - sx * az
    ay = tri.v0[ky] - ray.orig[ky] - sy * az
    bx = tri.v1[kx] - ray.orig[kx] - sx * bz
    by = tri.v1[ky] - ray.orig[ky] - sy * bz
    cx = tri.v2[kx] - ray.orig[kx] - sx * cz
    cy = tri.v2[ky] - ray.orig[ky] - sy * cz

    # edge functions: U of the edge opposite v0, V, W
    u = cx * by - cy * bx
    v = ax * cy - ay * cx
    w = bx * ay - by * ax
    if ((u < ZERO) | (v < ZERO) | (w < ZERO)) & ((u > ZERO) | (v > ZERO) | (w > ZERO)):
        return 1, NO_T, NO_T, NO_T
    "edges"
    sure = (u != ZERO) & (v != ZERO) & (w != ZERO)

    det = u + v + w
    along = u * (sz * az) + v * (sz * bz) + w * (sz * cz)
    t = flipped(along, det)
    if sure & ((t < ZERO) | (t > tmax * abs(det))):
        return 2, NO_T, NO_T, NO_T
    inverse = ONE / det
    return HIT if sure else UNDECIDED, along * inverse, v * inverse, w * inverse


def again_safely(v0, v1, v2, orig, dir, tmax):
    """Decide by edge functions in float64, so that NaN and infinity miss."""
    a, b, c, at_a, at_b, at_c = in_double(v0, v1, v2, orig, dir)
    det = at_a + at_b + at_c
    positive = at_a >= 0.0 and at_b >= 0.0 and at_c >= 0.0
    negative = at_a <= 0.0 and at_b <= 0.0 and at_c <= 0.0
    if not ((positive or negative) and 0.0 < abs(det) < math.inf):
        return 1, math.nan, math.nan, math.nan
    nearest = min(double(a[2]), double(b[2]), double(c[2]))
    farthest = max(double(a[2]), double(b[2]), double(c[2]))
    t, u, v = where(doubles(v0), doubles(v1), doubles(v2), doubles(orig), doubles(dir))
    if not (abs(t) < math.inf and u + v >= 0.0):  # seen edge-on, exactly, or without an area
        u, v = at_b / det, at_c / det
        t = (at_a * a[2] + at_b * b[2] + at_c * c[2]) / det
    t = min(max(t, nearest), farthest)
    return HIT if 0.0 < t < tmax else 2, t, u, v


@kernel(
    title="Watertight, safe from NaN, stable t",
    method="watertight",
    domain="ray",
    outcomes=("hit", "outside", "t outside (0, tmax)"),
    outputs=("t", "u", "v"),
    source="Woop, Benthin & Wald 2013; comparisons and t: ours",
    fallback=again_safely,
    claims=("S1", "S2", "S3", "S4", "S5", "S6"),
)
def watertight_safe(tri, ray, tmax):
    # the axis of the greatest component of the direction, and the two that follow it
    dx, dy, dz = abs(ray.dir[0]), abs(ray.dir[1]), abs(ray.dir[2])
    kz = 0 if (dx >= dy) & (dx >= dz) else (1 if dy >= dz else 2)
    kx = 0 if kz == 2 else kz + 1
    ky = 0 if kx == 2 else kx + 1

    # the shear
    sx = ray.dir[kx] / ray.dir[kz]
    sy = ray.dir[ky] / ray.dir[kz]
    sz = ONE / ray.dir[kz]

    # the vertices, moved and sheared
    az = tri.v0[kz] - ray.orig[kz]
    bz = tri.v1[kz] - ray.orig[kz]
    cz = tri.v2[kz] - ray.orig[kz]
    ax = tri.v0[kx] - ray.orig[kx] - sx * az
    ay = tri.v0[ky] - ray.orig[ky] - sy * az
    bx = tri.v1[kx] - ray.orig[kx] - sx * bz
    by = tri.v1[ky] - ray.orig[ky] - sy * bz
    cx = tri.v2[kx] - ray.orig[kx] - sx * cz
    cy = tri.v2[ky] - ray.orig[ky] - sy * cz

    # edge functions of the edges opposite v0, v1 and v2
    at_a = cx * by - cy * bx
    at_b = ax * cy - ay * cx
    at_c = bx * ay - by * ax
    least = min(at_a, at_b, at_c)
    most = max(at_a, at_b, at_c)
    if (least < ZERO) & (most > ZERO):
        return 1, NO_T, NO_T, NO_T
    "edges"

    det = at_a + at_b + at_c
    inverse = ONE / det
    u = at_b * inverse
    v = at_c * inverse

    # N = e x f, and the point inside seen from the origin
    ex = tri.v1[0] - tri.v0[0]
    ey = tri.v1[1] - tri.v0[1]
    ez = tri.v1[2] - tri.v0[2]
    fx = tri.v2[0] - tri.v0[0]
    fy = tri.v2[1] - tri.v0[1]
    fz = tri.v2[2] - tri.v0[2]
    nx = ey * fz - ez * fy
    ny = ez * fx - ex * fz
    nz = ex * fy - ey * fx
    px = tri.v0[0] - ray.orig[0] + (u * ex + v * fx)
    py = tri.v0[1] - ray.orig[1] + (u * ey + v * fy)
    pz = tri.v0[2] - ray.orig[2] + (u * ez + v * fz)
    nd = ray.dir[0] * nx + ray.dir[1] * ny + ray.dir[2] * nz
    t = (nx * px + ny * py + nz * pz) / nd
    reach = abs(ax) + abs(ay) + abs(bx) + abs(by) + abs(cx) + abs(cy)

    # between the depths of the vertices
    depth_a, depth_b, depth_c = sz * az, sz * bz, sz * cz
    finite = (abs(t) < INFINITY) & (abs(det) < INFINITY) & (reach * reach < SLENDER * abs(det))
    t = min(max(t, min(depth_a, depth_b, depth_c)), max(depth_a, depth_b, depth_c))
    sure = ((least > ZERO) | (most < ZERO)) & finite
    if sure & ((t <= ZERO) | (t >= tmax)):
        return 2, NO_T, NO_T, NO_T
    return HIT if sure else UNDECIDED, t, u, v
