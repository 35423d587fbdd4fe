"""Cameras: rays go where a pinhole sends them, in tiles; what should be in view is."""

import math
import os

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads import meshes
from rtbench.workloads.cameras import (
    RECOMMENDED,
    Camera,
    bounds,
    dense_part,
    framing,
    inside,
    picture,
    primary_rays,
    recommended,
    upward,
)
from rtbench.workloads.generated_models import MODELS, scanned
from rtbench.workloads.meshes import Mesh, load_mesh
from rtbench.workloads.solids import cube, icosphere

SEEN = {
    "cube": cube,
    "sphere far away": lambda: icosphere(2).scaled(100).moved((1e4, -2e4, 3e4)),
    "scanned": lambda: scanned(2_000),
    "tall": lambda: stretched(1, 5, 1),
    "flat field": lambda: stretched(40, 30, 1),
    "flat wall": lambda: stretched(1, 30, 30),
}


def stretched(*factors):
    return Mesh("stretched", cube().vertices * factors, cube().faces, np.zeros(3))


def seen_at(camera, points):
    """Return right, up and depth of points as the camera sees them, by solving for them."""
    forward = np.subtract(camera.target, camera.position)
    right = np.cross(forward, camera.up)
    up = np.cross(right, forward)
    basis = np.stack([v / math.sqrt(v @ v) for v in (right, up, forward)], axis=1)
    x, y, z = np.linalg.solve(basis, (points - np.array(camera.position)).T)
    return x / z, y / z, z


def test_rays_of_a_simple_camera():
    camera = Camera((1.0, 2.0, 10.0), (1.0, 2.0, 0.0), field_of_view=90.0)
    origins, directions, pixels = primary_rays(camera, 6, 4, tile=1)
    assert pixels.tolist() == list(range(24))
    assert (origins == (1, 2, 10)).all()
    # 90 degrees over 4 rows: a pixel is 1/2 wide 1 away. Left and top come first; x is right.
    np.testing.assert_allclose(directions[0], (-1.25, 0.75, -1), atol=1e-6)
    np.testing.assert_allclose(directions[5], (1.25, 0.75, -1), atol=1e-6)
    np.testing.assert_allclose(directions[23], (1.25, -0.75, -1), atol=1e-6)
    tall = primary_rays(camera, 4, 6, tile=1)[1]  # the shorter side still spans 90 degrees
    np.testing.assert_allclose(tall[0], (-0.75, 1.25, -1), atol=1e-6)


def test_t_is_depth_and_numbers_are_those_of_float32():
    camera = Camera((3.0, 1.0, 2.0), (0.0, 0.5, -1.0), (0.1, 1.0, 0.2))
    origins, directions, _ = primary_rays(camera, 16, 12)
    forward = np.subtract(camera.target, camera.position)
    forward /= np.linalg.norm(forward)
    np.testing.assert_allclose(directions @ forward, 1, atol=1e-6)
    for a in (origins, directions):
        assert a.dtype == np.float64 and a.flags.c_contiguous
        np.testing.assert_array_equal(a, a.astype(np.float32))
    finer = primary_rays(camera, 16, 12, data=np.float64)[1]
    assert (finer != directions).any()
    np.testing.assert_allclose(finer, directions, atol=1e-7)


def test_sixteen_rays_in_a_row_are_a_square():
    _, directions, pixels = primary_rays(Camera((0, 0, 5), (0, 0, 0)), 32, 24)
    assert sorted(pixels) == list(range(32 * 24))
    for packet in pixels.reshape(-1, 16):
        rows, columns = packet // 32, packet % 32
        assert np.ptp(rows) == np.ptp(columns) == 3 and rows.min() % 4 == columns.min() % 4 == 0
    # The same rays as row by row.
    row_by_row = primary_rays(Camera((0, 0, 5), (0, 0, 0)), 32, 24, tile=1)[1]
    np.testing.assert_array_equal(directions, row_by_row[pixels])


@pytest.mark.parametrize(("width", "height", "tile"), [(7, 5, 4), (1, 1, 4), (9, 8, 8), (5, 9, 1)])
def test_pictures_put_everything_back(width, height, tile):
    _, directions, pixels = primary_rays(Camera((0, 0, 5), (0, 0, 0)), width, height, tile)
    assert sorted(pixels) == list(range(width * height))
    image = picture(pixels, pixels, width, height)
    np.testing.assert_array_equal(image, np.arange(width * height).reshape(height, width))
    x = picture(directions, pixels, width, height)
    assert x.shape == (height, width, 3)
    assert (np.diff(x[:, :, 0], axis=1) > 0).all() and (np.diff(x[:, :, 1], axis=0) < 0).all()


@pytest.mark.parametrize("name", SEEN)
@pytest.mark.parametrize("aspect", [4 / 3, 1.0, 0.5])
def test_the_whole_mesh_is_in_view(name, aspect):
    mesh = SEEN[name]()
    camera = framing(mesh, aspect)
    x, y, depth = seen_at(camera, mesh.vertices)
    half = math.tan(math.radians(camera.field_of_view) / 2)
    across = np.abs(x).max() / (half * max(aspect, 1)), np.abs(y).max() / (half / min(aspect, 1))
    assert (depth > 0).all() and max(across) < 1
    assert max(across) > 0.85  # not from too far
    # From in front of it, above and to the right.
    up = upward(mesh)
    way = np.subtract(camera.position, camera.target)
    assert way[up] > 0 and camera.up == tuple(np.eye(3)[up])


def test_what_is_up():
    assert upward(cube()) == 1 and upward(stretched(1, 5, 1)) == 1
    assert upward(stretched(40, 30, 1)) == 2 and upward(stretched(1, 30, 30)) == 0
    assert upward(stretched(40, 1, 40)) == 1 and upward(stretched(3, 2, 1)) == 1


def test_vertices_that_nothing_uses_do_not_count():
    far = Mesh("far", np.concatenate([cube().vertices, [(1e6, 0, 0)]]), cube().faces, np.zeros(3))
    lower, upper = bounds(far)
    assert (lower == -1).all() and (upper == 1).all()
    assert framing(far) == framing(cube())


def test_inside_of_a_room():
    room = stretched(10, 3, 4)
    camera = inside(room)
    lower, upper = bounds(room)
    assert (camera.position > lower).all() and (camera.position < upper).all()
    np.testing.assert_allclose(camera.position, (-5, -1.2, 0), atol=1e-6)
    np.testing.assert_allclose(camera.target, (10, -1.2, 0), atol=1e-6)


def test_near_what_is_dense():
    ball = icosphere(3).scaled(0.1).moved((3.0, 0.1, -2.0))
    field = stretched(50, 0, 50)
    both = Mesh(
        "field",
        np.concatenate([field.vertices, ball.vertices]),
        np.concatenate([field.faces, ball.faces + len(field.vertices)]),
        np.zeros(3),
    )
    low, high = dense_part(both)
    assert (low > (2.89, -0.01, -2.11)).all() and (high < (3.11, 0.21, -1.89)).all()
    assert dense_part(ball) is None and dense_part(cube()) is None
    camera = recommended(both)
    assert camera == inside(both)
    x, y, depth = seen_at(camera, ball.vertices)
    half = math.tan(math.radians(camera.field_of_view) / 2)
    assert max(np.abs(x).max(), np.abs(y).max()) < half and depth.max() < 1
    # All of the image is ground or ball.
    assert (primary_rays(camera, 32, 24)[1][:, 1] < 0).all()


@pytest.mark.parametrize("name", MODELS)
def test_generated_models_are_seen(name):
    mesh = MODELS[name](2_000)
    camera = recommended(mesh)
    x, y, depth = seen_at(camera, mesh.triangles.mean(axis=1))
    half = math.tan(math.radians(camera.field_of_view) / 2)
    within = (depth > 0) & (np.abs(x) < half * 4 / 3) & (np.abs(y) < half)
    assert np.mean(within) > 0.75  # of five robots four


# What part of the rays must hit, of those of which it is known without tracing them.
INSIDE = {"sponza": "y", "teapot_in_stadium": "z"}


@pytest.mark.parametrize("name", INSIDE)
def test_recommended_cameras_of_known_models(name):
    there = meshes.models()
    if name not in there:
        pytest.skip(f"no {name}.ply: {meshes.MODELS} is {os.environ.get(meshes.MODELS)!r}")
    mesh = load_mesh(there[name])
    assert name in RECOMMENDED
    camera = recommended(mesh)
    lower, upper = bounds(mesh)
    if name == "sponza":
        assert (camera.position > lower).all() and (camera.position < upper).all()
    else:
        directions = primary_rays(camera, 64, 48)[1]
        assert (directions[:, 2] < 0).all()  # all down to the field, and none beyond its end
        ends = camera.position + directions * (camera.position[2] / -directions[:, 2:])
        assert (ends[:, :2] > lower[:2]).all() and (ends[:, :2] < upper[:2]).all()
        low, high = dense_part(mesh)
        assert (low > (-0.2, -0.2, -0.01)).all() and (high < (0.2, 0.2, 0.16)).all()
        distance = np.linalg.norm(np.subtract(camera.position, (low + high) / 2))
        assert distance == pytest.approx(1.1, abs=0.05)


BAD = {
    "nowhere": ((1, 2, 3), (1, 2, 3)),
    "along up": ((0, 5, 0), (0, 0, 0)),
    "not finite": ((0, math.nan, 0), (0, 0, 0)),
}


@pytest.mark.parametrize("name", BAD)
def test_cameras_that_see_nothing(name):
    with pytest.raises(RtbenchError, match="sees nothing"):
        Camera(*BAD[name])


def test_not_allowed():
    for angle in (0, 180, -5, math.nan):
        with pytest.raises(RtbenchError, match=r"field of view .* is not allowed"):
            Camera((0, 0, 1), (0, 0, 0), field_of_view=angle)
    camera = Camera((0, 0, 1), (0, 0, 0))
    for size in ((0, 4, 4), (4, -1, 4), (4, 4, 0)):
        with pytest.raises(RtbenchError, match=r"is not allowed \(allowed: 1 or more"):
            primary_rays(camera, *size)
