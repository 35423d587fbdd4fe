"""The three conditions, each at its very limit, where a float64 computation alone would guess."""

from fractions import Fraction

import numpy as np

from rtbench.accuracy import exact
from rtbench.accuracy.exact import GRAZING, HIT, MISS, NEAR_EDGE
from rtbench.workloads import draws, safety


def exact_class(item, direction):
    """Return the class of an item by rationals alone, written apart from the package."""
    _, _, v0, v1, v2 = ([Fraction(float(x)) for x in item[3 * k : 3 * k + 3]] for k in range(5))
    orig = [Fraction(float(x)) for x in item[:3]]
    dir = [Fraction(float(x)) for x in direction]
    edges = [[b - a for a, b in zip(p, q, strict=True)] for p, q in ((v0, v1), (v0, v2), (v1, v2))]
    if any(abs(x) < Fraction(1e-3) for edge in edges for x in edge):
        return safety.SHORT_EDGE
    side = exact.side_products(v0, v1, v2, orig, dir)
    volume = sum(side)
    e, f, _ = edges
    normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
    squares = sum(x * x for x in normal) * sum(x * x for x in dir)
    if volume**2 <= Fraction(1e-5) ** 2 * squares:
        return GRAZING
    weights = [s / volume for s in side]
    if any(min(abs(x), abs(1 - x)) < Fraction(1e-4) for x in weights):
        return NEAR_EDGE
    return HIT if min(weights) >= 0 else MISS


def assert_exact(items):
    _, _, directions = safety.lines(items)
    expected = [exact_class(item, d) for item, d in zip(items, directions, strict=True)]
    np.testing.assert_array_equal(safety.classify(items), expected)
    return expected


def test_random_items_are_classified_as_rationals_classify_them():
    for generator in draws.GENERATORS:
        classes = assert_exact(draws.draw(generator, 11, 2000))
        assert {HIT, MISS, safety.SHORT_EDGE} <= set(classes)


def test_near_edge_items_are_classified_as_rationals_classify_them():
    rng = np.random.default_rng(5)
    items = draws.draw("pcg64", 6, 1500)
    # Aim at points whose weight of v1 is about one of the limits, float32 rounding apart.
    u = rng.choice([0, 1e-4, 1 - 1e-4, 1, -1e-4, 1 + 1e-4], 1500) + rng.normal(0, 3e-7, 1500)
    v = rng.random(1500)
    v0, v1, v2 = (items[:, part].astype(float) for part in (draws.V0, draws.V1, draws.V2))
    target = v0 + u[:, None] * (v1 - v0) + v[:, None] * (v2 - v0)
    # The end point is twice as far away as the target, which does not have to lie in [0, 1].
    items[:, draws.END] = 2 * target - items[:, draws.ORIG]
    classes = assert_exact(items)
    assert min(classes.count(kind) for kind in (HIT, MISS, NEAR_EDGE)) > 50


def test_flat_items_are_classified_as_rationals_classify_them():
    rng = np.random.default_rng(7)
    items = draws.draw("pcg64", 8, 1500)
    v0, v1, v2 = (items[:, part].astype(float) for part in (draws.V0, draws.V1, draws.V2))
    normal = np.cross(v1 - v0, v2 - v0)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    inside = v0 + rng.random((1500, 1)) * (v1 - v0)
    along = (v2 - v1) / np.linalg.norm(v2 - v1, axis=1)[:, None]
    items[:, draws.ORIG] = inside
    rise = rng.choice([1e-5, -1e-5], (1500, 1)) * (1 + rng.normal(0, 0.02, (1500, 1)))
    items[:, draws.END] = items[:, draws.ORIG] + along + rise * normal
    classes = assert_exact(items)
    assert classes.count(GRAZING) > 100
    assert classes.count(GRAZING) < 1400


def test_edge_components_are_compared_exactly():
    item = draws.draw("pcg64", 1, 1)
    item[0, draws.TRIANGLE] = [0.25, 0.5, 0.75, 0.5, 0.125, 0.25, 0.875, 0.75, 0.5]
    assert safety.classify(item)[0] != safety.SHORT_EDGE
    high = np.float32(1.03e-3)
    low = np.float32(float(high) - 0.999999995e-3)
    # A little less than the limit, but float32 rounds the difference up to its own 1e-3.
    assert float(high) - float(low) < 1e-3
    assert high - low == np.float32(1e-3)
    item[0, 6], item[0, 9] = low, high
    assert safety.classify(item)[0] == safety.SHORT_EDGE
    item[0, 6] = np.float32(float(high) - 1.000000005e-3)
    assert float(high) - float(item[0, 6]) > 1e-3
    assert safety.classify(item)[0] != safety.SHORT_EDGE


def test_normalised_directions_are_unit_and_zero_stays_zero():
    vectors = np.array([[3, 0, 4], [0, 0, 0], [1e-3, 2e-3, -5e-4]], np.float32)
    unit = safety.normalise(vectors)
    assert unit.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(unit.astype(float), axis=1), [1, 0, 1], atol=1e-7)
    np.testing.assert_array_equal(unit[0], np.array([0.6, 0, 0.8], np.float32))
