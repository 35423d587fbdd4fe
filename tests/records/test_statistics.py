"""Verdicts, Holm, rankings and averages against scipy and by hand."""

import itertools

import numpy as np
import pytest
from scipy import stats

from rtbench.records.statistics import (
    Estimate,
    Times,
    geometric_mean,
    holm,
    kendall_tau,
    not_separable,
    outliers,
    ranking,
    slower_than_best,
    verdict,
)


def test_holm_by_hand():
    # Holm 1979: 0.01 <= 0.05/4, 0.013 <= 0.05/3, 0.03 > 0.05/2 stops; 0.04 would pass alone.
    assert holm([0.03, 0.01, 0.04, 0.013]) == [False, True, False, True]
    assert holm([]) == []
    assert holm([None, 0.049]) == [False, True]
    assert holm([0.03, 0.04]) == [False, False]


def test_holm_keeps_the_chance_of_any_false_alarm():
    rng = np.random.default_rng(1)
    alarms = sum(any(holm(row)) for row in rng.random((4000, 20)))
    assert 0.035 < alarms / 4000 < 0.065


def test_words_of_the_verdict():
    draws = np.ones(10)
    assert verdict(Estimate(1.2, draws), True) == "slower"
    assert verdict(Estimate(0.8, draws), True) == "faster"
    assert verdict(Estimate(1.2, draws), False) == "no difference resolved"
    assert verdict(Estimate(1.2), False) == "no interval"


def test_slower_than_best_by_hand():
    assert slower_than_best({"a": 10.0, "b": 12.5}) == {"a": 0, "b": 25}
    assert slower_than_best({}) == {}


def test_kernels_level_with_the_best_are_named():
    rng = np.random.default_rng(4)
    process, number = np.repeat(np.arange(5), 10), np.tile(np.arange(10), 5)
    shared = np.exp(rng.normal(0, 0.05, 50))

    def kernel(factor):
        return Times(factor * shared * np.exp(rng.normal(0, 0.01, 50)), process, number)

    found = {"best": kernel(1), "level": kernel(1.0005), "slow": kernel(1.2)}
    best, others = not_separable(found)
    assert {best, *others} == {"best", "level"}


def test_a_kernel_without_common_rounds_is_not_separable():
    a = Times(np.array([1.0, 1.0]), np.array([0, 0]), np.array([0, 1]))
    b = Times(np.array([9.0, 9.0]), np.array([1, 1]), np.array([0, 1]))
    assert not_separable({"a": a, "b": b}) == ("a", ["b"])


def test_geometric_mean_by_hand():
    found = geometric_mean([Estimate(2.0), Estimate(0.5), Estimate(8.0)])
    assert found.estimate.value == pytest.approx(2)
    assert found.estimate.interval() is None
    assert (found.least, found.greatest, found.count) == pytest.approx((0.5, 8, 3))
    assert found.deviation == pytest.approx(stats.gstd([2, 0.5, 8]))


def test_geometric_mean_does_not_depend_on_the_machine_divided_by():
    draws = np.random.default_rng(1).lognormal(0, 0.1, (2, 2000))
    ratios = [Estimate(float(np.median(row)), row, 5, 4.0) for row in draws]
    inverse = [Estimate(1 / item.value, 1 / item.draws, 5, 4.0) for item in ratios]
    there, back = geometric_mean(ratios), geometric_mean(inverse)
    assert there.estimate.value * back.estimate.value == pytest.approx(1)
    low, high = there.estimate.interval()
    assert back.estimate.interval() == pytest.approx((1 / high, 1 / low), rel=1e-3)


def test_kendall_agrees_with_scipy_on_all_orders_and_on_ties():
    for order in itertools.permutations(range(5)):
        expected = stats.kendalltau(range(5), order).statistic
        assert kendall_tau(range(5), order) == pytest.approx(expected)
    a, b = [1, 2, 2, 3, 5], [2, 1, 1, 3, 3]
    assert kendall_tau(a, b) == pytest.approx(stats.kendalltau(a, b).statistic)
    assert kendall_tau([1], [1]) is None
    assert kendall_tau([1, 1], [1, 2]) is None


def test_ranking_and_its_ties():
    assert ranking({"c": 1.0, "b": 2.0, "a": 2.0}) == ["c", "a", "b"]


def test_outliers_are_judged_inside_their_process():
    # The second process is slower as a whole: that is no outlier.
    values = np.array([10, 10.1, 9.9, 10.05, 15, 20, 20.2, 19.9, 20.1, 20.05])
    process = np.repeat([0, 1], 5)
    flags = outliers(Times(values, process, np.tile(np.arange(5), 2)))
    assert np.flatnonzero(flags).tolist() == [4]
