"""The camera as the compiled tracer reads it, and where in its picture things may be seen."""

from __future__ import annotations

import numpy as np

from rtbench.scenes.model import Camera
from rtbench.tracer import records
from rtbench.tracer.world import World

ROUNDINGS = 16  # of a direction, by which a ray may miss its place in the picture


def camera_of(camera: Camera, base: np.ndarray, real: type) -> np.ndarray:
    """Return a camera as the compiled tracer reads it, (1,)."""
    record = np.zeros(1, records.camera_type(real))
    right, up, forward = camera.axes
    half = np.tan(np.radians(camera.angle) / 2)
    record["position"] = np.subtract(camera.position, base)
    record["right"] = right * half * (camera.width / camera.height)
    record["up"] = up * half
    record["forward"] = forward
    record["across"], record["upward"] = right, up
    record["lens_radius"] = camera.lens_radius
    record["focus"] = camera.distance if camera.focus is None else camera.focus
    record["width"], record["height"] = camera.width, camera.height
    record["per_column"], record["per_row"] = 2.0 / camera.width, 2.0 / camera.height
    return record


def covered(boxes: np.ndarray, base: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """Return where in the picture of a camera with a pinhole boxes may be seen.

    Parameters
    ----------
    boxes : (n, 6) array
        Least and greatest x, y, z, taken from ``base``, (3,).
    camera : (1,) structured array
        See `camera_of`.

    Returns
    -------
    (n, 4) float64 array
        Left, upper, right and lower in pixels, a pixel wider than rays may be off; without end for
        a box that reaches behind the camera.
    """
    seen = camera[0]
    eps = float(np.finfo(seen["right"].dtype).eps)
    right, up, forward = (seen[name].astype(np.float64) for name in ("right", "up", "forward"))
    corners = np.array([[3 * (c >> axis & 1) + axis for axis in range(3)] for c in range(8)])
    way = boxes.astype(np.float64)[:, corners] + (base - seen["position"].astype(np.float64))
    wide, high = right @ right, up @ up
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depth = way @ forward
        columns = (way @ right / (wide * depth) + 1.0) * (0.5 * float(seen["width"]))
        rows = (1.0 - way @ up / (high * depth)) * (0.5 * float(seen["height"]))
        ahead = (depth > 0.001 * np.abs(way).max(axis=2)).all(axis=1)
    wider = 1.0 + ROUNDINGS * eps * float(max(seen["width"], seen["height"])) / np.sqrt(high)
    found = np.stack(
        [
            columns.min(axis=1) - wider,
            rows.min(axis=1) - wider,
            columns.max(axis=1) + wider,
            rows.max(axis=1) + wider,
        ],
        axis=1,
    )
    found[~ahead] = -np.inf, -np.inf, np.inf, np.inf
    return found


def tiles_of(world: World, camera: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the tiles of a picture, and those of them in which nothing is to be seen.

    Parameters
    ----------
    world : World
    camera : (1,) structured array
        See `camera_of`.
    size : int
        Of a tile's sides, in pixels; the last ones end with the picture.

    Returns
    -------
    traced, empty : (n, 4), (m, 4) int64 arrays
        Left, upper, right and lower. Rays through empty ones miss all that there is, from a
        pinhole; with a lens or planes without end none is known to be empty.
    """
    width, height = int(camera["width"][0]), int(camera["height"][0])
    left, upper = np.arange(0, width, size), np.arange(0, height, size)
    corners = np.stack(np.meshgrid(left, upper), axis=-1).astype(np.int64)
    ends = np.minimum(corners + size, (width, height))
    tiles = np.concatenate([corners, ends], axis=-1).reshape(-1, 4)
    if world.planes or camera["lens_radius"][0] > 0.0:
        return tiles, tiles[:0]
    places = covered(world.parts, world.tree_base, camera)
    # Of a box: +1 and -1 where its tiles begin and end, summed along both axes.
    many = np.array([len(left), len(upper)])
    first = np.clip(np.floor(places[:, :2] / size), 0, many).astype(np.int64)
    last = np.clip(np.floor(places[:, 2:] / size) + 1, 0, many).astype(np.int64)
    changes = np.zeros((len(upper) + 1, len(left) + 1), np.int64)
    there = (first < last).all(axis=1)
    (x0, y0), (x1, y1) = first[there].T, last[there].T
    for x, y, change in ((x0, y0, 1), (x1, y0, -1), (x0, y1, -1), (x1, y1, 1)):
        np.add.at(changes, (y, x), change)
    seen = changes.cumsum(axis=0).cumsum(axis=1)[:-1, :-1].reshape(-1) > 0
    return tiles[seen], tiles[~seen]
