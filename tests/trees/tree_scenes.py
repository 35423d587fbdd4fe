"""Scenes that are hard for a builder, small enough for plain Python."""

import numpy as np


def soup(seed, count=40, size=0.2):
    """Return triangles around random points of a unit cube."""
    rng = np.random.default_rng(seed)
    return rng.random((count, 1, 3)) + size * rng.normal(size=(count, 3, 3))


def quads(corners):
    """Return two triangles for each quadrangle of (Q, 4, 3)."""
    corners = np.asarray(corners, np.float64)
    return np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def floor(n, axis=2):
    """Return a flat grid of n times n abutting quadrangles."""
    made = []
    for i in range(n):
        for j in range(n):
            made.append([(i, j, 0), (i + 1, j, 0), (i + 1, j + 1, 0), (i, j + 1, 0)])
    return np.roll(quads(made), axis - 2, axis=2)


def lattice(n):
    """Return all faces of n**3 unit cubes: abutting, coplanar, parallel to the axes."""
    layers = [floor(n, axis) + k * np.eye(3)[axis] for axis in range(3) for k in range(n + 1)]
    return np.concatenate(layers)


def stairs(n):
    """Return n treads and n risers."""
    made = []
    for i in range(n):
        made.append([(i, i, 0), (i + 1, i, 0), (i + 1, i, 5), (i, i, 5)])
        made.append([(i + 1, i, 0), (i + 1, i + 1, 0), (i + 1, i + 1, 5), (i + 1, i, 5)])
    return quads(made)


ONE = np.array([[[0.0, 0, 0], [1, 0.5, 0.25], [0.25, 1, 1]]])
HARD = {
    "one triangle": ONE,
    "floor": floor(5),
    "wall": floor(4, 0),
    "lattice": lattice(2),
    "stairs": stairs(8),
    "duplicates": np.repeat(ONE, 40, axis=0),
    "duplicates among others": np.concatenate([np.repeat(ONE, 20, axis=0), soup(5, 20)]),
    "equal centroids": (ONE - ONE.mean(axis=1, keepdims=True)) * np.arange(1, 30)[:, None, None],
    "points": np.repeat(soup(6, 20)[:, :1], 3, axis=1),
    "one point": np.ones((12, 3, 3)),
    "layers an ulp apart": floor(2)[None, 0] + np.arange(30)[:, None, None] * [0, 0, 2.0**-23],
    "tiny and huge": np.concatenate([soup(7, 30) * 1e-3, soup(8, 4) * 1e3]),
    "far away": soup(9, 30) + np.array([1e6, -1e6, 3e5]),
    "slivers": soup(10, 30) * [1, 1e-6, 1] + np.arange(30)[:, None, None] * 0.01,
}
