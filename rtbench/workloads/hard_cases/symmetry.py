"""Families of symmetries: signed zeros, axis rays, orders of the corners, equal components."""

from __future__ import annotations

import itertools

import numpy as np

from rtbench.workloads.hard_cases.boundaries import toward_edge
from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    alone,
    grouped,
    reordered,
    spread,
    whole,
)

ORDERS = np.array(list(itertools.permutations(range(3))))


def signed_zeros(random: Random, values: np.ndarray) -> np.ndarray:
    """Return values with each zero made +0 or -0 at random."""
    return np.where(values == 0, np.copysign(0.0, random.choice([-1, 1], values.shape)), values)


def turned(random: Random, *vectors: np.ndarray) -> list[np.ndarray]:
    """Return rows of several arrays with their axes exchanged and mirrored, the same in all."""
    n = len(vectors[0])
    order = random.permuted(np.tile(np.arange(3), (n, 1)), axis=1)
    signs = random.choice([-1.0, 1.0], (n, 3))
    found = []
    for each in vectors:
        shape = (n,) + (1,) * (each.ndim - 2) + (3,)
        swapped = np.take_along_axis(each, np.broadcast_to(order.reshape(shape), each.shape), -1)
        found.append(signs.reshape(shape) * swapped)
    return found


def signed_zero_axis(random: Random, form: Format, n: int) -> Geometry:
    """Rays along an axis, zeros of both signs, to corners, edges, insides and past; small numbers.

    Four of five look toward the triangle. Float64's own have directions of more bits.
    """
    triangles = np.zeros((n, 3, 3))
    size = random.integers(1, 5, (n, 1)) * 4.0
    triangles[:, 1, 0:1] = triangles[:, 2, 1:2] = size
    triangles[:, :, 2] = random.integers(-2, 3, (n, 3))
    # In quarters of the edges: corners, edges, the inside, and past.
    spots = [(0, 0), (4, 0), (0, 4), (2, 0), (0, 1), (3, 1), (1, 1), (2, 1), (5, 0), (-1, 2)]
    spot = np.array(spots, float)[random.integers(len(spots), size=n)]
    origins = np.column_stack([spot * size / 4, random.choice([-8, -5, 6, 8], n)])
    directions = np.zeros((n, 3))
    toward = random.choice([-1, -1, -1, -1, 1], n) * np.sign(origins[:, 2])
    directions[:, 2] = toward * (random.integers(1, 4, n) + (0 if form.bits == 24 else 2.0**-40))
    triangles, origins, directions = turned(random, triangles, origins, directions)
    triangles, origins, directions = (
        signed_zeros(random, each) for each in (reordered(random, triangles), origins, directions)
    )
    numbers = np.concatenate([triangles.reshape(n, 9), origins, directions], axis=1)
    minus = ((numbers == 0) & np.signbit(numbers)).sum(axis=1)
    return alone(triangles, origins, directions, minus)


def permutation(random: Random, form: Format, n: int) -> Geometry:
    """A ray near an edge and one triangle, in all six orders of its corners."""
    triangles, rays, k = toward_edge(random, form, n)
    return grouped(triangles[:, ORDERS].reshape(-1, 3, 3), *rays, k, np.full(n, len(ORDERS)))


def axis_tie(random: Random, form: Format, n: int) -> Geometry:
    """Normals and directions whose greatest components are equal in size.

    Kinds: 0 two of the normal, 1 all of it, 2 two of the direction, 3 all of it, 4 all of both.
    """
    kind = spread(range(5), n)
    bits = np.full(n, 12.0 if form.bits == 24 else 40.0)
    corners = whole(random, bits, 3, 3)
    x, y = corners[:, :, 0], corners[:, :, 1]
    level = whole(random, bits, 1)
    # Planes y + z = level, normal (0, 1, 1), and x + y + z = level, normal (1, 1, 1).
    corners[:, :, 2] = np.where((kind == 0)[:, None], level - y, corners[:, :, 2])
    corners[:, :, 2] = np.where(np.isin(kind, (1, 4))[:, None], level - x - y, corners[:, :, 2])
    share = random.multinomial(8, (0.35, 0.35, 0.3), n) / 8 + random.choice([0, 0.25], (n, 1)) * [
        1,
        -2,
        1,
    ]
    target = np.rint(np.einsum("nk,nkc->nc", share, corners))
    way = whole(random, np.full(n, 6.0), 3)
    way[kind == 2, 1], way[kind == 2, 0] = 64, whole(random, np.full((kind == 2).sum(), 5.0))
    way[kind == 2, 2] = random.choice([-64, 64], (kind == 2).sum())
    way[kind >= 3] = 64 * random.choice([-1.0, 1.0], ((kind >= 3).sum(), 3))
    way[(way == 0).all(axis=1)] = [1, 2, 3]
    steps = 2.0 ** (bits - 8)[:, None]
    origins = target - steps * way
    corners, origins, way = turned(random, corners, origins, way)
    odd = 1 if form.bits == 24 else 1 + 2.0**-30
    return alone(reordered(random, corners), origins, odd * way, kind)
