"""Triangles and rays from which hard cases are made; no answers here.

A family draws in a format: what it returns are numbers of that format, held as float64. All
rounding to the format is by `Format.round`, so that nothing is rounded in passing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

Random = np.random.Generator


@dataclass(frozen=True)
class Format:
    """A floating-point format that cases are drawn in.

    Attributes
    ----------
    name : str
    dtype : type
        numpy's.
    bits : int
        Of a significand.
    digits : int
        Powers of ten by which difficulties reach just below the format's precision.
    """

    name: str
    dtype: type
    bits: int
    digits: int

    def round(self, values: np.ndarray) -> np.ndarray:
        """Return values rounded to the format, as float64; what is too great becomes infinite."""
        with np.errstate(over="ignore"):
            return np.asarray(values, np.float64).astype(self.dtype).astype(np.float64)


FLOAT32 = Format("float32", np.float32, 24, 7)
FLOAT64 = Format("float64", np.float64, 53, 15)
FORMATS = (FLOAT32, FLOAT64)


class Geometry(NamedTuple):
    """N rays, each with its triangle.

    Attributes
    ----------
    triangles : (N, 3, 3) float64 array
    origins, directions, difficulty : (N, 3), (N, 3), (N,) float64 arrays
    group : (N,) int array
        Which cases belong together, numbered from 0 within the family; -1: alone.
    name, source : (N,) unicode arrays
    """

    triangles: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    difficulty: np.ndarray
    group: np.ndarray
    name: np.ndarray
    source: np.ndarray


def alone(triangles, origins, directions, difficulty, source: str = "") -> Geometry:
    """Return cases none of which belongs to another.

    Parameters
    ----------
    triangles, origins, directions, difficulty : arrays
        As in `Geometry`.
    source : str
        Of all of them.

    Returns
    -------
    Geometry
    """
    n = len(triangles)
    difficulty = np.broadcast_to(np.asarray(difficulty, np.float64), n)
    texts = np.full(n, ""), np.full(n, source)
    return Geometry(triangles, origins, directions, difficulty, np.full(n, -1), *texts)


def grouped(triangles, origins, directions, difficulty, sizes: np.ndarray) -> Geometry:
    """Return groups of one ray against several triangles each.

    Parameters
    ----------
    triangles : (sum of sizes, 3, 3) array
        Those of the first group, then those of the second ...
    origins, directions, difficulty : (G, 3), (G, 3), (G,) arrays
        One a group.
    sizes : (G,) int array
        Triangles of each group.

    Returns
    -------
    Geometry
    """
    group = np.repeat(np.arange(len(sizes)), sizes)
    each = alone(triangles, origins[group], directions[group], np.asarray(difficulty)[group])
    return each._replace(group=group)


def joined(parts: list[Geometry]) -> Geometry:
    """Return several lots of cases as one; groups are renumbered so that they stay apart."""
    moved, first = [], 0
    for part in parts:
        moved.append(part._replace(group=np.where(part.group >= 0, part.group + first, -1)))
        first += part.group.max(initial=-1) + 1
    return Geometry(*(np.concatenate(columns) for columns in zip(*moved, strict=True)))


def spread(levels, n: int) -> np.ndarray:
    """Return n difficulties, each level as often as the others, in turn."""
    return np.resize(np.asarray(levels, np.float64), n)


def until(draw: Callable[[int], tuple], good: Callable[..., np.ndarray], n: int) -> tuple:
    """Draw until n items are good.

    Parameters
    ----------
    draw : callable
        Of a number of items; returns a tuple of arrays with one row an item.
    good : callable
        Of those arrays; returns a bool for each item.
    n : int
        How many are wanted.

    Returns
    -------
    tuple of arrays
        The first n good items.
    """
    kept, have = [], 0
    while have < n:
        drawn = draw(n)
        fine = good(*drawn)
        kept.append([array[fine] for array in drawn])
        have += int(fine.sum())
    return tuple(np.concatenate(arrays)[:n] for arrays in zip(*kept, strict=True))


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors divided by their lengths; scaled first, so that no size is out of range."""
    greatest = np.abs(vectors).max(axis=-1, keepdims=True)
    vectors = vectors / np.where(greatest > 0, greatest, 1)
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def ways(random: Random, *shape: int) -> np.ndarray:
    """Return random unit vectors, all directions alike."""
    return unit(random.normal(size=(*shape, 3)))


def rotations(random: Random, n: int) -> np.ndarray:
    """Return (n, 3, 3) random rotations, to be multiplied from the right."""
    first = ways(random, n)
    second = unit(np.cross(first, ways(random, n)))
    return np.stack([first, second, np.cross(first, second)], axis=1)


def well_shaped(random: Random, n: int) -> np.ndarray:
    """Return (n, 3, 3) triangles about the origin: corners about 1 away, heights above 1/2."""
    angles = np.array([0, 2, 4]) * np.pi / 3
    corners = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    return (corners + random.uniform(-0.3, 0.3, (n, 3, 3))) @ rotations(random, n)


def normals(triangles: np.ndarray) -> np.ndarray:
    """Return (N, 3) unit normals; where there is none, some unit vector across the first edge."""
    first, second = (unit(triangles[:, k] - triangles[:, 0]) for k in (1, 2))
    normal = unit(np.cross(first, second))
    spare = unit(np.cross(first, np.eye(3)[np.abs(first).argmin(axis=1)]))
    return np.where((normal != 0).any(axis=1, keepdims=True), normal, spare)


def weights(random: Random, n: int, margin: float = 0.1) -> np.ndarray:
    """Return (n, 3) weights of the corners: about half inside, half outside, none near an edge.

    Each is at least the margin from 0.
    """
    inside = margin + (1 - 3 * margin) * random.dirichlet((1, 1, 1), n)
    beyond = random.uniform(margin, 0.6, (n, 1))
    outside = inside * (1 + beyond)
    which = random.integers(3, size=n)
    rows = np.arange(n)
    outside[rows, which] = 0
    outside *= (1 + beyond) / outside.sum(axis=1, keepdims=True)
    outside[rows, which] = -beyond[:, 0]
    return np.where(random.random((n, 1)) < 0.5, inside, outside)


def at(weights: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the points with these weights of the corners."""
    return np.einsum("nk,nkc->nc", weights, triangles)


def aside(random: Random, normal: np.ndarray) -> np.ndarray:
    """Return unit vectors off the planes with these normals, 15 to 90 degrees, on either side."""
    n = len(normal)
    return unit(random.choice([-1.0, 1.0], (n, 1)) * normal + 0.7 * ways(random, n))


def aimed(random: Random, form: Format, targets, normal, distance=1.0):
    """Return rays to points, from somewhere off the planes with these normals.

    Parameters
    ----------
    random : Generator
    form : Format
    targets, normal : (N, 3) arrays
        Where to, and unit vectors.
    distance : float or (N,) array
        From the origins, rounded to the format, to the targets.

    Returns
    -------
    origins, directions : (N, 3) arrays
        In the format; directions of lengths between 1/2 and 2.
    """
    away = np.broadcast_to(np.asarray(distance, np.float64), len(targets))[:, None]
    origins = form.round(targets + away * aside(random, normal))
    length = 2.0 ** random.uniform(-1, 1, (len(targets), 1))
    return origins, form.round(length * unit(targets - origins))


def reordered(random: Random, triangles: np.ndarray) -> np.ndarray:
    """Return triangles with their corners in random order: both windings, all rotations."""
    order = random.permuted(np.tile(np.arange(3), (len(triangles), 1)), axis=1)
    return np.take_along_axis(triangles, order[:, :, None], axis=1)


def triple(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return a . (b x c) of rows."""
    return (a * np.cross(b, c)).sum(axis=-1)


def flatness(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return the signed volume that unit vectors along rows a, b, c span: 0 flat, 1 a cube."""
    return triple(unit(a), unit(b), unit(c))


def whole(random: Random, bits: np.ndarray, *shape: int) -> np.ndarray:
    """Return whole numbers of at most so many bits, one row for each of bits, as float64.

    Exact up to 52 bits.
    """
    bound = 2.0 ** np.asarray(bits).reshape(-1, *[1] * len(shape))
    drawn = random.random((len(bits), *shape)) * (2 * bound - 1) - bound
    return np.ceil(drawn)
