"""Which random pairs have an answer that no kernel should get wrong.

Decided without any kernel, in float64 with a proven bound or else exactly. All float32 arithmetic
here is numpy's, one operation at a time: sums of three run from left to right and nothing is
contracted.
"""

import numpy as np

from rtbench.accuracy import certified
from rtbench.accuracy.exact import GRAZING, NEAR_EDGE
from rtbench.workloads import draws

MARGIN = 1e-4
"""Least distance of a kept pair's u, v, w from 0 and from 1."""
PARALLEL = 1e-5
"""A kept pair's direction and normal have a cosine of more than this."""
SHORTEST_EDGE = 1e-3
"""Least magnitude of each component of each edge of a kept triangle: Badouel divides by one."""

SHORT_EDGE = 4
"""Class beside those of ``exact``."""
REASONS = {"edge": SHORT_EDGE, "parallel": GRAZING, "margin": NEAR_EDGE}


def normalise(vectors: np.ndarray) -> np.ndarray:
    """Return (N, 3) vectors divided by their lengths, in their dtype; a zero vector stays.

    Dividing and multiplying by the inverse give the same counts of table 4.5 from state 24660781,
    so those counts do not tell which the thesis's program did; dividing rounds once less.
    """
    squares = vectors * vectors
    length = np.sqrt(squares[:, 0] + squares[:, 1] + squares[:, 2])
    length[length == 0] = 1
    return vectors / length[:, None]


def lines(items: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the lines and triangles of items.

    Parameters
    ----------
    items : (N, 15) float32 array
        As `draws.items` draws them.

    Returns
    -------
    triangles : (N, 3, 3) float32 array
    origins, directions : (N, 3) float32 arrays
        Directions are normalised.
    """
    triangles = items[:, draws.TRIANGLE].reshape(-1, 3, 3)
    orig = np.ascontiguousarray(items[:, draws.ORIG])
    return triangles, orig, normalise(items[:, draws.END] - orig)


def classify(items: np.ndarray) -> np.ndarray:
    """Return the class of each item.

    Parameters
    ----------
    items : (N, 15) float32 array
        As `draws.items` draws them.

    Returns
    -------
    (N,) int8 array
        HIT, MISS, or the first of REASONS for which the item is refused; all decided exactly.
    """
    triangles, orig, dir = lines(items)
    classes = certified.classify(triangles, orig, dir, margin=MARGIN, grazing=PARALLEL)
    classes[_has_short_edge(triangles)] = SHORT_EDGE
    return classes


def _has_short_edge(triangles: np.ndarray) -> np.ndarray:
    """Tell which triangles have an edge component below SHORTEST_EDGE.

    Exact: coordinates in [0, 1] are multiples of 2^-39 (1/32767 in float32) or coarser, so that
    their differences are float64 numbers; the difference in float32 is not always exact.
    """
    v0, v1, v2 = (triangles[:, k].T.astype(np.float64) for k in range(3))
    short = np.zeros(len(triangles), bool)
    for a, b in ((v0, v1), (v0, v2), (v1, v2)):
        for axis in range(3):
            short |= np.abs(b[axis] - a[axis]) < SHORTEST_EDGE
    return short
