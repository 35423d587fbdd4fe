"""Closed fans of triangles around a vertex, and rays that meet that vertex or an inner edge.

Rays hit at t = 0.5, so that segments pass through too.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from workload import DATA, Group

SIZE = 512.0  # of a fan, in units: coordinates are whole numbers below 2^13, exact in float32


@dataclass(frozen=True, eq=False)
class Fans:
    """Pairs of all triangles of a fan and its one ray.

    Attributes
    ----------
    group : Group
    fan : (N,) int array
        To which fan a pair belongs.
    """

    group: Group
    fan: np.ndarray

    def hits(self, hit: np.ndarray) -> np.ndarray:
        """Return how many triangles of each fan are hit."""
        return np.bincount(self.fan, hit, self.fan[-1] + 1).astype(int)


def fan(random: np.random.Generator, spokes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a hub, its rim (K, 3) and a direction that sees the hub well inside the rim."""
    frame = np.linalg.qr(random.normal(size=(3, 3)))[0]
    angles = 2 * np.pi * (np.arange(spokes) + random.uniform(-0.2, 0.2, spokes)) / spokes
    length = random.uniform(0.5, 1.0, spokes)
    flat = np.stack([length * np.cos(angles), length * np.sin(angles)], axis=1)
    height = random.uniform(-0.05, 0.05, (spokes, 1))
    rim = 2 * np.rint(SIZE / 2 * np.hstack([flat, height]) @ frame)
    hub = np.rint(random.uniform(-SIZE, SIZE, 3))
    tilt = np.append(random.uniform(-0.3, 0.3, 2), random.choice([-1.0, 1.0]))
    return hub, hub + rim, np.rint(SIZE * tilt @ frame)


def gathered(cases, dtype: type) -> Fans:
    """Return the pairs of fans (hub, rim, origin, direction), vertices and windings in disorder."""
    random = np.random.default_rng(2)
    rows = []
    for number, (hub, rim, origin, direction) in enumerate(cases):
        for one, other in zip(rim, np.roll(rim, -1, axis=0), strict=True):
            triangle = random.permutation(np.stack([hub, one, other]))
            rows.append((triangle, origin, direction, number))
    triangles, origins, directions, fan = map(np.array, zip(*rows, strict=True))
    pairs = (a.astype(dtype) for a in (triangles, origins, directions))
    return Fans(Group(*pairs, np.inf), fan)


@functools.cache
def exact(precision: str, count: int = 60) -> Fans:
    """Return fans of whole numbers: rays through the hub or the middle of a spoke, exactly.

    Every third is axis-aligned, every third of the directions too: coordinates are 0 there.
    """
    random = np.random.default_rng(1)
    cases = []
    for number in range(count):
        hub, rim, direction = fan(random, 3 + number % 6)
        if number % 3 == 0:  # rim and direction along the axes
            axis = number // 3 % 3
            square = SIZE * np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
            rim = hub + np.roll(square, axis, axis=1)
            direction = np.roll([0, 0, SIZE], axis) * random.choice([-1, 1])
        target = hub if number % 2 else (hub + rim[0]) / 2
        cases.append((hub, rim, target - direction, 2 * direction))
    return gathered(cases, DATA[precision])


@functools.cache
def near(precision: str, count: int = 60) -> Fans:
    """Return fans of any numbers, up to 10^3 times their size away; rays aimed at inner points."""
    random = np.random.default_rng(3)
    dtype = DATA[precision]
    cases = []
    for number in range(count):
        hub, rim, direction = fan(random, 3 + number % 6)
        away = random.normal(size=3) * SIZE * 10.0 ** random.uniform(-3, 3)
        scale = random.uniform(0.001, 0.002)
        hub, rim = (((p + away) * scale).astype(dtype) for p in (hub, rim))
        share = random.uniform(0, 0.7) if number % 2 else 0.0
        target = hub.astype(float) + share * (rim[0].astype(float) - hub)
        origin = (target - direction * scale * random.uniform(0.5, 4)).astype(dtype)
        cases.append((hub, rim, origin, 2 * (target - origin)))
    return gathered(cases, dtype)
