from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy import errors, exact

# The line meets the plane where t = 1/7 and u = v = 1/3.
TRIANGLE = np.array([[[0, 0, 0], [3, 0, 0], [0, 3, 0]]], float)
ORIGIN, DOWN = np.array([[1, 1, 1]], float), np.array([[0, 0, -7]], float)


def test_exact_values_have_twice_the_digits():
    found = errors.exact_values(TRIANGLE, ORIGIN, DOWN)
    for k, x in enumerate((Fraction(1, 7), Fraction(1, 3), Fraction(1, 3))):
        assert found.value[0, k] == float(x)
        left = x - Fraction(float(x))
        assert left != 0 and found.rest[0, k] == float(left)


def test_an_error_below_the_digits_of_float64_is_seen():
    reference = errors.exact_values(TRIANGLE, ORIGIN, DOWN)
    found = errors.absolute_errors(np.array([[1 / 7, 1 / 3, 0.25]]), reference)
    truth = [abs(Fraction(1 / 7) - Fraction(1, 7)), abs(Fraction(1 / 3) - Fraction(1, 3))]
    assert found[0] == pytest.approx([*map(float, truth), 1 / 12], rel=1e-12)


def test_float32_is_compared_as_it_is():
    reference = errors.Values(np.full((1, 3), 0.1), np.zeros((1, 3)))
    found = errors.absolute_errors(np.full((1, 3), 0.1, np.float32), reference)
    assert found == pytest.approx(float(np.float32(0.1)) - 0.1)


def test_a_parallel_line_has_no_values():
    found = errors.exact_values(TRIANGLE, ORIGIN, np.array([[1.0, 0, 0]]))
    assert np.isnan(found.value).all() and np.isnan(found.rest).all()


def test_condition_is_the_worst_change_of_the_answer():
    """Each of the 15 numbers is changed by a part of itself; the sizes of the changes add up."""
    random = np.random.default_rng(3)
    step = 2.0**-24
    for _ in range(20):
        numbers = random.normal(size=15)

        def values(changed):
            corners = changed.reshape(5, 3).tolist()
            return np.array([float(x) for x in exact.line_hit(*corners)[1:]])

        worst = np.zeros(3)
        for place in range(15):
            up, down = numbers.copy(), numbers.copy()
            up[place] *= 1 + step
            down[place] *= 1 - step
            worst += np.abs(values(up) - values(down)) / (2 * step)
        vectors = numbers.reshape(1, 5, 3)
        found = errors.conditions(
            vectors[:, :3], vectors[:, 3], vectors[:, 4], values(numbers)[None]
        )
        assert found[0] == pytest.approx(worst, rel=1e-4)


def test_over_condition_counts_roundoffs():
    value, condition = np.full((1, 3), -2.0), np.full((1, 3), 6.0)
    found = errors.over_condition(np.full((1, 3), 2.0**-20), value, condition, 2.0**-24)
    assert found == pytest.approx(2.0)


def test_intervals_are_those_of_the_normal_distribution_for_many_pairs():
    sample = np.random.default_rng(1).normal(10, 2, (1, 4000))
    found = errors.mean_errors(sample, np.ones(sample.shape, bool), np.arange(4000))
    reach = 1.96 * sample.std() / np.sqrt(4000)
    assert found.mean[0] == pytest.approx(sample.mean())
    assert found.low[0] == pytest.approx(sample.mean() - reach, abs=0.1 * reach)
    assert found.high[0] == pytest.approx(sample.mean() + reach, abs=0.1 * reach)


def test_pairs_of_one_triangle_count_once():
    each = np.random.default_rng(2).normal(10, 2, 400)
    units = np.repeat(np.arange(400), 10)
    found = errors.mean_errors(each[None, units], np.ones((1, 4000), bool), units)
    reach = 1.96 * each.std() / np.sqrt(400)  # not of 4000
    assert found.high[0] - found.low[0] == pytest.approx(2 * reach, rel=0.1)


def test_only_what_is_used_counts():
    sample = np.array([[1.0, 3.0, np.nan, 100.0], [5.0, 5.0, 5.0, 5.0]])
    used = np.array([[True, True, False, False], [False] * 4])
    found = errors.mean_errors(sample, used, np.zeros(4, int))
    assert found.mean[0] == 2.0 and np.isnan(found.mean[1])
    assert np.isnan(found.low).all() and np.isnan(found.high).all()  # a single unit
