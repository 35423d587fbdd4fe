"""Rays from inside a closed mesh, aimed at its vertices, at points on its edges and at its faces.

Whoever starts inside a closed surface meets it, wherever he goes: a ray that meets no triangle has
leaked out between triangles. This holds exactly, of the rounded ray as of the one that was meant,
and for a surface that intersects itself too, as long as it winds around the origin: so here origins
fill a ball that no triangle enters and about whose centre the mesh winds once.

Directions are twice the difference of target and origin, rounded: t is about 1/2, and a kernel
that tests the segment from origin to origin + direction meets the target too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.workloads.meshes import Mesh

AIMS = ("vertex", "edge", "face")
NOT_AIMED = -1


@dataclass(frozen=True, eq=False)
class Aimed:
    """Rays and what they were aimed at.

    Attributes
    ----------
    mesh : Mesh
        Its coordinates are of the precision of the rays.
    origins, directions : (N, 3) arrays
        Of the data type asked for.
    aim : (N,) int8 array
        An index of AIMS.
    target : (N, 3) int64 array
        The vertices of what was aimed at: one, the two ends of the edge, the three of the face;
        NOT_AIMED after them.
    exact : (N,) bool array
        Whether the ray passes through its target exactly: no difference was rounded.
    convex : bool
        Whether every triangle faces every origin: then a ray meets the mesh near its target only.
    """

    mesh: Mesh
    origins: np.ndarray
    directions: np.ndarray
    aim: np.ndarray
    target: np.ndarray
    exact: np.ndarray
    convex: bool

    def elsewhere(self, triangle: np.ndarray) -> np.ndarray:
        """Tell which of the triangles that rays met share no vertex with what was aimed at.

        Parameters
        ----------
        triangle : (N,) int array
            -1: none.

        Returns
        -------
        (N,) bool array
            False where none was met.
        """
        corners = self.mesh.faces[triangle]
        near = (corners[:, :, None] == self.target[:, None, :]).any(axis=(1, 2))
        return (triangle >= 0) & ~near


def aimed_rays(
    mesh: Mesh, rays: dict[str, int], data: type = np.float32, seed: int = 1, inner: float = 0.5
) -> Aimed:
    """Draw rays from the middle of a closed mesh at its vertices, edges and faces.

    Parameters
    ----------
    mesh : Mesh
        Rounded to ``data`` first; its ``centre`` must lie inside.
    rays : dict of str to int
        How many at each of AIMS.
    data : numpy float type
        Of vertices, origins and directions.
    seed : int
    inner : float
        Origins lie in a ball about the centre, of this part of the radius that is free: 0 to 0.9.

    Returns
    -------
    Aimed
        First the rays at vertices, then those at edges, at faces.

    Raises
    ------
    RtbenchError
        If the mesh is not closed or its centre not inside; if nothing is free about it.
    """
    if not 0 <= inner <= 0.9:
        raise RtbenchError(f"inner {inner} is not allowed (allowed: 0 to 0.9)")
    mesh = mesh.rounded(data)
    radius = _free_ball(mesh)
    random = np.random.default_rng(seed)
    counts = [rays.get(name, 0) for name in AIMS]
    drawn = [draw(mesh, n, random) for draw, n in zip(_DRAWS, counts, strict=True)]
    aim = np.repeat(np.arange(3, dtype=np.int8), counts)
    target = np.concatenate([corners for corners, _ in drawn])
    points = np.concatenate([points for _, points in drawn]).astype(data).astype(float)
    origins = (mesh.centre + inner * radius * _in_ball(len(aim), random)).astype(data)
    if not (np.linalg.norm(origins.astype(float) - mesh.centre, axis=1) < 0.95 * radius).all():
        raise RtbenchError(f"{mesh.name} is too small for the coordinates of its place: {radius:g}")
    difference = points - origins.astype(float)
    directions = (2 * difference).astype(data)
    exact = _is_difference(difference, points, origins) & (directions == 2 * difference)
    return Aimed(
        mesh, origins, directions, aim, target, exact.all(axis=1), _faces_all(mesh, radius)
    )


def _at_vertices(mesh: Mesh, n: int, random: np.random.Generator) -> tuple:
    used = np.unique(mesh.faces)
    chosen = used[random.integers(len(used), size=n)]
    return _targets(chosen[:, None]), mesh.vertices[chosen]


def _at_edges(mesh: Mesh, n: int, random: np.random.Generator) -> tuple:
    start, end = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    edges = np.stack([start, end], axis=1)[start < end]
    chosen = edges[random.integers(len(edges), size=n)]
    part = random.random((n, 1))
    a, b = mesh.vertices[chosen].transpose(1, 0, 2)
    return _targets(chosen), a + part * (b - a)


def _at_faces(mesh: Mesh, n: int, random: np.random.Generator) -> tuple:
    chosen = mesh.faces[random.integers(len(mesh.faces), size=n)]
    weights = random.dirichlet([1.0, 1.0, 1.0], n)
    return _targets(chosen), (weights[:, :, None] * mesh.vertices[chosen]).sum(axis=1)


_DRAWS = (_at_vertices, _at_edges, _at_faces)


def _targets(corners: np.ndarray) -> np.ndarray:
    found = np.full((len(corners), 3), NOT_AIMED, dtype=np.int64)
    found[:, : corners.shape[1]] = corners
    return found


def _in_ball(n: int, random: np.random.Generator) -> np.ndarray:
    way = random.normal(size=(n, 3))
    return way / np.linalg.norm(way, axis=1, keepdims=True) * random.random((n, 1)) ** (1 / 3)


def _is_difference(difference: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Tell where a - b was not rounded (Knuth's two-sum)."""
    b = -b.astype(float)
    back = difference - a
    return (a - (difference - back)) + (b - back) == 0


def _free_ball(mesh: Mesh) -> float:
    """Return how far from its centre, which must be inside, the mesh begins."""
    if not mesh.closed:
        raise RtbenchError(f"{mesh.name} is not closed: {mesh.open_edges} edges are open")
    corners = mesh.triangles - mesh.centre
    if abs(abs(winding(corners)) - 1) > 1e-6:
        raise RtbenchError(f"the centre of {mesh.name} is not inside it, or inside more than once")
    return float(_distances(corners).min())


def winding(triangles: np.ndarray) -> float:
    """Return how often triangles (M, 3, 3) wind around (0, 0, 0): solid angle over 4 pi.

    Source
    ------
    Van Oosterom & Strackee 1983, equation 8.
    """
    a, b, c = triangles.transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    ab, bc, ca = ((x * y).sum(axis=1) for x, y in ((a, b), (b, c), (c, a)))
    return float(np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / math.tau)


def _distances(triangles: np.ndarray) -> np.ndarray:
    """Return how far each triangle is from (0, 0, 0): from its plane if it is met inside."""
    found = np.full(len(triangles), np.inf)
    inside = np.ones(len(triangles), bool)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    for i in range(3):
        a, b = triangles[:, i], triangles[:, (i + 1) % 3]
        edge = b - a
        length = np.maximum((edge * edge).sum(axis=1), np.finfo(float).tiny)
        part = np.clip(-(a * edge).sum(axis=1) / length, 0, 1)[:, None]
        found = np.minimum(found, np.linalg.norm(a + part * edge, axis=1))
        inside &= (np.cross(edge, -a) * normal).sum(axis=1) >= 0
    size = np.linalg.norm(normal, axis=1)
    flat = inside & (size > 0)
    found[flat] = np.abs((triangles[:, 0] * normal).sum(axis=1)[flat]) / size[flat]
    return found


def _faces_all(mesh: Mesh, radius: float) -> bool:
    """Tell whether the ball lies in front of, or behind, every triangle's plane alike."""
    corners = mesh.triangles - mesh.centre
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    height = (corners[:, 0] * normal).sum(axis=1)
    clear = np.abs(height) > 0.95 * radius * np.linalg.norm(normal, axis=1)
    return bool(clear.all() and (np.sign(height) == np.sign(height[0])).all())
