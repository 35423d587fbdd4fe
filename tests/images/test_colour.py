"""The curve of sRGB at its published points, and against exact arithmetic."""

from decimal import Decimal, getcontext

import numpy as np
import pytest

from rtbench.images.colour import luminance, to_display, to_linear


def exactly(light: str) -> float:
    """The standard's formula, in decimals of 40 digits."""
    getcontext().prec = 40
    light = Decimal(light)
    if light <= Decimal("0.0031308"):
        return float(Decimal("12.92") * light)
    root = (light.ln() / Decimal("2.4")).exp()
    return float(Decimal("1.055") * root - Decimal("0.055"))


@pytest.mark.parametrize(
    "light", ["0", "0.001", "0.0031308", "0.0031309", "0.01", "0.18", "0.5", "0.9", "1"]
)
def test_the_curve_is_the_standards(light):
    np.testing.assert_allclose(to_display(float(light)), exactly(light), rtol=1e-14, atol=0)


@pytest.mark.parametrize(
    ("level", "light"),
    # 128: ((128 / 255 + 0.055) / 1.055)^2.4; up to 10: level / 255 / 12.92. By a desk calculator.
    [(0, 0.0), (1, 0.000303527), (10, 0.00303527), (11, 0.00334654), (128, 0.2158605), (255, 1.0)],
)
def test_levels_of_8_bits_give_the_light_worked_out_by_hand(level, light):
    np.testing.assert_allclose(to_linear(level / 255), light, rtol=2e-6)


def test_middle_grey_is_118():
    assert round(255 * float(to_display(0.18))) == 118  # the 18 % grey card of photographers


def test_there_and_back_all_levels_of_16_bits_stay():
    levels = np.arange(65536)
    np.testing.assert_array_equal(np.rint(65535 * to_display(to_linear(levels / 65535))), levels)


def test_what_a_display_cannot_show_is_clipped_and_nan_stays():
    shown = to_display(np.array([-1.0, 2.0, np.inf, -np.inf, np.nan]))
    np.testing.assert_array_equal(shown, [0, 1, 1, 0, np.nan])


def test_luminance_of_white_is_1_and_green_is_brightest():
    red, green, blue, white = luminance(np.array([*np.eye(3), np.ones(3)]))
    assert white == pytest.approx(1) and green > red > blue
    assert green == 0.7152  # BT.709
