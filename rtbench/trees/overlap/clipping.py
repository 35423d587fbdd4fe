"""Clipping a triangle against a cell, or against what the last split cut.

Why nothing is lost by rounding (u = 2**-53, S the largest coordinate of the triangle). Suppose
that for the polygon so far there is a convex polygon P in the triangle's plane that holds all
that triangle and cell share, with corners within e of the computed ones. An edge from a to b is
cut at the computed t in [0, 1], 3 u from where the floats a and b say; the computed point lies
within 8 u S of a + (b - a) t, and so within e + 8 u S of the point of P's edge with the same t.
These points, with the corners kept, span the next P. It still holds all that is shared if the
plane was moved outward by e + 8 u S: then each corner and each edge point of P in the cell is
computed to lie on the near side, and the cut comes behind it. After all six planes e is at most
48 u S, so 64 u S is enough for the planes and for the box of the corners. Only points of P's
edges in their order were used: signs that rounding lets alternate along a polygon in the cell's
side give more corners, no harm, and where too many for the room the reference keeps its box.

The triangle's own corners are exact and bound the box as they are, also where a side goes through
one, as split planes do that were taken from a neighbour's box: it would be a pity if neighbours
that share a corner had bounds one float apart, and each cell a few needless triangles for it.
"""

import numpy as np

from rtbench.trees.overlap.rounding import downward, shared_box, upward, within_bounds


def widening(triangle):
    """Return how far a plane moves outward, and then the box: 64 roundings of any coordinate."""
    largest = abs(triangle[0])
    for i in range(1, 9):
        size = abs(triangle[i])
        largest = size if size > largest else largest
    return largest * 2.0**-47 + 1e-300


def least_of_three(a, b, c):
    """Return the least of three."""
    a = b if b < a else a
    return c if c < a else a


def greatest_of_three(a, b, c):
    """Return the greatest of three."""
    a = b if b > a else a
    return c if c > a else a


def cut_edge(room, side, i, j, axis, plane, to):
    """Write the point where the edge from corner i to corner j meets a plane."""
    start = room[side, i, axis]
    t = (plane - start) / (room[side, j, axis] - start)
    for k in range(3):
        room[1 - side, to, k] = room[side, i, k] + (room[side, j, k] - room[side, i, k]) * t
    room[1 - side, to, axis] = plane


def clipped_to_slab(room, side, count, cuts, axis, low, high, more):
    """Clip a polygon against two parallel sides of a cell, moved outward.

    Parameters
    ----------
    room : (2, 12, 3) float64 array
        The polygon's corners in ``room[side]``; the new ones go to ``room[1 - side]``.
    side : int
    count : int
        How many corners there are.
    cuts : int
        A bit for each corner, set if it was computed and is none of the triangle's.
    axis : int
    low, high, more : float64
        The sides, and how far they move outward.

    Returns
    -------
    count : int
        How many corners there are now; -1 if there is no room for them.
    cuts : int
    """
    n = 0
    bits = 0
    i = count - 1
    x = room[side, i, axis]
    low_plane, high_plane = low - more, high + more
    for j in range(count):
        if n > 9:  # an edge gives three corners at most
            return -1, 0
        next_x = room[side, j, axis]
        # A given corner in the side itself is all that an edge shares which leaves the cell there.
        if x < low_plane:
            if next_x >= low_plane and (next_x > low or (cuts >> j) & 1):
                cut_edge(room, side, i, j, axis, low_plane, n)
                bits |= 1 << n
                n += 1
        elif x > high_plane and next_x <= high_plane and (next_x < high or (cuts >> j) & 1):
            cut_edge(room, side, i, j, axis, high_plane, n)
            bits |= 1 << n
            n += 1
        if next_x < low_plane:
            if x >= low_plane and (x > low or (cuts >> i) & 1):
                cut_edge(room, side, i, j, axis, low_plane, n)
                bits |= 1 << n
                n += 1
        elif next_x > high_plane:
            if x <= high_plane and (x < high or (cuts >> i) & 1):
                cut_edge(room, side, i, j, axis, high_plane, n)
                bits |= 1 << n
                n += 1
        else:
            for k in range(3):
                room[1 - side, n, k] = room[side, j, k]
            bits |= ((cuts >> j) & 1) << n
            n += 1
        i, x = j, next_x
    return n, bits


def clipped_fit(triangle, own, cell, room):
    """Clip a triangle against a cell; its box there is the polygon's.

    Parameters
    ----------
    triangle : tuple of 9 float64
        Local corners v0x, v0y, ... v2z.
    own : tuple of 6 float64
        The reference's box so far: lx, ly, lz, ux, uy, uz; float32 numbers.
    cell : tuple of 6 float64
        The cell's box; float32 numbers.
    room : (2, 12, 3) float64 array
        Scratch.

    Returns
    -------
    inside : bool
        Whether the triangle belongs to the cell.
    lx, ly, lz, ux, uy, uz : float64
        Its box there, float32 numbers; of no meaning if it does not belong.

    Source: Sutherland & Hodgman 1974; as "perfect splits", Havran & Bittner 2002
    """
    box = shared_box(own, cell)
    if (box[0] > box[3]) | (box[1] > box[4]) | (box[2] > box[5]):
        return False, box[0], box[1], box[2], box[3], box[4], box[5]
    more = widening(triangle)
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = triangle
    lower_x, upper_x = least_of_three(x0, x1, x2), greatest_of_three(x0, x1, x2)
    lower_y, upper_y = least_of_three(y0, y1, y2), greatest_of_three(y0, y1, y2)
    lower_z, upper_z = least_of_three(z0, z1, z2), greatest_of_three(z0, z1, z2)
    cut_x = (lower_x < cell[0] - more) | (upper_x > cell[3] + more)
    cut_y = (lower_y < cell[1] - more) | (upper_y > cell[4] + more)
    cut_z = (lower_z < cell[2] - more) | (upper_z > cell[5] + more)
    if cut_x | cut_y | cut_z:
        room[0, 0, 0], room[0, 0, 1], room[0, 0, 2] = x0, y0, z0
        room[0, 1, 0], room[0, 1, 1], room[0, 1, 2] = x1, y1, z1
        room[0, 2, 0], room[0, 2, 1], room[0, 2, 2] = x2, y2, z2
        side, count, cuts = 0, 3, 0
        if cut_x:
            count, cuts = clipped_to_slab(room, side, count, cuts, 0, cell[0], cell[3], more)
            side = 1 - side
        if cut_y & (count > 0):
            count, cuts = clipped_to_slab(room, side, count, cuts, 1, cell[1], cell[4], more)
            side = 1 - side
        if cut_z & (count > 0):
            count, cuts = clipped_to_slab(room, side, count, cuts, 2, cell[2], cell[5], more)
            side = 1 - side
        if count == 0:
            return False, box[0], box[1], box[2], box[3], box[4], box[5]
        if count < 0:
            return True, box[0], box[1], box[2], box[3], box[4], box[5]
        lower_x = lower_y = lower_z = np.inf
        upper_x = upper_y = upper_z = -np.inf
        for i in range(count):
            off = more if (cuts >> i) & 1 else 0.0
            x, y, z = room[side, i, 0], room[side, i, 1], room[side, i, 2]
            lower_x, upper_x = min(lower_x, x - off), max(upper_x, x + off)
            lower_y, upper_y = min(lower_y, y - off), max(upper_y, y + off)
            lower_z, upper_z = min(lower_z, z - off), max(upper_z, z + off)
    return within_bounds(
        box,
        downward(lower_x),
        downward(lower_y),
        downward(lower_z),
        upward(upper_x),
        upward(upper_y),
        upward(upper_z),
    )


def in_order(a, b):
    """Return two points in the order of their first coordinates."""
    swap = a[0] > b[0]
    return (
        b[0] if swap else a[0],
        b[1] if swap else a[1],
        b[2] if swap else a[2],
        a[0] if swap else b[0],
        a[1] if swap else b[1],
        a[2] if swap else b[2],
    )


def bounds_between(a, b, c, low, high, more):
    """Return the bounds of the part of a triangle between two planes square to the first axis.

    Its corners are the triangle's that lie there, and for each plane that cuts the triangle a point
    of the edge that spans most and one of another edge.

    Parameters
    ----------
    a, b, c : tuple of 3 float64
        Corners, with the axis of the planes first.
    low, high : float64
    more : float64
        How far computed points may lie off.

    Returns
    -------
    lower_y, upper_y, lower_z, upper_z : float64
        Of the other two axes; lower above upper if nothing lies between.
    """
    ax, ay, az, bx, by, bz = in_order(a, b)
    bx, by, bz, cx, cy, cz = in_order((bx, by, bz), c)
    ax, ay, az, bx, by, bz = in_order((ax, ay, az), (bx, by, bz))
    below, above = bx < low, bx > high
    outside = below | above
    ly, uy = np.inf if outside else by, -np.inf if outside else by
    lz, uz = np.inf if outside else bz, -np.inf if outside else bz
    if (low > cx) | (high < ax):
        return ly, uy, lz, uz
    if ax < low:
        t = (low - ax) / (cx - ax)
        y0, z0 = ay + (cy - ay) * t, az + (cz - az) * t
        touched = bx == low  # the other edge ends there: no point of it is to be computed
        px, py, pz = bx if below else ax, by if below else ay, bz if below else az
        qx, qy, qz = cx if below else bx, cy if below else by, cz if below else bz
        t = (low - px) / (qx - px)
        y1, z1 = py + (qy - py) * t, pz + (qz - pz) * t
        y1, z1 = y0 if touched else y1, z0 if touched else z1
        ly, uy = (
            least_of_three(ly, y0 - more, y1 - more),
            greatest_of_three(uy, y0 + more, y1 + more),
        )
        lz, uz = (
            least_of_three(lz, z0 - more, z1 - more),
            greatest_of_three(uz, z0 + more, z1 + more),
        )
    else:
        ly, uy, lz, uz = min(ly, ay), max(uy, ay), min(lz, az), max(uz, az)
    if cx > high:
        t = (high - ax) / (cx - ax)
        y0, z0 = ay + (cy - ay) * t, az + (cz - az) * t
        touched = bx == high
        px, py, pz = ax if above else bx, ay if above else by, az if above else bz
        qx, qy, qz = bx if above else cx, by if above else cy, bz if above else cz
        t = (high - px) / (qx - px)
        y1, z1 = py + (qy - py) * t, pz + (qz - pz) * t
        y1, z1 = y0 if touched else y1, z0 if touched else z1
        ly, uy = (
            least_of_three(ly, y0 - more, y1 - more),
            greatest_of_three(uy, y0 + more, y1 + more),
        )
        lz, uz = (
            least_of_three(lz, z0 - more, z1 - more),
            greatest_of_three(uz, z0 + more, z1 + more),
        )
    else:
        ly, uy, lz, uz = min(ly, cy), max(uy, cy), min(lz, cz), max(uz, cz)
    return ly, uy, lz, uz


def plane_clipped_fit(triangle, own, cell, room):
    """Clip a triangle between the two planes of one axis, where the cell cuts off its box.

    That is all that a split cuts off; what lies beyond earlier splits is known by the box alone.
    Where the cell cuts the box on several axes, only the first is taken.

    Parameters, Returns: see `clipped_fit`.
    """
    box = shared_box(own, cell)
    if (box[0] > box[3]) | (box[1] > box[4]) | (box[2] > box[5]):
        return False, box[0], box[1], box[2], box[3], box[4], box[5]
    more = widening(triangle)
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = triangle
    lx, ly, lz, ux, uy, uz = box
    if (lx > own[0]) | (ux < own[3]):
        ly, uy, lz, uz = bounds_between((x0, y0, z0), (x1, y1, z1), (x2, y2, z2), lx, ux, more)
        ly, uy, lz, uz = downward(ly), upward(uy), downward(lz), upward(uz)
    elif (ly > own[1]) | (uy < own[4]):
        lz, uz, lx, ux = bounds_between((y0, z0, x0), (y1, z1, x1), (y2, z2, x2), ly, uy, more)
        lz, uz, lx, ux = downward(lz), upward(uz), downward(lx), upward(ux)
    elif (lz > own[2]) | (uz < own[5]):
        lx, ux, ly, uy = bounds_between((z0, x0, y0), (z1, x1, y1), (z2, x2, y2), lz, uz, more)
        lx, ux, ly, uy = downward(lx), upward(ux), downward(ly), upward(uy)
    return within_bounds(box, lx, ly, lz, ux, uy, uz)
