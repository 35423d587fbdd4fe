"""Generated meshes: closed solids; models of the size that was asked for, of the kind promised."""

import math

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads import generated_models, meshes
from rtbench.workloads.generated_models import MODELS, even, find_model, robots, scanned, stairs
from rtbench.workloads.solids import cube, icosphere, random_sphere, tetrahedron

SOLIDS = {
    "tetrahedron": tetrahedron,
    "cube": cube,
    "icosphere 0": lambda: icosphere(0),
    "icosphere 2": lambda: icosphere(2),
    "random sphere 16": random_sphere,
    "random sphere 3": lambda: random_sphere(3),
}


@pytest.fixture(params=SOLIDS)
def mesh(request):
    return SOLIDS[request.param]()


def directed_edges(mesh):
    return [(int(f[i]), int(f[(i + 1) % 3])) for f in mesh.faces for i in range(3)]


def volume(mesh):
    return float(np.linalg.det(mesh.triangles).sum() / 6)


def test_generated_meshes_are_closed_and_face_outward(mesh):
    edges = directed_edges(mesh)
    assert len(set(edges)) == len(edges) and {(b, a) for a, b in edges} == set(edges)
    assert mesh.closed and mesh.open_edges == 0
    corners, sides = len(np.unique(mesh.faces)), len(edges) // 2
    assert corners == len(mesh.vertices)
    assert corners - sides + len(mesh.faces) == 2  # a sphere, by Euler
    assert (np.linalg.det(mesh.triangles) > 0).all()  # each side is seen from the centre


def test_sizes_and_volumes():
    assert len(random_sphere().faces) == 2 * 16 + 2 * 16 * 13
    assert len(icosphere(3).faces) == 1280 and len(cube().faces) == 12
    assert volume(cube()) == pytest.approx(8)
    assert volume(tetrahedron()) == pytest.approx(8 / (9 * math.sqrt(3)))
    # Volumes of inscribed polyhedra come near to that of the sphere from below.
    found = [volume(icosphere(k)) for k in range(5)]
    assert found == sorted(found) and found[-1] < 4 / 3 * math.pi < 1.005 * found[-1]
    for k in range(3):
        np.testing.assert_allclose(np.linalg.norm(icosphere(k).vertices, axis=1), 1, rtol=1e-14)
    radius = np.linalg.norm(random_sphere(radii=(1, 6)).vertices, axis=1)
    assert 1 <= radius.min() < 2 and 5 < radius.max() <= 6


def test_not_allowed():
    for wrong in (-1, 9):
        with pytest.raises(RtbenchError, match=f"subdivisions {wrong} is not allowed"):
            icosphere(wrong)
    with pytest.raises(RtbenchError, match="rings 2 is not allowed"):
        random_sphere(2)


def longest_sides(mesh):
    corners = mesh.triangles
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("triangles", [1_000, 7_654, 100_000])
def test_models_are_of_the_size_asked_for(name, triangles):
    found = MODELS[name](triangles)
    assert len(found.faces) == pytest.approx(triangles, rel=0.03)
    assert found.faces.min() == 0 and found.faces.max() == len(found.vertices) - 1
    np.testing.assert_array_equal(found.vertices, found.vertices.astype(np.float32))
    assert found.degenerate == 0
    again = MODELS[name](triangles)
    np.testing.assert_array_equal(found.vertices, again.vertices)
    np.testing.assert_array_equal(found.faces, again.faces)


def test_a_million_triangles_are_few_for_arrays():
    for make in (even, scanned, robots, stairs):
        assert len(make(1_000_000).faces) == pytest.approx(1_000_000, rel=0.01)


def test_even_ones_are_spread_evenly():
    found = even(8_000)
    side = longest_sides(found)
    assert side.max() < 1.0001 * side.min()
    middles = found.triangles.mean(axis=1)
    in_eighths = np.histogramdd(middles, bins=2, range=[(0, 1)] * 3)[0]
    assert (in_eighths == 1_000).all()  # 20 cells a side, one in each
    normal = np.cross(*np.moveaxis(found.triangles[:, 1:] - found.triangles[:, :1], 1, 0))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert (np.abs((normal**2).mean(axis=0) - 1 / 3) < 0.02).all()  # turned every way
    assert not np.array_equal(found.vertices, even(8_000, seed=2).vertices)


def test_scanned_ones_are_closed_bumpy_and_of_similar_triangles():
    found = scanned(20_000)
    assert found.closed
    corners, sides = len(found.vertices), 3 * len(found.faces) // 2
    assert corners - sides + len(found.faces) == 2  # a sphere, by Euler
    assert (np.linalg.det(found.triangles) > 0).all()  # faces outward, seen from its centre
    side = longest_sides(found)
    assert side.max() < 5 * side.min() and side.max() < 3 * np.median(side)
    radius = np.linalg.norm(found.vertices, axis=1)
    assert radius.min() < 0.9 and radius.max() > 1.1
    assert 3.5 < volume(found) < 5  # once around
    other = scanned(20_000, seed=2)
    np.testing.assert_array_equal(found.faces, other.faces)
    assert not np.array_equal(found.vertices, other.vertices)


def test_robots_are_dense_in_an_empty_scene():
    found = robots(20_000)
    corners = found.triangles
    floor = (corners[:, :, 1] == 0).all(axis=1) & (longest_sides(found) > 1)
    assert np.count_nonzero(floor) == 2 and (longest_sides(found)[~floor] < 0.5).all()
    # A grid of 1 m cells over the floor: most are empty.
    used = np.unique(np.floor(corners[~floor].mean(axis=1)[:, [0, 2]]), axis=0)
    assert 5 <= len(used) < 0.03 * 40 * 40
    assert corners[..., 1].min() == 0 and 1.7 < corners[..., 1].max() < 1.9
    without = meshes.Mesh("robots", found.vertices, found.faces[~floor], found.centre)
    assert without.closed and volume(without) > 0
    # Nothing sticks out of the floor's other side, or stands beside it.
    assert np.abs(corners[~floor][..., [0, 2]]).max() < 10


def test_stairs_lie_in_planes_of_the_axes():
    found = stairs(4_000)
    corners = found.triangles
    flat = (corners == corners[:, :1]).all(axis=1)  # of each triangle, along each axis
    assert (flat.sum(axis=1) == 1).all() and not flat[:, 2].any()
    assert np.count_nonzero(flat[:, 0]) == np.count_nonzero(flat[:, 1])
    np.testing.assert_array_equal(corners, np.round(corners))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normal[flat[:, 1], 1] == 1).all()  # treads face up
    assert (normal[flat[:, 0], 0] == 1).all()  # risers face who climbs, towards -x
    # A sheet: beside its border every edge is there in both directions.
    assert found.open_edges == 2 * (2 * 32) + 2 * 31


def test_models_are_found(tmp_path, monkeypatch):
    monkeypatch.delenv(meshes.MODELS, raising=False)
    monkeypatch.chdir(tmp_path)
    assert len(find_model("scanned", triangles=1_000).faces) == pytest.approx(1_000, rel=0.03)
    assert len(find_model("even:2000").faces) == 2_000
    assert len(find_model("even:2_000", triangles=5_000).faces) == 2_000
    assert find_model("uneven:1000").name == "robots"
    monkeypatch.setattr(generated_models, "TRIANGLES", 3_000)
    assert len(find_model("even").faces) == 3_000

    (tmp_path / "mine.ply").write_bytes(PLY)
    np.testing.assert_array_equal(find_model("mine.ply").triangles, [np.eye(3)])
    with pytest.raises(RtbenchError, match=r"unknown model 'mine'.*; RTBENCH_MODELS names no fold"):
        find_model("mine")
    monkeypatch.setenv(meshes.MODELS, str(tmp_path))
    assert find_model("mine").name == "mine"
    assert find_model(tmp_path / "mine.ply").name == "mine"


PLY = b"""ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
1 0 0
0 1 0
0 0 1
3 0 1 2
"""
NOT_FOUND = {
    "scaned": "unknown model 'scaned'; did you mean 'scanned'",
    "scaned:2000": "unknown model 'scaned'; did you mean 'scanned'",
    "scanned:many": "model 'scanned:many': 'many' is no number of triangles .example: scanned:2",
    "scanned:": "'' is no number of triangles",
    "scanned:-5": "'-5' is no number of triangles",
    "even:10": "model 'even' of 10 triangles is not to be had .allowed: 1000 to 20000000.",
    "even:99999999999": "of 99999999999 triangles is not to be had",
    "even:" + 5000 * "9": "is no number of triangles",
    "nowhere.ply": "mesh 'nowhere.ply' cannot be read: no such file",
    "some/where": "mesh 'some/where' cannot be read: no such file",
    "": "cannot be read: is a folder",
}


@pytest.mark.parametrize("name", NOT_FOUND, ids=lambda name: name[:20])
def test_models_that_are_not_to_be_had(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(meshes.MODELS, raising=False)
    with pytest.raises(RtbenchError, match=NOT_FOUND[name]) as caught:
        find_model(name)
    assert "\n" not in str(caught.value)
