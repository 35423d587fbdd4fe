"""Ties are broken so that a closed surface is crossed once, whatever the ray passes through."""

import itertools

import numpy as np
import pytest

from rtbench.accuracy import oracle
from rtbench.accuracy.ties import sos_hit


def hull(vertices, faces):
    return np.array(vertices, float)[np.array(faces)]


TETRAHEDRON = hull(
    [[-9, -9, -9], [9, 0, 1], [0, 9, 2], [3, 3, 9]], [*itertools.combinations(range(4), 3)]
)
OCTAHEDRON = hull(
    [[8, 0, 0], [-8, 0, 0], [0, 8, 0], [0, -8, 0], [0, 0, 8], [0, 0, -8]],
    [*itertools.product((0, 1), (2, 3), (4, 5))],
)
CUBE_FACES = [
    [0, 1, 3],
    [0, 3, 2],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 3, 7],
    [2, 7, 6],
]
CUBE_FACES += [[0, 2, 6], [0, 6, 4], [1, 3, 7], [1, 7, 5]]
CUBE = hull([*itertools.product((-4, 4), repeat=3)], CUBE_FACES)
BODIES = {"tetrahedron": TETRAHEDRON, "octahedron": OCTAHEDRON, "cube": CUBE}
OFFSETS = {"at the origin": (0, 0, 0), "far": (148376, 1234, -223423)}


def targets(body):
    """All vertices, and points of all edges and faces."""
    weights = np.array([[1, 0, 0], [1, 1, 0], [3, 1, 0], [1, 2, 1]], float)
    points = [
        w @ face / w.sum()
        for face in body
        for turn in range(3)
        for w in (np.roll(weights, turn, 1))
    ]
    return np.unique(np.array(points), axis=0)


def crossings(body, orig, dir):
    n = len(body)
    found = oracle.owned(body, np.tile(orig, (n, 1)), np.tile(dir, (n, 1)))
    assert found.tolist() == [sos_hit(*triangle, orig, dir) for triangle in body.tolist()]
    return int(found.sum())


@pytest.mark.parametrize("offset", OFFSETS.values(), ids=OFFSETS)
@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_from_inside_exactly_one_triangle_is_hit(body, offset):
    rng = np.random.default_rng(1)
    # Mixed windings: which way a triangle turns must not matter.
    body = np.array([rng.permutation(face) for face in body])
    for orig in [(0, 0, 0), (1, 1, 1), (1, 0, 0), (-1, 2, 0.5)]:
        for target in targets(body):
            dir = 12 * (target - orig)
            if np.any(dir):
                assert crossings(body + offset, np.add(orig, offset, dtype=float), dir) == 1


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_from_outside_none_or_two_are_hit(body):
    """Also along faces and edges, and where the body is only touched."""
    points = targets(body)
    met = set()
    for orig in [(20, 0, 0), (20, 4, 4), (-4, 4, 20), (12, 12, 12), (17, -30, 3)]:
        for target in points:
            met.add(crossings(body, np.array(orig, float), 12 * (target - orig)))
    assert met == {0, 2}


def test_a_fan_around_a_vertex_is_hit_once():
    """A disc of triangles around a vertex, with rays through it and through its spokes."""
    for n in range(3, 9):
        angles = 2 * np.pi * np.arange(n) / n + 0.1
        ring = np.round(np.stack([16 * np.cos(angles), 16 * np.sin(angles), angles], 1))
        fan = np.array([[[0, 0, 0], ring[k], ring[(k + 1) % n]] for k in range(n)])
        for target in [np.zeros(3), *(ring / 2)]:
            for orig in ([0, 0, 64], [1, 2, 64], [16, 0, 64], [0, -8, -64]):
                assert crossings(fan, np.array(orig, float), target - orig) == 1


def test_the_pieces_of_a_divided_triangle_own_what_it_owns():
    """Where the whole is hit or not for sure, its four quarters are hit once or not at all."""
    rng = np.random.default_rng(2)
    a, b, c = 2 * rng.integers(-4, 5, (3, 3)).astype(float)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = np.array([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]])
    orig = np.array([3.0, 5, 40])
    for w in itertools.product(range(9), repeat=3):
        target = (w[0] * a + w[1] * b + w[2] * c) / 8 if sum(w) == 8 else None
        if target is None:
            continue
        whole = crossings(np.array([[a, b, c]]), orig, target - orig)
        assert crossings(parts, orig, target - orig) == whole
        assert whole == 1 or min(w) == 0


TRIANGLE = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]


@pytest.mark.parametrize(
    ("orig", "dir", "expected"),
    [
        ([1, 1, 1], [0, 0, -1], 1),
        ([1, 1, 1], [0, 0, 1], 0),
        ([3, 3, 1], [0, 0, -1], 0),
        ([0, 1, 1], [0, 0, -1], 1),  # moved along +x, into it
        ([1, 0, 1], [0, 0, -1], 1),  # x cannot tell; moved along +y, into it
        ([2, 2, 1], [0, 0, -1], 0),  # moved along +x, out of it
        ([0, 0, 1], [0, 0, -1], 1),
        ([4, 0, 1], [0, 0, -1], 0),
        ([0, 0, -1], [0, 0, -1], 0),  # behind
        ([1, 1, 0], [0, 0, -1], 0),  # t = 0
        ([1, 1, 0], [1, 0, 0], 0),  # in the plane
        ([1, 1, 1], [0, 0, 0], -1),
        ([1, 1, float("nan")], [0, 0, 1], -1),
    ],
)
def test_by_hand(orig, dir, expected):
    for triangle in itertools.permutations(TRIANGLE):
        assert sos_hit(*triangle, orig, dir) == expected


def test_x_decides_before_y():
    """On a diagonal, along which x moves the ray to one side and y to the other."""
    upper, lower = [[0, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 0, 0], [4, 4, 0], [4, 0, 0]]
    orig, dir = [1, 1, 5], [0, 0, -1]
    assert (sos_hit(*upper, orig, dir), sos_hit(*lower, orig, dir)) == (0, 1)


def test_z_decides_last():
    """An edge along x and a ray along y: neither x nor y moves the ray across."""
    above, below = [[-1, 0, 0], [1, 0, 0], [0, 3, 1]], [[-1, 0, 0], [1, 0, 0], [0, 3, -1]]
    orig, dir = [0, -5, 0], [0, 1, 0]
    assert (sos_hit(*above, orig, dir), sos_hit(*below, orig, dir)) == (1, 0)
