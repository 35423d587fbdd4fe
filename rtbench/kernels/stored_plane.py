"""What Badouel and Chirkov store beside the vertices: the triangle's plane and its projection."""

from __future__ import annotations

import numpy as np


def stored_plane(v0: np.ndarray, v1: np.ndarray, v2: np.ndarray) -> dict[str, np.ndarray]:
    """Compute the plane N.P + d = 0 of each triangle and the axes it is projected along.

    Sums run from x to z and nothing is contracted. The normal is of unit length in floating
    point; in rational arithmetic (dtype object) it keeps its length, which no sign test sees.

    Parameters
    ----------
    v0, v1, v2 : (N, 3) arrays of one dtype
        The vertices; float32, float64 or objects (rationals).

    Returns
    -------
    dict
        ``normal`` (N, 3) and ``d`` (N,) in the dtype of the vertices, ``i0``, ``i1``, ``i2``
        (N,) uint32: the dominant axis of the normal (ties go to the first) and the two
        others, i1 < i2.

    Source
    ------
    Badouel 1990; Blecha 2007, equations 3.8, 3.9, 3.15 and section 4.5.
    """
    e1, e2 = v1 - v0, v2 - v0
    normal = np.empty_like(e1)
    normal[:, 0] = e1[:, 1] * e2[:, 2] - e1[:, 2] * e2[:, 1]
    normal[:, 1] = e1[:, 2] * e2[:, 0] - e1[:, 0] * e2[:, 2]
    normal[:, 2] = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    if normal.dtype != object:
        squares = normal * normal
        length = np.sqrt(squares[:, 0] + squares[:, 1] + squares[:, 2])
        with np.errstate(invalid="ignore", divide="ignore"):  # a degenerate triangle has no normal
            normal = normal / length[:, None]
    d = -(v0[:, 0] * normal[:, 0] + v0[:, 1] * normal[:, 1] + v0[:, 2] * normal[:, 2])
    i0 = np.argmax(np.abs(normal), axis=1) if len(normal) else np.zeros(0, np.int64)
    others = np.array([[1, 2], [0, 2], [0, 1]], dtype=np.uint32)[i0]
    return {
        "normal": normal,
        "d": d,
        "i0": i0.astype(np.uint32),
        "i1": np.ascontiguousarray(others[:, 0]),
        "i2": np.ascontiguousarray(others[:, 1]),
    }
