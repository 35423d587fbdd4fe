"""Structural similarity: whether two pictures show the same edges, contrasts and brightness."""

from __future__ import annotations

import numpy as np

WINDOW = 11  # pixels along a side
DEVIATION = 1.5  # of the Gaussian window, in pixels
K1, K2 = 0.01, 0.03  # keep the quotients finite where the pictures are black or flat


def structural_similarity(a: np.ndarray, b: np.ndarray) -> float:
    """Return the mean structural similarity (SSIM) of two grey pictures.

    Parameters
    ----------
    a, b : (H, W) arrays of float
        Values of which 1 is the greatest that occurs.

    Returns
    -------
    float
        1 for equal pictures, down to -1; the mean over all places of a window that lies inside
        the picture. NaN for pictures smaller than the window.

    Source
    ------
    Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli 2004, Image quality assessment: from
    error visibility to structural similarity, equations 13 to 17, with the window, K1 and K2 of
    section III.C.
    """
    if min(a.shape) < WINDOW:
        return float("nan")
    c1, c2 = K1**2, K2**2
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    mean_a, mean_b = _windowed(a), _windowed(b)
    variance_a = _windowed(a * a) - mean_a * mean_a
    variance_b = _windowed(b * b) - mean_b * mean_b
    covariance = _windowed(a * b) - mean_a * mean_b
    brightness = (2 * mean_a * mean_b + c1) / (mean_a**2 + mean_b**2 + c1)
    contrast_and_structure = (2 * covariance + c2) / (variance_a + variance_b + c2)
    return float((brightness * contrast_and_structure).mean())


def _windowed(values: np.ndarray) -> np.ndarray:
    """Return the weighted means of all whole windows."""
    from scipy.ndimage import correlate1d

    reach = WINDOW // 2
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / DEVIATION) ** 2)
    weights /= weights.sum()
    inner = slice(reach, -reach)
    return correlate1d(correlate1d(values, weights, 0)[inner], weights, 1)[:, inner]
