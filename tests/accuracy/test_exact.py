from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy import exact
from rtbench.accuracy.exact import GRAZING, HIT, MISS, NEAR_EDGE

TRIANGLE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
DOWN = (0.0, 0.0, -1.0)


def cases(seed, n):
    """Yield vectors of a triangle and a line: random, on a grid (ties), of mixed scales."""
    rng = np.random.default_rng(seed)
    yield from rng.normal(size=(n, 5, 3)).tolist()
    yield from rng.integers(-2, 3, (n, 5, 3)).astype(float).tolist()
    scales = 10.0 ** rng.uniform(-30, 30, (n, 5, 3))
    yield from (rng.normal(size=(n, 5, 3)) * scales).tolist()


@pytest.mark.parametrize(
    ("x", "y", "hit"),
    [
        (0.25, 0.25, True),
        (0.0, 0.0, True),
        (1.0, 0.0, True),
        (0.0, 1.0, True),
        (0.5, 0.5, True),
        (0.5, 0.0, True),
        (0.0, 0.5, True),
        (0.5, float(np.nextafter(0.5, 1)), False),
        (float(np.nextafter(0.5, 0)), 0.5, True),
        (-5e-324, 0.5, False),
        (0.5, -5e-324, False),
        (5e-324, 5e-324, True),
    ],
)
@pytest.mark.parametrize("winding", [(0, 1, 2), (0, 2, 1), (2, 1, 0)])
def test_closed_triangle(x, y, hit, winding):
    v0, v1, v2 = (TRIANGLE[k] for k in winding)
    assert exact.line_hit(v0, v1, v2, (x, y, 3.0), DOWN).hit is hit


def test_values_are_exact():
    found = exact.line_hit(*TRIANGLE, (0.1, 0.2, 3.0), (0.0, 0.0, -0.3))
    assert found.u == Fraction(0.1)
    assert found.v == Fraction(0.2)
    assert found.t == 3 / Fraction(0.3)


def test_negative_t_is_a_hit_of_the_line():
    found = exact.line_hit(*TRIANGLE, (0.25, 0.25, -3.0), DOWN)
    assert found == (True, -3, Fraction(1, 4), Fraction(1, 4))


@pytest.mark.parametrize(
    ("triangle", "orig", "dir"),
    [
        (TRIANGLE, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
        (TRIANGLE, (0.25, 0.25, 0.0), (1.0, 1.0, 0.0)),
        (((0, 0, 0), (1, 1, 1), (2, 2, 2)), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        (TRIANGLE, (0.25, 0.25, 1.0), (0.0, 0.0, 0.0)),
    ],
    ids=["parallel", "in the plane", "no area", "no direction"],
)
def test_without_a_determinant_there_is_no_hit(triangle, orig, dir):
    assert exact.line_hit(*triangle, orig, dir) == (False, None, None, None)
    assert exact.classify(*triangle, orig, dir) == MISS
    assert exact.classify(*triangle, orig, dir, 1e-4, 1e-5) == GRAZING


def test_point_of_the_line_is_the_point_of_the_plane():
    for v0, v1, v2, orig, dir in cases(1, 200):
        _, t, u, v = exact.line_hit(v0, v1, v2, orig, dir)
        if t is None:
            continue
        for a, b, c, o, d in zip(v0, v1, v2, orig, dir, strict=True):
            a, b, c, o, d = map(Fraction, (a, b, c, o, d))
            assert o + t * d == a + u * (b - a) + v * (c - a)


def test_both_formulations_agree():
    ties = 0
    for v0, v1, v2, orig, dir in cases(2, 500):
        det, u, v, t = exact.numerators(v0, v1, v2, orig, dir)
        side = exact.side_products(v0, v1, v2, orig, dir)
        assert side == (u + v - det, -u, -v)
        assert exact.origin_volume(v0, v1, v2, orig) == -t
        hit = exact.line_hit(v0, v1, v2, orig, dir).hit
        assert exact.crosses(side) == hit
        assert exact.classify(v0, v1, v2, orig, dir) == (HIT if hit else MISS)
        ties += 0 in side
    assert ties > 50


def test_scaling_by_powers_of_two_changes_no_answer():
    for vectors in cases(3, 100):
        *points, dir = vectors
        moved = [[x * 2.0**-40 for x in point] for point in points]
        found = exact.line_hit(*points, dir)
        scaled = exact.line_hit(*moved, [x * 2.0**-700 for x in dir])
        assert found.hit == scaled.hit
        if found.t is not None:
            assert (scaled.u, scaled.v) == (found.u, found.v)
            assert scaled.t == found.t * Fraction(2) ** 660


def test_margin_refuses_within_and_keeps_at_the_limit():
    limit = 2.0**-10

    def at(x, y):
        return exact.classify(*TRIANGLE, (x, y, 1.0), DOWN, margin=limit)

    inside, outside = np.nextafter(limit, 0), np.nextafter(-limit, 0)
    assert at(limit, 0.5) == HIT
    assert at(float(inside), 0.5) == NEAR_EDGE
    assert at(-limit, 0.5) == MISS
    assert at(float(outside), 0.5) == NEAR_EDGE
    assert at(0.5, float(inside)) == NEAR_EDGE
    assert at(0.5, 0.5 - limit) == HIT
    assert at(0.5, float(np.nextafter(0.5 - limit, 1))) == NEAR_EDGE
    # Far from the triangle, but on the line where u = 1.
    assert at(1.0, 5.0) == NEAR_EDGE
    assert at(1.0 + limit, 5.0) == MISS
    assert at(-7.0, 7.0) == NEAR_EDGE
    assert at(-7.0, 8.0) == NEAR_EDGE


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_grazing_goes_by_the_cosine(flip):
    dir = (flip * 3.0, flip * np.sqrt(54.0), flip * 1.0)
    cosine = 1 / 8  # the length is 8

    def within(limit):
        return exact.classify(*TRIANGLE, (0.25, 0.25, 0.0), dir, grazing=limit)

    assert within(cosine * 1.0001) == GRAZING
    assert within(cosine * 0.9999) == HIT


def test_grazing_at_the_limit_is_grazing():
    limit = Fraction(4, 13)  # (3, 12, 4) has the length 13
    dir = (3, 12, 4)
    assert exact.classify(*TRIANGLE, (0.2, 0.2, 0.0), dir, grazing=limit) == GRAZING
    assert (
        exact.classify(*TRIANGLE, (0.2, 0.2, 0.0), dir, grazing=limit - Fraction(1, 10**30)) == HIT
    )


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_what_is_not_finite_is_refused(bad):
    with pytest.raises((ValueError, OverflowError)):
        exact.line_hit(*TRIANGLE, (0.25, bad, 1.0), DOWN)
