"""Shapes other than triangles as records, and their boxes.

A record is what compiled code reads. Of each kind:

- sphere: ``point`` is the centre, ``radius``;
- cone (of equal radii: a cylinder), without ends: ``point`` is the middle of the base, ``axis``
  points to the other end, ``height`` away; there the radius is ``radius + slope * height``;
- disc: ``point`` is the middle, ``axis`` the normal, ``radius``;
- plane: any ``point`` of it, ``axis`` is the normal.

``axis`` has length 1, up to rounding.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

SPHERE, CONE, DISC, PLANE = 1, 2, 3, 4
KINDS = {"spheres": SPHERE, "cones": CONE, "discs": DISC, "planes": PLANE}


def shape_type(real: type) -> np.dtype:
    """Return the record of a shape in the given precision, np.float32 or np.float64."""
    fields = [("point", real, 3), ("axis", real, 3)]
    fields += [(name, real) for name in ("radius", "height", "slope")]
    return np.dtype([*fields, ("kind", np.int32)], align=True)


def sphere(center: ArrayLike, radius: ArrayLike, real: type = np.float64) -> np.ndarray:
    """Return the records of spheres.

    Parameters
    ----------
    center : (..., 3) array_like
    radius : (...) array_like
    real : type
        np.float32 or np.float64.

    Returns
    -------
    (...) array of shape_type(real)
        Of a single shape, of no dimension.
    """
    return _records(real, SPHERE, center, (0.0, 0.0, 1.0), radius)


def cone(
    base: ArrayLike,
    apex: ArrayLike,
    base_radius: ArrayLike,
    apex_radius: ArrayLike,
    real: type = np.float64,
) -> np.ndarray:
    """Return the records of cut cones, whole cones (a radius is 0) and cylinders, without ends.

    Parameters
    ----------
    base, apex : (..., 3) array_like
        The middles of both ends, which differ.
    base_radius, apex_radius : (...) array_like
    real : type
        np.float32 or np.float64.

    Returns
    -------
    (...) array of shape_type(real)
    """
    along = np.subtract(apex, base, dtype=np.float64)
    height = _length(along)
    slope = np.subtract(apex_radius, base_radius, dtype=np.float64) / height
    return _records(real, CONE, base, along, base_radius, height, slope)


def disc(
    center: ArrayLike, normal: ArrayLike, radius: ArrayLike, real: type = np.float64
) -> np.ndarray:
    """Return the records of discs.

    Parameters
    ----------
    center, normal : (..., 3) array_like
        The normal has any length but 0.
    radius : (...) array_like
    real : type
        np.float32 or np.float64.

    Returns
    -------
    (...) array of shape_type(real)
    """
    return _records(real, DISC, center, normal, radius)


def plane(point: ArrayLike, normal: ArrayLike, real: type = np.float64) -> np.ndarray:
    """Return the records of planes.

    Parameters
    ----------
    point, normal : (..., 3) array_like
        The normal has any length but 0.
    real : type
        np.float32 or np.float64.

    Returns
    -------
    (...) array of shape_type(real)
    """
    return _records(real, PLANE, point, normal, 0.0)


def joined(records: Iterable[np.ndarray], real: type = np.float64) -> np.ndarray:
    """Return records of one precision, single ones or arrays of them, as one array (S,)."""
    parts = [np.atleast_1d(each) for each in records]
    whole = np.zeros(sum(map(len, parts)), shape_type(real))
    begin = 0
    for part in parts:
        whole[begin : begin + len(part)] = part
        begin += len(part)
    return whole


def boxes(records: np.ndarray) -> np.ndarray:
    """Return the boxes of shapes.

    Parameters
    ----------
    records : (S,) array of shape_type(real)

    Returns
    -------
    (S, 6) float64 array
        Least and greatest x, y, z, which are numbers of ``real``. No side cuts its shape; it is at
        most a few roundings of the shape's size and one float away from it. Of planes infinite.

    Source
    ------
    Of a circle about the unit vector a: r sqrt(1 - a_k^2) along the axis k (Quilez 2016, "disk and
    cylinder bounding box").
    """
    real = records.dtype["radius"]
    point = records["point"].astype(np.float64)
    axis = records["axis"].astype(np.float64)
    radius = records["radius"].astype(np.float64)
    height = records["height"].astype(np.float64)
    kind = records["kind"]
    square = axis * axis
    # Of the two other components: 1 - a_k^2 would lose what is left where a_k is near 1.
    across = np.sqrt(np.stack([square[:, k - 2] + square[:, k - 1] for k in range(3)], axis=1))
    across /= np.sqrt(square.sum(axis=1))[:, None]
    across[kind == SPHERE] = 1.0
    other_radius = np.maximum(radius + records["slope"] * height, 0.0)
    other = point + axis * height[:, None]  # of all but cones the point itself: height is 0
    # For the roundings here, and since an axis is of length 1 only up to rounding.
    pad = 4 * np.finfo(real).eps * (np.maximum(radius, other_radius) + height)[:, None]
    reach, other_reach = radius[:, None] * across, other_radius[:, None] * across
    found = np.empty((len(records), 6))
    low = np.minimum(point - reach, other - other_reach) - pad
    high = np.maximum(point + reach, other + other_reach) + pad
    found[:, :3] = np.nextafter(low.astype(real), real.type(-np.inf))
    found[:, 3:] = np.nextafter(high.astype(real), real.type(np.inf))
    found[kind == PLANE] = [-np.inf] * 3 + [np.inf] * 3
    return found


def _records(
    real: type,
    kind: int,
    point: ArrayLike,
    axis: ArrayLike,
    radius: ArrayLike,
    height: ArrayLike = 0.0,
    slope: ArrayLike = 0.0,
) -> np.ndarray:
    point, axis = np.asarray(point, np.float64), np.asarray(axis, np.float64)
    radius = np.asarray(radius, np.float64)
    found = np.zeros(
        np.broadcast_shapes(point.shape[:-1], axis.shape[:-1], radius.shape), shape_type(real)
    )
    found["point"], found["axis"] = point, axis / _length(axis)[..., None]
    found["radius"], found["height"], found["slope"] = radius, height, slope
    found["kind"] = kind
    return found


def _length(vectors: np.ndarray) -> np.ndarray:
    """Return lengths without overflow, nor underflow to 0."""
    return np.hypot(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2])
