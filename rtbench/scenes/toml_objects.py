"""Objects, and the triangles of those that are made of triangles, from the values of a file."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.scenes.model import (
    GREATEST,
    Cone,
    Disc,
    Object,
    Plane,
    SceneError,
    Sphere,
    Triangles,
    check_number,
)
from rtbench.scenes.polygons import triangulated

Values = dict[str, Any]


def made(kind: str, values: Values, material: int, folder: Path) -> tuple[Object, str]:
    """Make an object.

    Parameters
    ----------
    kind : str
        One of OBJECT_KINDS.
    values : dict
        As `values_of` returns them.
    material : int
        Its number.
    folder : Path
        Where its file is, if it has one.

    Returns
    -------
    Object, str
        And a remark, empty if there is none.

    Raises
    ------
    SceneError
        Values that it cannot have.
    """
    values = {name: each for name, each in values.items() if name not in ("kind", "material")}
    shared = {"material": material}
    if "velocity" in values:
        shared["velocity"] = values.pop("velocity")
    if kind in _SHAPES:
        return _SHAPES[kind](**values, **shared), ""
    parts, remark = _PARTS[kind](values, folder)
    return Triangles(**parts, **shared), remark


def _cylinder(radius: float, **values: Any) -> Cone:
    check_number("radius", radius, 1e-30, GREATEST, "above 0")
    return Cone(base_radius=radius, apex_radius=radius, **values)


def _cone(apex_radius: float = 0.0, **values: Any) -> Cone:
    return Cone(apex_radius=apex_radius, **values)


def _polygon(values: Values, folder: Path) -> tuple[Values, str]:
    vertices = values["vertices"]
    chosen = triangulated(vertices)
    found = {"corners": vertices[chosen], "name": "polygon"}
    for key in ("normals", "coordinates"):
        if key in values:
            if len(values[key]) != len(vertices):
                raise SceneError(
                    key, f"{key}: {len(values[key])} of them for {len(vertices)} vertices"
                )
            found[key] = values[key][chosen]
    return found, ""


def _triangle(values: Values, folder: Path) -> tuple[Values, str]:
    count = len(values["vertices"])
    if count != 3:
        raise SceneError("vertices", f"vertices: {count} of them (allowed: 3 of a triangle)")
    parts, remark = _polygon(values, folder)
    return {**parts, "name": "triangle"}, remark


def _patch(values: Values, folder: Path) -> tuple[Values, str]:
    short = np.flatnonzero(~values["normals"].any(axis=1))
    if len(short):
        raise SceneError("normals", f"normals: number {short[0] + 1} has no direction")
    parts, remark = _polygon(values, folder)
    return {**parts, "name": "patch"}, remark


# Of a box: the bits of a corner's number say along which axes it is the upper one.
_SIDES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


def _box(values: Values, folder: Path) -> tuple[Values, str]:
    low, high = np.sort(np.array([values["corner"], values["opposite"]]), axis=0)
    if not (low < high).all():
        raise SceneError("opposite", "corner and opposite are equal along an axis: a flat box")
    upper = np.arange(8)[:, None] >> np.arange(3) & 1
    corners = np.where(upper, high, low)
    turn = rotation(values.get("rotate", (0.0, 0.0, 0.0)))
    if not np.array_equal(turn, np.eye(3)):
        middle = low / 2 + high / 2
        corners = (corners - middle) @ turn.T + middle
    faces = [(a, b, c) for a, b, c, d in _SIDES] + [(a, c, d) for a, b, c, d in _SIDES]
    return {"corners": corners[np.array(faces)], "closed": True, "name": "box"}, ""


def _mesh(values: Values, folder: Path) -> tuple[Values, str]:
    mesh = _found(values, folder)
    corners = mesh.triangles
    for key in ("fit", "scale"):
        if key in values:
            check_number(key, values[key], 1e-30, GREATEST, "above 0")
    factor = values.get("scale", 1.0)
    with np.errstate(over="ignore", invalid="ignore"):  # told below
        if "fit" in values:
            low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
            longest = (high - low).max()
            if not longest > 0:
                raise SceneError("fit", "fit: all vertices are in one place")
            corners = corners - (low / 2 + high / 2)
            factor *= values["fit"] / longest
        corners = corners * factor @ rotation(values.get("rotate", (0.0, 0.0, 0.0))).T
        corners = corners + values.get("move", (0.0, 0.0, 0.0))
    if not np.abs(corners).max() <= GREATEST:
        raise SceneError("scale", f"scale: vertices are beyond {GREATEST:g}")
    normals = smooth_normals(corners) if values.get("smooth") else None
    parts = {"corners": corners, "normals": normals, "closed": _closed(corners)}
    return {**parts, "name": mesh.name}, mesh.remark


def _found(values: Values, folder: Path) -> Any:
    """Return the Mesh that a table names by file or by model."""
    from rtbench.workloads.generated_models import MODELS, find_model
    from rtbench.workloads.meshes import load_mesh, models

    if ("file" in values) == ("model" in values):
        which = "both are given" if "file" in values else "neither is given"
        key = "model" if "file" in values else "file"
        raise SceneError(key, f"a mesh needs file or model: {which}")
    key = "file" if "file" in values else "model"
    try:
        if key == "file":
            return load_mesh(folder / values["file"], drop_degenerate=True)
        # A file in the current folder has no say here.
        kinds = [*MODELS, *models()]
        if values["model"].partition(":")[0] not in kinds:
            raise SceneError("model", unknown("model", values["model"], kinds))
        return find_model(values["model"], drop_degenerate=True)
    except SceneError:
        raise
    except (RtbenchError, ValueError) as problem:
        raise SceneError(key, f"{key}: {problem}") from None


def _numbered(corners: np.ndarray) -> tuple[np.ndarray, int]:
    """Return a number of the place of each corner, (M, 3) int64, and how many there are."""
    # Adding 0 makes -0 a 0: both are one place.
    places, numbers = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    return numbers.reshape(-1, 3), len(places)


def _closed(corners: np.ndarray) -> bool:
    """Tell whether triangles enclose something: each edge is there once in either direction."""
    numbers, count = _numbered(corners)
    starts, ends = numbers.ravel(), np.roll(numbers, -1, axis=1).ravel()
    there, back = np.sort(starts * count + ends), np.sort(ends * count + starts)
    return bool(np.array_equal(there, back) and (there[1:] != there[:-1]).all())


def smooth_normals(corners: np.ndarray) -> np.ndarray:
    """Return a normal for each corner: the mean over the triangles there, weighted by area.

    Parameters
    ----------
    corners : (M, 3, 3) float64 array
        Corners in one place, to the last bit, are one vertex.

    Returns
    -------
    (M, 3, 3) float64 array
        Of length 1; a triangle's own where the mean has no direction.

    Source
    ------
    Gouraud 1971; by area as Max 1999, Weights for computing vertex normals, calls the simplest.
    """
    numbers, count = _numbered(corners)
    # To size 1, so that no product leaves the range of float64.
    size = np.abs(corners - corners[0, 0]).max() or 1.0
    scaled = (corners - corners[0, 0]) / size
    across = np.cross(scaled[:, 1] - scaled[:, 0], scaled[:, 2] - scaled[:, 0])
    sums = np.stack(
        [
            np.bincount(numbers.ravel(), np.repeat(across[:, axis], 3), minlength=count)
            for axis in range(3)
        ],
        axis=1,
    )
    found = sums[numbers]
    length = np.linalg.norm(found, axis=2, keepdims=True)
    own = np.broadcast_to(across[:, None], found.shape)
    found = np.where(length > 1e-12 * np.abs(own).max(axis=2, keepdims=True), found, own)
    length = np.linalg.norm(found, axis=2, keepdims=True)
    return np.where(length > 0, found / np.where(length > 0, length, 1.0), (0.0, 0.0, 1.0))


def rotation(angles: tuple[float, float, float]) -> np.ndarray:
    """Return the matrix that turns about x, then y, then z, by degrees, (3, 3) float64.

    Counter-clockwise seen from the tip of each axis. Multiples of 90 degrees are exact.
    """
    turn = np.eye(3)
    for axis, angle in enumerate(angles):
        angle = math.fmod(angle, 360.0)
        quarter = angle / 90.0
        if quarter == int(quarter):
            cosine = (1.0, 0.0, -1.0, 0.0)[int(quarter) % 4]
            sine = (0.0, 1.0, 0.0, -1.0)[int(quarter) % 4]
        else:
            cosine, sine = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        one, two = (axis + 1) % 3, (axis + 2) % 3
        step = np.eye(3)
        step[one, one] = step[two, two] = cosine
        step[one, two], step[two, one] = -sine, sine
        turn = step @ turn
    return turn


_SHAPES: dict[str, Callable[..., Object]] = {
    "sphere": Sphere,
    "cylinder": _cylinder,
    "cone": _cone,
    "plane": Plane,
    "disc": Disc,
}
_PARTS: dict[str, Callable[[Values, Path], tuple[Values, str]]] = {
    "triangle": _triangle,
    "polygon": _polygon,
    "patch": _patch,
    "box": _box,
    "mesh": _mesh,
}
