"""From light to the numbers of a display and back: the curve of sRGB, and luminance."""

from __future__ import annotations

import numpy as np

LUMINANCE = (0.2126, 0.7152, 0.0722)  # of red, green and blue; Rec. ITU-R BT.709, as sRGB has them

_DARKEST_LIGHT, _DARKEST_NUMBER = 0.0031308, 0.04045  # where the straight part of the curve ends
_SLOPE, _OFFSET, _EXPONENT = 12.92, 0.055, 2.4


def to_display(linear: np.ndarray) -> np.ndarray:
    """Return the numbers that a display is given for light.

    Parameters
    ----------
    linear : array of float, any shape
        Light, 1 the brightest that can be shown. Clipped to 0..1; NaN stays NaN.

    Returns
    -------
    array of float64, same shape
        From 0 to 1.

    Source
    ------
    IEC 61966-2-1:1999, 5.2.
    """
    light = np.clip(np.asarray(linear, np.float64), 0.0, 1.0)
    root = light ** (1 / _EXPONENT)
    curve = root + _OFFSET * (root - 1)  # of this form the curve of 1 is 1, to the last bit
    return np.where(light <= _DARKEST_LIGHT, _SLOPE * light, curve)


def to_linear(display: np.ndarray) -> np.ndarray:
    """Return the light that a display makes of numbers.

    Parameters
    ----------
    display : array of float, any shape
        From 0 to 1; clipped. NaN stays NaN.

    Returns
    -------
    array of float64, same shape
        Light from 0 to 1.

    Source
    ------
    IEC 61966-2-1:1999, 5.2.
    """
    number = np.clip(np.asarray(display, np.float64), 0.0, 1.0)
    curve = ((number + _OFFSET) / (1 + _OFFSET)) ** _EXPONENT
    return np.where(number <= _DARKEST_NUMBER, number / _SLOPE, curve)


def luminance(pixels: np.ndarray) -> np.ndarray:
    """Return the weighted sum of red, green and blue, (H, W, 3) to (H, W).

    Of light it is the luminance; of display values it is what television calls luma.

    Source
    ------
    Rec. ITU-R BT.709-6, item 3.2.
    """
    red, green, blue = LUMINANCE
    return red * pixels[..., 0] + green * pixels[..., 1] + blue * pixels[..., 2]
