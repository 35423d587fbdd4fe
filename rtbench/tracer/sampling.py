"""Random numbers without state, and points and directions made of them.

A number depends on the pixel, the sample in it and the dimension, which says what it is used for,
and on nothing else: not on threads, tiles, or what was traced before. Every effect has a block of
dimensions of its own, so leaving one out leaves the numbers of all others alone.

What is neutral changes nothing: a facet of alpha 0 is the normal, bit for bit, and a light of
radius 0 is its centre; a rectangle without sides is its middle, where only -0 may become 0.
"""

from __future__ import annotations

import math

import numpy as np

# Stand-ins for the constants of a generated module, those of float64; `constants` has all.
REAL = np.float64
UNIFORM_SHIFT = np.uint64(11)
UNIFORM_UNIT = 2.0**-53

# The first dimension of each effect, 2^48 apart: what one sample draws for an effect, at one hit
# after the other, it takes from there on. antialiasing: 2, the place in the pixel; depth_of_field:
# 2, the place on the lens; motion_blur: 1, the time; soft_shadows: 2 a shadow ray, the place on the
# light; glossy: 2 a facet; dispersion: 1 a band; indirect: 3 a bounce, roulette and direction. A
# new effect goes to the end.
DRAWING = "antialiasing depth_of_field motion_blur soft_shadows glossy dispersion indirect"
DIMENSIONS = {name: np.uint64(k << 48) for k, name in enumerate(DRAWING.split())}


def hashed(x):
    """Return a whole number that looks random: SplitMix64's finaliser, one to one.

    Parameters
    ----------
    x : uint64
        0 gives 0.

    Returns
    -------
    uint64

    Source: Steele, Lea & Flood 2014, section 5, with the multipliers of Stafford's "Mix13".
    """
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def seed_of(pixel, sample):
    """Return the seed of a sample: no two samples have the same.

    Parameters
    ----------
    pixel, sample : uint64
        Below 2^32.

    Returns
    -------
    uint64
    """
    return hashed((pixel << np.uint64(32)) | sample)


def uniform(seed, dimension):
    """Return a number from 0 to below 1: output number ``dimension`` of SplitMix64 from that seed.

    Parameters
    ----------
    seed, dimension : uint64

    Returns
    -------
    REAL
        A multiple of 2^-24 in float32, of 2^-53 in float64; never 1.

    Source: Steele, Lea & Flood 2014, section 5.
    """
    x = hashed(seed + (dimension + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15))
    # Signed, since processors turn unsigned numbers into floats in several steps.
    return REAL(np.int64(x >> UNIFORM_SHIFT)) * UNIFORM_UNIT


def on_disc(u, v):
    """Return a point of the unit disc, x and y, uniform; neighbours stay neighbours.

    Parameters
    ----------
    u, v : REAL
        From 0 to 1.

    Source: Shirley & Chiu 1997.
    """
    a = 2.0 * u - 1.0
    b = 2.0 * v - 1.0
    if abs(a) > abs(b):
        radius = a
        angle = 0.7853981633974483 * (b / a)
    elif b != 0.0:
        radius = b
        angle = 1.5707963267948966 - 0.7853981633974483 * (a / b)
    else:
        return 0.0, 0.0
    return radius * math.cos(angle), radius * math.sin(angle)


def frame(nx, ny, nz):
    """Return two unit vectors, x, y, z of each, that with a unit normal make a right-handed frame.

    Source: Duff et al. 2017, listing 3.
    """
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    return 1.0 + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny


def cosine_direction(nx, ny, nz, u, v):
    """Return a unit direction about a unit normal, as likely as its cosine is great; x, y, z.

    Parameters
    ----------
    nx, ny, nz : REAL
    u, v : REAL
        From 0 to below 1.

    Returns
    -------
    REAL, REAL, REAL
        The probability density is the cosine over pi; the cosine may be 0.

    Source: Malley's method (Pharr, Jakob & Humphreys 2023, A.5.3).
    """
    x, y = on_disc(u, v)
    z = math.sqrt(max(0.0, 1.0 - x * x - y * y))
    tx, ty, tz, bx, by, bz = frame(nx, ny, nz)
    return (
        x * tx + y * bx + z * nx,
        x * ty + y * by + z * ny,
        x * tz + y * bz + z * nz,
    )


def facet(nx, ny, nz, vx, vy, vz, alpha, s, t):
    """Return the normal, x, y, z, of one of the small facets that a rough surface shows.

    Facets are spread as GGX says, and drawn as often as the viewer sees them (Heitz 2018). Light
    mirrored or refracted at such a facet would still have to be weighted by G2 / G1, what of it no
    other facet stands in the way of. Here that factor is taken to be 1: light that meets a second
    facet is not lost, so that a white mirror stays white, as rough as it may be. A mirrored
    direction that points below the surface has met one: it may be turned back up, or dropped.

    Parameters
    ----------
    nx, ny, nz : REAL
        The surface's unit normal, on the viewer's side.
    vx, vy, vz : REAL
        The unit direction to the viewer; from behind the normal it counts as along the surface.
    alpha : REAL
        Width of the slopes; at 0 the normal itself is returned, bit for bit.
    s, t : REAL
        From 0 to below 1.

    Source: Walter et al. 2007 (GGX); Heitz 2018 (visible normals); Dupuy & Benyoub 2023 (how they
    are drawn: evenly in a cap of the sphere).
    """
    if not alpha > 0.0:
        return nx, ny, nz
    tx, ty, tz, bx, by, bz = frame(nx, ny, nz)
    # Stretch the surface until its facets are those of a hemisphere.
    x = alpha * (vx * tx + vy * ty + vz * tz)
    y = alpha * (vx * bx + vy * by + vz * bz)
    z = max(0.0, vx * nx + vy * ny + vz * nz)
    length = math.sqrt(x * x + y * y + z * z)
    if not length > 0.0:  # seen along the surface, and the squares of alpha are below all floats
        return nx, ny, nz
    x /= length
    y /= length
    z /= length
    # Mirrored at the hemisphere, the view fills the cap of directions from -z up: choose there,
    # with the sum of both heights and the product of 1 - height and 1 + height free of cancelling.
    above = (1.0 - t) * (1.0 + z)
    radius = math.sqrt(max(0.0, t * (1.0 + z) * ((1.0 - z) + above)))
    angle = 6.283185307179586 * s
    # The facet is halfway between both; undo the stretching.
    x = alpha * (x + radius * math.cos(angle))
    y = alpha * (y + radius * math.sin(angle))
    length = math.sqrt(x * x + y * y + above * above)
    x /= length
    y /= length
    z = above / length
    return (
        x * tx + y * bx + z * nx,
        x * ty + y * by + z * ny,
        x * tz + y * bz + z * nz,
    )


def on_rectangle(px, py, pz, ux, uy, uz, vx, vy, vz, s, t):
    """Return a point of a rectangle, x, y, z, uniform.

    Parameters
    ----------
    px, py, pz : REAL
        Its middle.
    ux, uy, uz, vx, vy, vz : REAL
        Its sides. If they are 0 the point is the middle.
    s, t : REAL
        From 0 to 1: how far along each side.
    """
    s -= 0.5
    t -= 0.5
    return px + (s * ux + t * vx), py + (s * uy + t * vy), pz + (s * uz + t * vz)


def on_light_sphere(cx, cy, cz, radius, px, py, pz, s, t):
    """Return a point, x, y, z, of the side of a sphere that one sees from p.

    As seen from p it is uniform over the cone of directions that the sphere fills, and those of
    equal s lie on a ring: a grid of (s, t) is a grid on what looks like a disc.

    Parameters
    ----------
    cx, cy, cz : REAL
        The centre. It is returned, bit for bit, if the radius is 0 or p is in the sphere.
    radius : REAL
    px, py, pz : REAL
    s, t : REAL
        From 0 to 1.

    Source: Shirley, Wang & Zimmerman 1996, 3.2; the angle at the centre as Pharr, Jakob &
    Humphreys 2023, 6.2.4.
    """
    wx = px - cx
    wy = py - cy
    wz = pz - cz
    distance = math.sqrt(wx * wx + wy * wy + wz * wz)
    if not (radius > 0.0 and distance > radius):
        return cx, cy, cz
    wx /= distance
    wy /= distance
    wz /= distance
    # The cone, by sine and cosine; (1 - sine) (1 + sine) keeps its digits where p is near.
    sine = radius / distance
    cosine = math.sqrt((1.0 - sine) * (1.0 + sine))
    less = s * (1.0 - cosine)  # 1 - the direction's cosine
    # The ray's angle to the sphere's normal, then by the triangle p, centre, point the one at the
    # centre: their difference.
    square = min(1.0, s * (2.0 - less) / (1.0 + cosine))
    out = math.sqrt(square)
    along = math.sqrt(1.0 - square)
    high = out * out * sine + (1.0 - less) * along
    wide = out * ((1.0 - less) - along * sine)
    angle = 6.283185307179586 * t
    x = radius * wide * math.cos(angle)
    y = radius * wide * math.sin(angle)
    z = radius * high
    tx, ty, tz, bx, by, bz = frame(wx, wy, wz)
    return (
        cx + (x * tx + y * bx + z * wx),
        cy + (x * ty + y * by + z * wy),
        cz + (x * tz + y * bz + z * wz),
    )


NUMBERS = (hashed, seed_of, uniform)
CALLEES = (*NUMBERS, on_disc, frame, cosine_direction, facet, on_rectangle, on_light_sphere)


def constants(precision: str) -> dict[str, str]:
    """Return the constants of a generated module that these functions read, after ``REAL``.

    Also, for whoever calls `uniform`, ``DIMENSION_`` and each effect's name.
    """
    single = precision == "float32"
    return {
        "UNIFORM_SHIFT": "np.uint64(40)" if single else "np.uint64(11)",
        "UNIFORM_UNIT": "REAL(2.0**-24)" if single else "REAL(2.0**-53)",
        **{f"DIMENSION_{k.upper()}": f"np.uint64({int(v)})" for k, v in DIMENSIONS.items()},
    }
