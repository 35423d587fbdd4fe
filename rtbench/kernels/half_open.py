"""Half-open edges: of triangles that share an edge or a vertex a ray hits one, ties and all.

The rasteriser's rule, taken as a crossing number. The axis along which the direction is greatest
becomes z, and all is sheared so that the ray runs along it: vertices become points of a plane, the
ray its origin. Of a triangle two edges cross the x axis or none does, where y = 0 counts as below:
(p_y > 0) != (q_y > 0). An edge that does is *right* if it does at an x > 0: p_x q_y - p_y q_x has
the sign of x if the edge goes up, the other if it goes down. The triangle is hit if one of the two
is right and the other is not. So an edge that the ray meets belongs to the triangle on its right,
a level one to the triangle above it.

Exactly one, in exact arithmetic
--------------------------------
Look from (e, e^2) for a very small e > 0. A vertex with y = 0 lies below that point. Where an edge
crosses y = 0 at x, it crosses y = e^2 at x + O(e^2): beyond e if x > 0, before it if x <= 0. So the
edges that are right are those which the half line from (e, e^2) along +x meets, each in its inside,
and the rule, an odd number of them, is the even-odd rule of a point on no edge. Whatever edge or
vertex the ray meets, such a point lies in exactly one triangle of a mesh that covers its
surroundings once, and in none without an area. (No e is computed: it only says which comparisons
admit equality.)

No leak, in floating point
--------------------------
A vertex becomes the same point in every triangle that has it. Whether an edge is right depends on
its two points alone, and is bit for bit the same in either direction: products commute, a
difference only changes its sign. In the sum modulo 2 of the hits of a closed fan each inner edge
counts twice, which leaves that of its outline: if the ray is well inside that, an odd number of
triangles is hit, whatever rounding does near the inner edges and the vertex. So at least one; three
only where rounding folds the fan. Of two triangles with the ray well inside both together, exactly
one is hit. Neither the order of the vertices nor the way that a triangle is turned matters.

This holds as long as t decides nothing: near 0 and tmax two triangles may have different ones, and
of a triangle that rounding leaves without any width it may be NaN, and the triangle missed.

t is that of the point which the edge functions name, as in `rtbench.kernels.reached`, from vertices
relative to the ray's origin. NaN and infinity in the input make it NaN, 0 or infinite, which
misses. u and v are computed once more: an edge function p x q errs by roundings of |p| |q|, and a
triangle with a short edge is smaller than that; but the difference of near vertices is exact, and
(p - q) x q, q the nearer of the two to the ray, errs by roundings of |p - q| |q| alone.

Source: shear and edge functions Woop, Benthin & Wald 2013; crossing number Shimrat 1962.
"""

from rtbench.kernels.contract import HIT, NO_T, ONE, ZERO, kernel


def edge_function(px, py, qx, qy):
    """Return twice the area of the origin, p and q; of q and p it is the same with a minus."""
    return px * qy - py * qx


def right(area, py, qy):
    """Tell whether the edge from p to q crosses the x axis at an x > 0, given its edge function."""
    return (area > ZERO) & (py <= ZERO) & (qy > ZERO) | (area < ZERO) & (py > ZERO) & (qy <= ZERO)


def left(area, py, qy):
    """Tell whether the edge from p to q crosses the x axis at an x <= 0."""
    return (area <= ZERO) & (py <= ZERO) & (qy > ZERO) | (area >= ZERO) & (py > ZERO) & (qy <= ZERO)


def clamped(x):
    """Return x brought into [0, 1]; 0 of NaN."""
    return (x if x < ONE else ONE) if x > ZERO else ZERO


@kernel(
    title="Half-open edges, each of one triangle alone",
    method="Half-open edges",
    domain="ray",
    outcomes=("hit", "outside the edges", "t outside (0, tmax)"),
    outputs=("t", "u", "v"),
    source="top-left rule; Woop, Benthin & Wald 2013; Shimrat 1962",
    claims=("S1", "S2", "S3", "S4", "S5", "S6", "X2"),
)
def half_open(tri, ray, tmax):
    # the axis along which the direction is greatest, of equals the first, and the two after it
    x_size, y_size, z_size = abs(ray.dir[0]), abs(ray.dir[1]), abs(ray.dir[2])
    kz = 0 if (x_size >= y_size) & (x_size >= z_size) else (1 if y_size >= z_size else 2)
    kx = 0 if kz == 2 else kz + 1
    ky = 0 if kx == 2 else kx + 1
    d0, d1, d2 = ray.dir[kx], ray.dir[ky], ray.dir[kz]
    inverse = ONE / d2
    shear_x = d0 * inverse
    shear_y = d1 * inverse

    # OA, OB, OC along these axes; sheared
    a0 = tri.v0[kx] - ray.orig[kx]
    a1 = tri.v0[ky] - ray.orig[ky]
    a2 = tri.v0[kz] - ray.orig[kz]
    b0 = tri.v1[kx] - ray.orig[kx]
    b1 = tri.v1[ky] - ray.orig[ky]
    b2 = tri.v1[kz] - ray.orig[kz]
    c0 = tri.v2[kx] - ray.orig[kx]
    c1 = tri.v2[ky] - ray.orig[ky]
    c2 = tri.v2[kz] - ray.orig[kz]
    ax = a0 - shear_x * a2
    ay = a1 - shear_y * a2
    bx = b0 - shear_x * b2
    by = b1 - shear_y * b2
    cx = c0 - shear_x * c2
    cy = c1 - shear_y * c2

    # BC, CA, AB: two of them cross the axis or none does
    at_a = edge_function(bx, by, cx, cy)
    at_b = edge_function(cx, cy, ax, ay)
    at_c = edge_function(ax, ay, bx, by)
    on_right = right(at_a, by, cy) | right(at_b, cy, ay) | right(at_c, ay, by)
    on_left = left(at_a, by, cy) | left(at_b, cy, ay) | left(at_c, ay, by)
    if not (on_right & on_left):
        return 1, NO_T, NO_T, NO_T
    "condition: u, v"

    # the point P that the edge functions name
    whole = at_a + at_b + at_c
    wa = clamped(at_a / whole)
    wb = clamped(at_b / whole)
    wc = clamped(at_c / whole)
    p0 = wa * a0 + wb * b0 + wc * c0
    p1 = wa * a1 + wb * b1 + wc * c1
    p2 = wa * a2 + wb * b2 + wc * c2

    # N = AB x AC without its part along the longer of the two
    e0 = b0 - a0
    e1 = b1 - a1
    e2 = b2 - a2
    f0 = c0 - a0
    f1 = c1 - a1
    f2 = c2 - a2
    n0 = e1 * f2 - e2 * f1
    n1 = e2 * f0 - e0 * f2
    n2 = e0 * f1 - e1 * f0
    square_e = e0 * e0 + e1 * e1 + e2 * e2
    square_f = f0 * f0 + f1 * f1 + f2 * f2
    longer = square_e >= square_f
    l0 = e0 if longer else f0
    l1 = e1 if longer else f1
    l2 = e2 if longer else f2
    square = ONE / (square_e if longer else square_f)
    part = n0 * (l0 * square) + n1 * (l1 * square) + n2 * (l2 * square)
    n0p = n0 - part * l0
    n1p = n1 - part * l1
    n2p = n2 - part * l2

    # t = N . P / N . D
    above = n0p * p0 + n1p * p1 + n2p * p2
    t = above / (n0p * d0 + n1p * d1 + n2p * d2)
    if not ((t > ZERO) & (t < tmax)):
        return 2, NO_T, NO_T, NO_T
    "condition: t"

    # u and v once more from the edges, of which a short one is exact: an edge with the nearer of
    # its vertices, the whole with the two shorter edges
    ab_x = bx - ax
    ab_y = by - ay
    ac_x = cx - ax
    ac_y = cy - ay
    bc_x = cx - bx
    bc_y = cy - by
    ab_square = ab_x * ab_x + ab_y * ab_y
    ac_square = ac_x * ac_x + ac_y * ac_y
    bc_square = bc_x * bc_x + bc_y * bc_y
    no_ab = (ab_square >= ac_square) & (ab_square >= bc_square)
    no_bc = (bc_square > ab_square) & (bc_square >= ac_square)
    total = edge_function(
        ac_x if no_ab else ab_x,
        ac_y if no_ab else ab_y,
        ac_x if no_bc else bc_x,
        ac_y if no_bc else bc_y,
    )
    a_square = ax * ax + ay * ay
    b_square = bx * bx + by * by
    c_square = cx * cx + cy * cy
    ab_swapped = b_square < a_square
    ac_swapped = c_square < a_square
    ab_area = edge_function(bx if ab_swapped else ax, by if ab_swapped else ay, ab_x, ab_y)
    ac_area = edge_function(ac_x, ac_y, cx if ac_swapped else ax, cy if ac_swapped else ay)
    u = clamped(ac_area / total)
    v = clamped(ab_area / total)
    return HIT, t, u, v
