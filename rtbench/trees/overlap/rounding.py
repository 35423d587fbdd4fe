"""Rounding outward, from float64 to float32: a box may only grow."""

import numpy as np


def downward(x):
    """Return the greatest float32 that is not above x, as float64; never -0.0."""
    nearest = np.float64(np.float32(x))
    # Over half the gap to the float32 below and less than one and a half: it rounds to that one.
    gap = max(abs(nearest) * (2.0**-24 + 2.0**-40), 1.5 * 2.0**-150)
    below = np.float64(np.float32(nearest - gap))
    return (nearest if nearest <= x else below) + 0.0


def upward(x):
    """Return the least float32 that is not below x, as float64; never -0.0."""
    return 0.0 - downward(-x)


def shared_box(own, cell):
    """Return the part of a reference's box that lies in a cell, empty if a lower exceeds an upper.

    Parameters
    ----------
    own, cell : tuple of 6 float64
        lx, ly, lz, ux, uy, uz; float32 numbers.

    Returns
    -------
    tuple of 6 float64
    """
    return (
        (own[0] if own[0] > cell[0] else cell[0]) + 0.0,
        (own[1] if own[1] > cell[1] else cell[1]) + 0.0,
        (own[2] if own[2] > cell[2] else cell[2]) + 0.0,
        (own[3] if own[3] < cell[3] else cell[3]) + 0.0,
        (own[4] if own[4] < cell[4] else cell[4]) + 0.0,
        (own[5] if own[5] < cell[5] else cell[5]) + 0.0,
    )


def within_bounds(box, lower_x, lower_y, lower_z, upper_x, upper_y, upper_z):
    """Return what a fit returns: a box's part between bounds.

    Parameters
    ----------
    box : tuple of 6 float64
        As `shared_box` returns it.
    lower_x, lower_y, lower_z, upper_x, upper_y, upper_z : float64

    Returns
    -------
    inside : bool
        Whether anything is left.
    lx, ly, lz, ux, uy, uz : float64
    """
    lx = lower_x if lower_x > box[0] else box[0]
    ly = lower_y if lower_y > box[1] else box[1]
    lz = lower_z if lower_z > box[2] else box[2]
    ux = upper_x if upper_x < box[3] else box[3]
    uy = upper_y if upper_y < box[4] else box[4]
    uz = upper_z if upper_z < box[5] else box[5]
    return (lx <= ux) & (ly <= uy) & (lz <= uz), lx, ly, lz, ux, uy, uz
