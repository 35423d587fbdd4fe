"""Half-open edges: each shared edge and vertex belongs to one triangle, exactly and in floats."""

import itertools
from fractions import Fraction

import fans
import numpy as np
import pytest
import workload

import rtbench
from rtbench.compiled.exact import exact_form, exact_records
from rtbench.kernels.contract import HIT
from rtbench.kernels.half_open import left, right
from rtbench.kernels.registry import find

KERNEL = find("half_open_uv")
ORDERS = list(itertools.permutations(range(3)))


def exactly(group):
    """Return outcome and outputs of every pair in rational arithmetic."""
    vertices = tuple(group.triangles[:, i] for i in range(3))
    records = exact_records(KERNEL, vertices, group.origins, group.directions)
    return [exact_form(KERNEL)(tri, ray) for tri, ray in zip(*records, strict=True)]


@pytest.mark.parametrize("made", [fans.exact, fans.near])
def test_exactly_one_triangle_of_a_fan_is_hit_in_rationals(made):
    case = made("float32", 240)
    hit = np.array([answer[0] == HIT for answer in exactly(case.group)])
    assert set(case.hits(hit)) == {1}


def test_the_order_of_the_vertices_does_not_matter_in_rationals():
    case = fans.exact("float64")
    answers = set()
    for order in ORDERS:
        triangles = case.group.triangles[:, list(order)]
        group = workload.Group(triangles, case.group.origins, case.group.directions, np.inf)
        answers.add(tuple(answer[0] == HIT for answer in exactly(group)))
    assert len(answers) == 1


def test_a_square_s_two_triangles_share_what_every_ray_of_a_grid_meets():
    """Each point of a half-open square, borders included, is in exactly one of its halves."""
    corners = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], float)
    for diagonal, turn in itertools.product((0, 1), range(3)):
        halves = np.roll(corners, diagonal, axis=0)[[[0, 1, 2], [0, 2, 3]]]
        grid = np.array([[x, y, 1.0] for x in range(-1, 6) for y in range(-1, 6)])
        down = np.tile([0, 0, -1.0], (len(grid), 1))
        count = np.zeros(len(grid), int)
        for half in np.roll(halves, turn, axis=2):
            pairs = np.tile(half, (len(grid), 1, 1)), *(np.roll(a, turn, 1) for a in (grid, down))
            count += rtbench.intersect("half_open", *pairs, "float64").hit
        # One corner and the two borders at it are the square's, the other two are not.
        assert count.max() == 1 and count.sum() == 16


@pytest.mark.parametrize("precision", workload.DATA)
@pytest.mark.parametrize(("made", "most"), [(fans.exact, 1), (fans.near, 3)])
def test_no_fan_leaks_in_floats_and_ties_are_of_one_triangle(made, most, precision):
    case = made(precision, 1500)
    outcome, _ = case.group.answers(KERNEL, precision)
    hits = case.hits(outcome == HIT)
    # What remains is odd, whatever the roundings; and hardly ever more than one.
    assert set(hits) <= {1, most}
    assert (hits == 1).mean() > 0.99


@pytest.mark.parametrize("precision", workload.DATA)
def test_a_closed_mesh_is_hit_once_from_inside(precision):
    """An octahedron far away, rays from inside aimed at its vertices, edges and faces."""
    random = np.random.default_rng(4)
    dtype = workload.DATA[precision]
    points = np.vstack([np.eye(3), -np.eye(3)])
    points = (points + np.array([1234.0, -567.0, 89.0])).astype(dtype)
    faces = points[[[x, y, z] for x in (0, 3) for y in (1, 4) for z in (2, 5)]]
    centre = points.astype(float).mean(axis=0)
    origins = (centre + random.uniform(-0.2, 0.2, (600, 3))).astype(dtype)
    weights = random.dirichlet((1, 1, 1), 600)
    weights[:200] = np.eye(3)[random.integers(3, size=200)]
    weights[200:400, 0] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    targets = np.einsum("ni,nij->nj", weights, faces[random.integers(8, size=600)].astype(float))
    directions = targets - origins
    pairs = np.tile(faces, (600, 1, 1)), np.repeat(origins, 8, 0), np.repeat(directions, 8, 0)
    hit = rtbench.intersect("half_open", *pairs, precision).hit.reshape(600, 8)
    assert set(hit.sum(axis=1)) == {1}


def test_an_edge_is_the_same_in_either_direction():
    """Signed zeros, NaN and infinity included."""
    numbers = [0.0, -0.0, 1.0, -2.0, np.inf, -np.inf, np.nan]
    for area, p, q in itertools.product(numbers, numbers, numbers):
        for told in (right, left):
            assert told(area, p, q) == told(-area, q, p)
        assert not (right(area, p, q) and left(area, p, q))
        crosses = (p > 0) != (q > 0) and not np.isnan([area, p, q]).any()
        assert (right(area, p, q) or left(area, p, q)) == crosses


def test_values_are_those_of_the_exact_point():
    group = workload.groups("float64")["random"]
    for answer, right_one in zip(exactly(group), zip(group.reference.t, strict=True), strict=True):
        if answer[0] == HIT:
            t, u, v = answer[1:]
            assert isinstance(t, Fraction) and u >= 0 and v >= 0 and u + v <= 1
            assert float(t) == pytest.approx(right_one[0], rel=1e-14)
