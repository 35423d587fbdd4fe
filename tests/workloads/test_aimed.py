"""Rays from inside a mesh: each meets it in exact arithmetic, and near what it is aimed at."""

from fractions import Fraction

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads.aimed import AIMS, aimed_rays, winding
from rtbench.workloads.meshes import Mesh
from rtbench.workloads.nearest import nearest
from rtbench.workloads.solids import cube, icosphere, random_sphere, tetrahedron

FAR = (148376.0, 1234.0, -223423.0)
PLACES = {"origin": (0.0, 0.0, 0.0), "far": FAR}
MESHES = {
    "tetrahedron": tetrahedron(),
    "cube": cube(),
    "icosphere": icosphere(1),
    "random sphere": random_sphere(5),
}
COUNTS = {"vertex": 30, "edge": 20, "face": 10}


@pytest.mark.parametrize("data", [np.float32, np.float64])
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", MESHES)
def test_every_ray_meets_the_mesh_exactly(name, place, data):
    rays = aimed_rays(MESHES[name].moved(PLACES[place]), COUNTS, data)
    assert rays.origins.dtype == rays.directions.dtype == data
    found = nearest(rays.mesh.triangles, rays.origins, rays.directions)
    assert (found.triangle >= 0).all()
    assert rays.convex == (name != "random sphere")
    if rays.convex:
        assert not rays.elsewhere(found.triangle).any()
        np.testing.assert_allclose(found.t, 0.5, rtol=0.05 if place == "far" else 1e-6)


def test_aims_stand_in_their_order_with_their_targets():
    rays = aimed_rays(icosphere(2), COUNTS, np.float64)
    assert [AIMS[k] for k in rays.aim] == ["vertex"] * 30 + ["edge"] * 20 + ["face"] * 10
    assert ((rays.target >= 0).sum(axis=1) == rays.aim + 1).all()
    faces = [set(face) for face in rays.mesh.faces.tolist()]
    reached = rays.origins + 0.5 * rays.directions
    for target, point in zip(rays.target.tolist(), reached, strict=True):
        corners = [corner for corner in target if corner >= 0]
        around = sum(set(corners) <= face for face in faces)
        assert around in {1: (5, 6), 2: (2,), 3: (1,)}[len(corners)]
        # The point lies in what it is a point of: the smallest combination of the corners.
        weights = np.linalg.lstsq(rays.mesh.vertices[corners].T, point, rcond=None)[0]
        np.testing.assert_allclose(rays.mesh.vertices[corners].T @ weights, point, atol=1e-12)
        assert (weights > -1e-12).all() and weights.sum() == pytest.approx(1)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("data", [np.float32, np.float64])
def test_exact_says_which_rays_pass_through_their_vertex(place, data):
    rays = aimed_rays(icosphere(1).moved(PLACES[place]), {"vertex": 300}, data)
    for k in range(300):
        o, d, p = (
            [Fraction(float(x)) for x in vector]
            for vector in (
                rays.origins[k],
                rays.directions[k],
                rays.mesh.vertices[rays.target[k, 0]],
            )
        )
        assert rays.exact[k] == all(a + b / 2 == c for a, b, c in zip(o, d, p, strict=True))
    assert rays.exact.all() if place == "far" else rays.exact.mean() < 0.5


def test_elsewhere_is_a_triangle_without_the_target():
    rays = aimed_rays(icosphere(1), {"vertex": 50, "edge": 50})
    there = np.array(
        [np.flatnonzero((rays.mesh.faces == target[0]).any(axis=1))[0] for target in rays.target]
    )
    assert not rays.elsewhere(there).any()
    assert not rays.elsewhere(np.full(100, -1)).any()
    opposite = [
        np.flatnonzero(~np.isin(rays.mesh.faces, target).any(axis=1))[0] for target in rays.target
    ]
    assert rays.elsewhere(np.array(opposite)).all()


def test_the_seed_decides():
    one, same, other = (aimed_rays(cube(), COUNTS, seed=seed) for seed in (1, 1, 2))
    assert one.directions.tobytes() == same.directions.tobytes()
    assert one.directions.tobytes() != other.directions.tobytes()


def test_winding_counts_how_often_a_mesh_goes_round():
    sphere = icosphere(1).triangles
    assert winding(sphere) == pytest.approx(1)
    assert winding(sphere[:, ::-1]) == pytest.approx(-1)
    assert winding(icosphere(1).moved((1.5, 0, 0)).triangles) == pytest.approx(0, abs=1e-12)
    assert winding(np.concatenate([sphere, 2 * sphere])) == pytest.approx(2)
    assert winding(cube().triangles[:2]) == pytest.approx(1 / 6)


def test_no_rays_from_where_they_need_not_meet_anything():
    sphere = icosphere(1)
    holed = Mesh("holed", sphere.vertices, sphere.faces[1:], sphere.centre)
    with pytest.raises(RtbenchError, match="holed is not closed: 3 edges are open"):
        aimed_rays(holed, COUNTS)
    beside = Mesh("beside", sphere.vertices, sphere.faces, np.array([2.0, 0, 0]))
    with pytest.raises(RtbenchError, match="the centre of beside is not inside it"):
        aimed_rays(beside, COUNTS)
    with pytest.raises(RtbenchError, match="is too small for the coordinates of its place"):
        aimed_rays(sphere.scaled(0.02).moved(FAR), COUNTS, np.float32, inner=0.9)
    with pytest.raises(RtbenchError, match="inner 1 is not allowed"):
        aimed_rays(sphere, COUNTS, inner=1)
