"""Comparing pictures: every number against one worked out by hand."""

import math

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.images.colour import to_linear
from rtbench.images.comparison import compare, equal_bits

RANDOM = np.random.default_rng(1)
GREY = np.full((20, 30, 3), 0.5)


def test_equal_pictures():
    picture = RANDOM.random((16, 12, 3))
    found = compare(picture, picture.copy())
    assert found.equal_bits and found.psnr == math.inf and (found.height, found.width) == (16, 12)
    assert (found.mean_square, found.root_mean_square, found.greatest, found.differing) == (0,) * 4
    assert found.structural_similarity == pytest.approx(1)
    assert found.verdict == "equal to the last bit"


def test_one_channel_by_hand():
    other = GREY.copy()
    other[7, 11, 2] = 0.2
    found = compare(GREY, other, "linear")
    assert found.mean_square == pytest.approx(0.09 / 1800)
    assert found.root_mean_square == pytest.approx(0.3 / math.sqrt(1800))
    # 10 log10(1 / 0.00005) = 10 log10(20000) = 43.0103 dB
    assert found.psnr == pytest.approx(43.0103, abs=1e-4)
    assert found.greatest == pytest.approx(0.3) and found.greatest_at == (7, 11, 2)
    assert found.differing == found.above_one_step == found.above_two_steps == 1 / 600
    assert not found.equal_bits


def test_a_constant_shift_in_display_space():
    """0.1 everywhere is 20 dB, whatever the picture; steps of 8 bits are counted as such."""
    display = RANDOM.random((12, 12, 3)) * 0.9
    found = compare(to_linear(display), to_linear(display + 0.1))
    assert found.psnr == pytest.approx(20)
    assert found.root_mean_square == pytest.approx(0.1) and found.differing == 1
    assert compare(to_linear(display), to_linear(display + 0.1), "linear").psnr != pytest.approx(20)


@pytest.mark.parametrize(("steps", "shares"), [(1, (1, 0, 0)), (2, (1, 1, 0)), (3, (1, 1, 1))])
def test_steps_of_8_bits_are_counted_whole(steps, shares):
    """All levels: none is lost or won by the rounding of the curve there and back."""
    levels = np.arange(253).reshape(-1, 1, 1) * np.ones((1, 1, 3))
    found = compare(to_linear(levels / 255), to_linear((levels + steps) / 255))
    assert (found.differing, found.above_one_step, found.above_two_steps) == shares


def test_the_spaces_differ_as_eyes_and_light_do():
    """Dark greys far apart to the eye are near as light; what is beyond white cannot be seen."""
    dark, darker = np.full((1, 1, 3), 0.01), np.full((1, 1, 3), 0.0)
    assert compare(dark, darker, "linear").greatest == 0.01
    assert compare(dark, darker).greatest == pytest.approx(0.0998528, abs=1e-6)
    bright = compare(np.full((1, 1, 3), 2.0), np.full((1, 1, 3), np.inf))
    assert bright.differing == 0 and not bright.equal_bits
    assert bright.verdict == "equal on a display: they differ beyond black and white only"


def lab(display):
    """CIE 1976 L*a*b* of sRGB values, white D65 (CIE 15:2004; the matrix of IEC 61966-2-1)."""
    light = np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)
    matrix = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    x = light @ np.array(matrix).T / [0.9505, 1.0, 1.089]
    f = np.where(x > (6 / 29) ** 3, np.cbrt(x), x * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], 1)


def test_one_step_in_every_channel_is_below_what_is_just_noticeable():
    """What the words "cannot be told apart" rest on: 2.3 of CIELAB (Mahy et al. 1994)."""
    levels = np.stack(np.meshgrid(*[np.arange(0, 256, 15)] * 3), -1).reshape(-1, 3) + 0.0
    for signs in np.array(np.meshgrid(*[[-1, 0, 1]] * 3)).reshape(3, -1).T:
        other = np.clip(levels + signs, 0, 255)
        apart = np.linalg.norm(lab(levels / 255) - lab(other / 255), axis=1)
        assert apart.max() < 2.3


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        (lambda d: d + 0.9 / 255, "cannot be told apart"),
        (lambda d: np.where(np.arange(d.size).reshape(d.shape) == 77, d + 0.3, d), "alike: at mos"),
        (lambda d: d + 0.02, "alike in structure"),
        (lambda d: 1 - d, "can be told apart"),
    ],
)
def test_verdicts(change, verdict):
    display = np.linspace(0.1, 0.6, 100 * 40 * 3).reshape(100, 40, 3)
    assert compare(to_linear(display), to_linear(change(display))).verdict.startswith(verdict)


def test_in_linear_space_nothing_is_said_about_seeing():
    assert compare(GREY, GREY + 1e-9, "linear").verdict.startswith("not equal; whether it can be")


def test_bits():
    assert equal_bits(np.array([np.nan, 1.0]), np.array([np.nan, 1.0]))
    assert not equal_bits(np.array([0.0]), np.array([-0.0]))
    assert not equal_bits(np.array([1.0]), np.nextafter([1.0], 2))
    assert equal_bits(np.float32([0.1]), np.float64(np.float32([0.1])))
    assert not equal_bits(np.zeros((1, 2)), np.zeros((2, 1)))
    assert not compare(GREY, np.nextafter(GREY, 1)).equal_bits


def test_what_cannot_be_compared_is_said_in_one_line():
    with pytest.raises(
        RtbenchError, match="first picture is 30 x 20 pixels and the second 30 x 19"
    ):
        compare(GREY, GREY[:19])
    with pytest.raises(RtbenchError, match="unknown space 'lienar'; did you mean 'linear'"):
        compare(GREY, GREY, "lienar")
    with pytest.raises(RtbenchError, match="second picture is not"):
        compare(GREY, GREY[:, :, 0])
    bad = GREY.copy()
    bad[3:5, 4, 1] = np.nan
    with pytest.raises(RtbenchError, match=r"2 pixels of the second.* first in row 3, column 4"):
        compare(GREY, bad)
    bad[3:5, 4, 1] = np.inf
    with pytest.raises(RtbenchError, match="not finite"):
        compare(bad, GREY, "linear")
