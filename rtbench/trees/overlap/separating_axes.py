"""Separating axes: the exact answer, but for rounding, which never says no.

Everything is taken relative to a corner of the triangle, so that a difference of coordinates is
rounded once, by 2**-53 of itself; what is said to lie apart lies apart by more than 2**-48 of the
products that were summed, which is more than all roundings in them (and by 1e-280, where products
of tiny numbers underflow).
"""

from rtbench.trees.overlap.clipping import greatest_of_three, least_of_three
from rtbench.trees.overlap.rounding import shared_box


def apart_along_axis(p, q, across, low_p, high_p, low_q, high_q):
    """Tell whether a box and a triangle lie apart along an axis square to an edge and to x, y or z.

    All relative to the edge's start, in the two coordinates that the axis has.

    Parameters
    ----------
    p, q : float64
        The edge.
    across : tuple of 2 float64
        The triangle's third corner.
    low_p, high_p, low_q, high_q : float64
        The box.

    Returns
    -------
    bool
    """
    # The axis is (-q, p): the edge itself lies at 0 along it.
    third = p * across[1] - q * across[0]
    at = (p * low_q - q * low_p, p * low_q - q * high_p, p * high_q - q * low_p)
    last = p * high_q - q * high_p
    lower = least_of_three(at[0], at[1], at[2])
    lower = last if last < lower else lower
    upper = greatest_of_three(at[0], at[1], at[2])
    upper = last if last > upper else upper
    size_p = greatest_of_three(abs(low_p), abs(high_p), abs(across[0]))
    size_q = greatest_of_three(abs(low_q), abs(high_q), abs(across[1]))
    error = (abs(p) * size_q + abs(q) * size_p) * 2.0**-48 + 1e-280
    return (lower > greatest_of_three(0.0, third, 0.0) + error) | (
        upper < least_of_three(0.0, third, 0.0) - error
    )


def apart_along_edge(ax, ay, az, bx, by, bz, cx, cy, cz, cell):
    """Tell whether one of the three axes that belong to the edge from a to b separates."""
    ex, ey, ez = bx - ax, by - ay, bz - az
    fx, fy, fz = cx - ax, cy - ay, cz - az
    lx, ly, lz = cell[0] - ax, cell[1] - ay, cell[2] - az
    ux, uy, uz = cell[3] - ax, cell[4] - ay, cell[5] - az
    return (
        apart_along_axis(ey, ez, (fy, fz), ly, uy, lz, uz)
        or apart_along_axis(ez, ex, (fz, fx), lz, uz, lx, ux)
        or apart_along_axis(ex, ey, (fx, fy), lx, ux, ly, uy)
    )


def apart_along_normal(triangle, cell):
    """Tell whether the cell lies on one side of the triangle's plane."""
    x, y, z = triangle[0], triangle[1], triangle[2]
    ax, ay, az = triangle[3] - x, triangle[4] - y, triangle[5] - z
    bx, by, bz = triangle[6] - x, triangle[7] - y, triangle[8] - z
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    size_x = abs(ay * bz) + abs(az * by)
    size_y = abs(az * bx) + abs(ax * bz)
    size_z = abs(ax * by) + abs(ay * bx)
    lx, ly, lz = cell[0] - x, cell[1] - y, cell[2] - z
    ux, uy, uz = cell[3] - x, cell[4] - y, cell[5] - z
    lower = min(nx * lx, nx * ux) + min(ny * ly, ny * uy) + min(nz * lz, nz * uz)
    upper = max(nx * lx, nx * ux) + max(ny * ly, ny * uy) + max(nz * lz, nz * uz)
    error = size_x * max(abs(lx), abs(ux))
    error += size_y * max(abs(ly), abs(uy))
    error += size_z * max(abs(lz), abs(uz))
    error = error * 2.0**-48 + 1e-280
    return (lower > error) | (upper < -error)


def separating_axes_fit(triangle, own, cell, room):
    """Look for an axis along which triangle and cell lie apart, of the 13 that matter.

    Parameters, Returns: see `rtbench.trees.overlap.clipping.clipped_fit`.

    Source: Akenine-Moller 2001
    """
    lx, ly, lz, ux, uy, uz = shared_box(own, cell)
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = triangle
    inside = (lx <= ux) & (ly <= uy) & (lz <= uz)
    inside = inside and not (
        (least_of_three(x0, x1, x2) > cell[3])
        | (least_of_three(y0, y1, y2) > cell[4])
        | (least_of_three(z0, z1, z2) > cell[5])
        | (greatest_of_three(x0, x1, x2) < cell[0])
        | (greatest_of_three(y0, y1, y2) < cell[1])
        | (greatest_of_three(z0, z1, z2) < cell[2])
    )
    inside = inside and not (
        apart_along_normal(triangle, cell)
        or apart_along_edge(x0, y0, z0, x1, y1, z1, x2, y2, z2, cell)
        or apart_along_edge(x1, y1, z1, x2, y2, z2, x0, y0, z0, cell)
        or apart_along_edge(x2, y2, z2, x0, y0, z0, x1, y1, z1, cell)
    )
    return inside, lx, ly, lz, ux, uy, uz
