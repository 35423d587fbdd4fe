"""eta is how far the answer is from another, and the conditions how far its values move.

Both are compared with what exact arithmetic says of numbers that were moved.
"""

from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy import conditions, errors, exact, oracle, side_signs
from rtbench.accuracy.cases import EXPECT


def fraction(ratio):
    return Fraction(*map(int, ratio))


def volumes(ray):
    """The side volumes and the origin's, by formulas about the coordinates' origin."""
    return [*exact.side_products(*ray), exact.origin_volume(*ray[:4])]


def changes(ray):
    """x_j df/dx_j of the four volumes f for the fifteen x_j; exact: f is affine in each."""
    base = volumes(ray)
    table = []
    for place in range(5):
        for axis in range(3):
            moved = [list(vector) for vector in ray]
            moved[place][axis] *= 2
            table.append([a - b for a, b in zip(volumes(moved), base, strict=True)])
    return base, np.array(table, dtype=object)


def moved(ray, amount, signs):
    """Move each number by a part of itself, up or down."""
    signs = iter(signs)
    return [[x * (1 + amount * int(next(signs))) for x in vector] for vector in ray]


def answer(ray):
    return EXPECT[side_signs.decide(*ray).cls]


def near(rng, n, distance):
    """Rays that pass an edge, a vertex or the plane at a relative distance."""
    rays = rng.normal(size=(n, 5, 3))
    weights = rng.dirichlet([1, 1, 1], n)
    kind = rng.integers(0, 3, n)
    weights[kind < 2, 0] = distance * rng.normal(size=np.count_nonzero(kind < 2))
    weights[kind < 1, 1] = distance * rng.normal(size=np.count_nonzero(kind < 1))
    weights[:, 2] = 1 - weights[:, 0] - weights[:, 1]
    point = np.einsum("ij,ijk->ik", weights, rays[:, :3])
    rays[:, 4] = point - rays[:, 3]
    step = distance * rng.normal(size=(n, 1))
    rays[:, 3] = np.where((kind == 2)[:, None], point - step * rays[:, 4], rays[:, 3])
    return rays


def exactly(ray):
    return [[Fraction(x) for x in vector] for vector in ray.tolist()]


@pytest.mark.parametrize("distance", [1e-3, 1e-9, 1e-14])
class TestEta:
    def test_half_of_it_never_changes_the_answer(self, distance):
        rng = np.random.default_rng(1)
        seen = set()
        for ray in map(exactly, near(rng, 60, distance)):
            eta = fraction(conditions.sensitivity(*ray).eta)
            assert 0 < eta < 0.05
            seen.add(int(answer(ray)))
            for _ in range(4):
                assert answer(moved(ray, eta / 2, rng.choice([-1, 1], 15))) == answer(ray)
        assert seen == {0, 1}

    def test_a_little_more_than_it_changes_a_hit(self, distance):
        rng = np.random.default_rng(2)
        tried = 0
        for ray in map(exactly, near(rng, 120, distance)):
            if answer(ray) != 1:
                continue
            eta = fraction(conditions.sensitivity(*ray).eta)
            base, table = changes(ray)
            ways = 0
            for f, column in zip(base, table.T, strict=True):
                # Towards zero of this volume, by the worst signs.
                signs = [-1 if f * c > 0 else 1 for c in column]
                ways += answer(moved(ray, eta * Fraction(11, 10), signs)) == 0
            assert ways >= 1
            tried += 1
        assert tried > 20

    def test_a_little_more_than_it_changes_a_miss_by_one_sign(self, distance):
        rng = np.random.default_rng(3)
        tried = 0
        for ray in map(exactly, near(rng, 120, distance)):
            base, table = changes(ray)
            for sign in (1, -1):
                wrong = [k for k, f in enumerate(base) if f * sign < 0]
                if len(wrong) != 1:
                    continue
                eta = fraction(conditions.sensitivity(*ray).eta)
                worst = [abs(f) / sum(map(abs, c)) for f, c in zip(base, table.T, strict=True)]
                # The other three must stay, so that this one is all there is to change.
                if min(r for k, r in enumerate(worst) if k not in wrong) < 3 * eta:
                    continue
                assert eta == worst[wrong[0]]
                signs = [1 if sign * c > 0 else -1 for c in table.T[wrong[0]]]
                assert answer(ray) == 0
                assert answer(moved(ray, eta * Fraction(11, 10), signs)) == 1
                tried += 1
        assert tried > 20


def test_eta_is_the_definition_in_fractions():
    """On cases that are singular and tied too."""
    rays = np.random.default_rng(4).integers(-2, 3, (800, 5, 3))
    kinds = set()
    for ray in rays.tolist():
        if not any(ray[4]):
            continue
        base, table = changes(ray)
        sizes = [sum(map(abs, column)) for column in table.T]
        distance = [abs(f) / s if f else 0 for f, s in zip(base, sizes, strict=True)]
        up = [r for f, r in zip(base, distance, strict=True) if f <= 0]
        down = [r for f, r in zip(base, distance, strict=True) if f >= 0]
        expected = min(max(up), max(down)) if up and down else min(distance)
        assert fraction(conditions.sensitivity(*ray).eta) == expected <= Fraction(1, 3)
        kind = answer(ray)
        kinds.add((int(kind), expected == 0))
        assert kind != 2 or expected == 0
    assert kinds >= {(0, False), (1, False), (2, True)}


def test_a_small_eta_is_where_the_distance_is_small():
    for distance in (1e-4, 1e-12):
        rays = near(np.random.default_rng(5), 200, distance)
        eta = oracle.answers(*(rays[:, k] for k in range(5))).eta
        assert distance / 300 < np.median(eta) < distance


def test_conditions_are_the_worst_change_of_the_values():
    step = Fraction(1, 2**60)
    for ray in map(exactly, np.random.default_rng(6).normal(size=(20, 5, 3))):
        base = exact.line_hit(*ray)[1:]
        worst = [Fraction(0)] * 3
        for place in range(5):
            for axis in range(3):
                other = [list(vector) for vector in ray]
                other[place][axis] *= 1 + step
                values = exact.line_hit(*other)[1:]
                worst = [w + abs(a - b) / step for w, a, b in zip(worst, values, base, strict=True)]
        found = conditions.sensitivity(*ray)[1:]
        assert [float(fraction(c)) for c in found] == pytest.approx([*map(float, worst)], rel=1e-12)


def test_conditions_are_those_in_float64():
    rays = np.random.default_rng(7).normal(size=(300, 5, 3))
    found = oracle.answers(*(rays[:, k] for k in range(5)))
    values = np.stack([found.t, found.u, found.v], axis=1)
    expected = errors.conditions(rays[:, :3], rays[:, 3], rays[:, 4], values)
    got = np.stack([found.cond_t, found.cond_u, found.cond_v], axis=1)
    np.testing.assert_allclose(got, expected, rtol=1e-9)


def test_what_is_undefined_is_nan():
    triangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    rays = np.array(
        [
            [*triangle, [0, 0, 1], [1, 0, 0]],  # parallel
            [*triangle, [0, 0, 1], [0, 0, 0]],  # no direction
        ],
        float,
    )
    found = oracle.answers(*(rays[:, k] for k in range(5)))
    assert np.isfinite(found.eta).tolist() == [True, False]
    for name in ("t", "u", "v", "cond_t", "cond_u", "cond_v"):
        assert np.isnan(getattr(found, name)).all()
