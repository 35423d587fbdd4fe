"""Rays, t > 0, that float64 proves to hit or to miss: the filter in front of the oracle.

It takes det, u, v, t and their error bounds from ``bounds``. A ray that touches the triangle in one
point has u, v and w = det - u - v of one sign or 0, and so has their sum det, and t. It hits where
the signs of u, v, w and t are certain and alike. It misses where two of u, v, w certainly differ in
sign, or t certainly from one of them or from det. Nothing that touches an edge, starts on the plane
or lies in it is called a hit, nor any tie a miss: what is 0 there has no certain sign, and where
the ray lies in the plane or the triangle has none, t is 0.
"""

from functools import cache

import numpy as np

from rtbench.accuracy.bounds import CONSTANTS, LARGEST, PAIRS, UNDECIDED, bounded
from rtbench.accuracy.exact import HIT, MISS
from rtbench.compiled.instantiate import Instance, instantiate


def _ray_filter(triangles, origins, directions, out):
    """Write HIT, MISS or UNDECIDED for each ray."""
    for i in range(out.shape[0]):
        det, u, v, t, det_error, u_error, v_error, t_error, _, norms = bounded(
            triangles, origins, directions, i
        )
        out[i] = UNDECIDED
        if not norms < LARGEST:
            continue
        w = det - u - v
        w_error = 1.25 * (det_error + u_error + v_error)
        above = (u > u_error) + (v > v_error) + (w > w_error)
        below = (u < -u_error) + (v < -v_error) + (w < -w_error)
        if above > 0 and below > 0:
            out[i] = MISS
        elif above > 0 or det > det_error:
            if t < -t_error:
                out[i] = MISS
            elif above == 3 and t > t_error:
                out[i] = HIT
        elif below > 0 or det < -det_error:
            if t > t_error:
                out[i] = MISS
            elif below == 3 and t < -t_error:
                out[i] = HIT


@cache
def compiled_ray_filter(dtype: str) -> Instance:
    """Return the filter of rays for float32 or float64 arrays.

    Parameters
    ----------
    dtype : str
        ``"float32"`` or ``"float64"``, of the three arrays of pairs.

    Returns
    -------
    Instance
        ``call(triangles, origins, directions, out)`` writes HIT, MISS or UNDECIDED as int8.
    """
    return instantiate(
        _ray_filter,
        signature=f"void({PAIRS.format(dtype)}, int8[::1])",
        callees=(bounded,),
        constants=CONSTANTS,
        title=f"Hits and misses of {dtype} ray/triangle pairs, as far as float64 proves them.",
    )


def filtered_rays(triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return which rays, t > 0, hit or miss as far as float64 can prove it.

    Parameters
    ----------
    triangles : (N, 3, 3) float32 or float64 array
        Vertices, contiguous.
    origins, directions : (N, 3) array of the same dtype
        Rays, one a triangle; directions of any length.

    Returns
    -------
    (N,) int8 array
        HIT and MISS are certain and far from any tie; UNDECIDED is all else, whatever is not
        finite included.
    """
    out = np.empty(len(triangles), np.int8)
    compiled_ray_filter(triangles.dtype.name).call(triangles, origins, directions, out)
    return out
