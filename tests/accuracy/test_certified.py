"""The filter never contradicts rational arithmetic, and what it leaves open is decided exactly."""

from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy import bounds, certified, exact
from rtbench.accuracy.bounds import UNDECIDED
from rtbench.accuracy.exact import GRAZING, HIT, MISS, NEAR_EDGE

N = 400


def random_lines(rng):
    return rng.random((N, 5, 3))


def grid(rng):
    return rng.integers(0, 4, (N, 5, 3)).astype(float)


def near_edge(rng):
    """Lines through points of an edge, rounded."""
    pairs = rng.random((N, 5, 3))
    along = rng.random((N, 1))
    target = pairs[:, 0] * along + pairs[:, 1] * (1 - along)
    pairs[:, 4] = target - pairs[:, 3]
    return pairs


def near_vertex(rng):
    pairs = rng.random((N, 5, 3))
    pairs[:, 4] = pairs[:, 2] - pairs[:, 3]
    return pairs


def one_ulp_off(rng):
    """Exact hits of edges and vertices, with one coordinate moved by its last bit."""
    pairs = rng.integers(1, 9, (N, 5, 3)).astype(float)
    target = (pairs[:, 0] + pairs[:, 1]) / 2
    pairs[:, 4] = target - pairs[:, 3]
    which = rng.integers(0, 5, N), rng.integers(0, 3, N)
    rows = np.arange(N)
    moved = pairs[rows, *which].astype(np.float32)
    # A float32 ulp, so that the shift is still there when the pairs are rounded to float32.
    pairs[rows, *which] = np.nextafter(moved, np.where(rng.random(N) < 0.5, -99, 99), dtype="f4")
    return pairs


def needles(rng):
    pairs = near_edge(rng)
    pairs[:, 2] = pairs[:, 0] + (pairs[:, 1] - pairs[:, 0]) * 0.7 + rng.normal(0, 1e-6, (N, 3))
    return pairs


def mixed_scales(rng):
    pairs = near_edge(rng)
    return pairs * 10.0 ** rng.uniform(-8, 8, (N, 5, 3))


def tiny(rng):
    return near_edge(rng) * 1e-38


def huge(rng):
    return near_edge(rng) * 3e37


def far(rng):
    pairs = near_edge(rng)
    pairs[:, :4] += 1e5
    return pairs


FAMILIES = [
    random_lines,
    grid,
    near_edge,
    near_vertex,
    one_ulp_off,
    needles,
    mixed_scales,
    tiny,
    huge,
    far,
]


def scaled(factor):
    def family(rng):
        return near_edge(rng) * factor

    family.__name__ = f"scaled_{factor:g}"
    return family


def any_scales(rng):
    return near_edge(rng) * 10.0 ** rng.uniform(-300, 300, (N, 5, 3))


ONLY_FLOAT64 = [*map(scaled, (1e-200, 1e-320, 1e200, 1e308)), any_scales]
CASES = [(family, dtype) for family in FAMILIES for dtype in (np.float32, np.float64)]
CASES += [(family, np.float64) for family in ONLY_FLOAT64]


def arrays(family, dtype, seed=0):
    pairs = family(np.random.default_rng(seed)).astype(dtype)
    return pairs[:, :3], pairs[:, 3], pairs[:, 4]


def vectors(lines, i):
    triangles, origins, directions = lines
    return [*triangles[i].tolist(), origins[i].tolist(), directions[i].tolist()]


@pytest.mark.parametrize(
    ("family", "dtype"), CASES, ids=[f"{f.__name__}-{t.__name__}" for f, t in CASES]
)
class TestAgainstRationals:
    def test_hits(self, family, dtype):
        lines = arrays(family, dtype)
        proven = certified.filtered(*lines)
        expected = [exact.crosses(exact.side_products(*vectors(lines, i))) for i in range(N)]
        decided = proven != UNDECIDED
        np.testing.assert_array_equal(proven[decided], np.array(expected)[decided])
        np.testing.assert_array_equal(certified.line_hits(*lines), expected)

    def test_margins(self, family, dtype):
        lines = arrays(family, dtype, seed=1)
        for margin, grazing in ((1e-4, 1e-5), (0.3, 0.1), (1e-7, 0.0)):
            proven = certified.filtered(*lines, margin, grazing)
            expected = [exact.classify(*vectors(lines, i), margin, grazing) for i in range(N)]
            decided = proven != UNDECIDED
            np.testing.assert_array_equal(proven[decided], np.array(expected)[decided])
            np.testing.assert_array_equal(certified.classify(*lines, margin, grazing), expected)

    def test_bounds_hold(self, family, dtype):
        lines = arrays(family, dtype, seed=2)
        with np.errstate(all="ignore"):
            for i in range(N // 4):
                found = bounds.bounded(*lines, i)
                values, errors, norms = found[:4], found[4:8], found[9]
                if not norms < bounds.LARGEST:
                    continue
                truth = exact.numerators(*vectors(lines, i))
                for value, error, true in zip(values, errors, truth, strict=True):
                    assert abs(Fraction(float(value)) - true) <= Fraction(float(error))

    def test_reference(self, family, dtype):
        lines = arrays(family, dtype, seed=3)
        found = certified.reference(*lines)
        for i in range(N // 2):
            _, *truth = exact.line_hit(*vectors(lines, i))
            for name, true in zip(("t", "u", "v"), truth, strict=True):
                value, error = getattr(found, name)[i], getattr(found, f"{name}_error")[i]
                if true is None:
                    assert np.isnan(value)
                elif np.isinf(value):
                    assert abs(true) > Fraction(np.finfo(float).max)
                else:
                    assert abs(Fraction(float(value)) - true) <= Fraction(float(error))


class TestAtTheLimits:
    """Pairs whose margin or cosine equals the limit but for rounding."""

    @pytest.mark.parametrize("limit", [0.25, 1e-4])
    @pytest.mark.parametrize("weight", range(3))
    @pytest.mark.parametrize("side", [0, 1])
    def test_margins(self, limit, weight, side):
        rng = np.random.default_rng(6)
        pairs = rng.random((N, 5, 3))
        weights = rng.uniform(2, 3, (N, 3))
        weights[:, weight] = side + limit * rng.choice([-1, 1], N)
        # The two others come to the rest; both stay away from the limits.
        other, last = (weight + 1) % 3, (weight + 2) % 3
        weights[:, last] = 1 - weights[:, weight] - weights[:, other]
        target = np.einsum("ij,ijk->ik", weights, pairs[:, :3])
        pairs[:, 4] = target - pairs[:, 3]
        lines = pairs[:, :3], pairs[:, 3], pairs[:, 4]
        proven = certified.filtered(*lines, limit)
        expected = np.array([exact.classify(*vectors(lines, i), limit) for i in range(N)])
        assert min(np.count_nonzero(expected == kind) for kind in (MISS, NEAR_EDGE)) > N // 10
        assert np.count_nonzero(proven == UNDECIDED) > N // 2
        decided = proven != UNDECIDED
        np.testing.assert_array_equal(proven[decided], expected[decided])
        np.testing.assert_array_equal(certified.classify(*lines, limit), expected)

    def test_cosines(self):
        rng = np.random.default_rng(7)
        kinds = set()
        for k in range(21, 121):
            # (k^2 - 1, 2k, k^2 + 1) are the sides of a right triangle.
            limit = 2 * k / (k * k + 1)
            triangles = np.zeros((5, 3, 3))
            triangles[:, :, :2] = rng.integers(-999, 999, (5, 3, 2)) / 7
            origins = rng.random((5, 3))
            directions = np.array([[k * k - 1, 0, 2 * k]] * 5) * rng.integers(1, 999, (5, 1))
            lines = triangles, origins, directions
            proven = certified.filtered(*lines, grazing=limit)
            expected = [exact.classify(*vectors(lines, i), grazing=limit) for i in range(5)]
            assert all(p in (UNDECIDED, e) for p, e in zip(proven, expected, strict=True))
            assert certified.classify(*lines, grazing=limit).tolist() == expected
            kinds |= {e == GRAZING for e in expected}
        assert kinds == {True, False}

    @pytest.mark.parametrize("scale", [1.0, 1e-40, 1e-120, 1e-155, 1e-162, 1e-175])
    def test_cosines_of_short_directions(self, scale):
        triangles = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 2, float)
        origins = np.full((2, 3), 0.25)
        directions = np.array([[1, 0, 1.1e-5], [1, 0, 0.9e-5]]) * scale
        found = certified.classify(triangles, origins, directions, grazing=1e-5)
        assert (found == GRAZING).tolist() == [False, True]


class TestFilter:
    def test_decides_nearly_everything_that_is_random(self):
        proven = certified.filtered(*arrays(random_lines, np.float32), 1e-4, 1e-5)
        assert set(proven.tolist()) <= {HIT, MISS, NEAR_EDGE}
        rng = np.random.default_rng(4)
        lines = rng.random((100_000, 5, 3), dtype=np.float32)
        proven = certified.filtered(lines[:, :3], lines[:, 3], lines[:, 4])
        assert np.count_nonzero(proven == UNDECIDED) < 5

    @pytest.mark.parametrize("dtype", [np.float32, np.float64])
    def test_leaves_ties_open(self, dtype):
        lines = arrays(grid, dtype)
        open_ = certified.filtered(*lines) == UNDECIDED
        hits = certified.line_hits(*lines)
        # Both answers occur among what only rationals decide.
        assert np.count_nonzero(hits & open_) > 5
        assert np.count_nonzero(~hits & open_) > 5

    @pytest.mark.parametrize("margin", [0.25, 0.125])
    def test_leaves_exact_margins_open(self, margin):
        triangles = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], np.float32)
        origin, direction = np.array([[margin, 0.25, 1]], "f4"), np.array([[0, 0, -1]], "f4")
        lines = triangles, origin, direction
        assert certified.filtered(*lines, margin) == [UNDECIDED]
        assert certified.classify(*lines, margin) == exact.classify(*vectors(lines, 0), margin)

    def test_each_class_occurs(self):
        proven = certified.filtered(*arrays(random_lines, np.float64), 0.05, 0.1)
        assert set(proven.tolist()) == {HIT, MISS, NEAR_EDGE, GRAZING}

    def test_float64_differences_in_the_last_bits_are_seen(self):
        triangles = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 2, float)
        origins = np.array([[0.5, 0.5, 1], [0.5, np.nextafter(0.5, 1), 1]])
        directions = np.array([[0, 0, -1.0]] * 2)
        assert certified.line_hits(triangles, origins, directions).tolist() == [True, False]


class TestInput:
    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
    @pytest.mark.parametrize("where", range(5))
    def test_what_is_not_finite_misses(self, bad, where):
        pairs = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 1], [0, 0, -1]]] * 3)
        pairs[np.arange(3), where, np.arange(3)] = bad
        lines = pairs[:, :3], pairs[:, 3], pairs[:, 4]
        assert not certified.line_hits(*lines).any()
        assert np.isnan(certified.reference(*lines).t).all()

    def test_no_pairs(self):
        lines = np.empty((0, 3, 3)), np.empty((0, 3)), np.empty((0, 3))
        assert certified.line_hits(*lines).shape == (0,)
        assert certified.reference(*lines).t.shape == (0,)

    def test_integers_and_float16_are_taken_exactly(self):
        lines = arrays(grid, np.float64)
        expected = certified.line_hits(*lines)
        for dtype in (np.int64, np.int8, np.float16):
            found = certified.line_hits(*(a.astype(dtype) for a in lines))
            np.testing.assert_array_equal(found, expected)

    def test_input_is_left_alone_and_may_be_read_only(self):
        lines = [a.copy() for a in arrays(near_edge, np.float32)]
        for a in lines:
            a.flags.writeable = False
        assert certified.line_hits(*lines).dtype == bool

    @pytest.mark.parametrize(
        "shapes",
        [((2, 3), (2, 3), (2, 3)), ((2, 3, 3), (3, 3), (2, 3)), ((2, 3, 3), (2, 3), (2, 4))],
    )
    def test_wrong_shapes_are_named(self, shapes):
        with pytest.raises(ValueError, match=r"shapes must be \(N, 3, 3\)"):
            certified.line_hits(*(np.zeros(shape) for shape in shapes))

    @pytest.mark.parametrize("dtype", [complex, np.longdouble, object])
    def test_wider_numbers_are_refused(self, dtype):
        with pytest.raises(ValueError, match="at most float64"):
            certified.line_hits(np.zeros((1, 3, 3), dtype), np.zeros((1, 3)), np.zeros((1, 3)))

    @pytest.mark.parametrize(("margin", "grazing"), [(-0.1, 0), (1, 0), (np.nan, 0), (0, 0.2)])
    def test_limits_out_of_range_are_refused(self, margin, grazing):
        with pytest.raises(ValueError, match="out of range"):
            certified.filtered(*arrays(grid, np.float32), margin, grazing)
