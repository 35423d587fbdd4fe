"""The scenes that ship: each is read, and calls for the effects that its first lines name."""

import re

import pytest

from rtbench import resources
from rtbench.scenes.model import Sphere, Triangles
from rtbench.scenes.toml_scene import read

FILES = sorted((resources.configs() / "scenes").glob("*.toml"))


def named(file):
    """The effects that a scene's first lines name, in their order."""
    text = file.read_text(encoding="utf-8")
    assert text.startswith("# ")
    (told,) = re.findall(r"^# Calls for: (.+)$", text, re.MULTILINE)
    return told.split(", ")


def test_there_are_ten():
    assert len(FILES) == 10


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_shipped_scene_is_whole_and_small(file):
    scene = read(file)
    assert scene.name == file.stem and scene.remarks == ()
    assert (scene.camera.width, scene.camera.height) == (400, 300)
    assert 4 <= len(scene.objects) <= 20
    triangles = [each for each in scene.objects if isinstance(each, Triangles)]
    assert sum(len(each.corners) for each in triangles) < 5000


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_shipped_scene_calls_for_what_it_says(file):
    from rtbench.tracer.effects import called_for

    assert named(file) == [key for key, why in called_for(read(file)).items() if why]


def test_together_they_call_for_every_effect_and_no_two_for_the_same():
    from rtbench.tracer.effects import EFFECTS

    sets = [frozenset(named(file)) for file in FILES]
    assert frozenset().union(*sets) == set(EFFECTS)
    assert len(set(sets)) == len(sets)


def test_what_refracts_is_closed_and_faces_outwards():
    """A ray is inside once it has passed a surface from its front: all glass must have a front."""
    import numpy as np

    for file in FILES:
        scene = read(file)
        for number, material in enumerate(scene.materials):
            glass = [each for each in scene.objects if each.material == number]
            if not material.transmits:
                continue
            flat = [each.corners for each in glass if isinstance(each, Triangles)]
            assert len(flat) + sum(isinstance(each, Sphere) for each in glass) == len(glass)
            if flat:
                corners = np.concatenate(flat)
                edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
                there = {tuple(map(tuple, edge)) for edge in edges.tolist()}
                assert len(there) == len(edges)
                assert there == {(b, a) for a, b in there}
                middle = corners.mean(axis=(0, 1))
                assert np.linalg.det(corners - middle).sum() > 0
