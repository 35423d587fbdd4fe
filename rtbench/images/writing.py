"""Pictures into files, whole or not at all: an old picture stays until the new one is written."""

from __future__ import annotations

import io
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.images import portable
from rtbench.images.colour import to_display

NOT_A_NUMBER = (255, 0, 255)  # magenta: what no scene looks like
SOFTWARE = "rtbench"


class Written(NamedTuple):
    """What a file could not hold, in pixels."""

    not_numbers: int  # NaN: magenta in a PNG, kept elsewhere
    clipped: int  # darker than 0 or brighter than 1: only a PNG clips


def write(path: str | Path, pixels: np.ndarray, comment: str | None = None) -> Written:
    """Write a picture in the format that the name's suffix says.

    Parameters
    ----------
    path : str or Path
        ``.png``: 8 bits by the sRGB curve, clipped to 0..1, NaN in magenta. ``.npy``: the array
        as it is. ``.pfm``: float32, a Portable Float Map. An existing file is replaced once the
        new one is whole on the disk, and stays if that fails or is stopped.
    pixels : (H, W, 3) array of float
        Linear light, row 0 on top.
    comment : str, optional
        A line for the PNG's text, beside the name of this program; the other formats have none.

    Returns
    -------
    Written
        How many pixels are not numbers, and how many were clipped.

    Raises
    ------
    RtbenchError
        For an unknown suffix, a folder that is not there, an array that is no picture, or if the
        file cannot be written.
    """
    path = Path(path)
    encode = _encoder(path)
    pixels = np.asarray(pixels)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or 0 in pixels.shape or pixels.dtype.kind != "f":
        raise RtbenchError(
            f"cannot write {path}: a picture is an array of floats (height, width, 3), not of "
            f"{pixels.dtype} {pixels.shape}"
        )
    write_whole(path, encode(pixels, comment))
    nan = np.isnan(pixels).any(axis=2)
    beyond = ((pixels < 0) | (pixels > 1)).any(axis=2) & ~nan
    return Written(int(nan.sum()), int(beyond.sum()) if encode is _png else 0)


def require_writable(path: str | Path) -> None:
    """Complain about a name that `write` would refuse, before hours go into the picture.

    Parameters
    ----------
    path : str or Path
        The file to be.

    Raises
    ------
    RtbenchError
        For an unknown suffix, a folder in its place, or a folder that is not there or is closed.
    """
    path = Path(path)
    _encoder(path)
    if path.is_dir():
        raise RtbenchError(f"cannot write {path}: it is a folder (allowed: a file's name)")
    if not path.parent.is_dir():
        raise RtbenchError(f"cannot write {path}: there is no folder {str(path.parent)!r}")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise RtbenchError(f"cannot write {path}: Permission denied")


def write_whole(path: Path, data: bytes) -> None:
    """Write a file by way of another one beside it, so that nobody ever sees half of it.

    Parameters
    ----------
    path : Path
        The file; where it is a link, what it leads to is replaced.
    data : bytes
        Its content.

    Raises
    ------
    RtbenchError
        If it cannot be written; what was there before is there still.
    """
    if path.is_dir():
        raise RtbenchError(f"cannot write {path}: it is a folder (allowed: a file's name)")
    if not path.parent.is_dir():
        raise RtbenchError(f"cannot write {path}: there is no folder {str(path.parent)!r}")
    target = Path(os.path.realpath(path))
    beside = target.with_name(f".rtbench-{os.getpid()}-{secrets.token_hex(4)}")
    try:
        try:
            with open(beside, "xb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())  # some disks say only now that they are full
            os.replace(beside, target)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise RtbenchError(f"cannot write {path}: {error.strerror or error}") from error


def _png(pixels: np.ndarray, comment: str | None) -> bytes:
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    levels = np.rint(255 * np.nan_to_num(to_display(pixels))).astype(np.uint8)
    levels[np.isnan(pixels).any(axis=2)] = NOT_A_NUMBER
    text = PngInfo()
    text.add(b"sRGB", b"\0")  # says by which curve; "perceptual" intent
    text.add_text("Software", SOFTWARE)
    if comment:
        text.add_text("Comment", comment.replace("\0", " "))
    out = io.BytesIO()
    Image.fromarray(levels).save(out, "PNG", pnginfo=text)
    return out.getvalue()


def _npy(pixels: np.ndarray, comment: str | None) -> bytes:
    out = io.BytesIO()
    np.save(out, pixels, allow_pickle=False)
    return out.getvalue()


def _pfm(pixels: np.ndarray, comment: str | None) -> bytes:
    return portable.float_map(pixels)


_ENCODERS: dict[str, Callable[[np.ndarray, str | None], bytes]] = {
    ".png": _png,
    ".npy": _npy,
    ".pfm": _pfm,
}
SUFFIXES = tuple(_ENCODERS)


def _encoder(path: Path) -> Callable[[np.ndarray, str | None], bytes]:
    found = _ENCODERS.get(path.suffix.lower())
    if found is None:
        said = unknown("suffix of a picture", path.suffix, SUFFIXES)
        raise RtbenchError(f"cannot write {path}: {said}")
    return found
