"""Rays and discs."""

import sys

# A stand-in for what each generated module puts at its top.
LARGEST = sys.float_info.max


def disc(shape, orig, dir, itself):
    """Return t > 0 where a ray hits a disc, or -1.

    Parameters
    ----------
    shape : record
        As `rtbench.shapes.records` makes it.
    orig, dir : three numbers
        ``dir`` has any length.
    itself : bool
        Whether the ray starts on this disc, up to rounding: it is not hit then.

    Returns
    -------
    float
        In units of ``dir``. A NaN in the ray, or a direction of 0 or along the disc, hits nothing.
    """
    if itself:
        return -1.0
    fx, fy, fz = orig[0] - shape.point[0], orig[1] - shape.point[1], orig[2] - shape.point[2]
    across = dir[0] * shape.axis[0] + dir[1] * shape.axis[1] + dir[2] * shape.axis[2]
    t = -(fx * shape.axis[0] + fy * shape.axis[1] + fz * shape.axis[2]) / across
    if not (t > 0.0 and t <= LARGEST):
        return -1.0
    px, py, pz = fx + t * dir[0], fy + t * dir[1], fz + t * dir[2]
    return t if px * px + py * py + pz * pz <= shape.radius * shape.radius else -1.0


def disc_normal(shape, x, y, z):
    """Return the unit normal of a disc."""
    return shape.axis[0], shape.axis[1], shape.axis[2]


def onto_disc(shape, x, y, z):
    """Return a point near a disc's plane moved onto it."""
    wx, wy, wz = x - shape.point[0], y - shape.point[1], z - shape.point[2]
    above = wx * shape.axis[0] + wy * shape.axis[1] + wz * shape.axis[2]
    return x - above * shape.axis[0], y - above * shape.axis[1], z - above * shape.axis[2]
