"""The two formulations agree, and with a third one; every class is met; values are rounded once."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy import cases, elimination, exact, oracle, rationals, side_signs
from rtbench.accuracy.cases import CLASS_NAMES, EXPECT

N = 5000


def small_integers(n, seed=0):
    """Configurations of which many are degenerate, coplanar or ties."""
    return np.random.default_rng(seed).integers(-2, 3, (n, 5, 3)).astype(float)


def batch(rays):
    return oracle.answers(*(rays[:, k] for k in range(5)))


@pytest.fixture(params=["int", "mpz"])
def integer(request, monkeypatch):
    """Each kind of whole number that the oracle may compute in."""
    kind = int if request.param == "int" else pytest.importorskip("gmpy2").mpz
    monkeypatch.setattr(rationals, "Integer", kind)
    return kind


CROSSING, FLAT = [[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 0, 0], [4, 4, 4], [2, 2, 2]]
POINT = [[1, 1, 1]] * 3
BY_HAND = [
    ("miss", CROSSING, [3, 3, 1], [0, 0, -1]),
    ("hit_interior", CROSSING, [1, 1, 1], [0, 0, -1]),
    ("hit_edge", CROSSING, [2, 2, 1], [0, 0, -1]),
    ("hit_edge", CROSSING, [1, 0, 1], [0, 0, -1]),
    ("hit_vertex", CROSSING, [0, 4, 1], [0, 0, -1]),
    ("hit_vertex", CROSSING, [1, 1, 1], [-1, -1, -1]),
    ("origin_on", CROSSING, [1, 1, 0], [0, 0, -1]),
    ("origin_on", CROSSING, [4, 0, 0], [0, 1, -1]),
    ("miss", CROSSING, [5, 0, 0], [0, 1, -1]),
    ("behind", CROSSING, [1, 1, 1], [0, 0, 1]),
    ("behind", CROSSING, [0, 0, 1], [0, 0, 1]),
    ("coplanar_touch", CROSSING, [-1, 1, 0], [1, 0, 0]),
    ("coplanar_touch", CROSSING, [1, 1, 0], [1, 0, 0]),
    ("coplanar_touch", CROSSING, [-1, 4, 0], [1, 0, 0]),
    ("coplanar_touch", CROSSING, [4, 0, 0], [1, 0, 0]),  # its origin alone
    ("coplanar_touch", CROSSING, [-1, 0, 0], [1, 0, 0]),  # along an edge
    ("coplanar_miss", CROSSING, [5, 0, 0], [1, 0, 0]),
    ("coplanar_miss", CROSSING, [-1, 1, 0], [-1, 0, 0]),
    ("coplanar_miss", CROSSING, [-1, 5, 0], [1, 0, 0]),
    ("parallel", CROSSING, [-1, 1, 1], [1, 0, 0]),
    ("parallel", CROSSING, [1, 0, 1], [1, 0, 0]),
    ("degenerate_touch", FLAT, [3, 3, 0], [0, 0, 1]),
    ("degenerate_touch", FLAT, [-1, -1, -1], [1, 1, 1]),
    ("degenerate_touch", FLAT, [4, 4, 4], [1, 1, 1]),
    ("degenerate_touch", FLAT, [4, 4, 0], [0, 0, 1]),
    ("degenerate_miss", FLAT, [5, 5, 5], [1, 1, 1]),
    ("degenerate_miss", FLAT, [5, 5, 0], [0, 0, 1]),
    ("degenerate_miss", FLAT, [3, 3, 0], [0, 0, -1]),
    ("degenerate_miss", FLAT, [3, 2, 0], [0, 0, 1]),
    ("degenerate_miss", FLAT, [3, 2, 0], [1, 1, 1]),
    ("degenerate_touch", POINT, [0, 0, 0], [2, 2, 2]),
    ("degenerate_touch", POINT, [1, 1, 1], [0, 0, 2]),
    ("degenerate_miss", POINT, [2, 2, 2], [2, 2, 2]),
    ("degenerate_miss", POINT, [1, 0, 0], [0, 0, 1]),
    ("invalid", CROSSING, [1, 1, 1], [0, -0.0, 0]),
    ("invalid", CROSSING, [1, 1, np.nan], [0, 0, -1]),
    ("invalid", CROSSING, [1, 1, 1], [0, 0, -np.inf]),
    ("invalid", [[np.inf, 0, 0], [1, 0, 0], [0, 1, 0]], [9, 9, 1], [0, 0, 1]),
]


@pytest.mark.parametrize(("name", "triangle", "orig", "dir"), BY_HAND)
def test_classes_by_hand(name, triangle, orig, dir, integer):
    rays = np.array([[*triangle, orig, dir]], float)
    for order in itertools.permutations(range(3)):
        turned = rays[:, [*order, 3, 4]]
        assert [CLASS_NAMES[c] for c in batch(turned).cls] == [name]
        expected = oracle.expectations(turned[:, :3], turned[:, 3], turned[:, 4])
        assert expected == EXPECT[CLASS_NAMES.index(name)]


class TestFormulations:
    def test_agree_on_small_integers_and_meet_every_class(self, integer):
        rays = small_integers(N)
        rays[:50, 0, 0] = np.nan
        found = batch(rays)  # raises if they do not
        assert set(found.cls.tolist()) == set(range(12))
        np.testing.assert_array_equal(found.expect, EXPECT[found.cls])

    @pytest.mark.full
    def test_agree_on_a_hundred_thousand(self):
        found = batch(small_integers(100_000, seed=1))
        assert min(np.bincount(found.cls, minlength=12)) > 50

    @pytest.mark.parametrize("spread", [0, 4, 300])
    def test_agree_on_floats_of_any_scale(self, spread, integer):
        rng = np.random.default_rng(2)
        rays = rng.normal(size=(400, 5, 3)) * 10.0 ** rng.uniform(-spread, spread, (400, 5, 3))
        rays[::2, 4] = rays[::2, 0] - rays[::2, 3]  # about half of these meet a vertex exactly
        assert set(batch(rays).cls.tolist()) >= {cases.MISS, cases.HIT_INTERIOR, cases.BEHIND}

    def test_both_kinds_of_integers_give_the_same(self, monkeypatch):
        gmpy2 = pytest.importorskip("gmpy2")
        rng = np.random.default_rng(3)
        rays = np.concatenate([small_integers(500), rng.normal(size=(200, 5, 3))])
        monkeypatch.setattr(rationals, "Integer", gmpy2.mpz)
        fast = batch(rays)
        monkeypatch.setattr(rationals, "Integer", int)
        for a, b in zip(fast, batch(rays), strict=True):
            np.testing.assert_array_equal(a, b)

    def test_a_contradiction_is_not_passed_over(self, monkeypatch):
        ray = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 1], [0, 0, -1]]
        for wrong in (
            side_signs.Decision(cases.MISS, (1, 1), (1, 4), (1, 4)),
            side_signs.Decision(cases.HIT_INTERIOR, (1, 1), (1, 4), (1, 3)),
            side_signs.Decision(cases.HIT_INTERIOR),
        ):
            monkeypatch.setattr(elimination, "decide", lambda *_, wrong=wrong: wrong)
            with pytest.raises(oracle.Disagreement, match="by elimination"):
                oracle.decide(*ray)

    def test_exact_input_may_be_rational(self):
        third = Fraction(1, 3)
        ray = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [third, 2 * third, 7], [0, 0, -3]]
        found = oracle.decide(*ray)
        assert found.cls == cases.HIT_EDGE
        assert [Fraction(*map(int, x)) for x in found[1:]] == [7 * third, third, 2 * third]


def touches(ray):
    """Tell in fractions whether a closed ray touches a triangle: no formula of the oracle's.

    It does if (orig, 1) is a sum of not negative multiples of (v0, 1), (v1, 1), (v2, 1) and
    (-dir, 0), and then also one of linearly independent ones (Carathéodory).
    """
    rays = [[Fraction(x) for x in vector] for vector in ray]
    columns = [[*vector, Fraction(1)] for vector in rays[:3]] + [[*(-x for x in rays[4]), 0]]
    target = [*rays[3], 1]
    for size in range(1, 5):
        for chosen in itertools.combinations(columns, size):
            gram = [[sum(map(lambda a, b: a * b, p, q)) for q in (*chosen, target)] for p in chosen]
            weights = solved(gram)
            if weights is None or min(weights) < 0:
                continue
            point = [sum(w * c[k] for w, c in zip(weights, chosen, strict=True)) for k in range(4)]
            if point == target:
                return True
    return False


def solved(rows):
    """Solve a square system in fractions by Gauss-Jordan elimination; None where singular."""
    n = len(rows)
    for k in range(n):
        pivot = next((r for r in range(k, n) if rows[r][k]), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for r in range(n):
            if r != k:
                rows[r] = [x - rows[r][k] * y for x, y in zip(rows[r], rows[k], strict=True)]
    return [row[n] for row in rows]


def test_fractions_alone_find_the_same_rays_to_touch():
    rays = small_integers(N, seed=4)
    found = batch(rays).cls
    sample = [i for kind in range(11) for i in np.flatnonzero(found == kind)[:60]]
    touching = {1, 2, 3, 4, 6, 9}
    assert len(sample) > 400
    for i in sample:
        assert touches(rays[i].astype(int).tolist()) == (found[i] in touching), rays[i]


def test_values_are_those_of_moller_and_trumbore_in_fractions():
    rng = np.random.default_rng(5)
    rays = np.concatenate([small_integers(500, seed=6), rng.normal(size=(200, 5, 3))])
    found = batch(rays)
    for i, ray in enumerate(rays.tolist()):
        hit, *truth = exact.line_hit(*ray)
        for value, true in zip((found.t[i], found.u[i], found.v[i]), truth, strict=True):
            assert np.isnan(value) if true is None else value == float(true)
        if any(ray[4]):
            assert hit == (found.cls[i] in {1, 2, 3, 4, 5})


class TestSymmetry:
    def test_vertex_order_only_turns_u_and_v(self):
        rays = np.concatenate([small_integers(300), np.random.default_rng(7).random((100, 5, 3))])
        first = batch(rays)
        turned = batch(rays[:, [1, 2, 0, 3, 4]])  # the new u is the old v
        mirrored = batch(rays[:, [0, 2, 1, 3, 4]])
        for other in (turned, mirrored):
            for name in ("cls", "sos_hit", "t", "eta", "cond_t"):
                np.testing.assert_array_equal(getattr(other, name), getattr(first, name))
        np.testing.assert_array_equal(turned.u, first.v)
        np.testing.assert_array_equal((mirrored.u, mirrored.v), (first.v, first.u))
        np.testing.assert_array_equal(mirrored.cond_u, first.cond_v)

    @pytest.mark.parametrize("power", [-1000, -60, 60, 900])
    def test_powers_of_two_scale_t_alone(self, power):
        rays = np.concatenate([small_integers(300), np.random.default_rng(8).random((100, 5, 3))])
        scale = 2.0**power
        first = batch(rays)
        grown = batch(rays * [[[scale]] * 4 + [[1.0]]])
        np.testing.assert_array_equal(grown.t, first.t * scale)
        np.testing.assert_array_equal(grown.cond_t, first.cond_t * scale)
        for name in ("cls", "sos_hit", "u", "v", "eta", "cond_u", "cond_v"):
            np.testing.assert_array_equal(getattr(grown, name), getattr(first, name))


class TestRange:
    def test_subnormal_and_huge_numbers_are_exact(self):
        tiny, huge = 5e-324, 2.0**1023
        triangle = [[0, 0, 0], [2 * tiny, 0, 0], [0, 2 * tiny, 0]]
        rays = [
            [*triangle, [tiny, tiny, tiny], [0, 0, -1]],
            [*triangle, [tiny, 0, huge], [0, 0, -1]],
            [*triangle, [tiny, 0, huge], [0, 0, -tiny]],
            [[-huge, -huge, 0], [huge, -huge, 0], [0, huge, 0], [tiny, 0, 1], [0, 0, -huge]],
        ]
        found = batch(np.array(rays, float))
        names = ["hit_edge", "hit_edge", "hit_edge", "hit_interior"]
        assert [CLASS_NAMES[c] for c in found.cls] == names
        assert found.t.tolist() == [tiny, huge, np.inf, 2.0**-1023]
        assert found.u.tolist() == [0.5, 0.5, 0.5, 0.25] and found.v.tolist()[3] == 0.5

    @pytest.mark.parametrize(
        ("above", "below", "value"),
        [
            (1, 3, 1 / 3),
            (-1, -(2**1075), 0.0),  # a tie goes to even
            (3, 2**1075, 1e-323),
            (-(2**1075) - 1, 2**2150, -5e-324),
            (2**1024 - 2**971, 1, np.finfo(float).max),
            (2**1024 - 2**970, 1, np.inf),
            (2**1024, -1, -np.inf),
            (2**54 + 3, 1, 2.0**54 + 4),
        ],
    )
    def test_rounding(self, above, below, value, integer):
        assert rationals.nearest_float(integer(above), integer(below)) == value


class TestInput:
    def test_no_cases(self):
        assert all(a.shape == (0,) for a in batch(np.empty((0, 5, 3))))
        empty = np.empty((0, 3, 3)), np.empty((0, 3)), np.empty((0, 3))
        assert oracle.expectations(*empty).shape == oracle.owned(*empty).shape == (0,)

    def test_dtypes(self):
        found = batch(small_integers(100).astype(np.int8))
        assert [a.dtype for a in found[:3]] == [np.int8] * 3
        assert {a.dtype for a in found[3:]} == {np.dtype(float)}
        for name, a in zip(found._fields, batch(small_integers(100)), strict=True):
            np.testing.assert_array_equal(getattr(found, name), a)

    @pytest.mark.parametrize("shape", [(2, 2), (2,), (2, 4)])
    def test_wrong_shapes_are_named(self, shape):
        with pytest.raises(ValueError, match="shape"):
            oracle.answers(*[np.zeros(shape)] * 5)
        with pytest.raises(ValueError, match="one shape"):
            oracle.answers(np.zeros(shape), *[np.zeros((2, 3))] * 4)

    def test_progress_reaches_one(self):
        seen = []
        rays = small_integers(600)
        oracle.answers(*(rays[:, k] for k in range(5)), progress=seen.append)
        assert len(seen) > 2 and seen == sorted(seen) and seen[-1] == 1.0
        seen.clear()
        oracle.owned(rays[:, :3], rays[:, 3], rays[:, 4], progress=seen.append)
        assert seen == sorted(seen) and seen[-1] == 1.0
