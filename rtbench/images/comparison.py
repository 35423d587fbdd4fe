"""Two pictures compared: by how much they differ, where most, and whether anybody can see it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.images.colour import luminance, to_display
from rtbench.images.structure import structural_similarity

SPACES = ("display", "linear")
STEP = 1 / 255  # of a picture of 8 bits
# Numbers of 8 bits go to light and back: what was one step apart is so again only by rounding.
_ROUNDING = 1e-9
_FEW = 0.001  # share of the pixels
_LIKE = 0.95  # structural similarity


@dataclass(frozen=True)
class Comparison:
    """How two pictures of one size differ.

    Attributes
    ----------
    space : str
        ``display``: values by the sRGB curve, clipped to 0..1, as people see them.
        ``linear``: light itself.
    height, width : int
        In pixels.
    mean_square, root_mean_square : float
        Of the differences of all channels, in units of full light (1).
    psnr : float
        Peak signal-to-noise ratio in dB, the peak 1; infinite for equal values.
    greatest : float
        The greatest difference of a channel.
    greatest_at : tuple of int
        Its row (from the top), column and channel; the first of equal ones.
    structural_similarity : float
        SSIM of the luminances; NaN below 11 x 11 pixels.
    differing, above_one_step, above_two_steps : float
        The share of pixels of which a channel differs: at all, by more than 1/255, than 2/255.
    equal_bits : bool
        Whether all numbers are equal to the last bit, before any curve or clipping.
    """

    space: str
    height: int
    width: int
    mean_square: float
    root_mean_square: float
    psnr: float
    greatest: float
    greatest_at: tuple[int, int, int]
    structural_similarity: float
    differing: float
    above_one_step: float
    above_two_steps: float
    equal_bits: bool

    @property
    def structural_difference(self) -> float:
        """1 less the structural similarity: 0 for equal pictures."""
        return 1 - self.structural_similarity

    @property
    def verdict(self) -> str:
        """In words, whether the pictures can be told apart.

        One step of 8 bits in every channel is at most 1.9 units of CIELAB, whatever the colour;
        2.3 units are just noticeable (M. Mahy, L. Van Eycken, A. Oosterlinck 1994, Evaluation of
        uniform color spaces). The other limits are ours.
        """
        if self.equal_bits:
            return "equal to the last bit"
        if self.space == "linear":
            return "not equal; whether it can be seen is a question in display space"
        if self.differing == 0:
            return "equal on a display: they differ beyond black and white only"
        if self.above_one_step == 0:
            return "cannot be told apart: no channel differs by more than one step of 8 bits"
        if self.above_two_steps <= _FEW:
            return f"alike: at most {100 * _FEW:g} % of the pixels differ by more than two steps"
        if self.structural_similarity >= _LIKE:
            return "alike in structure, with differences that can be seen"
        return "can be told apart"


def compare(a: np.ndarray, b: np.ndarray, space: str = "display") -> Comparison:
    """Return how two pictures differ.

    Parameters
    ----------
    a, b : (H, W, 3) arrays of float
        Linear light.
    space : str
        ``display`` (what people see: there a step is about as visible in the dark as in the
        light) or ``linear`` (what a renderer computes: there means are of light).

    Returns
    -------
    Comparison

    Raises
    ------
    RtbenchError
        If the sizes differ, for an unknown space, and for NaN, or infinite light in linear space,
        which have no difference.

    Source
    ------
    Wang, Bovik, Sheikh & Simoncelli 2004 for the structural similarity; see `structure`.
    """
    shown_a, shown_b = in_space(a, b, space)
    apart = np.abs(shown_b - shown_a)
    mean_square = float(np.mean(apart * apart))
    most = np.unravel_index(int(np.argmax(apart)), apart.shape)
    by_pixel = apart.max(axis=2)
    return Comparison(
        space,
        *by_pixel.shape,
        mean_square,
        math.sqrt(mean_square),
        -10 * math.log10(mean_square) if mean_square else math.inf,
        float(apart[most]),
        tuple(int(place) for place in most),
        structural_similarity(luminance(shown_a), luminance(shown_b)),
        float(np.mean(by_pixel > 0)),
        float(np.mean(by_pixel > STEP + _ROUNDING)),
        float(np.mean(by_pixel > 2 * STEP + _ROUNDING)),
        equal_bits(a, b),
    )


def equal_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two pictures hold the same numbers to the last bit.

    Parameters
    ----------
    a, b : arrays of float
        Compared as float64, which holds every float32. 0 and -0 differ; equal NaNs do not.

    Returns
    -------
    bool
    """
    a, b = (np.ascontiguousarray(one, np.float64) for one in (a, b))
    return a.shape == b.shape and bool((a.view(np.uint64) == b.view(np.uint64)).all())


def in_space(a: np.ndarray, b: np.ndarray, space: str) -> tuple[np.ndarray, np.ndarray]:
    """Return two pictures of one size as values of a space, or complain; see `compare`."""
    if space not in SPACES:
        raise RtbenchError(unknown("space", space, SPACES))
    a, b = (np.asarray(one, np.float64) for one in (a, b))
    for name, one in (("first", a), ("second", b)):
        if one.ndim != 3 or one.shape[2] != 3 or 0 in one.shape:
            raise RtbenchError(f"the {name} picture is not (height, width, 3) but {one.shape}")
    if a.shape != b.shape:
        raise RtbenchError(
            f"the first picture is {_size(a)} pixels and the second {_size(b)}: only pictures of "
            "one size can be compared"
        )
    for name, one in (("first", a), ("second", b)):
        bad = (np.isnan(one) if space == "display" else ~np.isfinite(one)).any(axis=2)
        if bad.any():
            row, column = np.argwhere(bad)[0]
            what = "not numbers" if space == "display" else "not finite numbers"
            raise RtbenchError(
                f"{bad.sum():,} pixels of the {name} picture are {what}, the first in row {row}, "
                f"column {column}: there is no difference to them"
            )
    return (a, b) if space == "linear" else (to_display(a), to_display(b))


def _size(picture: np.ndarray) -> str:
    return f"{picture.shape[1]} x {picture.shape[0]}"
