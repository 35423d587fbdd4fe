import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads import draws


def test_order_of_an_item_is_orig_end_v0_v1_v2():
    item = np.arange(15)
    assert item[draws.ORIG].tolist() == [0, 1, 2]
    assert item[draws.END].tolist() == [3, 4, 5]
    assert [item[part].tolist() for part in (draws.V0, draws.V1, draws.V2)] == (
        item[draws.TRIANGLE].reshape(3, 3).tolist()
    )


def test_msvc_coordinates_are_rand_over_32767_in_float32():
    state, expected = 7, []
    for _ in range(45):
        state = (state * 214013 + 2531011) % 2**32
        # A float64 quotient of integers this small rounds to float32 as the quotient itself does.
        expected.append(np.float32(((state >> 16) & 0x7FFF) / 32767))
    np.testing.assert_array_equal(draws.draw("msvc", 7, 3).ravel(), expected)


def test_pcg64_coordinates_are_numpys():
    expected = np.random.default_rng(7).random(45, dtype=np.float32)
    np.testing.assert_array_equal(draws.draw("pcg64", 7, 3).ravel(), expected)


@pytest.mark.parametrize("generator", draws.GENERATORS)
def test_portions_make_no_difference(generator):
    draw = draws.items(generator, 3)
    parts = np.concatenate([draw(k) for k in (1, 2, 5, 1500)])
    np.testing.assert_array_equal(parts, draws.draw(generator, 3, 1508))
    assert parts.dtype == np.float32


@pytest.mark.parametrize("generator", draws.GENERATORS)
def test_seeds_differ(generator):
    assert not np.array_equal(draws.draw(generator, 1, 4), draws.draw(generator, 2, 4))


def test_unknown_generator_names_the_nearest():
    with pytest.raises(RtbenchError, match="did you mean 'pcg64'"):
        draws.items("pcg46", 1)


@pytest.mark.parametrize(
    ("generator", "seed"), [("pcg64", -1), ("msvc", -1), ("msvc", 2**32), ("pcg64", 1.5)]
)
def test_bad_seed_is_refused_in_one_line(generator, seed):
    with pytest.raises(RtbenchError, match=r"seed .* is not allowed") as caught:
        draws.items(generator, seed)
    assert "\n" not in str(caught.value)


def test_largest_msvc_state_is_taken():
    assert draws.draw("msvc", 2**32 - 1, 1).shape == (1, 15)
