"""Where light goes at a boundary, and how much of it: mirrors, Snell's law, Fresnel's equations.

Directions d are of length 1 and go to the surface; normals n are of length 1 and face them:
d . n <= 0. Cosines are taken from 0 to 1. ``ratio`` is the index of refraction where the light
comes from over the one where it goes to.

What is neutral changes nothing: at ratio 1 the direction goes on, bit for bit, and nothing is
reflected, exactly; without an Abbe number the index is returned as it is, and so is index 1.
"""

from __future__ import annotations

import math

import numpy as np

REAL = np.float64  # stands in for the constant of a generated module


def reflected(dx, dy, dz, nx, ny, nz):
    """Return the direction, x, y, z, of the ray that a mirror sends back."""
    twice = 2.0 * (dx * nx + dy * ny + dz * nz)
    return dx - twice * nx, dy - twice * ny, dz - twice * nz


def refracted(dx, dy, dz, nx, ny, nz, ratio):
    """Return the direction behind the surface, and whether there is none: total reflection.

    Parameters
    ----------
    dx, dy, dz, nx, ny, nz : REAL
        Unit vectors; the normal against the direction.
    ratio : REAL
        1 gives the direction back, bit for bit.

    Returns
    -------
    REAL, REAL, REAL
        Of length 1 but for rounding; where all is reflected, the direction that came.
    bool
        Whether all is reflected.

    Source: Snell's law in vector form (Heckbert 1989).
    """
    if ratio == 1.0:
        return dx, dy, dz, False
    cosine = -(dx * nx + dy * ny + dz * nz)
    # ratio^2 times the square of the sine, apart so that nothing is lost near grazing.
    square = 1.0 - ratio * ratio * ((1.0 - cosine) * (1.0 + cosine))
    if square < 0.0:
        return dx, dy, dz, True
    across = ratio * cosine - math.sqrt(square)
    return ratio * dx + across * nx, ratio * dy + across * ny, ratio * dz + across * nz, False


def fresnel(cosine, ratio):
    """Return how much unpolarised light a boundary of two dielectrics reflects.

    Parameters
    ----------
    cosine : REAL
        Between the normal and the light that comes.
    ratio : REAL
        1 gives exactly 0, at any angle.

    Returns
    -------
    REAL
        From 0 to 1; 1 where all is reflected.

    Notes
    -----
    Both amplitudes are written with the factor 1 - ratio^2 taken out of their numerators: nothing
    cancels, however near to 1 the ratio is.

    Source: Fresnel's equations (Born & Wolf 1999, 1.5.2).
    """
    if ratio == 1.0:
        return 0.0
    square = ratio * ratio
    apart = (1.0 - ratio) * (1.0 + ratio)
    behind = apart + square * cosine * cosine  # the cosine behind the boundary, squared
    if not behind > 0.0:
        return 1.0
    behind = math.sqrt(behind)
    across = ratio * cosine + behind
    along = cosine + ratio * behind
    upright = apart / (across * across)
    parallel = apart * (cosine * cosine * (1.0 + square) - square) / (along * along)
    return min(1.0, 0.5 * (upright * upright + parallel * parallel))


def index_for(index, abbe, nanometres):
    """Return the index of refraction for light of a wavelength.

    Parameters
    ----------
    index : REAL
        For the line d, 587.5618 nm. 1 remains exactly 1: the vacuum does not disperse.
    abbe : REAL
        The Abbe number, (n_d - 1) / (n_F - n_C); 0 or less: the index is returned as it is.
    nanometres : REAL
        The wavelength in vacuum.

    Source: Cauchy's equation n = A + B / wavelength^2, through n_d with the Abbe number's
    difference between the lines F, 486.1327 nm, and C, 656.2725 nm (Born & Wolf 1999, 2.3.4).
    """
    if not abbe > 0.0:
        return index
    d = 587.5618 / nanometres
    f = 587.5618 / 486.1327
    c = 587.5618 / 656.2725
    return index + (index - 1.0) / abbe * ((d - 1.0) * (d + 1.0) / ((f - c) * (f + c)))


def band(k, u):
    """Return a wavelength of one of three bands of colour, in nanometres, uniform in it.

    Parameters
    ----------
    k : int
        0: red, 600 to 700; 1: green, 500 to 600; 2: blue, 400 to 500. Together they are what eyes
        see, and what each primary of sRGB looks like (611, 549, 464 nm) lies in its own.
    u : REAL
        From 0 to 1.
    """
    if k == 0:
        least = 600.0
    elif k == 1:
        least = 500.0
    else:
        least = 400.0
    return least + 100.0 * u


CALLEES = (reflected, refracted, fresnel, index_for, band)
