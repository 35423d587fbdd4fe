"""Closed solids about (0, 0, 0): what a ray from inside must hit."""

from __future__ import annotations

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.workloads.meshes import Mesh


def tetrahedron() -> Mesh:
    """Return a regular tetrahedron about (0, 0, 0), its vertices 1 away; outside is its front."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    return _about_zero("tetrahedron", corners, faces)


def cube() -> Mesh:
    """Return the cube from -1 to 1, two triangles a side; its faces lie in planes of the axes."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[q[i] for i in three] for q in quads for three in ((0, 1, 2), (0, 2, 3))]
    return _about_zero("cube", corners, np.array(faces))


def icosphere(subdivisions: int = 2) -> Mesh:
    """Return a sphere of radius 1 of 20 * 4^subdivisions triangles, an icosahedron subdivided.

    Raises
    ------
    RtbenchError
        For subdivisions outside 0 to 8.
    """
    if not 0 <= subdivisions <= 8:
        raise RtbenchError(f"subdivisions {subdivisions} is not allowed (allowed: 0 to 8)")
    golden = (1 + np.sqrt(5)) / 2
    vertices = np.array(
        [np.roll([0, a, b], k) for k in range(3) for a in (-1, 1) for b in (-golden, golden)]
    )
    # A face of the icosahedron is three vertices that are all 2 apart.
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 2.1
    faces = np.array(
        [
            [i, j, k]
            for i in range(12)
            for j in range(i + 1, 12)
            for k in range(j + 1, 12)
            if near[i, j] and near[j, k] and near[i, k]
        ]
    )
    inward = np.linalg.det(vertices[faces]) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(subdivisions):
        vertices, faces = _subdivided(vertices, faces)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return _about_zero(f"icosphere {subdivisions}", vertices, faces)


def _subdivided(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each triangle cut into four at the middles of its edges, which neighbours share."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, place = np.unique(ends, axis=0, return_inverse=True)
    middle = len(vertices) + place.reshape(-1, 3)  # of each face: on edges 01, 12, 20
    (a, b, c), (ab, bc, ca) = faces.T, middle.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    new = np.concatenate([np.stack(part, axis=1) for part in parts])
    return np.concatenate([vertices, vertices[edges].mean(axis=1)]), new


def random_sphere(rings: int = 16, radii: tuple[float, float] = (1.0, 6.0), seed: int = 1) -> Mesh:
    """Return a sphere of latitude and longitude whose vertices lie at random distances.

    Parameters
    ----------
    rings : int
        Latitudes, the poles being two of them, and longitudes: 3 or more.
    radii : (float, float)
        Least and greatest distance of a vertex from (0, 0, 0).
    seed : int

    Raises
    ------
    RtbenchError
        For fewer rings.

    Source
    ------
    pbrt-v4, shapes_test.cpp, Triangle.Watertight (16 x 16, radii 1 to 6). A pole is one vertex
    here.
    """
    if rings < 3:
        raise RtbenchError(f"rings {rings} is not allowed (allowed: 3 or more)")
    theta = np.pi * np.arange(1, rings - 1) / (rings - 1)
    phi = 2 * np.pi * np.arange(rings) / rings
    x, y = (np.outer(np.sin(theta), f(phi)).ravel() for f in (np.cos, np.sin))
    unit = np.stack([x, y, np.repeat(np.cos(theta), rings)], axis=1)
    unit = np.concatenate([unit, [[0, 0, 1], [0, 0, -1]]])
    radius = np.random.default_rng(seed).uniform(*radii, len(unit))
    north, south = len(unit) - 2, len(unit) - 1
    faces = []
    for k in range(rings):
        after = (k + 1) % rings
        faces.append([north, k, after])
        for row in range(0, (rings - 3) * rings, rings):
            below = row + rings
            faces += [[row + k, below + k, below + after], [row + k, below + after, row + after]]
        last = (rings - 3) * rings
        faces.append([south, last + after, last + k])
    return _about_zero(f"random sphere {rings}", unit * radius[:, None], np.array(faces))


def _about_zero(name: str, vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    return Mesh(name, vertices, faces.astype(np.int64), np.zeros(3))
