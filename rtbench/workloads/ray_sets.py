"""Sets of rays over a mesh: random ones, shadow rays, and a mixture of hard ones.

Primary rays are in ``cameras``. All are float64 arrays of numbers that float32 can hold, unless
another data type is asked for, so that every precision traces the same rays.
"""

from __future__ import annotations

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.workloads.cameras import bounds, dense_part, upward
from rtbench.workloads.meshes import Mesh

INTERIORS = ("sponza", "cornell_box")  # models that rays belong into, by the stem of their file
NUDGE = 16.0  # roundoffs of the hit point's greatest coordinate, from the surface


def random_rays(
    mesh: Mesh, n: int, seed: int = 1, within: bool | None = None, data: type = np.float32
) -> tuple[np.ndarray, np.ndarray]:
    """Draw rays without any coherence, as diffuse reflections make them.

    From uniformly random points on the mesh's bounding sphere to uniformly random points in its
    bounding box; where something dense stands in a scene that is nearly empty (`dense_part`), every
    second ray is aimed into the box of that. Within a room: from and to random points in the box.

    Parameters
    ----------
    mesh : Mesh
    n : int
        How many rays.
    seed : int
    within : bool, optional
        Whether rays start within the box; if not given, whether the mesh's name is of INTERIORS.
    data : numpy float type
        That can hold all numbers.

    Returns
    -------
    origins, directions : (n, 3) float64 arrays
        Directions are target - origin: not normalised, none is 0.

    Raises
    ------
    RtbenchError
        For a number below 0.
    """
    random = _stream(n, seed)
    lower, upper = bounds(mesh)
    targets = random.uniform(lower, upper, (n, 3))
    dense = dense_part(mesh)
    if dense is not None:
        targets[1::2] = random.uniform(*dense, (n, 3))[1::2]
    if within if within is not None else mesh.name in INTERIORS:
        origins = random.uniform(lower, upper, (n, 3))
    else:
        radius = np.linalg.norm(upper - lower) / 2
        origins = (lower + upper) / 2 + radius * _unit(random, n)
    return _rays(origins, targets - origins, data)


def light_of(mesh: Mesh) -> np.ndarray:
    """Return where a point light may hang, (3,) float64 of numbers that float32 can hold.

    Over the front of the mesh, one and a half of its diagonals from its middle; in a room (see
    INTERIORS) below its middle's ceiling, at three quarters of the height.
    """
    lower, upper = dense_part(mesh) or bounds(mesh)
    up = upward(mesh)
    way = np.array([0.3, 0.3, 0.3] if up == 1 else [0.3, -0.3, 0.3])
    way[up] = 1.0
    middle = (lower + upper) / 2
    if mesh.name in INTERIORS:
        middle[up] = lower[up] + 0.75 * (upper - lower)[up]
    else:
        middle += 1.5 * np.linalg.norm(upper - lower) * way / np.linalg.norm(way)
    return middle.astype(np.float32).astype(np.float64)


def shadow_rays(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    t: np.ndarray,
    triangle: np.ndarray,
    light: np.ndarray,
    data: type = np.float32,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return rays from where primary rays hit to a point light.

    No tmin is needed: the hit point, origin + t direction, is put onto the plane of its triangle
    and moved off it, to the side that the primary ray came from, by 16 roundoffs of its greatest
    coordinate and of the triangle's. A surface seen from its unlit side thus shadows itself.

    Parameters
    ----------
    triangles : (M, 3, 3) array
    origins, directions : (N, 3) arrays
        Primary rays.
    t : (N,) array
        Of their hits, in units of the direction.
    triangle : (N,) int array
        That was hit; -1: none, which gives no shadow ray.
    light : (3,) array
    data : numpy float type
        That can hold all numbers.

    Returns
    -------
    origins, directions : (S, 3) float64 arrays
        In the order of the primary rays; directions are light - origin, not normalised.
    tmax : (S,) float64 array
        1, at the light.
    ray : (S,) int64 array
        The primary ray of each.
    """
    ray = np.flatnonzero(np.asarray(triangle) >= 0)
    corners = np.asarray(triangles, dtype=np.float64)[np.asarray(triangle)[ray]]
    start, way = (np.asarray(a, dtype=np.float64)[ray] for a in (origins, directions))
    points = start + np.asarray(t, dtype=np.float64)[ray, None] * way
    # Of length 1 before the product, which else may be too small for floats.
    first, second = (_normed(corners[:, k] - corners[:, 0]) for k in (1, 2))
    normal = _normed(np.cross(first, second))
    points -= ((points - corners[:, 0]) * normal).sum(axis=1, keepdims=True) * normal
    side = (normal * way).sum(axis=1, keepdims=True)
    # Without area, or seen edge on: back where the ray came from.
    off = np.where(side == 0, -_normed(way), -np.sign(side) * normal)
    size = np.maximum(np.abs(points).max(axis=1), np.abs(corners).max(axis=(1, 2)))
    points += NUDGE * np.finfo(data).eps / 2 * size[:, None] * off
    found = _rays(points, np.asarray(light, dtype=np.float64) - points.astype(data), data)
    return *found, np.ones(len(ray)), ray


def mixed_rays(
    mesh: Mesh, n: int, seed: int = 1, data: type = np.float32
) -> tuple[np.ndarray, np.ndarray]:
    """Draw rays that find out whether a tree answers as brute force does.

    A quarter starts on surfaces: at vertices exactly, on edges, on faces, a third each. A quarter
    is parallel to an axis or to a plane of two, zeros of both signs in the direction; half of
    their coordinates are exactly those of a vertex, where split planes are. The others are random,
    from outside and from within the box, half of them aimed at vertices. Of each quarter
    the first half is sorted by the signs of the direction, so that packets of rays that go the same
    way are among them.

    Parameters
    ----------
    mesh : Mesh
    n : int
        How many rays.
    seed : int
    data : numpy float type
        That can hold all numbers.

    Returns
    -------
    origins, directions : (n, 3) float64 arrays
        Not normalised, none is 0: first those from surfaces, then those parallel to axes.

    Raises
    ------
    RtbenchError
        For a number below 0.
    """
    random = _stream(n, seed)
    counts = [n // 4, n // 4, (n - 2 * (n // 4)) // 2]
    counts.append(n - sum(counts))
    parts = []
    for draw, count in zip((_on_surfaces, _parallel, _outside, _inside), counts, strict=True):
        origins, directions = _rays(*draw(mesh, count, random), data)
        octant = np.signbit(directions) @ (1, 2, 4)
        half = np.argsort(octant[: count // 2], kind="stable")
        order = np.concatenate([half, np.arange(count // 2, count)])
        parts.append((origins[order], directions[order]))
    origins, directions = (np.concatenate(list(whole)) for whole in zip(*parts, strict=True))
    return origins, directions


def _on_surfaces(mesh: Mesh, n: int, random: np.random.Generator) -> tuple:
    corners = mesh.triangles[random.integers(len(mesh.faces), size=n)]
    weights = random.dirichlet((1.0, 1.0, 1.0), n)
    weights[: n // 3] = (1, 0, 0)
    weights[n // 3 : 2 * n // 3, 2] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    origins = (weights[:, :, None] * corners).sum(axis=1)
    origins[: n // 3] = corners[: n // 3, 0]
    order = random.permutation(n)
    directions = _unit(random, n)
    # Every fifth goes along an edge of the surface it starts on.
    directions[::5] = (corners[:, 1] - corners[:, 0])[::5]
    return origins[order], directions[order]


def _parallel(mesh: Mesh, n: int, random: np.random.Generator) -> tuple:
    lower, upper = bounds(mesh)
    size = upper - lower
    origins = random.uniform(lower - size / 4, upper + size / 4, (n, 3))
    through = random.random((n, 3)) < 0.5
    vertices = mesh.vertices[mesh.faces[random.integers(len(mesh.faces), size=n), 0]]
    origins[through] = vertices[through]
    kept = random.integers(3, size=n)  # the axis that is not 0, or, of every fourth ray, that is
    one = np.arange(3) == kept[:, None]
    one[::4] = ~one[::4]
    zero = np.where(random.random((n, 3)) < 0.5, 0.0, -0.0)
    length = np.where(random.random((n, 3)) < 0.5, 1.0, random.uniform(0.1, 2, (n, 3)))
    sign = np.where(random.random((n, 3)) < 0.5, 1.0, -1.0)
    return origins, np.where(one, sign * length, zero)


def _outside(mesh: Mesh, n: int, random: np.random.Generator) -> tuple:
    lower, upper = bounds(mesh)
    far = random.uniform(1, 4, (n, 1)) * np.linalg.norm(upper - lower) / 2
    origins = _held((lower + upper) / 2 + far * _unit(random, n))
    return origins, _targets(mesh, n, random) - origins


def _inside(mesh: Mesh, n: int, random: np.random.Generator) -> tuple:
    origins = _held(random.uniform(*bounds(mesh), (n, 3)))
    return origins, _targets(mesh, n, random) - origins


def _held(points: np.ndarray) -> np.ndarray:
    """Round points to float32 before a direction is taken from them to a vertex."""
    return points.astype(np.float32).astype(np.float64)


def _targets(mesh: Mesh, n: int, random: np.random.Generator) -> np.ndarray:
    """Return points in the box, every second one a vertex."""
    targets = random.uniform(*bounds(mesh), (n, 3))
    vertices = mesh.vertices[mesh.faces[random.integers(len(mesh.faces), size=n), 0]]
    targets[::2] = vertices[::2]
    return targets


def _stream(n: int, seed: int) -> np.random.Generator:
    if n < 0:
        raise RtbenchError(f"number of rays {n} is not allowed (allowed: 0 or more)")
    return np.random.default_rng(seed)


def _unit(random: np.random.Generator, n: int) -> np.ndarray:
    return _normed(random.normal(size=(n, 3)))


def _normed(vectors: np.ndarray) -> np.ndarray:
    """Return them with length 1; 0 stays 0."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length == 0, 1, length)


def _rays(origins: np.ndarray, directions: np.ndarray, data: type) -> tuple[np.ndarray, np.ndarray]:
    """Return rays rounded to a data type; a direction of 0 becomes that of z."""
    origins, directions = (
        a.astype(data, order="C").astype(np.float64) for a in (origins, directions)
    )
    directions[~directions.any(axis=1)] = (0.0, 0.0, 1.0)
    return origins, directions
