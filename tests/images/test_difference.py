"""The picture of a difference: white, vermilion, blue, and the gain that it tells."""

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.images.colour import to_display
from rtbench.images.difference import difference

GREY = np.full((2, 3, 3), 0.5)
VERMILION, BLUE = (0xD5, 0x5E, 0x00), (0x00, 0x72, 0xB2)  # Okabe & Ito 2008


def levels(pixels):
    return np.rint(255 * to_display(pixels)).astype(int).tolist()


def test_equal_pictures_are_white():
    found = difference(GREY, GREY)
    assert (found.pixels == 1).all() and found.gain == 1


def test_colours_tell_which_way_and_how_far():
    other = GREY.copy()
    other[0, 0] += 0.25
    other[0, 1] -= 0.25
    other[0, 2] += 0.125
    found = difference(GREY, other, "linear", gain=4)
    assert levels(found.pixels)[0][:2] == [list(VERMILION), list(BLUE)]
    half = [(255 + level) / 2 for level in VERMILION]
    np.testing.assert_allclose(levels(found.pixels)[0][2], half, atol=0.5001)
    assert levels(found.pixels)[1] == [[255, 255, 255]] * 3


def test_a_difference_of_hue_alone_is_seen():
    """Red up, blue down by more: the channel that differs most decides."""
    other = GREY.copy()
    other[1, 1] = 0.6, 0.5, 0.3
    red, _, blue = difference(GREY, other, "linear").pixels[1, 1]
    assert blue > red


@pytest.mark.parametrize(("apart", "gain"), [(0.25, 4), (0.3, 2), (1e-6, 2**19), (0.5, 2)])
def test_the_gain_is_the_greatest_power_of_two_that_fits(apart, gain):
    other = GREY.copy()
    other[0, 0, 0] += apart
    if apart in (0.25, 0.5):  # exact
        assert difference(GREY, other, "linear").gain == gain
    assert gain * apart <= 1 < 2 * gain * apart or apart in (0.25, 0.5)
    assert difference(GREY, other, "linear").gain == gain


def test_a_few_great_differences_do_not_hide_the_others():
    a = np.zeros((100, 100, 3))
    b = a + 0.01
    b[0, :10] = 1
    found = difference(a, b, "linear")
    assert found.gain == 64  # 0.64 of the colour for 0.01
    assert levels(found.pixels)[0][0] == list(VERMILION)


def test_what_is_refused():
    with pytest.raises(RtbenchError, match="one size"):
        difference(GREY, GREY[:1])
    for gain in (0, -1.0, np.nan, np.inf):
        with pytest.raises(RtbenchError, match="gain"):
            difference(GREY, GREY, gain=gain)
