"""Indirect light against closed forms: furnaces, cavities, form factors; within its own noise."""

from __future__ import annotations

import numpy as np
import pytest
from tiny_scenes import EXACT, glowing, made, renderer

from rtbench.scenes.model import BLACK, WHITE, Camera, Disc, Indirect, Light, Material, Sphere

EFFECTS = ("shadows", "antialiasing", "motion_blur", "indirect")
KINDS = ("spheres", "discs", "motion")
BOTH = pytest.mark.parametrize(
    "precision", ["float64", pytest.param("float32", marks=pytest.mark.full)]
)
INSIDE = Camera((0, 0, 0), (0, 0, -1), angle=40.0, width=16, height=16)
UP = (0.0, 1.0, 0.0)


def picture(
    objects, materials, camera, precision="float64", lights=(), background=BLACK, **indirect
):
    scene = made(
        objects,
        materials,
        camera,
        lights,
        background,
        indirect=Indirect(**({"samples": 64} | indirect)),
    )
    return renderer(scene, EFFECTS, KINDS, precision).render()


def agrees(pixels: np.ndarray, expected, sigmas: float = 4.0, relative: float = 0.02) -> None:
    """Assert that the mean is right within its noise, and the noise small enough to tell.

    Pixels draw their own numbers: their spread tells the error of their mean.
    """
    values = pixels.reshape(-1, pixels.shape[-1]).astype(np.float64)
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    expected = np.broadcast_to(expected, values.shape[1:])
    assert (error < relative * expected).all()
    assert (abs(values.mean(axis=0) - expected) <= sigmas * error + 1e-5 * expected).all()


@BOTH
@pytest.mark.parametrize("albedo", [1.0, 0.5])
def test_furnace(precision, albedo):
    """A ball in a world of light 1 sends back its albedo, everywhere: in albedo 1 it vanishes."""
    camera = Camera((0, 0, 5), angle=10.0, width=16, height=16)
    ball = Material(diffuse=(albedo,) * 3)
    found = picture([Sphere()], [ball], camera, precision, background=WHITE, samples=16)
    np.testing.assert_allclose(found.pixels, albedo, atol=EXACT[precision])


def test_a_white_world_of_hollows_is_white():
    """Where nothing is absorbed, balls on a floor vanish too, but for paths that are cut off."""
    things = [
        Disc(center=(0, 0, 0), normal=UP, radius=5.0),
        Sphere(center=(0, 1, 0), radius=1.0),
        Sphere(center=(1.6, 0.6, 0.5), radius=0.6),
    ]
    camera = Camera((0, 2, 6), (0, 0.5, 0), angle=30.0, width=16, height=16)
    white = Material(diffuse=WHITE)
    found = picture(things, [white], camera, background=WHITE, depth=64).pixels
    assert found.max() <= 1 + 1e-9
    assert found.min() > 0.95 and found.mean() > 0.9995  # one path of 64 may be cut


@BOTH
@pytest.mark.parametrize("depth", [1, 2, 5, 12])
@pytest.mark.parametrize("albedo", [(0.5, 0.5, 0.5), (0.9, 0.6, 0.1)])
def test_in_a_closed_ball_light_adds_up(precision, depth, albedo):
    """e (1 + a + a^2 ... + a^depth), though roulette ends most paths: it is unbiased."""
    wall = Material(diffuse=albedo, emission=(0.25, 0.5, 1.0))
    found = picture([Sphere(radius=3.0)], [wall], INSIDE, precision, depth=depth)
    a = np.array(albedo)
    series = np.array([0.25, 0.5, 1.0]) * (a[:, None] ** np.arange(depth + 1)).sum(axis=1)
    agrees(found.pixels, series)
    longest = 256 * 64 * depth
    assert found.rays["indirect"] <= longest
    if depth > 2:
        assert found.rays["indirect"] < 0.9 * longest  # roulette did end some


@BOTH
@pytest.mark.parametrize("height", [0.5, 2.0])
def test_light_from_a_lamp_that_is_no_light_source(precision, height):
    """Below a glowing disc: albedo times its form factor, R^2 / (R^2 + h^2)."""
    floor = Disc(material=0, center=(0, 0, 0), normal=UP, radius=1.0)
    lamp = Disc(material=1, center=(0, height, 0), normal=UP, radius=1.0)
    camera = Camera((0, height / 2, 0), (0, 0, 0), (0, 0, 1), angle=0.01, width=32, height=32)
    materials = [Material(diffuse=(0.8, 0.4, 0.2)), glowing(2.0)]
    found = picture([floor, lamp], materials, camera, precision)
    agrees(found.pixels, 2.0 * np.array([0.8, 0.4, 0.2]) / (1 + height**2))


@BOTH
def test_light_by_way_of_a_ceiling(precision):
    """Light from below meets a ceiling; the upper side of a small plate sees what that sends."""
    height, radius, small = 1.0, 2.0, 0.05
    plate = Disc(material=0, center=(0, 0, 0), normal=UP, radius=small)
    ceiling = Disc(material=1, center=(0, height, 0), normal=UP, radius=radius)
    sun = Light("directional", direction=(0, 1, 0), color=(1.0, 0.5, 0.25))
    camera = Camera((0, 0.5, 0), (0, 0, 0), (0, 0, 1), angle=0.01, width=32, height=32)
    materials = [Material(diffuse=(0.5, 0.5, 0.5)), Material(diffuse=(0.8, 0.8, 0.8))]
    found = picture([plate, ceiling], materials, camera, precision, [sun], depth=1)
    # All of the ceiling but the plate's own shadow on it.
    factor = radius**2 / (radius**2 + height**2) - small**2 / (small**2 + height**2)
    agrees(found.pixels, 0.5 * 0.8 * factor * np.array([1.0, 0.5, 0.25]))


def test_noise_target_ends_a_pixel_when_it_is_reached():
    """Fewer paths than allowed, more where light is uneven, and the pixels spread by the target."""
    wall = Material(diffuse=(0.7, 0.7, 0.7), emission=(0.3, 0.3, 0.3))
    objects = [Sphere(radius=3.0)]
    target, most = 0.02, 4096
    found = picture(objects, [wall], INSIDE, samples=most, noise=target)
    paths = found.rays["primary"]
    assert 256 * 16 < paths < 256 * most / 4
    spread = found.pixels[..., 1].std(ddof=1)
    assert 0.5 * target < spread < 1.3 * target
    finer = picture(objects, [wall], INSIDE, samples=most, noise=target / 2)
    assert finer.rays["primary"] == pytest.approx(4 * paths, rel=0.1)  # error as 1 / sqrt(n)
    # Where nothing is left to chance, few paths are enough.
    even = picture(
        [Sphere(center=(0, 0, 50))], [wall], INSIDE, samples=most, noise=target, background=WHITE
    )
    assert 256 * 16 <= even.rays["primary"] <= 256 * (1 / target + 2)


def test_a_pixel_that_ends_early_has_seen_the_whole_shutter_time():
    """A wall that is in view in the second half of the time only, of which few paths are taken."""
    wall = Disc(material=0, center=(0, -30, -5), normal=(0, 0, 1), radius=20.0, velocity=(0, 20, 0))
    found = picture(
        [wall],
        [glowing(1.0)],
        Camera((0, 0, 0), (0, 0, -1), angle=0.01, width=16, height=16),
        samples=4096,
        noise=0.2,
    )
    assert found.rays["primary"] < 256 * 64
    agrees(found.pixels, 0.5)
