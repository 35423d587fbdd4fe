"""PNG files of 16 bits a channel, whole: the usual library keeps only the upper 8 of them."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from rtbench.errors import RtbenchError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}  # by colour type: grey, colour, each with alpha
_HEADER_END = 29  # of the signature and the first chunk's 13 bytes
_NONE, _SUB, _UP, _AVERAGE, _PAETH = range(5)


def is_deep(data: bytes) -> bool:
    """Return whether data begins like a PNG file of 16 bits a channel."""
    return data.startswith(SIGNATURE) and len(data) >= _HEADER_END and data[24] == 16


def decode(data: bytes) -> np.ndarray:
    """Return the samples of a 16-bit PNG.

    Parameters
    ----------
    data : bytes
        The whole file, not interlaced.

    Returns
    -------
    (H, W, C) array of uint16
        C is 1 (grey), 2 (grey, alpha), 3 or 4.

    Raises
    ------
    RtbenchError
        If the file is interlaced, damaged or cut off.

    Source
    ------
    ISO/IEC 15948:2004 (PNG), 5.3 chunks, 9 filtering.
    """
    width, height, _, colour_type, _, _, interlaced = struct.unpack(">IIBBBBB", data[16:29])
    if colour_type not in _CHANNELS or width < 1 or height < 1:
        raise RtbenchError("its header is damaged")
    if interlaced:
        raise RtbenchError("it is interlaced, with 16 bits: save it without interlacing")
    channels = _CHANNELS[colour_type]
    row = 2 * channels * width
    needed = (row + 1) * height
    try:
        # No more than is needed: a few bytes of a damaged file can unfold into gigabytes.
        unpacked = zlib.decompressobj().decompress(_compressed(data), needed)
    except zlib.error:
        raise RtbenchError("its pixels are damaged") from None
    if len(unpacked) < needed:
        raise RtbenchError(f"it is cut off: {len(unpacked):,} of {needed:,} bytes are there")
    lines = np.frombuffer(unpacked, np.uint8).reshape(height, row + 1)
    found = np.zeros((height, row), np.uint8)
    above = np.zeros(row, np.uint8)
    for k in range(height):
        found[k] = above = _unfiltered(int(lines[k, 0]), lines[k, 1:], above, 2 * channels)
    return found.view(">u2").reshape(height, width, channels)


def _compressed(data: bytes) -> bytes:
    """Return the bodies of the chunks of pixels, joined."""
    parts, place = [], len(SIGNATURE)
    while place + 8 <= len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        if kind == b"IDAT":
            parts.append(data[place + 8 : place + 8 + length])
        elif kind == b"IEND":
            break
        place += length + 12
    return b"".join(parts)


def _unfiltered(kind: int, line: np.ndarray, above: np.ndarray, step: int) -> np.ndarray:
    """Return the bytes of a row; `step` bytes are one pixel, sums are modulo 256."""
    if kind == _NONE:
        return line
    if kind == _SUB:
        return np.cumsum(line.reshape(-1, step), axis=0, dtype=np.uint8).ravel()
    if kind == _UP:
        return line + above
    if kind not in (_AVERAGE, _PAETH):
        raise RtbenchError("its pixels are damaged")
    # Each byte needs the one before: plain integers are quicker here than arrays of one element.
    given, up = line.tolist(), above.tolist()
    found = [0] * step + given
    corners = [0] * step + up
    for k, value in enumerate(given):
        left = found[k]
        average = (left + up[k]) >> 1
        guess = average if kind == _AVERAGE else _paeth(left, up[k], corners[k])
        found[k + step] = (value + guess) & 255
    return np.array(found[step:], np.uint8)


def _paeth(left: int, up: int, corner: int) -> int:
    to_left, to_up, to_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
    if to_left <= to_up and to_left <= to_corner:
        return left
    return up if to_up <= to_corner else corner
