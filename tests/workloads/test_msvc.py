import numpy as np
import pytest

from rtbench.workloads import msvc


def plain_rand(state, n):
    """Return n numbers of rand() and the last state, one step after another."""
    numbers = []
    for _ in range(n):
        state = (state * 214013 + 2531011) % 2**32
        numbers.append((state >> 16) & 0x7FFF)
    return numbers, state


def test_srand_1_gives_the_well_known_numbers():
    numbers, _ = msvc.rand(1, 10)
    assert numbers.tolist() == [41, 18467, 6334, 26500, 19169, 15724, 11478, 29358, 26962, 24464]


@pytest.mark.parametrize("state", [0, 24660781, 2**31, 2**32 - 1])
@pytest.mark.parametrize("n", [1, msvc.BLOCK - 1, msvc.BLOCK, 2 * msvc.BLOCK + 7])
def test_jumps_equal_single_steps(state, n):
    numbers, last = msvc.rand(state, n)
    expected, expected_last = plain_rand(state, n)
    assert numbers.tolist() == expected
    assert last == expected_last


def test_no_numbers_leave_the_state():
    numbers, state = msvc.rand(5, 0)
    assert len(numbers) == 0
    assert state == 5


def test_highest_bit_of_the_state_is_never_seen():
    low, _ = msvc.rand(12345, 1000)
    high, _ = msvc.rand(12345 + 2**31, 1000)
    np.testing.assert_array_equal(low, high)
