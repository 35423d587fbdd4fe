"""The camera's way round, crowds, and frames told from seconds that are known."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.scenes.model import Camera, Light, Material, Scene, Settings, Sphere, Triangles
from rtbench.tracer import orbit
from rtbench.tracer.options import Options, Subsampling

TRIANGLE = Triangles(corners=np.eye(3)[None])
LIT = (Light(position=(0.0, 5.0, 0.0)),)


def scene(*objects, **more):
    return Scene("small", Camera(width=8, height=6), LIT, (Material(),), objects, **more)


def test_a_turn_in_four_is_a_square():
    """By hand: quarter turns about the y axis, counter-clockwise seen from above."""
    camera = Camera(position=(0.0, 2.0, 5.0), target=(0.0, 1.0, 0.0))
    turn = orbit.around(camera, 4)
    assert turn[0] is camera
    places = np.array([one.position for one in turn])
    want = [(0, 2, 5), (5, 2, 0), (0, 2, -5), (-5, 2, 0)]
    np.testing.assert_allclose(places, want, atol=1e-15 * 8)
    assert {one.target for one in turn} == {camera.target}


def test_height_and_distance_stay_about_any_axis():
    up = np.array([0.2, -0.4, 1.0])
    camera = Camera(position=(3.0, -2.0, 7.0), target=(1.0, 1.0, 1.0), up=tuple(up))
    turn = orbit.around(camera, 7)
    arms = np.array([one.position for one in turn]) - camera.target
    np.testing.assert_allclose(arms @ up, arms[0] @ up, rtol=1e-13)
    np.testing.assert_allclose([one.distance for one in turn], camera.distance, rtol=1e-13)
    # Equal steps, and the last view is one step before the first.
    steps = np.linalg.norm(np.diff(arms, axis=0, append=arms[:1]), axis=1)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-12)
    height = (arms[0] @ up) / np.linalg.norm(up)
    radius = math.sqrt(camera.distance**2 - height**2)
    assert steps[0] == pytest.approx(2 * radius * math.sin(math.pi / 7))


@pytest.mark.parametrize("count", [1, 2, 7, 100])
def test_a_crowd_has_so_many_objects_in_the_same_space(count):
    crowd = orbit.crowd(count, 40, 30)
    spheres = [each for each in crowd.objects if isinstance(each, Sphere)]
    assert len(crowd.objects) == count and len(spheres) == math.ceil(count / 2)
    assert (crowd.camera.width, crowd.camera.height) == (40, 30)
    # Were all spheres, their volumes would add up to the same part of the unit cube.
    volume = count * 4 / 3 * math.pi * spheres[0].radius ** 3
    assert volume == pytest.approx(orbit.FILLED)
    assert np.abs([each.center for each in spheres]).max() <= 0.5


def test_the_first_of_a_large_crowd_are_those_of_a_small_one():
    small, large = orbit.crowd(5), orbit.crowd(50)
    for one, other in zip(small.objects, large.objects, strict=False):
        assert type(one) is type(other) and one.material == other.material
        if isinstance(one, Sphere):
            assert one.center == other.center and one.radius > other.radius


@pytest.mark.parametrize("count", [0, -1, orbit.MOST_OBJECTS + 1])
def test_a_crowd_of_none_is_refused(count):
    with pytest.raises(RtbenchError, match=f"objects {count} is not allowed"):
        orbit.crowd(count)


def test_variants_cross_everything_and_begin_with_every_pixel_shaded():
    finer = Subsampling(grid=(8, 8))
    found = orbit.variants(scene(TRIANGLE), Options(subsampling=finer, depth=3), ("a", "b"))
    told = [(one.kernel, one.subsampling, one.shading) for one in found]
    assert told[0] == ("a", False, True)
    assert sorted(told) == [(k, s, d) for k in "ab" for s in (False, True) for d in (False, True)]
    for one in found:
        assert one.options.kernel == one.kernel
        assert one.options.subsampling == (finer if one.subsampling else None)
        assert one.options.depth == (3 if one.shading else 0)


def test_without_shading_no_effect_is_left():
    mirror = Material(reflection=(0.5, 0.5, 0.5), specular=(1.0, 1.0, 1.0))
    two = (Sphere(), Sphere(center=(0.0, 3.0, 0.0)))
    shiny = Scene("shiny", Camera(), LIT, (mirror,), two, settings=Settings(samples=4, depth=2))
    shaded, plain = orbit.variants(shiny, Options(without=("specular",)), ("a",))[:2]
    assert shaded.options.without == ("specular",)
    assert set(plain.options.without) >= {"shadows", "reflection", "specular", "antialiasing"}
    assert (plain.options.depth, plain.options.samples) == (0, 1)


def test_where_no_triangle_is_kernels_do_not_differ():
    found = orbit.variants(scene(Sphere()), Options(), ("watertight_safe", "moller1"))
    assert len(found) == 4 and {one.kernel for one in found} == {""}
    assert {one.options.kernel for one in found} == {"watertight_safe"}


def test_rates_are_of_the_frames_seconds():
    one = orbit.Variant(scene(TRIANGLE), "a", True, True, Options())
    seconds = np.array([0.01, 0.02, 0.04, 0.05, 0.1])
    told = orbit.row(one, seconds, 41.6, 2 * seconds)
    assert (told["fps"], told["fps_least"]) == (pytest.approx(25), pytest.approx(10))
    # 2.5 % of the way through 4 gaps is 0.1 of the first and of the last gap.
    assert told["fps_high"] == pytest.approx(1 / 0.011)
    assert told["fps_low"] == pytest.approx(1 / 0.095)
    assert (told["frame_ms"], told["speedup"]) == (pytest.approx(40), pytest.approx(2))
    assert (told["rays"], told["frames"], told["objects"]) == (42, 5, 1)


@pytest.fixture
def clockwork(monkeypatch):
    """Renderers whose frames take seconds that are known: and who was asked when."""
    asked = []

    class Clockwork:
        def __init__(self, scene, options):
            self.cost = (2.0 if options.depth is None else 1.0) + 10 * (options.kernel == "b")
            self.name = options.kernel, options.subsampling is not None, options.depth is None
            self.scene = scene

        def render(self, camera=None, threads=1, progress=None):
            asked.append((self.scene.name, self.name, camera.position, threads))
            return SimpleNamespace(rays={"primary": 3, "shadow": 4}, cost=self.cost)

    def stopwatch(call):
        picture = call()
        return picture, picture.cost

    monkeypatch.setattr(orbit, "stopwatch", stopwatch)
    return Clockwork, asked


def test_variants_take_turns_frame_by_frame(clockwork):
    make, asked = clockwork
    fractions, ready = [], []
    two = scene(TRIANGLE), orbit.crowd(4)
    rows = orbit.orbit(
        two,
        Options(),
        ("a", "b"),
        frames=3,
        threads=2,
        progress=fractions.append,
        prepared=ready.append,
        make=make,
    )
    assert len(rows) == 16 and {row["scene"] for row in rows} == {"small", "crowd of 4"}
    first, timed = asked[:16], asked[16:]
    assert len(timed) == 3 * 16 and {one[3] for one in asked} == {2}
    assert {place for _, _, place, _ in first} == {one.camera.position for one in two}
    for frame in range(3):
        together = timed[16 * frame : 16 * (frame + 1)]
        # All of them, in the same order, but another begins each time; one view a scene.
        assert together[0][:2] == first[frame][:2]
        turned = [one[:2] for one in together]
        assert turned == [one[:2] for one in first[frame:] + first[:frame]]
        assert len({(name, place) for name, _, place, _ in together}) == 2
    assert fractions == sorted(fractions) and (fractions[-1], ready[-1]) == (1, 1)
    by = {(r["scene"], r["kernel"], r["subsampling"], r["shading"]): r for r in rows}
    assert by["small", "a", False, True]["fps"] == pytest.approx(0.5)
    assert by["small", "a", False, True]["speedup"] == 1
    assert by["small", "a", True, False]["speedup"] == pytest.approx(2)
    assert by["crowd of 4", "b", False, True]["speedup"] == pytest.approx(2 / 12)
    assert {row["rays"] for row in rows} == {7}


@pytest.mark.parametrize("frames", [0, -5, orbit.MOST_FRAMES + 1])
def test_a_turn_without_frames_is_refused(frames, clockwork):
    with pytest.raises(RtbenchError, match=f"frames {frames} is not allowed"):
        orbit.orbit([scene(Sphere())], frames=frames, make=clockwork[0])
    assert clockwork[1] == []
