"""Typical rays and triangles: at half hits, as a leaf of a tree meets them, far from the origin.

Unlike `rtbench.workloads.pairs` nothing is redrawn: borders are met as often as chance has it, so
that rare wrong answers can be counted.
"""

from __future__ import annotations

import hashlib
from typing import NamedTuple

import numpy as np

from rtbench.workloads.meshes import Mesh

EDGE = 0.05  # of a leaf's triangle, about
AWAY = 2.0  # of its ray's origin
# Rays pass a leaf through a box so many edges wide: 4.7 % of them hit.
BOX = 1.19
OFFSET = 1000.0  # of what lies far from the origin


class Tests(NamedTuple):
    """Rays, each with its own triangle, all numbers of float32.

    Attributes
    ----------
    name : str
    triangles : (N, 3, 3) float32 array
        Vertices.
    origins, directions : (N, 3) float32 arrays
        Directions are 1 long.
    """

    name: str
    triangles: np.ndarray
    origins: np.ndarray
    directions: np.ndarray

    @property
    def v0(self) -> np.ndarray:
        """The first vertices."""
        return self.triangles[:, 0]

    @property
    def v1(self) -> np.ndarray:
        """The second vertices."""
        return self.triangles[:, 1]

    @property
    def v2(self) -> np.ndarray:
        """The third vertices."""
        return self.triangles[:, 2]

    @property
    def digest(self) -> str:
        """SHA-256 (hex) of the three arrays."""
        sha = hashlib.sha256()
        for array in self[1:]:
            sha.update(np.ascontiguousarray(array, "<f4"))
        return sha.hexdigest()

    def take(self, rows: np.ndarray) -> Tests:
        """Return some of them."""
        return Tests(self.name, *(array[rows] for array in self[1:]))


def half_hits(n: int, seed: int = 1) -> Tests:
    """Return random triangles in the unit cube and rays from inside it, of which half hit.

    A ray aims at a point of the parallelogram of which the triangle is one half.
    """
    random = np.random.default_rng([seed, 50])
    corners, origins = random.random((n, 3, 3)), random.random((n, 3))
    a, b = random.random((2, n, 1))
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return _rounded("random", corners, origins, corners[:, 0] + a * first + b * second)


def leaf(n: int, seed: int = 1) -> Tests:
    """Return small triangles (edges 0.05 long) and rays from 2 away that pass near: 4.7 % hit."""
    random = np.random.default_rng([seed, 5])
    centres = random.random((n, 3))
    turned = _directions(random, n), _directions(random, n)
    across = np.cross(*turned)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    x, y = turned[0], np.cross(across, turned[0])
    # An equilateral triangle, its corners then moved by up to a fifth of an edge.
    angles = 2 * np.pi * np.arange(3) / 3
    radius = EDGE / np.sqrt(3)
    corners = centres[:, None] + radius * (
        np.cos(angles)[None, :, None] * x[:, None] + np.sin(angles)[None, :, None] * y[:, None]
    )
    corners += random.uniform(-EDGE / 5, EDGE / 5, corners.shape)
    through = centres + BOX * EDGE * random.uniform(-1, 1, (n, 3))
    return _rounded("leaf", corners, through + AWAY * _directions(random, n), through)


def far(n: int, seed: int = 1) -> Tests:
    """Return pairs as `half_hits` draws them, moved by 1000 along every axis."""
    near = half_hits(n, seed + 1000)
    corners = (near.triangles + np.float32(OFFSET)).astype(np.float64)
    origins = (near.origins + np.float32(OFFSET)).astype(np.float64)
    a, b = np.random.default_rng([seed, 51]).random((2, n, 1))
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return _rounded("far", corners, origins, corners[:, 0] + a * first + b * second)


def from_outside(mesh: Mesh, n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return rays at a mesh about (0, 0, 0) from three times its size, of which about half hit.

    Parameters
    ----------
    mesh : Mesh
        Round, about.
    n : int
    seed : int

    Returns
    -------
    origins, directions : (N, 3) float32 arrays
        A ray passes the centre at up to sqrt(2) times the mesh's radius, equally often everywhere.
    """
    random = np.random.default_rng([seed, 52])
    radius = float(np.linalg.norm(mesh.vertices - mesh.centre, axis=1).mean())
    outward = _directions(random, n)
    aside = np.cross(outward, _directions(random, n))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    through = mesh.centre + radius * np.sqrt(2 * random.random((n, 1))) * aside
    origins = (mesh.centre + 3 * radius * outward).astype(np.float32)
    return origins, _unit(through - origins).astype(np.float32)


WORKLOADS = {"random": half_hits, "leaf": leaf, "far": far}


def _rounded(name: str, corners: np.ndarray, origins: np.ndarray, targets: np.ndarray) -> Tests:
    triangles, origins = corners.astype(np.float32), origins.astype(np.float32)
    return Tests(name, triangles, origins, _unit(targets - origins).astype(np.float32))


def _directions(random: np.random.Generator, n: int) -> np.ndarray:
    return _unit(random.normal(size=(n, 3)))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
