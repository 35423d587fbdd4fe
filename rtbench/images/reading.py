"""Pictures from files, as linear light: our own formats, and what other ray tracers write."""

from __future__ import annotations

import io
import struct
import warnings
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.images import deep_png, portable
from rtbench.images.colour import to_linear

SUFFIXES = (
    *(".png", ".npy", ".pfm", ".ppm", ".pgm", ".pnm", ".pbm", ".tga", ".bmp"),
    *(".jpg", ".jpeg", ".tif", ".tiff", ".gif"),
)
MEANINGS = ("display", "linear")
_USUAL_GAMMA = 0.45455  # what a PNG says of itself that follows the sRGB curve
_NEAR = 0.002

# Samples (H, W, C), what full light is among them (None: they are light), and the curve to light.
_Decoded = tuple[np.ndarray, float | None, str | float]


def read(path: str | Path, numbers: str = "display") -> np.ndarray:
    """Read a picture as linear light.

    Parameters
    ----------
    path : str or Path
        ``.npy`` or ``.pfm`` (floats, taken as they are), or whole numbers of 8 or 16 bits:
        ``.png``, ``.ppm``, ``.tga``, ``.bmp`` and others. Grey becomes three equal channels, a
        palette its colours; alpha is dropped.
    numbers : str
        What the whole numbers mean: ``display``, by the sRGB curve (or by the exponent that a PNG
        tells in its gAMA chunk), or ``linear``, as programs write them that know of no curve.

    Returns
    -------
    (H, W, 3) array of float64
        Row 0 on top; whole numbers give 0 to 1.

    Raises
    ------
    RtbenchError
        For a file that is not there, an unknown suffix, or what is no picture.
    """
    path = Path(path)
    if numbers not in MEANINGS:
        raise RtbenchError(unknown("meaning of numbers", numbers, MEANINGS))
    if path.suffix.lower() not in SUFFIXES:
        said = unknown("suffix of a picture", path.suffix, SUFFIXES)
        raise RtbenchError(f"cannot read {path}: {said}")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RtbenchError(f"cannot read {path}: {error.strerror or error}") from None
    try:
        return _three_channels(*_decoded(path.suffix.lower(), data, numbers))
    except RtbenchError as problem:
        raise RtbenchError(f"cannot read {path}: {problem}") from None
    except MemoryError:
        raise RtbenchError(f"cannot read {path}: it is too large for this memory") from None


def _decoded(suffix: str, data: bytes, numbers: str) -> _Decoded:
    if suffix == ".npy":
        return _array(data), None, numbers
    if suffix == ".pfm" or data[:2] in portable.MAGICS:
        values, most = portable.samples(data)
        return values, most, numbers
    return _by_library(data, numbers)


def _array(data: bytes) -> np.ndarray:
    try:
        found = np.load(io.BytesIO(data), allow_pickle=False)
    except (OSError, ValueError, EOFError, SyntaxError, TypeError, KeyError, UnicodeError):
        raise RtbenchError("it is not an array of numpy's, or cut off") from None
    if not isinstance(found, np.ndarray):
        found.close()
        raise RtbenchError("it holds several arrays")
    if found.ndim == 2:
        found = found[:, :, None]
    if found.ndim != 3 or found.dtype.kind != "f":
        raise RtbenchError(f"it is not an array of floats (H, W, 3): {found.dtype} {found.shape}")
    return found


def _by_library(data: bytes, numbers: str) -> _Decoded:
    from PIL import Image, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about metadata, and sizes that we can hold
            with Image.open(io.BytesIO(data)) as image:
                curve = _curve(image.info, numbers) if image.format == "PNG" else numbers
                if deep_png.is_deep(data):
                    return deep_png.decode(data), 65535, curve
                return *_samples(image), curve
    except UnidentifiedImageError:
        raise RtbenchError("it is not a picture") from None
    except Image.DecompressionBombError:
        most = 2 * (Image.MAX_IMAGE_PIXELS or 0)
        raise RtbenchError(f"it has more than {most:,} pixels") from None
    except (OSError, ValueError, SyntaxError, EOFError, IndexError, OverflowError) as error:
        raise RtbenchError(f"it is damaged: {error}") from None
    except (struct.error, TypeError, KeyError, AttributeError):
        raise RtbenchError("it is damaged") from None


def _samples(image) -> tuple[np.ndarray, float | None]:
    if image.mode == "F":
        return np.asarray(image)[:, :, None], None
    if image.mode.startswith("I"):  # one channel of 16 bits
        return np.asarray(image)[:, :, None], 65535
    return np.asarray(image.convert("RGB")), 255


def _curve(info: dict, numbers: str) -> str | float:
    """Return what a PNG says about its numbers: the exponent from them to light, if it is odd."""
    gamma = info.get("gamma")
    if numbers == "linear" or "srgb" in info or not gamma or gamma < 0:
        return numbers
    return numbers if abs(gamma - _USUAL_GAMMA) < _NEAR else 1 / gamma


def _three_channels(values: np.ndarray, most: float | None, curve: str | float) -> np.ndarray:
    values = values[:, :, :1] if values.shape[2] < 3 else values[:, :, :3]
    if 0 in values.shape:
        raise RtbenchError("it has no pixels")
    light = values.astype(np.float64)
    if most is not None:
        light = light / most
        if curve == "display":
            light = to_linear(light)
        elif curve != "linear":
            light = light ** float(curve)
    return np.repeat(light, 3, axis=2) if light.shape[2] == 1 else light
