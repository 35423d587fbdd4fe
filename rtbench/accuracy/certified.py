"""Batches of line/triangle questions: proven in float64 where that can be, the rest exactly."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtbench.accuracy import exact
from rtbench.accuracy.bounds import (
    GRAZING_LIMIT,
    UNDECIDED,
    compiled_filter,
    compiled_reference,
)
from rtbench.accuracy.exact import HIT, MISS


class Reference(NamedTuple):
    """Where lines meet the planes of their triangles, in float64 with proven error bounds."""

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    t_error: np.ndarray
    u_error: np.ndarray
    v_error: np.ndarray


def _pairs(
    triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[list[np.ndarray], str]:
    """Return the three arrays, contiguous and of one dtype, and its name."""
    given = [np.asarray(a) for a in (triangles, origins, directions)]
    if any(np.result_type(a.dtype, np.float64) != np.float64 for a in given):
        raise ValueError("triangles, origins and directions must be real and at most float64")
    # Only an exact conversion may stand in front of an exact answer.
    small = all(np.result_type(a.dtype, np.float32) == np.float32 for a in given)
    dtype = np.dtype(np.float32 if small else np.float64)
    arrays = [np.require(a, dtype, "CW") for a in given]
    n = len(arrays[0])
    if [a.shape for a in arrays] != [(n, 3, 3), (n, 3), (n, 3)]:
        shapes = ", ".join(str(a.shape) for a in arrays)
        raise ValueError(f"shapes must be (N, 3, 3), (N, 3), (N, 3), not {shapes}")
    return arrays, dtype.name


def _vectors(arrays: Sequence[np.ndarray], i: int) -> list[list[float]]:
    """Return v0, v1, v2, orig and dir of pair i as Python floats."""
    triangles, origins, directions = arrays
    return [*triangles[i].tolist(), origins[i].tolist(), directions[i].tolist()]


def filtered(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    margin: float = 0.0,
    grazing: float = 0.0,
) -> np.ndarray:
    """Return the class of each pair as far as float64 can prove it.

    Parameters
    ----------
    triangles : (N, 3, 3) array
        Vertices, float32, float64 or what fits in them.
    origins, directions : (N, 3) array
        Lines, one a triangle; directions of any length.
    margin, grazing : float
        As for `exact.classify`; grazing at most 0.1.

    Returns
    -------
    (N,) int8 array
        HIT, MISS, NEAR_EDGE, GRAZING, or UNDECIDED where the bound is too large to tell.

    Raises
    ------
    ValueError
        For wrong shapes or dtypes, or margin or grazing out of range.
    """
    if not (0 <= margin < 1 and 0 <= grazing <= GRAZING_LIMIT):
        raise ValueError(f"margin {margin} or grazing {grazing} is out of range")
    arrays, dtype = _pairs(triangles, origins, directions)
    out = np.empty(len(arrays[0]), np.int8)
    compiled_filter(dtype).call(*arrays, float(margin), float(grazing), out)
    return out


def classify(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    margin: float = 0.0,
    grazing: float = 0.0,
) -> np.ndarray:
    """Return the exact class of each pair: the filter's where it is proven, else by rationals.

    Parameters
    ----------
    triangles, origins, directions, margin, grazing
        As for `filtered`.

    Returns
    -------
    (N,) int8 array
        HIT, MISS, NEAR_EDGE or GRAZING; MISS where a number is not finite.

    Raises
    ------
    ValueError
        As `filtered`.
    """
    out = filtered(triangles, origins, directions, margin, grazing)
    arrays, _ = _pairs(triangles, origins, directions)
    for i in np.flatnonzero(out == UNDECIDED):
        finite = all(np.isfinite(a[i]).all() for a in arrays)
        out[i] = exact.classify(*_vectors(arrays, i), margin, grazing) if finite else MISS
    return out


def line_hits(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Decide exactly which lines meet their closed triangles.

    Parameters
    ----------
    triangles, origins, directions
        As for `filtered`.

    Returns
    -------
    (N,) bool array
        True also on edges and vertices and for negative t; False for a line in or parallel to the
        plane, for a triangle without area and where a number is not finite.

    Raises
    ------
    ValueError
        As `filtered`.
    """
    return classify(triangles, origins, directions) == HIT


def reference(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> Reference:
    """Return where each line meets the plane of its triangle, with proven error bounds.

    Parameters
    ----------
    triangles, origins, directions
        As for `filtered`.

    Returns
    -------
    Reference
        (N,) float64 arrays: t in units of the direction, u and v the weights of v1 and v2, and
        bounds of their absolute errors. Whatever float64 cannot bound is computed exactly and
        rounded. NaN where the line is parallel to the plane or a number is not finite.

    Raises
    ------
    ValueError
        As `filtered`.
    """
    arrays, dtype = _pairs(triangles, origins, directions)
    out = np.empty((len(arrays[0]), 6))
    compiled_reference(dtype).call(*arrays, out)
    for i in np.flatnonzero(~np.isfinite(out).all(axis=1)):
        out[i] = np.nan
        if not all(np.isfinite(a[i]).all() for a in arrays):
            continue
        _, t, u, v = exact.line_hit(*_vectors(arrays, i))
        if t is not None:
            out[i, :3] = [_nearest_float(x) for x in (t, u, v)]
            out[i, 3:] = np.spacing(np.abs(out[i, :3]))
    return Reference(*np.ascontiguousarray(out.T))


def _nearest_float(x: exact.Fraction) -> float:
    """Round a rational to float64; to infinity where it lies beyond the range."""
    try:
        return float(x)
    except OverflowError:
        return np.inf if x > 0 else -np.inf
