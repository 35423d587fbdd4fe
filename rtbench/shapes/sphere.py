"""Rays and spheres.

The textbook's b^2 - a c is a small difference of large numbers where a sphere is small or far. Here
it is r^2 minus the square of the vector from the centre to the nearest point of the ray, whose
error is a rounding of the distance: what the ray itself is known to. Nothing overflows in float32
where lengths, that of the direction too, are from 2^-30 to 2^30.

Sources: Haines, Günther & Akenine-Möller 2019, "Precision improvements for ray/sphere
intersection" (Ray Tracing Gems, ch. 7); points back onto the surface: Pharr, Jakob & Humphreys
2016, section 3.9.4.
"""

import math
import sys

# A stand-in for what each generated module puts at its top.
LARGEST = sys.float_info.max


def sphere(shape, orig, dir, itself):
    """Return the least t > 0 at which a ray hits a sphere, or -1.

    Parameters
    ----------
    shape : record
        As `rtbench.shapes.records` makes it.
    orig, dir : three numbers
        ``dir`` has any length.
    itself : bool
        Whether the ray starts on this sphere, up to rounding: where it starts is no hit.

    Returns
    -------
    float
        In units of ``dir``. A NaN in the ray or a direction of 0 hits nothing.
    """
    a = dir[0] * dir[0] + dir[1] * dir[1] + dir[2] * dir[2]
    if not a > 0.0:
        return -1.0
    fx, fy, fz = orig[0] - shape.point[0], orig[1] - shape.point[1], orig[2] - shape.point[2]
    middle = -(fx * dir[0] + fy * dir[1] + fz * dir[2]) / a
    if itself:
        t = middle + middle  # the roots are as far from the middle: one is 0
    else:
        px, py, pz = fx + middle * dir[0], fy + middle * dir[1], fz + middle * dir[2]
        square = shape.radius * shape.radius - (px * px + py * py + pz * pz)
        if not square >= 0.0:
            return -1.0
        half = math.sqrt(square / a)
        # The root away from 0 by a sum, the other by their product, which is c / a.
        away = middle + half if middle > 0.0 else middle - half
        c = fx * fx + fy * fy + fz * fz - shape.radius * shape.radius
        t = c / (a * away)
        if not t > 0.0:
            t = away
    return t if t > 0.0 and t <= LARGEST else -1.0


def sphere_normal(shape, x, y, z):
    """Return the unit normal, outward, of a sphere at a point of its surface.

    A sphere that is lost in the rounding of its place may have a point in its very centre: there
    it is the z axis.
    """
    nx, ny, nz = x - shape.point[0], y - shape.point[1], z - shape.point[2]
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        return 0.0, 0.0, 1.0
    return nx / length, ny / length, nz / length


def onto_sphere(shape, x, y, z):
    """Return a point near a sphere's surface moved onto it, along the normal."""
    nx, ny, nz = sphere_normal(shape, x, y, z)
    return (
        shape.point[0] + nx * shape.radius,
        shape.point[1] + ny * shape.radius,
        shape.point[2] + nz * shape.radius,
    )
