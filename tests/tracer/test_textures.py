"""Checkers that do not flicker, and pixels where they belong."""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np
import pytest
from compiled_functions import PRECISIONS, Compiled, plain

from rtbench.tracer import textures

KINDS = {"checker": "rrrr > i", "texel": "piiirr > rrr"}


@functools.cache
def compiled(precision: str) -> Compiled:
    return Compiled(textures, KINDS, precision)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("size", [0.1, 1.0, 7.0])
def test_cubes_take_turns(precision, size):
    """At the middle of each cube its parity; across any face, the other kind."""
    for cell in itertools.product(range(-3, 4), repeat=3):
        x, y, z = ((k + 0.5) * size for k in cell)
        assert compiled(precision).checker(x, y, z, size) == sum(cell) % 2


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("height", [0.0, -1.0, 0.5, 0.25, 1 / 3, -2.0, 0.1])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_floors_do_not_flicker(precision, height, axis):
    """Where a floor lies between layers of cubes, as people put it, rounding does not show."""
    rng = np.random.default_rng(1)
    n = 20_000
    points = np.array([(k + 0.5) for k in rng.integers(-8, 8, (3, n))], float)
    count = np.delete(points, axis, axis=0).astype(int) - (np.delete(points, axis, 0) < 0)
    noise = 64 * np.finfo(precision).eps * rng.uniform(-1, 1, n)
    points[axis] = height + noise
    found = compiled(precision).checker(*points, 1.0)
    layer = math.floor(height)
    np.testing.assert_array_equal(found, (count.sum(0) + layer) % 2)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_checkers_repeat_after_two_cubes(precision):
    """So another base of coordinates is allowed, if it is a multiple of that."""
    points = np.random.default_rng(2).uniform(-4, 4, (3, 2000))
    points = np.round(points * 64) / 64  # so that what is added is added exactly
    at = compiled(precision)
    near = at.checker(*points, 0.5)
    moved = points + np.array([[2.0], [-5.0], [64.0]])
    np.testing.assert_array_equal(at.checker(*moved, 0.5), near)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_checkers_of_what_is_no_place(precision):
    """An infinite plane is hit anywhere: one of both colours, never an error."""
    for x in (np.inf, -np.inf, np.nan):
        assert compiled(precision).checker(x, 0.0, 0.0, 1.0) == 0
    assert compiled(precision).checker(1e30, -1e30, 3.0, 1.0) in (0, 1)


WIDTH, HEIGHT, OFFSET = 5, 3, 6
IMAGE = np.random.default_rng(3).random((HEIGHT, WIDTH, 3)).astype(np.float32)
PIXELS = np.concatenate([np.full(OFFSET, np.nan, np.float32), IMAGE.ravel()])


def looked_up(u: float, v: float) -> list[float]:
    """Return the colour between pixels, each of which has its place in a plane full of images."""
    x, y = u * WIDTH - 0.5, v * HEIGHT - 0.5
    total = np.zeros(3)
    left, lower = math.floor(x), math.floor(y)
    for i, j in itertools.product((left, left + 1), (lower, lower + 1)):
        weight = (1 - abs(x - i)) * (1 - abs(y - j))
        total += weight * IMAGE[HEIGHT - 1 - j % HEIGHT, i % WIDTH].astype(float)
    return total


@pytest.mark.parametrize("precision", PRECISIONS)
def test_images_between_their_pixels(precision):
    """Bilinear, repeating on all sides, (0, 0) in the lower left corner."""
    rng = np.random.default_rng(4)
    u, v = rng.uniform(-3, 3, (2, 2000)).astype(precision)
    u[:6], v[:6] = (0, 1, 0, 1, -1, 0.5), (0, 0, 1, 1, 2, 0.5)
    found = np.array(compiled(precision).texel(PIXELS, OFFSET, WIDTH, HEIGHT, u, v))
    expected = np.array([looked_up(float(a), float(b)) for a, b in zip(u, v, strict=True)]).T
    np.testing.assert_allclose(found, expected, rtol=0, atol=64 * np.finfo(precision).eps)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_middles_of_pixels_are_the_pixels(precision):
    """The lowest row is the last one."""
    for row, column in np.ndindex(HEIGHT, WIDTH):
        u, v = (column + 0.5) / WIDTH, (HEIGHT - 1 - row + 0.5) / HEIGHT
        found = compiled(precision).texel(PIXELS, OFFSET, WIDTH, HEIGHT, u, v)
        np.testing.assert_allclose(found, IMAGE[row, column], atol=1e-5)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_images_of_one_colour(precision):
    """That colour, bit for bit, anywhere: also where numbers are no places."""
    colour = np.array([1.0, 0.1, 1 / 3], np.float32)
    u, v = np.random.default_rng(5).uniform(-9, 9, (2, 1000)).astype(precision)
    u[:4], v[:4] = (np.nan, np.inf, 1e30, -1e-30), (0.5, -np.inf, np.nan, 1e30)
    for width, height in ((1, 1), (4, 2)):
        pixels = np.tile(colour, width * height)
        found = np.array(compiled(precision).texel(pixels, 0, width, height, u, v))
        assert (found == colour[:, None].astype(precision)).all()


def test_compiled_and_plain_agree():
    """The same operations give the same bits."""
    u, v = np.random.default_rng(6).uniform(-2, 2, (2, 200))
    at = compiled("float64")
    found = at.texel(PIXELS, OFFSET, WIDTH, HEIGHT, u, v)
    expected = plain(lambda a, b: textures.texel(PIXELS, OFFSET, WIDTH, HEIGHT, a, b), u, v)
    np.testing.assert_array_equal(found, expected)
    points = np.random.default_rng(7).uniform(-9, 9, (3, 500))
    np.testing.assert_array_equal(
        at.checker(*points, 0.75), plain(lambda *p: textures.checker(*p, 0.75), *points)
    )
