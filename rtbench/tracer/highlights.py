"""What of a light a surface sends to the viewer: highlights, rough diffuse surfaces, spots.

n, l and v are unit vectors: the normal, to the light, to the viewer. Powers are the costly part,
so they are taken only where the cosine is above 0.

What is neutral changes nothing: a surface of roughness 0 has the factor 1, exactly, and so has
whatever lies in a spot's inner cone.
"""

from __future__ import annotations

import math

import numpy as np

REAL = np.float64  # stands in for the constant of a generated module


def phong(nx, ny, nz, lx, ly, lz, vx, vy, vz, exponent):
    """Return Phong's highlight: the cosine between viewer and mirrored light, to a power.

    Parameters
    ----------
    nx, ny, nz, lx, ly, lz, vx, vy, vz : REAL
    exponent : REAL
        0 or more; 0 gives 1 where the cosine is above 0.

    Returns
    -------
    REAL
        From 0 to 1; 0 where the cosine is not above 0. That the light is in front of the surface
        is for the caller to see to.

    Source: Phong 1975.
    """
    twice = 2.0 * (nx * lx + ny * ly + nz * lz)
    cosine = (twice * nx - lx) * vx + (twice * ny - ly) * vy + (twice * nz - lz) * vz
    if not cosine > 0.0:
        return 0.0
    # Rounded above 1, a cosine would blow up with a great exponent.
    return math.pow(min(1.0, cosine), exponent)


def blinn_phong(nx, ny, nz, lx, ly, lz, vx, vy, vz, exponent):
    """Return Blinn's highlight: the cosine between the normal and what is halfway, to a power.

    Parameters
    ----------
    nx, ny, nz, lx, ly, lz, vx, vy, vz, exponent : REAL
        As for `phong`.

    Source: Blinn 1977.
    """
    hx = lx + vx
    hy = ly + vy
    hz = lz + vz
    cosine = nx * hx + ny * hy + nz * hz
    if not cosine > 0.0:
        return 0.0
    cosine /= math.sqrt(hx * hx + hy * hy + hz * hz)
    return math.pow(min(1.0, cosine), exponent)


def oren_nayar(nx, ny, nz, lx, ly, lz, vx, vy, vz, sigma):
    """Return by what a rough diffuse surface differs from Lambert's: a factor of the latter.

    Parameters
    ----------
    nx, ny, nz, lx, ly, lz, vx, vy, vz : REAL
        Light and viewer in front of the surface.
    sigma : REAL
        Standard deviation of the slopes' angles, in radians; 0 gives exactly 1.

    Source: Oren & Nayar 1994, equation 30 (without light that facets send to each other). With
    alpha the greater and beta the lesser angle to the normal, sin(alpha) tan(beta) cos(phi) is
    (l . v - cos cos) over the greater cosine: no angle is needed.
    """
    if sigma == 0.0:
        return 1.0
    square = sigma * sigma
    light = nx * lx + ny * ly + nz * lz
    viewer = nx * vx + ny * vy + nz * vz
    factor = 1.0 - 0.5 * square / (square + 0.33)
    alike = (lx * vx + ly * vy + lz * vz) - light * viewer
    greater = max(light, viewer)
    if alike > 0.0 and greater > 0.0:
        factor += 0.45 * square / (square + 0.09) * (alike / greater)
    return factor


def spot(cosine, inner, outer):
    """Return how much of a spot's light goes into a direction.

    Parameters
    ----------
    cosine : REAL
        Between the spot's axis and the direction.
    inner, outer : REAL
        Cosines of the angles up to which all light goes, exactly 1, and from which on none. An
        inner one of -2 lets all light pass, even a cosine that is rounded below -1.

    Returns
    -------
    REAL
        From 0 to 1, smooth between the cones.

    Source: Pharr, Jakob & Humphreys 2023, 12.1.1.
    """
    if cosine >= inner:
        return 1.0
    if not cosine > outer:
        return 0.0
    x = (cosine - outer) / (inner - outer)
    return x * x * (3.0 - 2.0 * x)


CALLEES = (phong, blinn_phong, oren_nayar, spot)
