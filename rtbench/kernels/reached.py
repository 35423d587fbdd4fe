"""t of the point that the weights u and v name: accurate on slivers, where a kernel's own t is not.

At a hit inside, t hardly changes when the vertices move by a rounding, however thin the triangle;
what a kernel computes from its determinants does, since each of them is one of nearly nothing. But
t = N . (u AB + v AC - AO) / N . D takes the errors of u and v away: they lie in the plane, where N
does not see them, and what errs in the length of N cancels.

The rounded cross product N of a sliver is not perpendicular to the long edges, however, by as much
as u and v are wrong, and sees their errors after all. So its part along the longer of AB and AC is
taken out: N - (N . L / L . L) L; the short way across the triangle does not matter then. Measured
against rationals, over hits of needles and caps down to 10^-5 (float32) and 10^-12 (float64) of
their length, of corners nearly in line, grazing and far away, with u and v of Möller and Trumbore,
99 of 100 errors are below 2 eps (cond_t + |t|); without that step below 150 and 10^7 of it on
needles, with their own t 4 10^4 and 2 10^11. The order in which u AB + v AC - AO is summed makes
hardly any difference, clamping u and v none. Where A is so much larger than B and C that AB and AC
do not hold these any more, u and v are no weights, and t is no better than they.

No product has more factors of an edge than N . D, so that nothing overflows or underflows first.
"""

from rtbench.kernels.contract import ONE


def reached(tri, ray, u, v):
    """Return t of the point A + u AB + v AC, in units of the direction; see the module's text."""
    v01x = tri.v1[0] - tri.v0[0]
    v01y = tri.v1[1] - tri.v0[1]
    v01z = tri.v1[2] - tri.v0[2]
    v02x = tri.v2[0] - tri.v0[0]
    v02y = tri.v2[1] - tri.v0[1]
    v02z = tri.v2[2] - tri.v0[2]
    v0ox = ray.orig[0] - tri.v0[0]
    v0oy = ray.orig[1] - tri.v0[1]
    v0oz = ray.orig[2] - tri.v0[2]
    crossx = v01y * v02z - v01z * v02y
    crossy = v01z * v02x - v01x * v02z
    crossz = v01x * v02y - v01y * v02x

    # the longer edge, and the same divided by its square
    square1 = v01x * v01x + v01y * v01y + v01z * v01z
    square2 = v02x * v02x + v02y * v02y + v02z * v02z
    longer = square1 >= square2
    longx = v01x if longer else v02x
    longy = v01y if longer else v02y
    longz = v01z if longer else v02z
    square = ONE / (square1 if longer else square2)
    part = crossx * (longx * square) + crossy * (longy * square) + crossz * (longz * square)
    normalx = crossx - part * longx
    normaly = crossy - part * longy
    normalz = crossz - part * longz

    pointx = u * v01x + v * v02x - v0ox
    pointy = u * v01y + v * v02y - v0oy
    pointz = u * v01z + v * v02z - v0oz
    above = normalx * pointx + normaly * pointy + normalz * pointz
    below = normalx * ray.dir[0] + normaly * ray.dir[1] + normalz * ray.dir[2]
    t_reached = above / below
    return t_reached
