"""Repetitions shared out, samples laid out, cells interleaved."""

import itertools

import numpy as np
import pytest

from rtbench.measure.schedule import order, samples_for, shares


def test_shares_sum_to_the_total_and_differ_by_one_at_most():
    rng = np.random.default_rng(7)
    drawn = zip(rng.integers(0, 10**9, 500), rng.integers(1, 3000, 500), strict=True)
    for total, parts in [*itertools.product(range(40), range(1, 40)), *drawn]:
        shared = shares(int(total), int(parts))
        assert len(shared) == parts
        assert sum(shared) == total
        assert max(shared) - min(shared) <= 1


@pytest.mark.parametrize("pairs", [1, 200, 2000, 25_000, 1_000_000])
def test_every_sample_has_a_repetition(pairs):
    for repetitions in [*range(1, 60), 100, 999, 1000, 10_007, 20_000, 10**6]:
        for processes, rounds in itertools.product((None, 1, 2, 5, 70), (None, 1, 3, 10, 90)):
            chosen = samples_for(repetitions, pairs, processes, rounds)
            assert min(chosen) >= 1
            assert chosen[0] * chosen[1] <= repetitions


@pytest.mark.parametrize("pairs", [1, 2000, 1_000_000])
def test_one_repetition_is_one_sample(pairs):
    assert samples_for(1, pairs) == (1, 1)


def test_a_few_repetitions_are_several_processes_of_one_round():
    assert samples_for(4, 25_000) == (4, 1)


def test_what_was_wished_is_what_is_done_where_the_repetitions_suffice():
    for pairs in (10, 25_000):
        assert samples_for(20_000, pairs, 7, 13) == (7, 13)
        assert samples_for(20_000, pairs, processes=7)[0] == 7
        assert samples_for(20_000, pairs, rounds=13)[1] == 13
        assert samples_for(10, pairs, rounds=10) == (1, 10)
        assert samples_for(10, pairs, processes=10) == (10, 1)


def test_the_order_is_reproducible_and_another_for_another_seed_or_process():
    assert order(1, 0, 0, 30) == order(1, 0, 0, 30)
    assert len({tuple(order(seed, process, 0, 30)) for seed in (1, 2) for process in (0, 1)}) == 4


@pytest.mark.parametrize("cells", [0, 1, 2, 7])
def test_every_round_has_every_cell_once(cells):
    for turn in range(3 * cells + 1):
        assert sorted(order(5, 2, turn, cells)) == list(range(cells))


def test_every_cell_comes_to_every_place_before_the_next_shuffle():
    cells = 9
    rounds = [order(3, 1, turn, cells) for turn in range(2 * cells)]
    for place in range(cells):
        assert sorted(r[place] for r in rounds[:cells]) == list(range(cells))
    successors = [{(a, b) for a, b in itertools.pairwise([*r, r[0]])} for r in rounds]
    assert all(s == successors[0] for s in successors[:cells])  # rotated only
    assert successors[cells] != successors[0]  # shuffled anew
