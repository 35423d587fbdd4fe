"""Meshes as scenes: all in view, lit so that shadows fall, nothing copied."""

import numpy as np
import pytest

from rtbench.scenes import mesh_scene
from rtbench.scenes.mesh_scene import camera_of, read
from rtbench.scenes.model import SceneError
from rtbench.workloads.meshes import Mesh
from rtbench.workloads.solids import cube, icosphere

BOX = """OFF
8 6 0
0 0 0
4 0 0
4 2 0
0 2 0
0 0 1
4 0 1
4 2 1
0 2 1
4 0 3 2 1
4 4 5 6 7
4 0 1 5 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
"""


@pytest.fixture
def box(tmp_path):
    path = tmp_path / "box.off"
    path.write_text(BOX)
    return path


def seen(camera, points):
    """Where points are in the picture: -1 to 1 across, -1 to 1 up, and how deep."""
    right, up, forward = camera.axes
    away = np.asarray(points) - camera.position
    half = np.tan(np.radians(camera.angle) / 2)
    depth = away @ forward
    return (
        away @ right / depth / half * camera.height / camera.width,
        away @ up / depth / half,
        depth,
    )


def test_a_mesh_file_is_framed_and_lit(box):
    found = read(box)
    (shape,) = found.objects
    assert found.name == "box" and found.source == str(box) and not found.remarks
    assert shape.corners.shape == (12, 3, 3) and shape.normals is None
    x, y, depth = seen(found.camera, shape.corners.reshape(-1, 3))
    assert (depth > 0).all() and (np.abs(x) <= 1).all() and (np.abs(y) <= 1).all()
    # It fills the picture one way or the other.
    assert max(np.ptp(x), np.ptp(y)) > 1.6
    (light,) = found.lights
    right, up, _ = found.camera.axes
    way = np.subtract(light.position, found.camera.position)
    # Above and beside, no further away than the mesh: 20 to 60 degrees off the view.
    middle = shape.corners.mean(axis=(0, 1))
    to_light, to_eye = light.position - middle, found.camera.position - middle
    cosine = to_light @ to_eye / np.linalg.norm(to_light) / np.linalg.norm(to_eye)
    assert way @ up > 0 and abs(way @ right) > 0 and 20 < np.degrees(np.arccos(cosine)) < 60
    (grey,) = found.materials
    assert len({*grey.diffuse}) == 1 and not grey.reflects and not grey.transmits
    assert found.background[2] > found.background[0] > 0


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("shape", [cube, icosphere])
def test_all_of_a_mesh_is_in_view_at_any_scale(shape, scale):
    mesh = shape().scaled(scale).moved((100 * scale, 0, -30 * scale))
    x, y, depth = seen(camera_of(mesh), mesh.vertices)
    assert (depth > 0).all() and np.abs([x, y]).max() <= 1


def test_the_mesh_is_in_memory_once(monkeypatch):
    mesh = icosphere(2)
    monkeypatch.setattr(mesh_scene, "_found", lambda text, models: mesh)
    assert read("mine").objects[0].corners is mesh.triangles


def test_a_known_camera_stands_where_it_is_said_to():
    """The Cornell box: photographed from (278, 273, -800), 39 degrees across."""
    mesh = Mesh("cornell_box", cube().vertices * 550, cube().faces, np.zeros(3))
    camera = camera_of(mesh)
    assert camera.position == (278, 273, -800) and camera.angle == 39
    assert camera.width == camera.height


def test_in_a_room_the_light_is_inside():
    room = Mesh("sponza", cube().vertices * (20, 4, 8), cube().faces, np.zeros(3))
    camera = camera_of(room)
    lower, upper = room.vertices.min(axis=0), room.vertices.max(axis=0)
    light = mesh_scene._light(camera, room)
    for point in (camera.position, light):
        assert (lower < point).all() and (point < upper).all()
    # Beside the camera: no wall of a yard within the building is between them.
    assert 0.1 < np.linalg.norm(np.subtract(light, camera.position)) < (upper - lower).min() / 4


def test_generated_models_and_those_of_a_folder(box, tmp_path, monkeypatch):
    monkeypatch.delenv("RTBENCH_MODELS", raising=False)
    assert len(read("even:2000").objects[0].corners) == 2000
    import trimesh

    trimesh.load_mesh(box).export(tmp_path / "brick.ply")
    assert len(read("brick", tmp_path).objects[0].corners) == 12
    assert len(read("even:1000", tmp_path).objects[0].corners) == 1000
    with pytest.raises(SceneError, match="unknown model 'brik'; did you mean 'brick'"):
        read("brik", tmp_path)
    monkeypatch.setenv("RTBENCH_MODELS", str(tmp_path))
    assert read("brick").name == "brick"


def test_what_is_left_out_of_a_mesh_is_remarked(tmp_path):
    path = tmp_path / "bad.off"
    path.write_text("OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\nnan 0 0\n3 0 1 2\n3 0 1 3\n3 0 1 1\n")
    found = read(path)
    assert len(found.objects[0].corners) == 1
    (remark,) = found.remarks
    assert "2 of 3 triangles dropped" in remark and "not finite" in remark and "no area" in remark


def test_meshes_that_cannot_be_scenes_are_told_in_a_line(tmp_path):
    huge = tmp_path / "huge.off"
    huge.write_text("OFF\n3 1 0\n0 0 0\n1e30 0 0\n0 1e30 0\n3 0 1 2\n")
    cut_off = tmp_path / "cut.ply"
    cut_off.write_text("ply\nformat ascii 1.0\n")
    for path, why in ((huge, "is not allowed|not all finite"), (cut_off, "damaged|no triangles")):
        with pytest.raises(SceneError, match=why) as found:
            read(path)
        assert found.value.key == "scene" and "\n" not in str(found.value)
        assert path.name in str(found.value)
