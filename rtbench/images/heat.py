"""Heat maps: a number a pixel as colours, one to one."""

from __future__ import annotations

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.images.colour import to_linear

COLOURS = "viridis"  # perceptually uniform, dark to light in grey print too
MISSING = (0.6, 0.6, 0.6)  # no number: a grey that is not among the colours


def heat_map(values: np.ndarray, least: float = 0.0, most: float | None = None) -> np.ndarray:
    """Return numbers as a picture, dark for few and light for many.

    Parameters
    ----------
    values : (H, W) array
        A number a pixel, row 0 on top. Where it is not finite the picture is grey.
    least, most : float
        What is darkest and lightest; beyond them colours stay. By default the scale begins at 0
        and ends at the greatest value.

    Returns
    -------
    (H, W, 3) array of float64
        Linear light: a PNG of it has the colours of the table, to be read by eyes or programs.

    Raises
    ------
    RtbenchError
        If values are no (H, W) array, or most is not above least.

    Source
    ------
    The table is matplotlib's viridis (S. van der Walt, N. Smith 2015).
    """
    from matplotlib import colormaps

    values = _checked(values)
    finite = np.isfinite(values)
    if most is None:
        most = float(values[finite].max()) if finite.any() else least
        most = most if most > least else least + 1  # all are least: all are dark
    if not most > least:
        raise RtbenchError(f"a scale from {least:g} to {most:g} is not allowed: it has no width")
    scaled = (np.where(finite, values, least) - least) / (most - least)
    colours = colormaps[COLOURS](np.clip(scaled, 0, 1))[:, :, :3]
    return to_linear(np.where(finite[:, :, None], colours, MISSING))


def _checked(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, np.float64)
    if values.ndim != 2 or not values.size:
        raise RtbenchError(f"a heat map needs numbers (height, width), not {values.shape}")
    return values
