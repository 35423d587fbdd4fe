"""Rays and cones: cylinders and cut cones, without ends.

Taken from the middle of the shape and moved along the ray to its point nearest to it, a ray is at
once a point and a direction in the plane across the axis (u, v) and a radius that the cone has
beside it, which changes with t (R, k): |u + t v| = R + k t. The discriminant of that is
|R v - k u|^2 - |u x v|^2, a difference of squares of lengths, so that its error is a rounding of
lengths. Beyond the ends lies the other nappe too. Nothing overflows in float32 where lengths, that
of the direction too, are from 2^-30 to 2^30.

Sources: the quadratic's roots by a sum without cancelling and by their product as in
`rtbench.shapes.sphere`; the discriminant in this form is ours.
"""

import math
import sys

# Stand-ins for what each generated module puts at its top.
ROUNDOFF = sys.float_info.epsilon / 2
LARGEST = sys.float_info.max


def cone(shape, orig, dir, itself):
    """Return the least t > 0 at which a ray hits a cone, or -1.

    Parameters
    ----------
    shape : record
        As `rtbench.shapes.records` makes it.
    orig, dir : three numbers
        ``dir`` has any length.
    itself : bool
        Whether the ray starts on this cone, up to rounding: where it starts is no hit, nor is the
        rest of a ray that runs along the cone.

    Returns
    -------
    float
        In units of ``dir``. A NaN in the ray or a direction of 0 hits nothing.
    """
    dx, dy, dz = dir[0], dir[1], dir[2]
    square = dx * dx + dy * dy + dz * dz
    if not square > 0.0:
        return -1.0
    ax, ay, az = shape.axis[0], shape.axis[1], shape.axis[2]
    # From the middle of the axis.
    half = 0.5 * shape.height
    fx = orig[0] - shape.point[0] - half * ax
    fy = orig[1] - shape.point[1] - half * ay
    fz = orig[2] - shape.point[2] - half * az
    start = 0.0
    if not itself:
        start = -(fx * dx + fy * dy + fz * dz) / square
        fx, fy, fz = fx + start * dx, fy + start * dy, fz + start * dz
    # Across the axis, turned by a right angle; along it; and the radius.
    ux, uy, uz = fy * az - fz * ay, fz * ax - fx * az, fx * ay - fy * ax
    vx, vy, vz = dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax
    height, rise = fx * ax + fy * ay + fz * az, dx * ax + dy * ay + dz * az
    radius, growth = shape.radius + shape.slope * (half + height), shape.slope * rise
    v_square = vx * vx + vy * vy + vz * vz
    a = v_square - growth * growth
    b = ux * vx + uy * vy + uz * vz - radius * growth
    if itself:
        size = fx * fx + fy * fy + fz * fz + half * half
        noise = 8.0 * ROUNDOFF * (1.0 + abs(shape.slope)) * math.sqrt(size * square)
        if not abs(b) > noise:  # along the cone: no other side is to be known from 0
            return -1.0
        first = second = -(b + b) / a
    else:
        mx, my, mz = radius * vx - growth * ux, radius * vy - growth * uy, radius * vz - growth * uz
        twist = fx * vx + fy * vy + fz * vz
        discriminant = mx * mx + my * my + mz * mz - twist * twist
        if not discriminant >= 0.0:
            return -1.0
        root = math.sqrt(discriminant)
        q = -(b + root) if b > 0.0 else root - b
        first, second = q / a, (ux * ux + uy * uy + uz * uz - radius * radius) / q
        if second < first:
            first, second = second, first
    t = first
    for _ in range(2):
        # Newton's method: near a tip, and along a side, all of u and R is cancelled in the roots.
        # No step across the middle between both, to which it would lead where they meet.
        for _ in range(2):
            px, py, pz, there = ux + t * vx, uy + t * vy, uz + t * vz, radius + t * growth
            off = px * px + py * py + pz * pz - there * there
            change = px * vx + py * vy + pz * vz - there * growth
            if abs(off * a) < change * change:
                t -= 0.5 * off / change
        # A root that is infinite or NaN is not within the ends.
        result = start + t
        if result > 0.0 and result <= LARGEST and abs(height + t * rise) <= half:
            return result
        t = second
    return -1.0


def cone_across(shape, x, y, z):
    """Return the unit vector from the axis to a point, its distance, its height over the base.

    On the axis no direction is across more than another: there the vector is 0.
    """
    ax, ay, az = shape.axis[0], shape.axis[1], shape.axis[2]
    wx, wy, wz = x - shape.point[0], y - shape.point[1], z - shape.point[2]
    ux, uy, uz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
    distance = math.sqrt(ux * ux + uy * uy + uz * uz)
    if not distance > 0.0:
        return (0.0, 0.0, 0.0), distance, wx * ax + wy * ay + wz * az
    ux, uy, uz = ux / distance, uy / distance, uz / distance
    # Turned back by a second product, which is across even where the axis is not quite of length 1.
    across = ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux
    return across, distance, wx * ax + wy * ay + wz * az


def cone_normal(shape, x, y, z):
    """Return the unit normal, away from the axis, of a cone at a point of its surface."""
    across, distance, _ = cone_across(shape, x, y, z)
    slope = shape.slope
    if not distance > 0.0:  # the tip: along the axis, outward
        sign = -1.0 if slope > 0.0 else 1.0
        return sign * shape.axis[0], sign * shape.axis[1], sign * shape.axis[2]
    length = math.sqrt(1.0 + slope * slope)
    return (
        (across[0] - slope * shape.axis[0]) / length,
        (across[1] - slope * shape.axis[1]) / length,
        (across[2] - slope * shape.axis[2]) / length,
    )


def onto_cone(shape, x, y, z):
    """Return a point near a cone's surface moved onto it, along the normal."""
    across, distance, height = cone_across(shape, x, y, z)
    slope = shape.slope
    # Above the surface by outside / sqrt(1 + slope^2), along a normal of the same length.
    outside = (distance - (shape.radius + slope * height)) / (1.0 + slope * slope)
    return (
        x - outside * (across[0] - slope * shape.axis[0]),
        y - outside * (across[1] - slope * shape.axis[1]),
        z - outside * (across[2] - slope * shape.axis[2]),
    )
