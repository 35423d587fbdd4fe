"""Cameras, where one stands to see a mesh, and the primary rays of an image in square tiles."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.workloads.meshes import Mesh

ANGLE = 45.0  # degrees
AROUND, ABOVE = 35.0, 20.0  # degrees: a view of front, side and top
MARGIN = 1.04  # of what is in view
FLAT = 0.2  # a scene so much thinner along one axis lies on the ground
FIFTH = 0.2  # of the triangles, the smallest: where these lie ...
DENSE = 0.25  # ... in so small a part of the scene, there is what one came to see
TILE = 4


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Attributes
    ----------
    position, target, up : (float, float, float)
        Where it stands, what it looks at, and what is not horizontal there.
    field_of_view : float
        Across the shorter side of the image, in degrees.

    Raises
    ------
    RtbenchError
        If these leave no view: not finite, no distance, up along the view, an angle that is not
        between 0 and 180.
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    field_of_view: float = ANGLE

    def __post_init__(self):
        if not 0 < self.field_of_view < 180:
            raise RtbenchError(
                f"field of view {self.field_of_view} is not allowed (allowed: above 0, below 180)"
            )
        with np.errstate(invalid="ignore", divide="ignore"):
            good = np.isfinite(self.axes).all()
        if not good:
            raise RtbenchError(
                f"a camera at {self.position} that looks at {self.target} with {self.up} up sees "
                "nothing"
            )

    @property
    def axes(self) -> np.ndarray:
        """Right, up and forward, each of length 1, (3, 3) float64."""
        forward = np.asarray(self.target, dtype=np.float64) - self.position
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, np.asarray(self.up, dtype=np.float64))
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])


def primary_rays(
    camera: Camera, width: int, height: int, tile: int = TILE, data: type = np.float32
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a ray through the middle of each pixel, tile by tile.

    Where the sides of the image are multiples of the tile's, tile^2 rays in a row are one square of
    the image: a packet. At the right and lower border of other images tiles are cut.

    Parameters
    ----------
    camera : Camera
    width, height : int
        Of the image, in pixels.
    tile : int
        Side of a tile in pixels; 1: row by row.
    data : numpy float type
        That can hold all numbers.

    Returns
    -------
    origins, directions : (N, 3) float64 arrays
        Directions are not normalised: their part along the view is 1 (before rounding), so t is the
        depth in the scene's unit.
    pixels : (N,) int64 array
        row * width + column, row 0 being the top one; see `picture`.

    Raises
    ------
    RtbenchError
        For numbers below 1.
    """
    for what, value in (("width", width), ("height", height), ("tile", tile)):
        if value < 1:
            raise RtbenchError(f"{what} {value} is not allowed (allowed: 1 or more)")
    pixels = np.arange(width * height, dtype=np.int64)
    row, column = pixels // width, pixels % width
    order = np.lexsort((column, row, column // tile, row // tile))
    pixels, row, column = pixels[order], row[order], column[order]
    step = 2 * np.tan(np.radians(camera.field_of_view) / 2) / min(width, height)
    right, up, forward = camera.axes
    x, y = (column + 0.5 - width / 2) * step, (height / 2 - row - 0.5) * step
    directions = forward + x[:, None] * right + y[:, None] * up
    origins = np.broadcast_to(np.asarray(camera.position, dtype=np.float64), directions.shape)
    rays = (a.astype(data, order="C").astype(np.float64) for a in (origins, directions))
    return *rays, pixels


def picture(values: np.ndarray, pixels: np.ndarray, width: int, height: int) -> np.ndarray:
    """Return what was found for the rays as an image.

    Parameters
    ----------
    values : (N, ...) array
        One a ray, in their order.
    pixels : (N,) int array
        As `primary_rays` returns them.
    width, height : int

    Returns
    -------
    (height, width, ...) array
    """
    values = np.asarray(values)
    found = np.empty_like(values)
    found[pixels] = values
    return found.reshape(height, width, *values.shape[1:])


def bounds(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and greatest coordinates of the vertices that triangles use, (3,) each."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    return mesh.vertices[used].min(axis=0), mesh.vertices[used].max(axis=0)


def upward(mesh: Mesh) -> int:
    """Return the axis that is up: y, unless the scene is flat along another, as a field is."""
    lower, upper = bounds(mesh)
    size = upper - lower
    axis = int(np.argmin(size))
    return axis if size[axis] < FLAT * np.median(size) else 1


def dense_part(mesh: Mesh) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the box of what is dense in a scene that is nearly empty, None in other scenes.

    It is where the middles of the smallest triangles lie, a fifth of all, but for the outermost 2 %
    on each side, if its diagonal is less than a quarter of the scene's.
    """
    lower, upper = bounds(mesh)
    corners = mesh.triangles
    sides = np.stack([corners[:, i] - corners[:, i - 1] for i in range(3)])
    longest = (sides * sides).sum(axis=2).max(axis=0)
    middles = corners[longest <= np.quantile(longest, FIFTH)].mean(axis=1)
    low, high = np.quantile(middles, (0.02, 0.98), axis=0)
    small = 0 < np.linalg.norm(high - low) < DENSE * np.linalg.norm(upper - lower)
    return (low, high) if small else None


def framing(mesh: Mesh, aspect: float = 4 / 3) -> Camera:
    """Return a camera outside that sees the whole mesh: front, right side and top.

    Parameters
    ----------
    mesh : Mesh
        Its front is seen along -z where y is up, along +y where z is.
    aspect : float
        Width of the image over its height.
    """
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    return _framed(mesh.vertices[used], upward(mesh), ABOVE, aspect)


def inside(mesh: Mesh) -> Camera:
    """Return a camera within a scene's box: near what is dense, or else within a room.

    Near what is dense (`dense_part`) the camera frames that from so far above that the ground fills
    the image. In a room it stands three tenths up and a quarter of the longer horizontal side from
    the middle, and looks through the middle at the far end.
    """
    up = upward(mesh)
    dense = dense_part(mesh)
    if dense is not None:
        corners = np.array(list(itertools.product(*zip(*dense, strict=True))))
        return _framed(corners, up, 35.0, 4 / 3, 2.0)
    lower, upper = bounds(mesh)
    size = upper - lower
    horizontal = [axis for axis in range(3) if axis != up]
    along = max(horizontal, key=lambda axis: size[axis])
    position, target = (lower + upper) / 2, (lower + upper) / 2
    position[along] -= size[along] / 4
    position[up] = target[up] = lower[up] + 0.3 * size[up]
    target[along] = upper[along]
    return Camera(_told(position), _told(target), _told(np.eye(3)[up]), 60.0)


def _framed(points: np.ndarray, up: int, above: float, aspect: float, far: float = 1.0) -> Camera:
    """Return a camera just so far from points that all of them are in view, times ``far``."""
    side = 2 if up == 0 else 0
    back = 3 - up - side
    around, above = np.radians(AROUND), np.radians(above)
    way = np.zeros(3)
    way[up] = np.sin(above)
    way[side] = np.cos(above) * np.sin(around)
    way[back] = np.cos(above) * np.cos(around) * (1 if up == 1 else -1)
    lower, upper = points.min(axis=0), points.max(axis=0)
    middle = (lower + upper) / 2
    size = max(np.linalg.norm(upper - lower), np.abs(middle).max() * 1e-6, 1e-30)
    axes = Camera(_told(way), (0.0, 0.0, 0.0), _told(np.eye(3)[up])).axes
    # To the middle of what is seen, then so far back that the outermost are in view.
    seen = axes @ (points - middle).T
    shift = (seen[:2].min(axis=1) + seen[:2].max(axis=1)) / 2
    middle = middle + shift @ axes[:2]
    x, y, z = axes @ (points - middle).T
    half = np.tan(np.radians(ANGLE) / 2)
    wide, tall = half * max(aspect, 1), half * max(1 / aspect, 1)
    near = max((MARGIN * np.maximum(np.abs(x) / wide, np.abs(y) / tall) - z).max(), size / 2)
    return Camera(_told(middle + far * near * way), _told(middle), _told(np.eye(3)[up]))


def _told(point: np.ndarray) -> tuple[float, float, float]:
    """Return a point as a tuple of numbers that float32 can hold."""
    x, y, z = np.asarray(point, dtype=np.float32).tolist()
    return x, y, z


ROBOTS = Camera((2.0, 2.0, 4.2), (-0.4, 0.8, -0.4))
RECOMMENDED: dict[str, Camera | Callable[[Mesh], Camera]] = {
    "sponza": inside,
    "teapot_in_stadium": Camera((0.63, -0.65, 0.7), (0.0, 0.0, 0.07), (0.0, 0.0, 1.0)),
    "cornell_box": Camera((278.0, 273.0, -800.0), (278.0, 273.0, 0.0), field_of_view=39.0),
    "robots": ROBOTS,
}
"""Where to stand, by the stem of the model's file: in the atrium; 1.1 m from the teapot, with the
field all around it; where the box was photographed from; in front of four of the five robots."""


def recommended(mesh: Mesh) -> Camera:
    """Return the camera of RECOMMENDED; else one near what is dense, or one of all."""
    if mesh.name in RECOMMENDED:
        there = RECOMMENDED[mesh.name]
        return there if isinstance(there, Camera) else there(mesh)
    return inside(mesh) if dense_part(mesh) is not None else framing(mesh)
