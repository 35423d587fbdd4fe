"""Rays and planes."""

import sys

# A stand-in for what each generated module puts at its top.
LARGEST = sys.float_info.max


def plane(shape, orig, dir, itself):
    """Return t > 0 where a ray hits a plane, or -1.

    Parameters
    ----------
    shape : record
        As `rtbench.shapes.records` makes it.
    orig, dir : three numbers
        ``dir`` has any length.
    itself : bool
        Whether the ray starts on this plane, up to rounding: it is not hit then.

    Returns
    -------
    float
        In units of ``dir``. A NaN in the ray, or a direction of 0 or along the plane, hits nothing.
    """
    if itself:
        return -1.0
    fx, fy, fz = orig[0] - shape.point[0], orig[1] - shape.point[1], orig[2] - shape.point[2]
    across = dir[0] * shape.axis[0] + dir[1] * shape.axis[1] + dir[2] * shape.axis[2]
    t = -(fx * shape.axis[0] + fy * shape.axis[1] + fz * shape.axis[2]) / across
    return t if t > 0.0 and t <= LARGEST else -1.0


def plane_normal(shape, x, y, z):
    """Return the unit normal of a plane."""
    return shape.axis[0], shape.axis[1], shape.axis[2]


def onto_plane(shape, x, y, z):
    """Return a point near a plane moved onto it."""
    wx, wy, wz = x - shape.point[0], y - shape.point[1], z - shape.point[2]
    above = wx * shape.axis[0] + wy * shape.axis[1] + wz * shape.axis[2]
    return x - above * shape.axis[0], y - above * shape.axis[1], z - above * shape.axis[2]
