"""Intervals against scipy, by hand, and by their coverage of a known truth."""

import numpy as np
import pytest
from scipy import stats

from rtbench.records import student
from rtbench.records.resampling import (
    Estimate,
    Times,
    mean,
    median,
    p_value,
    paired_ratio,
    ratio,
    total,
)


def times(values, process=None) -> Times:
    values = np.asarray(values, float)
    process = np.zeros(len(values), int) if process is None else np.asarray(process)
    numbers = np.zeros(len(values), int)
    for one in np.unique(process):
        numbers[process == one] = np.arange(np.count_nonzero(process == one))
    return Times(values, process, numbers)


def simulated(rng, processes, rounds, true, between, within) -> Times:
    effect = rng.normal(0, between, (processes, 1))
    noise = rng.normal(0, within, (processes, rounds))
    return times((true * np.exp(effect + noise)).ravel(), np.repeat(np.arange(processes), rounds))


@pytest.mark.parametrize("freedom", [1, 1.7, 2, 4, 8.3, 30])
@pytest.mark.parametrize("t", [0.1, 1, 2.776, 9])
def test_students_distribution_agrees_with_scipy(t, freedom):
    assert student.below(t, freedom) == pytest.approx(stats.t.cdf(t, freedom), abs=2e-6)


def test_tail_is_hesterbergs_expanded_percentile():
    for units in (2, 3, 5, 10):
        t = stats.t.ppf(0.975, units - 1)
        expected = stats.norm.cdf(-np.sqrt(units / (units - 1)) * t)
        assert student.tail(0.05, units, units - 1) == pytest.approx(expected, rel=1e-3)


def test_one_level_agrees_with_scipy_bootstrap():
    values = np.random.default_rng(3).lognormal(3, 0.2, 41)
    alone = np.arange(len(values))  # a process each
    found = median(times(values, alone), seed=1, resamples=20000).interval()
    tail = stats.norm.cdf(-np.sqrt(41 / 40) * stats.t.ppf(0.975, 40))
    oracle = stats.bootstrap(
        (values,),
        np.median,
        confidence_level=1 - 2 * tail,
        n_resamples=20000,
        method="percentile",
        rng=np.random.default_rng(4),
    )
    # The bootstrap of a median is discrete; two order statistics are neighbours at most.
    ordered = np.sort(values)
    for ours, theirs in zip(found, oracle.confidence_interval, strict=True):
        assert abs(np.searchsorted(ordered, ours) - np.searchsorted(ordered, theirs)) <= 1
    assert np.std(median(times(values, alone), resamples=20000).draws) == pytest.approx(
        oracle.standard_error, rel=0.05
    )


def test_one_process_has_no_interval_however_many_its_rounds():
    values = np.random.default_rng(5).lognormal(3, 0.2, 30)
    one = median(times(values))
    assert one.value == np.median(values)
    assert one.interval() is None and p_value(one) is None


def test_unequal_processes_have_the_same_distribution_as_drawn_one_by_one():
    sizes = (2, 5, 3)
    groups = [np.random.default_rng(i).normal(10 + i, 1, n) for i, n in enumerate(sizes)]
    rng = np.random.default_rng(9)
    slow = [
        np.median(
            np.concatenate([rng.choice(groups[k], len(groups[k])) for k in rng.integers(0, 3, 3)])
        )
        for _ in range(8000)
    ]
    process = np.repeat(np.arange(3), sizes)
    fast = median(times(np.concatenate(groups), process), resamples=8000).draws
    for level in (0.1, 0.25, 0.5, 0.75, 0.9):
        assert np.quantile(fast, level) == pytest.approx(np.quantile(slow, level), abs=0.15)
    assert stats.ks_2samp(fast, slow).pvalue > 1e-3


@pytest.mark.parametrize(
    ("processes", "between", "within", "least", "most"),
    [
        (2, 0.03, 0.01, 0.91, 1.0),
        (3, 0.03, 0.01, 0.91, 0.985),
        (4, 0.03, 0.01, 0.91, 0.985),
        (5, 0.03, 0.01, 0.91, 0.985),
        (10, 0.03, 0.01, 0.91, 0.985),
        (5, 0.01, 0.03, 0.95, 1.0),
    ],
)
def test_coverage_with_a_process_effect(processes, between, within, least, most):
    rng = np.random.default_rng(11)
    covered = 0
    for seed in range(300):
        low, high = median(simulated(rng, processes, 10, 30, between, within), seed).interval()
        covered += low <= 30 <= high
    assert least <= covered / 300 <= most


def test_false_alarms_between_equal_machines_stay_below_the_level():
    rng = np.random.default_rng(13)
    alarms = 0
    for seed in range(300):
        a = median(simulated(rng, 5, 10, 30, 0.03, 0.01), 2 * seed)
        b = median(simulated(rng, 5, 10, 30, 0.03, 0.01), 2 * seed + 1)
        alarms += p_value(ratio(b, a)) < 0.05
    assert alarms / 300 < 0.06


def test_a_clear_difference_is_resolved_even_among_sixty():
    rng = np.random.default_rng(14)
    a = median(simulated(rng, 5, 10, 30, 0.01, 0.01), 1)
    b = median(simulated(rng, 5, 10, 33, 0.01, 0.01), 2)
    assert p_value(ratio(b, a)) < 0.05 / 60
    assert p_value(ratio(a, b)) < 0.05 / 60
    assert p_value(ratio(b, a), bound=1.15) == 1.0


def test_one_sample_has_no_interval():
    found = median(times([7.5]))
    assert (found.value, found.draws, found.interval()) == (7.5, None, None)
    assert p_value(found) is None


def test_equal_samples_have_an_interval_of_one_point():
    found = median(times([4, 4, 4, 4], [0, 0, 1, 1])).interval()
    assert found == pytest.approx((4, 4), rel=1e-12)


def test_same_seed_same_interval_and_other_seed_another():
    data = times(np.random.default_rng(2).normal(30, 1, 20), np.repeat(np.arange(4), 5))
    assert median(data, 1).interval() == median(data, 1).interval()
    assert not np.array_equal(median(data, 1).draws, median(data, 2).draws)


def test_order_of_the_rows_does_not_matter():
    data = times(np.random.default_rng(2).normal(30, 1, 20), np.repeat(np.arange(4), 5))
    mixed = np.random.default_rng(3).permutation(20)
    other = Times(data.ns[mixed], data.process[mixed], data.round[mixed])
    assert median(data).interval() == median(other).interval()


def test_paired_ratio_removes_what_both_share():
    rng = np.random.default_rng(6)
    shared = np.exp(rng.normal(0, 0.3, 50))
    process = np.repeat(np.arange(5), 10)
    slow = times(1.05 * shared * np.exp(rng.normal(0, 0.002, 50)), process)
    fast = times(shared, process)
    found = paired_ratio(slow, fast)
    low, high = found.interval()
    assert 1.04 < low < 1.05 < high < 1.06
    assert p_value(found) < 1e-3
    unpaired = ratio(median(slow, 1), median(fast, 2)).interval()
    assert unpaired[0] < 1 < unpaired[1]


def test_paired_ratio_by_hand():
    # Log ratios of 2, 4 and 1/2: their median is log 2.
    assert paired_ratio(times([2, 4, 1]), times([1, 1, 2])).value == pytest.approx(2)


def test_pairs_are_found_by_process_and_round():
    a = Times(np.array([10.0, 30.0, 7.0]), np.array([0, 1, 1]), np.array([0, 0, 5]))
    b = Times(np.array([3.0, 5.0]), np.array([1, 0]), np.array([0, 0]))
    assert paired_ratio(a, b).value == pytest.approx(np.sqrt(2 * 10))
    assert total([a, b]).ns.tolist() == [15, 33]
    nothing = Times(np.array([1.0]), np.array([9]), np.array([9]))
    assert paired_ratio(a, nothing) is None


def test_ratio_of_a_run_to_itself_is_exactly_one():
    data = median(times(np.random.default_rng(2).normal(30, 1, 20), np.repeat(np.arange(4), 5)))
    assert ratio(data, data).interval() == (1, 1)
    assert p_value(ratio(data, data)) == 1.0


def test_welch_satterthwaite_freedom_of_two_equal_spreads_is_their_sum():
    draws = np.exp(np.random.default_rng(1).normal(0, 0.1, 2000))
    one = Estimate(1.0, draws, 5, 4.0)
    other = Estimate(1.0, draws[::-1].copy(), 5, 4.0)
    assert ratio(one, other).freedom == pytest.approx(8)
    certain = Estimate(1.0, np.ones(2000), 5, 4.0)
    assert ratio(one, certain).freedom == pytest.approx(4)


def test_p_value_agrees_with_the_interval_it_inverts():
    rng = np.random.default_rng(8)
    for shift in (0.02, 0.04, 0.06):
        draws = np.exp(rng.normal(shift, 0.02, 200_000))
        found = Estimate(float(np.exp(shift)), draws, 5, 4.0)
        low, _ = found.interval(1 - p_value(found))
        assert low == pytest.approx(1, abs=2e-3)


def test_mean_of_cells_drawn_together_keeps_their_spread():
    process = np.repeat(np.arange(5), 4)
    values = np.random.default_rng(1).normal(30, 2, 20)
    a, b = median(times(values, process), 3), median(times(values + 10, process), 3)
    assert mean([a, b]).value == pytest.approx(a.value + 5)
    assert np.std(mean([a, b]).draws) == pytest.approx(np.std(a.draws))
    assert mean([a, Estimate(3.0)]).draws is None
