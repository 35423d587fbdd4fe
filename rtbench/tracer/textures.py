"""What colour a texture has at a point: cubes by turns, and the pixels of an image.

What is neutral changes nothing: a texture of one colour everywhere gives that colour, bit for bit.
"""

from __future__ import annotations

import numpy as np

REAL = np.float64  # stands in for the constant of a generated module


def checker(x, y, z, size):
    """Return which of two kinds of cubes, by turns in space, a point is in: 0 or 1.

    Cubes begin 0.0137 of their size below the multiples of it. A floor at a height that people
    choose, 0 first of all, then lies inside cubes, not between two layers of them, where rounding
    would throw dice at every point.

    Parameters
    ----------
    x, y, z : REAL
        In the scene's own space. What is added to them by another base has to be a multiple of
        twice the size, after which all repeats.
    size : REAL
        The side of a cube.

    Returns
    -------
    int
        0 at the origin. What is not finite is in 0.
    """
    count = np.floor(x / size + 0.0137) + np.floor(y / size + 0.0137) + np.floor(z / size + 0.0137)
    return 1 if count - 2.0 * np.floor(0.5 * count) > 0.5 else 0


def texel(pixels, offset, width, height, u, v):
    """Return an image's colour, three numbers, between the four nearest pixels.

    Parameters
    ----------
    pixels : (N,) float32 array
        Red, green, blue of each pixel; rows from the top.
    offset : int
        Where in it the image begins.
    width, height : int
        Of the image, 1 or more.
    u, v : REAL
        (0, 0) is the lower left corner, (1, 1) the upper right one; beyond, the image repeats,
        and so it does between its last and its first pixels. What is not finite is taken as 0.

    Source: bilinear interpolation between the middles of pixels (Williams 1983).
    """
    u -= np.floor(u)
    v -= np.floor(v)
    if not (u >= 0.0 and u <= 1.0):
        u = 0.0
    if not (v >= 0.0 and v <= 1.0):
        v = 0.0
    x = u * REAL(width) - 0.5
    y = (1.0 - v) * REAL(height) - 0.5
    left = np.floor(x)
    upper = np.floor(y)
    x -= left
    y -= upper
    column = int(left)
    row = int(upper)
    # Half a pixel at either end lies between the last and the first.
    if column < 0:
        column = width - 1
    if row < 0:
        row = height - 1
    right = column + 1 if column + 1 < width else 0
    below = row + 1 if row + 1 < height else 0
    a = offset + 3 * (row * width + column)
    b = offset + 3 * (row * width + right)
    c = offset + 3 * (below * width + column)
    d = offset + 3 * (below * width + right)
    return (
        between(pixels[a], pixels[b], pixels[c], pixels[d], x, y),
        between(pixels[a + 1], pixels[b + 1], pixels[c + 1], pixels[d + 1], x, y),
        between(pixels[a + 2], pixels[b + 2], pixels[c + 2], pixels[d + 2], x, y),
    )


def between(a, b, c, d, x, y):
    """Return what lies between four numbers: a and b above, c and d below, x and y the way."""
    a = REAL(a)
    c = REAL(c)
    a += x * (REAL(b) - a)
    c += x * (REAL(d) - c)
    return a + y * (c - a)


CALLEES = (checker, between, texel)
