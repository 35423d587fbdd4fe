"""Lens, shutter, pixel and rough mirrors: how far they spread light, by hand."""

from __future__ import annotations

from math import atan, pi, radians, sqrt, tan

import numpy as np
import pytest
from tiny_scenes import EXACT, glowing, made, rectangle, renderer

from rtbench.scenes.model import BLACK, WHITE, Camera, Disc, Material, Sphere

EFFECTS = ("reflection", "glossy", "depth_of_field", "motion_blur", "antialiasing")
KINDS = ("triangles", "spheres", "discs", "motion")
BRIGHT = glowing(1.0)
BOTH = pytest.mark.parametrize(
    "precision", ["float64", pytest.param("float32", marks=pytest.mark.full)]
)


def picture(objects, camera, samples, precision="float64", materials=(BRIGHT,), **more):
    scene = made(objects, materials, camera, samples=samples, **more)
    return renderer(scene, EFFECTS, KINDS, precision).render().pixels[..., 0].astype(np.float64)


def pixels_in(camera: Camera, distance: float) -> float:
    """Return how many pixels a length of 1 is at a distance."""
    return camera.height / (2 * distance * tan(radians(camera.angle / 2)))


@BOTH
@pytest.mark.parametrize("z", [2.0, 3.0, 4.0, 6.0, 12.0])
def test_circle_of_confusion(precision, z):
    """A small disc at z spreads, where all is sharp, over 2 R |1 - focus / z| and its own image."""
    lens, focus, radius = 0.1, 4.0, 0.01
    camera = Camera(
        (0, 0, 0), (0, 0, -1), angle=10.0, width=41, height=41, lens_radius=lens, focus=focus
    )
    found = picture(
        [Disc(center=(0, 0, -z), normal=(0, 0, 1), radius=radius)], camera, 400, precision
    )
    scale = pixels_in(camera, focus)
    blur, own = lens * abs(1 - focus / z) * scale, radius * focus / z * scale
    y, x = np.nonzero(found)
    away = np.hypot(x - 20, y - 20)
    assert away.max() <= blur + own + sqrt(0.5)
    assert away.max() >= blur + own - 1.5
    assert found.sum() == pytest.approx(pi * own**2, rel=0.06)  # no light is lost
    if blur > 3 * own:
        # Even over the circle: as much inside as the share of its area.
        yy, xx = np.mgrid[:41, :41] - 20
        half = found[np.hypot(xx, yy) <= 0.5 * blur].sum() / found.sum()
        share = (np.hypot(xx, yy) <= 0.5 * blur).sum() / (pi * blur**2)
        assert half == pytest.approx(share, rel=0.12)
    if z == focus:
        assert found[20, 20] > 0.9


def test_the_focus_is_a_plane_and_not_a_sphere():
    """Far from the axis a thing is sharp at the same distance along the view, not along the ray."""
    camera = Camera(
        (0, 0, 0), (0, 0, -1), angle=60.0, width=64, height=64, lens_radius=0.5, focus=4.0
    )
    wall = rectangle((3, 0, -4.0), (2, 0, 0), (0, 4, 0))  # from x = 1 on
    found = picture([wall], camera, 16)
    edge = 32 + 1.0 * pixels_in(camera, 4.0)
    column = np.arange(64)
    assert (found[:, column + 1 <= edge] == 0).all()
    assert (found[4:60, (column >= edge)] == 1).all()


@BOTH
def test_motion_blur_is_as_long_as_the_way(precision):
    """A square of width w that moves by d: brightness w / d, rising and falling over w."""
    camera = Camera((0, 0, 8), (0, 0, 0), angle=45.0, width=64, height=16)
    scale = pixels_in(camera, 8.0)
    w, d = 8 / scale, 24 / scale  # in pixels: 8 and 24
    still = rectangle((-12 / scale, 0, 0), (w / 2, 0, 0), (0, 9, 0))
    moving = rectangle((-12 / scale, 0, 0), (w / 2, 0, 0), (0, 9, 0), velocity=(d, 0, 0))
    at = picture([still], camera, 256, precision)
    blurred = picture([moving], camera, 256, precision)
    x = np.arange(64) + 0.5
    assert at.mean(axis=0) == pytest.approx(np.where(abs(x - 20) < 4, 1.0, 0.0), abs=1e-9)
    begin, end = 16.0, 48.0
    expected = np.clip(np.minimum(x - begin, end - x) / 24, 0, 8 / 24)
    assert blurred == pytest.approx(np.tile(expected, (16, 1)), abs=4 / 256)
    assert blurred.sum() == pytest.approx(at.sum(), rel=2e-3)


def test_every_part_of_the_shutters_time_counts():
    """What passes a pixel for 1 / 16 of the time is seen by 1 in 16 rays, whichever part it is."""
    camera = Camera((0, 0, 8), (0, 0, 0), angle=1e-3, width=8, height=8)
    for part in range(16):
        # As wide as 1 / 16 of its way, it comes to the middle at part / 16.
        stripe = rectangle((-1 - 2 * part, 0, 0), (1, 0, 0), (0, 9, 0), velocity=(32, 0, 0))
        found = picture([stripe], camera, 16)
        np.testing.assert_allclose(found, 1 / 16, atol=1 / 16 if part == 0 else 1e-9)


def test_a_ball_that_moves_towards_the_camera_grows():
    """The share of the shutter's time in which it covers a place is that after it came so near."""
    camera = Camera((0, 0, 10), (0, 0, 0), angle=20.0, width=33, height=33)
    found = picture([Sphere(radius=0.5, velocity=(0, 0, 5))], camera, 256)
    # At distance D it covers all within asin(r / D) of the axis.
    x = (np.arange(33) - 16) / 33 * 2 * tan(radians(10))
    distance = 0.5 / np.sin(np.arctan(np.maximum(abs(x), 1e-9)))
    expected = (np.clip(distance, 5, 10) - 5) / 5
    np.testing.assert_allclose(found[16], expected, atol=0.06)


@BOTH
def test_a_pixel_is_as_bright_as_the_part_that_is_covered(precision):
    """Edges at any place: what of each pixel lies beyond it, but for the cell that it cuts."""
    camera = Camera((0, 0, 8), (0, 0, 0), angle=45.0, width=16, height=16)
    scale = pixels_in(camera, 8.0)
    for place in (0.1, 0.25, 0.7):
        wall = rectangle(((3 + place) / scale + 50, 0, 0), (50, 0, 0), (0, 50, 0))
        found = picture([wall], camera, 64, precision)
        assert not found[:, :11].any() and (found[:, 12:] == 1).all()
        np.testing.assert_allclose(found[:, 11], 1 - place, atol=1 / 8)
        assert found[:, 11].mean() == pytest.approx(1 - place, abs=0.02)


@BOTH
@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.5, 1.0])
def test_a_rough_mirror_in_a_white_world_is_white(precision, roughness):
    mirror = Material(diffuse=BLACK, reflection=WHITE, roughness=roughness)
    camera = Camera((0, 0, 5), angle=30.0, width=16, height=16)
    for thing in (Sphere(), Disc(normal=(0.7, 0, 0.7), radius=3.0)):
        found = picture([thing], camera, 16, precision, [mirror], background=WHITE)
        np.testing.assert_allclose(found, 1.0, atol=EXACT[precision])


@pytest.mark.parametrize("roughness", [0.05, 0.2, 0.5])
@BOTH
def test_the_lobe_of_a_rough_mirror(precision, roughness):
    """Seen from above, what of a lamp is mirrored is how many facets lean by half its angle.

    GGX: of the facets as seen from above, tan^2 t / (alpha^2 + tan^2 t) lean by up to t. What would
    go below the surface is turned back up.
    """
    mirror = Material(diffuse=BLACK, reflection=WHITE, roughness=roughness)
    camera = Camera((0, 1, 0), (0, 0, 0), (0, 0, 1), angle=1e-3, width=32, height=32)

    def leaning(angle):
        return tan(angle) ** 2 / (roughness**2 + tan(angle) ** 2)

    for radius in (0.5, 2.0, 6.0):
        floor = Disc(material=0, center=(0, 0, 0), normal=(0, 1, 0), radius=10.0)
        lamp = Disc(material=1, center=(0, 3, 0), normal=(0, 1, 0), radius=radius)
        found = picture([floor, lamp], camera, 16, precision, [mirror, BRIGHT])
        half = atan(radius / 3) / 2
        expected = leaning(half) + 1 - leaning(pi / 2 - half)
        spread = sqrt(expected * (1 - expected) / (found.size * 16))
        assert abs(found.mean() - expected) < 4 * spread
