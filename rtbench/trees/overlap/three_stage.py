"""The thesis's three stages: corners and sides, planes at 45 degrees, planes at the corners.

A corner of the triangle in the cell: it belongs there. All three beyond one side, beyond one of
the 12 planes that touch an edge, or of the 8 that touch a corner and meet all its sides at one
angle: it does not. Otherwise it is let through, for nothing at times. In world space the planes
stand at 45 degrees as described; in space scaled by the box they do so once the cell is a cube,
as in Voorhies's test; which of the two lets fewer through depends on the box and the triangles.

Every plane is a weighted sum of how far a corner lies beyond two or three sides. The weights that
scale are products of the box's lengths, so that nothing is divided by a flat cell's zero: there
the planes turn into its sides. Each distance is first made less by 2**-48 of its size, more than
all roundings after it, so that a sum above zero is one in exact arithmetic too.
"""

from rtbench.trees.overlap.rounding import shared_box


def surely_beyond(distance):
    """Return how far a corner lies at least beyond a side, for a distance rounded once."""
    return distance - abs(distance) * 2.0**-48


def beyond_sides(x, y, z, cell):
    """Return how far a corner lies beyond each side, in the order of the box's numbers."""
    return (
        surely_beyond(cell[0] - x),
        surely_beyond(cell[1] - y),
        surely_beyond(cell[2] - z),
        surely_beyond(x - cell[3]),
        surely_beyond(y - cell[4]),
        surely_beyond(z - cell[5]),
    )


def in_cell(x, y, z, cell):
    """Tell whether a corner lies in the closed cell."""
    return (
        (x >= cell[0])
        & (x <= cell[3])
        & (y >= cell[1])
        & (y <= cell[4])
        & (z >= cell[2])
        & (z <= cell[5])
    )


def beyond_edges(a, b, c, i, j, weight_i, weight_j):
    """Tell whether three corners lie beyond one of four edges, given the axes across them.

    Parameters
    ----------
    a, b, c : tuple of 6 float64
        As `beyond_sides` returns it.
    i, j : int
        The two axes.
    weight_i, weight_j : float64
    """
    for side_i in range(i, 6, 3):
        for side_j in range(j, 6, 3):
            if (
                (a[side_i] * weight_i + a[side_j] * weight_j > 0.0)
                & (b[side_i] * weight_i + b[side_j] * weight_j > 0.0)
                & (c[side_i] * weight_i + c[side_j] * weight_j > 0.0)
            ):
                return True
    return False


def beyond_corners(a, b, c, weight_x, weight_y, weight_z):
    """Tell whether three corners of a triangle lie beyond one of the eight of the cell."""
    for x in range(0, 6, 3):
        for y in range(1, 6, 3):
            for z in range(2, 6, 3):
                if (
                    (a[x] * weight_x + a[y] * weight_y + a[z] * weight_z > 1e-280)
                    & (b[x] * weight_x + b[y] * weight_y + b[z] * weight_z > 1e-280)
                    & (c[x] * weight_x + c[y] * weight_y + c[z] * weight_z > 1e-280)
                ):
                    return True
    return False


def passes_stages(triangle, cell, dx, dy, dz, corner_x, corner_y, corner_z):
    """Return whether the three stages let a triangle through.

    Parameters
    ----------
    triangle : tuple of 9 float64
    cell : tuple of 6 float64
    dx, dy, dz : float64
        The box that is a cube to the planes.
    corner_x, corner_y, corner_z : float64
        Weights of the planes at the corners: products of two of them.
    """
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = triangle
    if in_cell(x0, y0, z0, cell) | in_cell(x1, y1, z1, cell) | in_cell(x2, y2, z2, cell):
        return True
    a = beyond_sides(x0, y0, z0, cell)
    b = beyond_sides(x1, y1, z1, cell)
    c = beyond_sides(x2, y2, z2, cell)
    for side in range(6):
        if (a[side] > 0.0) & (b[side] > 0.0) & (c[side] > 0.0):
            return False
    if beyond_edges(a, b, c, 0, 1, dy, dx):
        return False
    if beyond_edges(a, b, c, 1, 2, dz, dy):
        return False
    if beyond_edges(a, b, c, 2, 0, dx, dz):
        return False
    return not beyond_corners(a, b, c, corner_x, corner_y, corner_z)


def three_stage_world_fit(triangle, own, cell, room):
    """Test against planes at 45 degrees in world space.

    Parameters, Returns: see `rtbench.trees.overlap.clipping.clipped_fit`.

    Source: Silhavy 2010, 4.1.1
    """
    lx, ly, lz, ux, uy, uz = shared_box(own, cell)
    inside = (lx <= ux) & (ly <= uy) & (lz <= uz)
    inside = inside and passes_stages(triangle, cell, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    return inside, lx, ly, lz, ux, uy, uz


def three_stage_fit(triangle, own, cell, room):
    """Test against planes at 45 degrees in space scaled to make the cell a cube.

    Parameters, Returns: see `rtbench.trees.overlap.clipping.clipped_fit`.

    Source: Silhavy 2010, 4.1.1; Voorhies 1992, Triangle-Cube Intersection (Graphics Gems III)
    """
    lx, ly, lz, ux, uy, uz = shared_box(own, cell)
    dx, dy, dz = cell[3] - cell[0], cell[4] - cell[1], cell[5] - cell[2]
    inside = (lx <= ux) & (ly <= uy) & (lz <= uz)
    inside = inside and passes_stages(triangle, cell, dx, dy, dz, dy * dz, dz * dx, dx * dy)
    return inside, lx, ly, lz, ux, uy, uz
