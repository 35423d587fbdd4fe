"""Ray sets: rays start and end where they are said to; nothing shadows itself but its dark side."""

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads.cameras import dense_part, framing, primary_rays
from rtbench.workloads.generated_models import robots, scanned
from rtbench.workloads.meshes import Mesh
from rtbench.workloads.ray_sets import light_of, mixed_rays, random_rays, shadow_rays
from rtbench.workloads.solids import cube, icosphere

SETS = {"random": random_rays, "mixed": mixed_rays}


@pytest.fixture(scope="module")
def mesh():
    return scanned(1_000)


def nearest(triangles, origins, directions, tmax):
    """Return t and index of the nearest hits, in float64 (Moeller and Trumbore, all pairs)."""
    a = triangles[:, 0]
    e, f = triangles[:, 1] - a, triangles[:, 2] - a
    t, index = np.full(len(origins), np.nan), np.full(len(origins), -1)
    with np.errstate(all="ignore"):
        for k, (o, d) in enumerate(zip(origins, directions, strict=True)):
            p, s = np.cross(d, f), o - a
            det, q = (e * p).sum(axis=1), np.cross(s, e)
            u, v, far = (s * p).sum(axis=1) / det, q @ d / det, (f * q).sum(axis=1) / det
            far[~((u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0) & (far < tmax))] = np.inf
            if np.isfinite(far.min(initial=np.inf)):
                index[k], t[k] = np.argmin(far), far.min()
    return t, index


@pytest.mark.parametrize("name", SETS)
def test_what_all_sets_promise(name, mesh):
    draw = SETS[name]
    origins, directions = draw(mesh, 1001, 7)
    assert origins.shape == directions.shape == (1001, 3)
    for a in (origins, directions):
        assert a.dtype == np.float64 and np.isfinite(a).all()
        np.testing.assert_array_equal(a, a.astype(np.float32))
    assert directions.any(axis=1).all()
    again, other = draw(mesh, 1001, 7), draw(mesh, 1001, 8)
    np.testing.assert_array_equal(origins, again[0])
    np.testing.assert_array_equal(directions, again[1])
    assert not np.array_equal(origins, other[0])
    finer = draw(mesh, 1001, 7, data=np.float64)
    assert (finer[1] != finer[1].astype(np.float32)).any()
    assert len(draw(mesh, 0)[0]) == 0
    for few in (1, 2, 3, 5):
        assert len(draw(mesh, few)[1]) == few
    with pytest.raises(RtbenchError, match="number of rays -1 is not allowed"):
        draw(mesh, -1)


def test_random_rays_go_from_the_sphere_into_the_box(mesh):
    moved = mesh.moved((5.0, 0.0, -3.0)).rounded(np.float32)
    lower, upper = moved.vertices.min(axis=0), moved.vertices.max(axis=0)
    origins, directions = random_rays(moved, 4_000)
    middle, radius = (lower + upper) / 2, np.linalg.norm(upper - lower) / 2
    np.testing.assert_allclose(np.linalg.norm(origins - middle, axis=1), radius, rtol=1e-5)
    ends = (origins + directions - lower) / (upper - lower)
    assert ends.min() > -1e-5 and ends.max() < 1 + 1e-5
    assert (np.abs(ends.mean(axis=0) - 0.5) < 0.03).all()
    assert (np.abs(((origins - middle) / radius).mean(axis=0)) < 0.05).all()


def test_random_rays_within():
    room = Mesh("sponza", cube().vertices, cube().faces, np.zeros(3))
    for origins, directions in (random_rays(room, 500), random_rays(cube(), 500, within=True)):
        assert np.abs(origins).max() <= 1 and np.abs(origins + directions).max() < 1.0001
    outside = random_rays(room, 500, within=False)[0]
    assert (np.abs(outside).max(axis=1) > 0.99).all()


def test_every_second_random_ray_is_aimed_at_what_is_dense():
    scene = robots(2_000)
    low, high = dense_part(scene)
    origins, directions = random_rays(scene, 2_000)
    ends = origins + directions
    there = ((ends > low - 1e-3) & (ends < high + 1e-3)).all(axis=1)
    assert there[1::2].all() and np.mean(there[0::2]) < 0.2


@pytest.mark.parametrize("data", [np.float32, np.float64])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (100.0, -50.0, 25.0)])
def test_a_ball_shadows_its_dark_side_only(data, place):
    ball = icosphere(3).moved(place).rounded(np.float32)
    triangles = ball.triangles
    primary = primary_rays(framing(ball), 40, 30)[:2]
    t, triangle = nearest(triangles, *primary, np.inf)
    light = np.add(place, (-4.0, 3.0, 0.5))
    origins, directions, tmax, ray = shadow_rays(
        triangles, *primary, t.astype(data), triangle, light, data
    )
    np.testing.assert_array_equal(ray, np.flatnonzero(triangle >= 0))
    assert len(ray) > 300 and (tmax == 1).all()
    # They start where the primary rays end, just off the triangle, on their side; t is 1 at the
    # light.
    hits = primary[0][ray] + t[ray, None] * primary[1][ray]
    scale = np.abs(triangles).max()
    assert np.abs(origins - hits).max() < 64 * np.finfo(data).eps * scale + 2e-7 * t[ray].max()
    assert np.abs(origins + directions - light).max() < 1e-6 * scale
    corners = triangles[triangle[ray]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    off = ((origins - corners[:, 0]) * normal).sum(axis=1)
    off /= np.linalg.norm(normal, axis=1)
    assert off.min() > 0 and off.max() < 20 * np.finfo(data).eps * scale
    # A convex body: lit where the light is before the plane, else in its own shadow.
    before = ((light - corners[:, 0]) * normal).sum(axis=1)
    before /= np.linalg.norm(normal, axis=1)
    clear = np.abs(before) > 0.05  # else a ray may leave past the edge before it enters
    occluded = nearest(triangles, origins, directions, 1)[1] >= 0
    assert 0.2 < np.mean(occluded) < 0.8
    np.testing.assert_array_equal(occluded[clear], before[clear] < 0)


def test_shadow_rays_of_odd_hits():
    flat = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [0, 0, 1], [1, 0, 1]]], float)
    tiny = 2.0**-120 * flat[:1]
    triangles = np.concatenate([flat, tiny])
    origins = np.array([[0.2, 0.2, 2], [0.2, 0.2, -2], [0.5, 0, 3], [0, 0, 1], [9, 9, 9]])
    directions = np.array([[0, 0, -1], [0, 0, 1], [0, 0, -1], [0, 0, -1.0], [0, 0, 1]])
    t, triangle = np.array([2, 2, 2, 1, np.nan]), np.array([0, 0, 1, 2, -1])
    start, way, _, ray = shadow_rays(triangles, origins, directions, t, triangle, (0, 0, 8))
    assert ray.tolist() == [0, 1, 2, 3]
    # Above, below, back along the ray from a triangle without area, above a tiny one.
    assert start[0, 2] > 0 > start[1, 2] and start[2, 2] > 1 and start[3, 2] > 0
    assert np.isfinite(start).all() and np.isfinite(way).all()
    nothing = shadow_rays(triangles, origins, directions, t, np.full(5, -1), (0, 0, 8))
    assert [a.shape for a in nothing] == [(0, 3), (0, 3), (0,), (0,)]


def test_lights_hang_above(mesh):
    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    assert light_of(mesh)[1] > upper[1]
    room = Mesh("sponza", mesh.vertices, mesh.faces, mesh.centre)
    assert (light_of(room) > lower).all() and (light_of(room) < upper).all()
    assert np.abs(light_of(robots(2_000))).max() < 20  # near the robots


def test_mixed_rays_are_what_they_are_said_to_be(mesh):
    origins, directions = mixed_rays(mesh, 2_000)
    quarters = [(origins[k : k + 500], directions[k : k + 500]) for k in range(0, 2_000, 500)]
    used = mesh.vertices[np.unique(mesh.faces)]
    vertices = {tuple(vertex) for vertex in used}

    on_vertex = np.array([tuple(o) in vertices for o in quarters[0][0]])
    assert 160 < np.count_nonzero(on_vertex) < 175
    # The others lie on the surface: so near to a triangle's plane, within it.
    corners = mesh.triangles
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for o in quarters[0][0][~on_vertex][:60]:
        height = np.abs(((o - corners[:, 0]) * normal).sum(axis=1))
        sides = corners - np.roll(corners, 1, axis=1)
        near = np.linalg.norm(corners - o, axis=2).max(axis=1)
        assert height[near < np.linalg.norm(sides, axis=2).max(axis=1) + 1e-6].min() < 1e-6

    zeros = (quarters[1][1] == 0).sum(axis=1)
    assert set(zeros) == {1, 2} and np.count_nonzero(zeros == 2) == 375
    minus = (quarters[1][1] == 0) & np.signbit(quarters[1][1])
    assert 0.4 < minus.sum() / zeros.sum() < 0.6
    coordinates = [set(mesh.vertices[:, axis]) for axis in range(3)]
    shared = [np.mean([x in coordinates[a] for x in quarters[1][0][:, a]]) for a in range(3)]
    assert min(shared) > 0.4 and max(shared) < 0.6

    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    radius = np.linalg.norm(upper - lower) / 2
    away = np.linalg.norm(quarters[2][0] - (lower + upper) / 2, axis=1) / radius
    assert away.min() > 0.999 and away.max() > 3
    assert ((quarters[3][0] >= lower) & (quarters[3][0] <= upper)).all()
    for o, d in quarters[2:]:
        missed = [np.abs(used - end).max(axis=1).min() for end in o + d]
        assert np.count_nonzero(np.less(missed, 1e-6)) == 250  # aimed at vertices
    # Packets of 16 that go the same way are among them, and such that do not.
    for _, d in quarters:
        octant = np.signbit(d) @ (1, 2, 4)
        same = [np.ptp(octant[k : k + 16]) == 0 for k in range(0, 480, 16)]
        assert 5 < np.count_nonzero(same) < 25
