"""The tests side by side: pairs of a triangle and a cell, and what each lets through."""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.trees.overlap.registry import FITS, fit_sources


def fit(triangle, own, cell, room):  # the test
    return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


def pairwise(corners, own, cells, inside, boxes):
    room = np.empty((2, 12, 3))
    for i in range(corners.shape[0]):
        result = fit(
            (
                corners[i, 0, 0],
                corners[i, 0, 1],
                corners[i, 0, 2],
                corners[i, 1, 0],
                corners[i, 1, 1],
                corners[i, 1, 2],
                corners[i, 2, 0],
                corners[i, 2, 1],
                corners[i, 2, 2],
            ),
            (own[i, 0], own[i, 1], own[i, 2], own[i, 3], own[i, 4], own[i, 5]),
            (cells[i, 0], cells[i, 1], cells[i, 2], cells[i, 3], cells[i, 4], cells[i, 5]),
            room,
        )
        inside[i] = result[0]
        boxes[i, 0] = result[1]
        boxes[i, 1] = result[2]
        boxes[i, 2] = result[3]
        boxes[i, 3] = result[4]
        boxes[i, 4] = result[5]
        boxes[i, 5] = result[6]


@functools.cache
def compiled(test: str) -> Instance:
    """Return a test over pairs, compiled: ``call(corners, own, cells, inside, boxes)``."""
    return instantiate(
        pairwise,
        signature=(
            "void(float64[:, :, ::1], float64[:, ::1], float64[:, ::1], boolean[::1], "
            "float64[:, ::1])"
        ),
        callees=fit_sources(test),
        title=f"overlap test {test} over pairs",
    )


def fitted(
    test: str, triangles: np.ndarray, cells: np.ndarray, own: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return which triangles belong to their cells, and their boxes there.

    Parameters
    ----------
    test : str
        One of ``FITS``.
    triangles : (N, 3, 3) array
        Local coordinates.
    cells : (N, 6) array
        lx, ly, lz, ux, uy, uz; float32 numbers.
    own : (N, 6) array, optional
        The references' boxes so far, float32 numbers; the triangles' own by default.

    Returns
    -------
    inside : (N,) bool array
    boxes : (N, 6) float64 array
        float32 numbers; of no meaning where not inside.

    Raises
    ------
    RtbenchError
        For an unknown test.
    ValueError
        For shapes that do not belong together.
    """
    corners = np.ascontiguousarray(triangles, np.float64)
    cells = np.ascontiguousarray(cells, np.float64)
    own = boxes_of(corners) if own is None else np.ascontiguousarray(own, np.float64)
    n = len(corners)
    if corners.shape != (n, 3, 3) or cells.shape != (n, 6) or own.shape != (n, 6):
        raise ValueError(
            f"triangles {corners.shape}, cells {cells.shape} and boxes {own.shape}: "
            "(N, 3, 3), (N, 6) and (N, 6) are wanted"
        )
    inside, boxes = np.empty(n, bool), np.empty((n, 6))
    compiled(test).call(corners, own, cells, inside, boxes)
    return inside, boxes


def overlapping(test: str, triangles: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return which triangles (N, 3, 3) a test lets into their cells (N, 6), a bool array.

    Raises
    ------
    RtbenchError, ValueError
        As `fitted`.
    """
    return fitted(test, triangles, cells)[0]


def boxes_of(corners: np.ndarray) -> np.ndarray:
    """Return the boxes (N, 6) of triangles (N, 3, 3), rounded outward to float32 numbers."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    boxes = np.concatenate([low, high], axis=1).astype(np.float32)
    below, above = boxes[:, :3], boxes[:, 3:]  # views
    np.nextafter(below, np.float32(-np.inf), out=below, where=below > low)
    np.nextafter(above, np.float32(np.inf), out=above, where=above < high)
    return boxes.astype(np.float64)


def let_through(triangles: np.ndarray, cells: np.ndarray) -> dict[str, int]:
    """Count the triangles that each test lets into a cell that they do not touch.

    Parameters
    ----------
    triangles : (N, 3, 3) array
    cells : (N, 6) array
        As `fitted` takes them.

    Returns
    -------
    dict of str to int
        By test. What touches is told by separating axes and clipping together: each errs only by
        rounding, and only toward touching.
    """
    passed = {test: overlapping(test, triangles, cells) for test in FITS}
    touching = passed["separating_axes"] & passed["clipped"]
    return {test: int(np.count_nonzero(through & ~touching)) for test, through in passed.items()}
