"""The one door: each file goes to its reader, unknown names are told with the nearest."""

import subprocess
import sys

import pytest

from rtbench import resources
from rtbench.scenes import reading
from rtbench.scenes.model import SceneError, Sphere

NFF = """v from 0 -8 1 at 0 0 1 up 0 0 1 angle 30 hither 0.5 resolution 320 200
f 1 1 1 1 0 1 0 1
s 0 0 0 1
"""
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.delenv("RTBENCH_MODELS", raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_files_go_by_their_suffix(folder):
    (folder / "one.nff").write_text(NFF)
    (folder / "two.NFF").write_text(NFF)
    (folder / "three.obj").write_text(OBJ)
    for name in ("one.nff", "two.NFF"):
        assert isinstance(reading.read(folder / name).objects[0], Sphere)
    assert reading.read("three.obj").objects[0].corners.shape == (1, 3, 3)
    assert reading.read("even:1000").name == "even"


def test_scenes_that_ship(folder, monkeypatch):
    scenes = folder / "configs" / "scenes"
    scenes.mkdir(parents=True)
    for name in ("lamp", "glass"):
        (scenes / f"{name}.toml").write_text("[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\n")
    monkeypatch.setattr(resources, "configs", lambda: folder / "configs")
    assert reading.names() == ["glass", "lamp"]
    (folder / "lamp").mkdir()  # a folder of that name does not stand in the way
    assert reading.read("lamp").source.endswith("lamp.toml")
    with pytest.raises(SceneError, match="unknown scene 'glas'; did you mean 'glass'"):
        reading.read("glas")
    with pytest.raises(SceneError, match="unknown scene 'robot'; did you mean 'robots'"):
        reading.read("robot")


def test_every_scene_that_ships_can_be_read():
    names = reading.names()
    assert names
    for name in names:
        assert reading.read(name).objects, name


def test_absent_files_are_told_with_the_nearest(folder):
    (folder / "balls.nff").write_text(NFF)
    (folder / "notes.txt").write_text("no scene")
    for name in ("bals.nff", folder / "bals.nff"):
        with pytest.raises(SceneError, match=r"no such file; did you mean '.*balls\.nff'") as found:
            reading.read(name)
        assert "\n" not in str(found.value) and "notes" not in str(found.value)
    with pytest.raises(SceneError, match=r"scene 'no/where\.toml': there is no such file$"):
        reading.read("no/where.toml")


def test_what_is_no_scene_is_refused(folder):
    (folder / "picture.jpg").write_bytes(b"\xff\xd8\xff")
    (folder / "bare").write_text(NFF)
    (folder / "sub.nff").mkdir()
    with pytest.raises(SceneError, match=r"unknown scene format 'jpg'.*nff.*toml"):
        reading.read("picture.jpg")
    with pytest.raises(SceneError, match="unknown scene format ''"):
        reading.read("bare")
    with pytest.raises(SceneError, match=r"scene 'sub\.nff' is a folder"):
        reading.read("sub.nff")
    with pytest.raises(SceneError, match="model 'even' of 10 triangles is not to be had"):
        reading.read("even:10")


def test_reading_needs_no_compiler():
    code = (
        "import sys; from rtbench.scenes import reading, nff, polygons\n"
        "assert not {'numba', 'trimesh', 'pandas', 'PIL'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
