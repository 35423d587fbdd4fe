"""The portable formats of Netpbm: float maps (PFM), pixmaps and greymaps (PPM, PGM) in binary."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from rtbench.errors import RtbenchError

MAGICS = (b"PF", b"Pf", b"P5", b"P6")
_GAP = rb"(?:\s|#[^\r\n]*[\r\n])+"
_HEADER = re.compile(
    rb"(PF|Pf|P5|P6)" + _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})" + _GAP + rb"([-+.\deE]{1,40})\s"
)


class Samples(NamedTuple):
    """What a file holds: (H, W, 1 or 3), row 0 on top; floats of light, or integers to a most."""

    values: np.ndarray
    most: int | None  # None: floats


def float_map(pixels: np.ndarray) -> bytes:
    """Return a picture as a Portable Float Map: float32, little endian, the bottom row first.

    Parameters
    ----------
    pixels : (H, W, 3) array of float
        Row 0 on top; rounded to float32.

    Returns
    -------
    bytes
        The whole file.

    Source
    ------
    P. Debevec, Portable FloatMap; the Netpbm manual, "pfm".
    """
    height, width, _ = pixels.shape
    with np.errstate(over="ignore"):  # light beyond float32 becomes inf, as it should
        rows = np.ascontiguousarray(pixels[::-1], "<f4")
    return b"PF\n%d %d\n-1.0\n" % (width, height) + rows.tobytes()


def samples(data: bytes) -> Samples:
    """Return what a PFM, or a binary PPM or PGM, holds.

    Parameters
    ----------
    data : bytes
        The whole file. The sign of a float map's scale gives the order of its bytes; the size of
        the scale, which programs use as they like, is ignored.

    Returns
    -------
    Samples

    Raises
    ------
    RtbenchError
        If the header is none, or if the file ends too early.
    """
    header = _HEADER.match(data)
    if header is None:
        raise RtbenchError("its header is not that of a portable map (PF, Pf, P5, P6)")
    magic, last = header[1], header[4].decode("ascii")
    width, height = int(header[2]), int(header[3])
    channels = 3 if magic in (b"PF", b"P6") else 1
    if magic in (b"PF", b"Pf"):
        most, form = None, ("<f4" if _scale(last) < 0 else ">f4")
    else:
        most = int(last) if last.isdigit() else 0
        if not 1 <= most <= 65535:
            raise RtbenchError(f"its greatest value {last} is not allowed (allowed: 1 to 65535)")
        form = "u1" if most < 256 else ">u2"
    if width < 1 or height < 1:
        raise RtbenchError(f"it has no pixels: {width} x {height}")
    number = width * height * channels
    needed, there = number * np.dtype(form).itemsize, len(data) - header.end()
    if there < needed:
        raise RtbenchError(f"it is cut off: {there:,} of {needed:,} bytes of pixels are there")
    values = np.frombuffer(data, form, number, header.end()).reshape(height, width, channels)
    return Samples(values[::-1] if most is None else values, most)


def _scale(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise RtbenchError(f"its scale {text} is not a number") from None
