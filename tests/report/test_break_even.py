import numpy as np
import pytest

from rtbench.report.break_even import Costs, costs_of


def costs(test, preparation, sizes=(64, 4096), draws=None):
    test, preparation = (np.array(one, float) for one in (test, preparation))
    kernels = [f"k{number}" for number in range(len(test))]
    spread = None if draws is None else np.zeros((*preparation.shape, draws.shape[2]))
    return Costs("float32", 0.1, kernels, np.array(sizes, float), test, preparation, draws, spread)


def test_stretches_are_where_a_search_finds_the_least_cost():
    random = np.random.default_rng(3)
    for _ in range(50):
        found = costs(random.uniform(3, 9, (6, 1)), random.uniform(0, 200, (6, 1)), (64,))
        stretches = found.stretches(0)
        assert stretches[0].start == 0 and stretches[-1].end == np.inf
        assert [s.end for s in stretches[:-1]] == [s.start for s in stretches[1:]]
        for rays in np.geomspace(0.01, 1e5, 200):
            best = np.argmin(found.test[:, 0] + found.preparation[:, 0] / rays)
            (told,) = [s.kernel for s in stretches if s.start <= rays < s.end]
            assert told == found.kernels[best]


def test_break_even_of_two_is_preparation_over_what_is_saved():
    first, second = costs([[7.0], [4.0]], [[0.0], [120.0]], (64,)).stretches(0)
    assert (first.kernel, second.kernel) == ("k0", "k1")
    assert first.end == second.start == pytest.approx(120 / 3)


def test_what_is_slower_and_prepared_is_never_the_cheapest():
    (only,) = costs([[7.0], [7.5]], [[0.0], [20.0]], (64,)).stretches(0)
    assert only == ("k0", 0, np.inf)


def test_between_two_sizes_costs_are_straight_over_the_logarithm():
    found = costs([[4.0, 8.0]], [[100.0, 50.0]]).at(np.array([64, 512, 4096]))
    assert found.test[0] == pytest.approx([4, 6, 8])  # 512 is their geometric mean
    assert found.preparation[0] == pytest.approx([100, 75, 50])


def test_doubt_is_where_resamples_disagree():
    random = np.random.default_rng(1)
    far = np.stack([random.normal(5.0, 0.1, 400), random.normal(9.0, 0.1, 400)])
    near = np.stack([random.normal(5.0, 0.5, 400), random.normal(5.1, 0.5, 400)])
    draws = np.stack([far, near], axis=1)
    found = costs([[5.0, 5.0], [9.0, 5.1]], np.zeros((2, 2)), draws=draws)
    assert found.unresolved(np.array([1.0, 100.0])).tolist() == [[False, False], [True, True]]
    assert costs([[5.0]], [[0.0]], (64,)).unresolved(np.array([1.0])) is None


def test_a_run_s_costs_are_its_medians_and_preparations(make):
    run = make("break_even")
    low, high = costs_of(run)
    assert (low.density, high.density) == (0.1, 0.5)
    assert low.sizes.tolist() == [64, 512, 4096, 32768, 262144]
    wald = low.kernels.index("wald_last_whole_uv")
    assert low.preparation[wald] == pytest.approx(130 * (1 + 200 / low.sizes))
    assert low.preparation[low.kernels.index("moller_trumbore_last_whole_uv")].max() == 0
    rows = run.summary[(run.summary.kernel == "wald_last_whole_uv") & (run.summary.density == 0.1)]
    assert low.test[wald] == pytest.approx(rows.sort_values("scene").ns_per_test.to_numpy())
    assert low.test_draws.shape[:2] == low.test.shape


def test_a_kernel_whose_preparation_was_not_timed_is_left_out(make):
    run = make("break_even")
    run.info["preparation"] = [
        row for row in run.info["preparation"] if row["kernel"] != "wald_last_whole_uv"
    ]
    assert all("wald_last_whole_uv" not in one.kernels for one in costs_of(run))
