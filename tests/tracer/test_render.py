"""Pictures: the same to the last bit whatever only costs time; counters; the smallest scenes."""

import dataclasses

import numpy as np
import pytest
from tracer_scenes import FORCED, KINDS, WHITE, lit_at_the_eye, many, mesh, options, picture

from rtbench.compiled import instantiate
from rtbench.compiled.machine_code import instructions
from rtbench.errors import RtbenchError
from rtbench.scenes.model import (
    Camera,
    Light,
    Material,
    Plane,
    Scene,
    Settings,
    Sphere,
    Triangles,
)
from rtbench.tracer import render as rendering
from rtbench.tracer.effects import EFFECTS
from rtbench.tracer.options import Options
from rtbench.tracer.render import Renderer, render


def assert_same(one, other):
    np.testing.assert_array_equal(one.pixels, other.pixels)
    assert one.rays == other.rays and one.saved == other.saved


def glassy():
    """Return many objects, of which some mirror and some are of glass."""
    scene = many()
    materials = list(scene.materials)
    for i in range(0, len(materials), 3):
        materials[i] = Material(reflection=(0.5, 0.4, 0.3), diffuse=(0.3, 0.2, 0.6))
    for i in range(1, len(materials), 3):
        materials[i] = Material(transmission=(0.9, 0.8, 0.7), index=1.5, fresnel=True)
    return dataclasses.replace(scene, materials=tuple(materials), background=(0.2, 0.3, 0.4))


def test_threads_and_their_order_change_nothing():
    made = Renderer(glassy(), options())
    first = made.render()
    assert first.rays["reflection"] > 100 and first.rays["refraction"] > 100
    for threads in (1, 2, 5):
        assert_same(made.render(threads=threads), first)


def test_the_size_of_tiles_changes_nothing(monkeypatch):
    made = Renderer(glassy(), options())
    first = made.render()
    for tile in (1, 7, 16, 1000):
        monkeypatch.setattr(rendering, "TILE", tile)
        assert_same(made.render(), first)


def test_what_compiles_nothing(monkeypatch):
    """Another camera, light, colour, place or number of objects: no module but those there are."""
    made = Renderer(many(), options())
    made.render()
    before = set(made.instance.path.parent.iterdir())
    asked, load = [made.instance.path], instantiate.load

    def watched(path, entry):
        asked.append(path)
        return load(path, entry)

    monkeypatch.setattr(instantiate, "load", watched)
    scene = many()
    turned = dataclasses.replace(scene.camera, position=(3, 2, -1), width=31, height=47, angle=80)
    assert made.render(turned).pixels.shape == (47, 31, 3)
    changed = [
        dataclasses.replace(scene, camera=turned),
        dataclasses.replace(scene, lights=(Light(color=(1, 0, 2), position=(0, 9, 0)),)),
        dataclasses.replace(scene, materials=tuple(WHITE for _ in scene.materials)),
        dataclasses.replace(scene, background=(0.5, 0, 0), ambient=(0, 0, 0)),
        many(moved=(3.0, 1.0, 2.0)),
        many(seed=6, triangles=90, shapes=3),
        dataclasses.replace(glassy(), settings=Settings(depth=2, threshold=0.1)),
    ]
    for each in changed:
        other = Renderer(each, options())
        assert other.instance.path == made.instance.path
        other.render()
    assert set(asked) <= before


def test_arrays_are_counted_by_the_entry_alone():
    """What it calls takes references to none: counting them costs more than what is computed."""
    entry, *callees = [], []
    for line in instructions(Renderer(many(), options()).instance.assembly):
        if line.endswith(":") and "CPI" not in line and not line.startswith(".L"):
            callees.append([])
        callees[-1].append(line)
    _, entry, *callees = callees
    assert callees and sum(map(len, callees)) > 500
    assert not any("NRT" in line for callee in callees for line in callee)
    # The entry counts what it keeps once, before its loop over pixels.
    labels = [i for i, line in enumerate(entry) if line.startswith(".L")]
    increments = [i for i, line in enumerate(entry) if "NRT_incref" in line]
    assert all(i < labels[0] for i in increments)


def test_a_moved_camera_is_the_scene_with_that_camera():
    scene = glassy()
    turned = dataclasses.replace(scene.camera, position=(-2, 1, 3), angle=70)
    moved = Renderer(scene, options()).render(turned)
    assert_same(moved, picture(dataclasses.replace(scene, camera=turned)))


def test_counters_by_hand():
    """A wall before three lights: one shines, one stands behind it, one is black."""
    wall = Triangles(corners=np.array([[[-9.0, -9, 0], [9, -9, 0], [0, 18, 0]]]))
    lights = (
        Light(position=(0, 0, 4)),
        Light(position=(0, 0, -4)),
        Light(position=(1, 0, 4), color=(0, 0, 0)),
        Light(position=(2, 0, 4), shadows=False),
    )
    scene = Scene(
        "wall", Camera((0, 0, 5), (0, 0, 0), (0, 1, 0), 20, 37, 11), lights, (WHITE,), (wall,)
    )
    pixels = 37 * 11
    for precision in ("float32", "float64"):
        shown = picture(scene, precision)
        assert shown.rays == {
            "primary": pixels,
            "shadow": pixels,
            "reflection": 0,
            "refraction": 0,
            "indirect": 0,
        }
        assert shown.saved == {
            "light_behind": pixels,
            "no_contribution": pixels,
            "below_threshold": 0,
            "depth": 0,
            "interpolated": 0,
        }
        # Two lights at a height of 4 over the wall's middle and 2 beside it, by their cosines.
        x = ((np.arange(37) + 0.5) * 2 - 37) / 11 * 5 * np.tan(np.radians(10))
        y = (1 - (np.arange(11) + 0.5) * 2 / 11) * 5 * np.tan(np.radians(10))
        away = x[None] ** 2 + y[:, None] ** 2
        beside = (x[None] - 2) ** 2 + y[:, None] ** 2
        expected = 4 / np.sqrt(16 + away) + 4 / np.sqrt(16 + beside)
        np.testing.assert_allclose(
            shown.pixels[..., 0], expected, rtol=50 * np.finfo(precision).eps
        )


def test_depth_and_threshold_by_hand():
    """Between two mirrors of 1/2 a ray is worth 1/2^k: so many are shot, and one is saved."""
    mirrors = tuple(Plane(point=(0, 0, z), normal=(0, 0, 1)) for z in (-1, 1))
    half = Material(diffuse=(0, 0, 0), reflection=(0.5, 0.5, 0.5), emission=(1, 1, 1))
    scene = Scene(
        "mirrors",
        Camera((0, 0, 0), (0, 0, 1), (0, 1, 0), 10, 5, 3),
        (),
        (half,),
        (*mirrors, Triangles(corners=np.zeros((1, 3, 3)))),
        settings=Settings(depth=6, threshold=0.0),
    )
    for depth in (0, 1, 6):
        shown = picture(scene, depth=depth)
        assert shown.rays["primary"] == 15 and shown.rays["reflection"] == 15 * depth
        assert shown.saved["depth"] == 15 and shown.saved["below_threshold"] == 0
        assert (shown.pixels == 2 - 0.5**depth).all()
    # 1/16 is not above the threshold: three rays.
    shown = picture(scene, threshold=1 / 16)
    assert shown.rays["reflection"] == 45
    assert shown.saved["below_threshold"] == 15 and shown.saved["depth"] == 0


EMPTY = Scene("empty", Camera(width=5, height=4), background=(0.25, 0.5, 1))


@pytest.mark.parametrize(
    "objects",
    [
        (),
        (Triangles(),),
        (Plane(point=(0, -1, 0)),),
        (Triangles(), Plane(point=(0, -1, 0)), Plane(point=(0, -2, 0))),
        (Triangles(corners=np.zeros((4, 3, 3))),),
        (Triangles(), Sphere(center=(0, -50, 0), radius=40)),
    ],
)
@pytest.mark.parametrize("lights", [(), (Light(position=(0, 3, 0)),)])
def test_scenes_of_next_to_nothing(objects, lights):
    """Of one compiled tracer, but for leaves without triangles; above the horizon is background."""
    scene = dataclasses.replace(EMPTY, objects=objects, lights=lights)
    held = any(isinstance(each, Triangles) and len(each.corners) for each in objects)
    shown = picture(scene, force=FORCED if held else ("shadows",))
    assert shown.rays["primary"] == 20
    assert (shown.pixels[0] == (0.25, 0.5, 1)).all()
    assert np.isfinite(shown.pixels).all()


@pytest.mark.parametrize(("width", "height"), [(1, 1), (33, 1), (1, 65), (31, 33)])
def test_odd_sizes(width, height):
    """All pixels are written, whatever the tiles: inside a ball that shines, all of one colour."""
    ball = (Sphere(radius=3.0), Triangles(corners=np.zeros((1, 3, 3))))
    scene = Scene(
        "ball",
        Camera((0, 0, 1), (0, 0, 0), (0, 1, 0), 90, width, height),
        (),
        (Material(emission=(0.5, 0.25, 1)),),
        ball,
    )
    shown = picture(scene, threads=2)
    assert shown.pixels.shape == (height, width, 3)
    assert (shown.pixels == (0.5, 0.25, 1)).all()
    assert shown.rays["primary"] == width * height


@pytest.mark.full
@pytest.mark.parametrize(
    ("effect", "precision"),
    [*((each, "float64") for each in EFFECTS), ("all", "float64"), ("all", "float32")],
)
def test_forced_effects_change_nothing(effect, precision):
    """An effect that a scene does not call for, compiled in, leaves every bit as it is."""
    force = tuple(EFFECTS) if effect == "all" else (effect,)
    kinds = KINDS if effect == "all" else ()
    for scene in (many(), glassy()):
        plain = render(scene, Options(precision=precision))
        forced = render(scene, Options(precision=precision, force=force, kinds=kinds))
        assert all(forced.effects[each] for each in force)
        np.testing.assert_array_equal(forced.pixels, plain.pixels)
        if effect != "all":
            assert forced.rays == plain.rays and forced.saved == plain.saved


@pytest.mark.full
def test_motion_compiled_in_changes_nothing():
    for scene in (many(), glassy()):
        plain = render(scene)
        assert_same(render(scene, Options(kinds=("motion",))), plain)


def test_what_is_refused_is_refused_in_a_line():
    for given in (
        {"precision": "float16"},
        {"kinds": ("torus",)},
    ):
        with pytest.raises(RtbenchError) as told:
            Options(**given)
        assert "\n" not in str(told.value)
    scene = lit_at_the_eye((mesh("cube"),), (2, 2, 2), (0, 0, 0), size=4)
    for given in (
        {"kernel": "no_such_kernel"},
        {"structure": "octree"},
        {"force": ("shadow",)},
        {"force": FORCED, "without": FORCED},
        {"samples": 3},
        {"depth": -1},
    ):
        with pytest.raises(RtbenchError) as told:
            Renderer(scene, Options(**given))
        assert "\n" not in str(told.value)
