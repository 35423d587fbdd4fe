"""Where a ray enters a scene: once a ray, in float64, so that the walk itself may be in float32.

The walk takes place in local coordinates, from where the ray enters the scene's box, and its
parameter is the distance along the axis in which the ray moves fastest: neither a far scene or
origin nor a direction of any length costs it digits. What is called s below is that parameter.

No hit that a kernel reports is lost: where a ray crosses a plane is widened by ``pad`` to both
sides, which holds what float32 rounds in the walk (below 2^-21 of what local coordinates reach:
the local origin, a reciprocal, a difference and a product of half a unit each), what is changed of
directions along which the ray hardly moves (2^-26), and what a kernel of the usual kind may be off
by, which is a few roundings of the distances from the origin to the triangle (the margins are 8
times that and more). So it does no harm if a ray lies in a plane or starts in it; 0 times infinity
does not come up, since no component of the direction is taken to be nearer to 0 than SLOWEST.

Along the ray a kernel may be off by much more, where the ray grazes a triangle: cells that begin
later than the best t are visited for another T_ROUNDING of the distance, which costs next to
nothing. What is further off than all that, such as Möller-Trumbore's t of a ray that lies in the
triangle's plane, no tree can find: there the answer may not be that of brute force.

Sources: Williams et al. 2005 (signs and zeros); Ize 2013 (widening); the rest is ours.
"""

from __future__ import annotations

import numpy as np

# Stand-ins for the constants of a generated module, those of float32; `constants` has all.
KERNEL_ROUNDING = 2.0**-20
WALK_ROUNDING = 2.0**-20
DOUBLE_ROUNDING = 2.0**-50
T_ROUNDING = 2.0**-14
LEAST_T, GREATEST_T = 2.0**-149, 2.0**127
LEAST_PAD = 2.0**-130  # in scenes of subnormal size everything is near
SLOWEST = 2.0**-26  # of the fastest component, in the walk
SLOWEST_OF_ALL = 2.0**-200  # and before it


def not_greater(x, most):  # x, moved towards 0
    return min(max(x, -most), most)


def enter(orig, dir, tmax, scene, line):
    """Return how a ray enters a scene, and write the line along which it walks.

    Parameters
    ----------
    orig, dir : three numbers
    tmax : number
    scene : (10,) float64 array
        The base, the least and greatest local x, y, z, the greatest magnitude of a coordinate.
    line : (9,) float32 array
        Is given, three each: where it enters, local; 1 over the direction in units of the fastest
        component; what is to be added to s where a plane is crossed.

    Returns
    -------
    enters : bool
        Whether it comes near the scene's box before tmax; never where a number is not finite or
        the direction is 0.
    exit : float32
        s where it leaves, or where tmax is.
    start, size, slack : float64
        A t is ``t * size - start`` in s, and cells that begin later than that by more than slack
        cannot hold anything nearer.
    pad : float64
        By how much planes are widened to both sides; the line has it in units of s.
    """
    ox, oy, oz = (
        np.float64(orig[0]) - scene[0],
        np.float64(orig[1]) - scene[1],
        np.float64(orig[2]) - scene[2],
    )
    dx, dy, dz = np.float64(dir[0]), np.float64(dir[1]), np.float64(dir[2])
    # A NaN anywhere makes the sum one; minima and maxima do not tell.
    finite = abs(ox) + abs(oy) + abs(oz) + abs(dx) + abs(dy) + abs(dz) < np.inf
    size = max(abs(dx), abs(dy), abs(dz))
    # Neither division waits for another.
    ix = not_greater(size / dx, 1.0 / SLOWEST_OF_ALL)
    iy = not_greater(size / dy, 1.0 / SLOWEST_OF_ALL)
    iz = not_greater(size / dz, 1.0 / SLOWEST_OF_ALL)
    dx, dy, dz = dx / size, dy / size, dz / size
    extent = 2.0 * max(max(-scene[3], scene[6]), max(-scene[4], scene[7]), max(-scene[5], scene[8]))
    away = max(abs(ox), abs(oy), abs(oz)) + extent
    pad = WALK_ROUNDING * extent + KERNEL_ROUNDING * away + DOUBLE_ROUNDING * scene[9] + LEAST_PAD
    low_x, high_x = (scene[3] - pad - ox) * ix, (scene[6] + pad - ox) * ix
    low_y, high_y = (scene[4] - pad - oy) * iy, (scene[7] + pad - oy) * iy
    low_z, high_z = (scene[5] - pad - oz) * iz, (scene[8] + pad - oz) * iz
    start = max(0.0, min(low_x, high_x), min(low_y, high_y), min(low_z, high_z))
    end = min(max(low_x, high_x), max(low_y, high_y), max(low_z, high_z))
    # What t may be off by, and where floats are far apart: a t so small, or held at the greatest.
    slack = 2.0 * pad + T_ROUNDING * away + LEAST_T * size
    end = min(end, np.float64(tmax) * size + slack)
    leaves = end - start + slack
    slack = slack if GREATEST_T * size >= 2.0 * away else np.inf
    enters = (start <= end) & (size > 0.0) & finite & (start < np.inf)
    ix = not_greater(ix, 1.0 / SLOWEST)
    iy = not_greater(iy, 1.0 / SLOWEST)
    iz = not_greater(iz, 1.0 / SLOWEST)
    line[0] = np.float32(ox + start * dx)
    line[1] = np.float32(oy + start * dy)
    line[2] = np.float32(oz + start * dz)
    line[3] = np.float32(ix)
    line[4] = np.float32(iy)
    line[5] = np.float32(iz)
    line[6] = np.float32(pad * abs(ix))
    line[7] = np.float32(pad * abs(iy))
    line[8] = np.float32(pad * abs(iz))
    return enters, np.float32(leaves), start, size, slack, pad


def limit_of(t, start, size, slack):
    """Return beyond which s no cell need be visited once t is the best known, float32."""
    return np.float32(np.float64(t) * size - start + slack)


CALLEES = (not_greater, enter, limit_of)


def margins(extent: float, reach: float, precision: str) -> tuple[float, float, float]:
    """Return pad, slack and how far away it may be of any ray that starts in the scene's box.

    Parameters
    ----------
    extent : float
        Twice the greatest magnitude of a local coordinate of the box.
    reach : float
        The greatest magnitude of a coordinate.
    precision : str

    Returns
    -------
    pad, slack, away : float
        As `enter` computes them of its farthest corner, the slack without what a short direction
        adds; ``away`` twice, as it is compared.
    """
    numbers = {name: eval(text) for name, text in constants(precision).items()}
    away = 1.5 * extent
    pad = numbers["WALK_ROUNDING"] * extent + numbers["KERNEL_ROUNDING"] * away
    pad += numbers["DOUBLE_ROUNDING"] * reach + numbers["LEAST_PAD"]
    return pad, 2.0 * pad + numbers["T_ROUNDING"] * away, 2.0 * away


def constants(precision: str) -> dict[str, str]:
    """Return the constants of a generated module that these functions read."""
    kernel = "2.0**-20" if precision == "float32" else "2.0**-49"
    return {
        "KERNEL_ROUNDING": kernel,
        "WALK_ROUNDING": "2.0**-20",
        "DOUBLE_ROUNDING": "2.0**-50",
        "T_ROUNDING": "2.0**-14" if precision == "float32" else "2.0**-40",
        "LEAST_T": "2.0**-149" if precision == "float32" else "2.0**-1074",
        "GREATEST_T": "2.0**127" if precision == "float32" else "2.0**1023",
        "LEAST_PAD": "2.0**-130",
        "SLOWEST": "2.0**-26",
        "SLOWEST_OF_ALL": "2.0**-200",
    }
