"""The difference of two pictures as a picture: where, how much, and which way."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.images.colour import to_linear
from rtbench.images.comparison import in_space

# Of Okabe & Ito 2008: eyes of every kind tell these two apart. White: no difference.
BRIGHTER = (0xD5 / 255, 0x5E / 255, 0x00 / 255)  # vermilion: the second picture is brighter
DARKER = (0x00 / 255, 0x72 / 255, 0xB2 / 255)  # blue: the second picture is darker
_SHARE = 0.99  # of the pixels that differ: those that the automatic gain must not saturate


class Difference(NamedTuple):
    """A picture of a difference, and by how much the difference is amplified in it."""

    pixels: np.ndarray  # (H, W, 3) float64, linear light
    gain: float


def difference(
    a: np.ndarray, b: np.ndarray, space: str = "display", gain: float | None = None
) -> Difference:
    """Return a picture of where and by how much b differs from a.

    Parameters
    ----------
    a, b : (H, W, 3) arrays of float
        Linear light.
    space : str
        ``display`` or ``linear``: where differences are taken; see `compare`.
    gain : float, optional
        A difference of 1/gain has the full colour. By default the greatest power of two that
        leaves 99 % of the differing pixels below that, and at least 1.

    Returns
    -------
    Difference
        White where the pictures are equal, towards vermilion where b is brighter and towards blue
        where it is darker: by the channel of a pixel that differs most, so that no difference of
        hue alone is lost.

    Raises
    ------
    RtbenchError
        As `compare`, and for a gain that is not above 0.
    """
    shown_a, shown_b = in_space(a, b, space)
    apart = shown_b - shown_a
    most = np.abs(apart).argmax(axis=2)
    signed = np.take_along_axis(apart, most[:, :, None], axis=2)[:, :, 0]
    if gain is None:
        gain = _gain(np.abs(signed))
    elif not 0 < gain < math.inf:
        raise RtbenchError(f"gain {gain} is not allowed (allowed: above 0)")
    strength = np.minimum(np.abs(signed) * gain, 1.0)[:, :, None]
    colour = np.where(signed[:, :, None] > 0, BRIGHTER, DARKER)
    return Difference(to_linear(1 - strength * (1 - colour)), gain)


def _gain(apart: np.ndarray) -> float:
    apart = apart[apart > 0]
    if not apart.size:
        return 1.0
    usual = float(np.quantile(apart, _SHARE))
    return 2.0 ** max(math.floor(-math.log2(usual)), 0)
