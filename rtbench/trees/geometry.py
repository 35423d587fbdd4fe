"""Triangles as trees see them: boxes in float32, near the scene.

A tree needs no more than where things are about: its boxes and split planes are float32 in every
precision, of a scene far from (0, 0, 0) taken from near its middle, so that it loses nothing by
it. Boxes are rounded outward, and rays are widened when they walk: see
`rtbench.trees.traversal.entering`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtbench.compiled.layout import DATA_TYPE, check_precision

NEAR = 4.0  # extents from 0 to where a scene may reach and still be near
FARTHEST = 2.0**90


@dataclass(frozen=True, eq=False)
class Geometry:
    """Triangles and their boxes.

    Attributes
    ----------
    corners : (M, 3, 3) array
        Vertices v0, v1, v2 in the precision of the data.
    base : (3,) float64 array
        What is local is taken from here: 0, or near the middle along axes where the scene is far
        from 0.
    boxes : (M, 6) float32 array
        Least and greatest local x, y, z of each triangle, rounded outward.
    box : (6,) float32 array
        That of all; zeros where there is no triangle.
    reach : float
        The greatest magnitude of a coordinate of ``corners``.
    """

    corners: np.ndarray
    base: np.ndarray
    boxes: np.ndarray
    box: np.ndarray
    reach: float

    def __len__(self) -> int:
        return len(self.boxes)

    @classmethod
    def of(cls, triangles: np.ndarray, precision: str = "float32") -> Geometry:
        """Return triangles (M, 3, 3) of any float dtype as a tree sees them.

        Raises
        ------
        ValueError
            For another shape, and for coordinates that are not finite in the precision, naming
            the first such triangle, or beyond FARTHEST.
        """
        check_precision(precision)
        given = np.asarray(triangles)
        if given.ndim != 3 or given.shape[1:] != (3, 3):
            raise ValueError(f"triangles have shape {given.shape}: (M, 3, 3) is wanted")
        if given.dtype.kind not in "fiu":
            raise ValueError(f"triangles have dtype {given.dtype}: numbers are wanted")
        with np.errstate(over="ignore", invalid="ignore"):
            corners = np.ascontiguousarray(given, dtype=DATA_TYPE[precision])
        if not np.isfinite(corners).all():
            strange = np.flatnonzero(~np.isfinite(corners).all(axis=(1, 2)))
            raise ValueError(
                f"{len(strange)} of {len(corners)} triangles are not finite in {precision}, the "
                f"first is triangle {strange[0]}"
            )
        if not len(corners):
            none = np.zeros((0, 6), np.float32)
            return cls(corners, np.zeros(3), none, np.zeros(6, np.float32), 0.0)
        low, high = corners.min(axis=1), corners.max(axis=1)
        least, most = (each.astype(np.float64) for each in (low.min(axis=0), high.max(axis=0)))
        reach = float(max(-least.min(), most.max(), 0.0))
        if reach > FARTHEST:
            raise ValueError(
                f"triangles reach {reach:g} from 0: trees walk in float32, and what it computes of "
                f"coordinates beyond {FARTHEST:g} overflows; scale the scene"
            )
        base = _base(least, most)
        boxes = np.empty((len(corners), 6), np.float32)
        boxes[:, :3] = outward(low - base, -np.inf)
        boxes[:, 3:] = outward(high - base, np.inf)
        box = np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
        return cls(corners, base, boxes, box, reach)


def _base(least: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return from where local coordinates are taken.

    Float32 numbers must stay such, or a corner that two triangles share would be no longer one
    number but two, rounded down and up, and planes would no longer part them: so the base is 0,
    or a multiple of the least power of two above the scene's extent.
    """
    extent = most - least
    flat = extent == 0
    grid = np.exp2(np.ceil(np.log2(np.where(flat, 1.0, extent))))
    middle = np.where(flat, least, np.round((least / 2 + most / 2) / grid) * grid)
    return np.where(np.maximum(-least, most) > NEAR * extent, middle, 0.0)


def outward(values: np.ndarray, toward: float) -> np.ndarray:
    """Return float64 values in float32, rounded toward -inf or inf; -0.0 becomes 0.0."""
    with np.errstate(over="ignore"):
        rounded = values.astype(np.float32)
    wrong = rounded > values if toward < 0 else rounded < values
    rounded[wrong] = np.nextafter(rounded[wrong], np.float32(toward))
    return rounded + np.float32(0)
