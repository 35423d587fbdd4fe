"""Whom a ray through a shared edge hits: both triangles, exactly one, or none.

A property of the method, not of its arithmetic: the kernel is asked in rational numbers, whatever
the order in which the vertices of the two triangles are named. What has no exact form is asked in
floating point: the numbers below are so small that sums and products are exact there too.
"""

from __future__ import annotations

import itertools
from collections import Counter
from typing import NamedTuple

import numpy as np

from rtbench.accuracy.causes import exact_hits
from rtbench.kernels.contract import Kernel

ORDERS = tuple(itertools.permutations(range(3)))
PAIRS_OF_ORDERS = len(ORDERS) ** 2

# Half an edge, half a direction, and the third vertices on both sides of the ray, all from the
# point where the ray meets the edge. The greatest component of a direction is a power of two, so
# that a shear by quotients is exact in floating point.
SHAPES = (
    ((1, 2, 0), (1, -2, 4), (4, -3, 1), (-3, 4, 1)),
    ((1, 1, 0), (0, 0, 2), (2, -1, 0), (-2, 3, 0)),
    ((0, 1, 0), (-1, 1, -2), (3, 1, 0), (-2, 1, 1)),
    ((2, -1, 1), (1, 3, -4), (1, 4, 3), (-2, -3, -1)),
)
POINT = (1, -2, 3)


class EdgeRule(NamedTuple):
    """What becomes of a ray through a shared edge.

    Attributes
    ----------
    word : str
        ``closed`` (both triangles are hit), ``half-open`` (always exactly one), ``open`` (none),
        ``once or twice``, or what the method loses: ``loses 16 of 36 vertex orders``.
    hits : Counter
        Of all pairs of vertex orders in all configurations: how many had 0, 1, 2 hits.
    """

    word: str
    hits: Counter


def configurations() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return shared edges with a ray through each, in all axes and both directions.

    Returns
    -------
    triangles : (C, 2, 6, 3, 3) float64 array
        The two triangles of each in their six vertex orders.
    origins, directions : (C, 3) float64 arrays
        The ray meets the edge at t = 1/2.
    """
    triangles, origins, directions = [], [], []
    for shape, axis, sense in itertools.product(SHAPES, range(3), (1, -1)):
        edge, half, one, other = (np.roll(vector, axis) for vector in shape)
        point = np.roll(POINT, axis)
        ends = [point - edge, point + 2 * edge]
        both = ([*ends, point + third] for third in (one, other))
        triangles.append([[[v[i] for i in order] for order in ORDERS] for v in both])
        origins.append(point - sense * half)
        directions.append(2 * sense * half)
    return tuple(np.array(part, dtype=np.float64) for part in (triangles, origins, directions))


def pairs() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the configurations pair by pair: (N, 3, 3), (N, 3) and (N, 3) float64 arrays."""
    triangles, origins, directions = configurations()
    shape = (*triangles.shape[:3], 3)
    rays = (np.broadcast_to(a[:, None, None], shape) for a in (origins, directions))
    return triangles.reshape(-1, 3, 3), *(a.reshape(-1, 3) for a in rays)


def edge_rule(kernel: Kernel | None, computed: np.ndarray) -> EdgeRule:
    """Find out whether a kernel is closed, half-open or open at edges.

    Parameters
    ----------
    kernel : Kernel or None
        One that tests lines, rays or segments; None for a function that is no kernel.
    computed : (N,) bool array
        Which of `pairs` it hits in floating point: asked only where it cannot be asked in
        rational numbers.
    """
    if kernel is not None and kernel.exact:
        computed = exact_hits(kernel, *pairs())
    return rule_of(computed.reshape(-1, 2, len(ORDERS)))


def rule_of(hit: np.ndarray) -> EdgeRule:
    """Return the rule that answers follow.

    Parameters
    ----------
    hit : (C, 2, 6) bool array
        By configuration, triangle and vertex order.
    """
    hits = hit[:, 0, :, None].astype(int) + hit[:, 1, None, :]
    counts = Counter(hits.ravel().tolist())
    words = {(2,): "closed", (1,): "half-open", (0,): "open", (1, 2): "once or twice"}
    word = words.get(tuple(sorted(counts)))
    if word is None:
        lost = np.count_nonzero(hits == 0, axis=(1, 2))
        span = f"{lost.min()}" if lost.min() == lost.max() else f"{lost.min()} to {lost.max()}"
        word = f"loses {span} of {PAIRS_OF_ORDERS} vertex orders"
    return EdgeRule(word, counts)
