"""Mirrors and glass against the laws of optics, worked out by hand, through whole pictures."""

from __future__ import annotations

from math import asin, cos, degrees, hypot, radians, sin, tan

import numpy as np
import pytest
from tiny_scenes import EXACT, RULER, figure, glowing, made, ray, rectangle, renderer, ruler, seen

from rtbench.scenes.model import BLACK, WHITE, Camera, Disc, Light, Material, Sphere, Texture

EFFECTS = ("shadows", "reflection", "refraction", "dispersion", "specular", "texture")
KINDS = ("triangles", "spheres", "discs")
BOTH = pytest.mark.parametrize(
    "precision", ["float64", pytest.param("float32", marks=pytest.mark.full)]
)
SIDE = np.sqrt(3.0) / 2


def glass(index, **more) -> Material:
    return Material(diffuse=BLACK, transmission=WHITE, index=index, **more)


def tracer(objects, materials, precision="float64", **more):
    scene = made(objects, materials, speck=True, depth=more.pop("depth", 12), **more)
    return renderer(scene, EFFECTS, KINDS, precision)


def slab(thick: float) -> list:
    """Return a wide plate from z = 0 down to -thick, of material 0."""
    return [
        rectangle((0, 0, 0), (50, 0, 0), (0, 50, 0)),
        rectangle((0, 0, -thick), (0, 50, 0), (50, 0, 0)),
    ]


@BOTH
@pytest.mark.parametrize("index", [1.33, 1.5, 2.4, 1 / 1.5])
def test_snell_through_a_slab(precision, index):
    """sin(in) = index sin(inside): the ray lands beside where it would, and leaves as it came."""
    thick, below = 2.0, 3.0
    by = tracer(
        [*slab(thick), ruler((0, 0, -thick - below), (20, 0, 0), (0, 20, 0), material=1)],
        [glass(index), RULER],
        precision,
    )
    for angle in (0.0, 10.0, 25.0, 40.0 if index < 1 else 70.0):
        inside = asin(sin(radians(angle)) / index)
        x = thick * tan(inside) + below * tan(radians(angle))
        way = sin(radians(angle)), 0, -cos(radians(angle))
        red, green, blue = seen(by, ray((-4 * way[0], 0, -4 * way[2]), way))
        assert 40 * red - 20 == pytest.approx(x, abs=50 * EXACT[precision])
        assert green == pytest.approx(0.5, abs=EXACT[precision])
        assert blue == 1


@BOTH
def test_a_glass_ball_turns_a_ray_twice(precision):
    """A ray at distance b from the middle is turned by 2 (asin(b / R) - asin(b / n R))."""
    radius, index, far = 1.0, 1.5, -4.0
    by = tracer(
        [
            Sphere(material=0, center=(0, 0, 0), radius=radius),
            ruler((0, 0, far), (20, 0, 0), (0, 20, 0), material=1),
        ],
        [glass(index), RULER],
        precision,
    )
    for b in (0.0, 0.1, 0.5, 0.9):
        before, behind = asin(b / radius), asin(b / (index * radius))
        turned = 2 * (before - behind)
        # Seen from the middle it comes in at the angle `before` from the axis, and its way
        # through the ball spans pi - 2 behind.
        at = before + np.pi - 2 * behind
        x, z = radius * sin(at), radius * cos(at)
        landing = x - (z - far) * tan(turned)
        red, green, _ = seen(by, ray((b, 0, 5), (0, 0, -1)))
        assert 40 * red - 20 == pytest.approx(landing, abs=100 * EXACT[precision])
        assert green == pytest.approx(0.5, abs=EXACT[precision])


def prism(abbe=None, index=1.5, distance=5.0, precision="float64"):
    """Return a tracer of a prism of 60 degrees, its edge on top, before a ruler at x = distance."""
    top, left, right = (0, SIDE, 0), (-0.5, 0, 0), (0.5, 0, 0)

    def at(point, z):
        return point[0], point[1], z

    # Of the ruler, all colours run along its first side.
    rule = Material(ambient=WHITE, diffuse=BLACK, texture=GREY, name="ruler")
    return tracer(
        [
            figure(at(top, -1), at(left, -1), at(left, 1), at(top, 1)),
            figure(at(top, 1), at(right, 1), at(right, -1), at(top, -1)),
            figure(at(left, 1), at(left, -1), at(right, -1), at(right, 1)),
            ruler((distance, 0, 0), (0, 20, 0), (0, 0, 20), material=1),
        ],
        [glass(index, abbe=abbe), rule],
        precision,
    )


GREY = Texture("image", pixels=np.array([[[0] * 3, [1] * 3]] * 2, np.float32))


def through_prism(angle: float, index: float) -> float:
    """Return the angle below the horizontal at which a ray leaves the prism, in radians.

    ``angle``: below the horizontal at which it comes, to the left face; its normal is 30 degrees
    above the horizontal to the left.
    """
    first = asin(sin(radians(30) - angle) / index)  # below the normal's line
    second = asin(index * sin(radians(60) - first))  # at the right face
    return second - radians(30)


def into_prism(angle: float) -> Camera:
    """Return a ray that comes to the middle of the left face."""
    way = np.array([cos(angle), -sin(angle), 0.0])
    return ray(np.array([-0.25, SIDE / 2, 0.0]) - 3 * way, way)


@BOTH
@pytest.mark.parametrize("index", [1.33, 1.5, 1.7])
def test_a_prism_turns_light(precision, index):
    """Two rulers, one behind the other, tell the direction in which the ray leaves."""
    near, far = (prism(None, index, d, precision) for d in (3.0, 5.0))
    least = 2 * asin(index / 2) - radians(60)  # n = sin((A + D) / 2) / sin(A / 2)
    for angle in (-least / 2, -least / 2 - radians(5), -least / 2 + radians(5)):
        y = [40 * seen(by, into_prism(angle))[0] - 20 for by in (near, far)]
        expected = through_prism(angle, index)
        assert (y[0] - y[1]) / 2 == pytest.approx(tan(expected), abs=100 * EXACT[precision])
    assert through_prism(-least / 2, index) == pytest.approx(least / 2)


@pytest.mark.parametrize("abbe", [20.0, 60.0])
def test_a_prism_parts_colours_as_cauchy_says(abbe):
    """Each colour leaves at angles of the indices in its own band, red turned the least."""
    index, angle = 1.5, radians(-20)
    near, far = (prism(abbe, index, d) for d in (3.0, 5.0))
    # n = A + B / wavelength^2 through n_d, with (n_d - 1) / (n_F - n_C) the Abbe number.
    slope = (index - 1) / abbe / (1 / 486.1327**2 - 1 / 656.2725**2)

    def index_at(wavelength):
        return index + slope * (1 / wavelength**2 - 1 / 587.5618**2)

    camera = into_prism(angle)
    wide = Camera(camera.position, camera.target, angle=1e-6, width=16, height=16)
    y = [40 * by.render(wide).pixels.reshape(-1, 3) - 20 for by in (near, far)]
    found = np.arctan((y[0] - y[1]) / 2)
    for k, (low, high) in enumerate([(600, 700), (500, 600), (400, 500)]):
        least, most = (through_prism(angle, index_at(nm)) for nm in (high, low))
        assert least - 1e-6 <= found[:, k].min() and found[:, k].max() <= most + 1e-6
        assert np.ptp(found[:, k]) > 0.9 * (most - least)


def test_without_an_abbe_number_colours_stay_together():
    red, green, blue = seen(prism(None), into_prism(radians(-20)))
    assert red == green == blue


def test_dispersion_leaves_white_white():
    """Glass that parts colours, in a world of one colour: nothing is lost, nothing gained."""
    material = glass(1.5, abbe=20.0, fresnel=True, reflection=WHITE)
    by = tracer([Sphere()], [material], background=WHITE, depth=40)
    camera = Camera((0, 0, 5), angle=20.0, width=16, height=16)
    np.testing.assert_allclose(by.render(camera).pixels, 1.0, atol=1e-3)


def surface(material, precision="float64"):
    """Return a tracer of the boundary z = 0 of something that fills all below it.

    Below is a red wall, above the white of the background.
    """
    below = Disc(material=1, center=(0, 0, -50), normal=(0, 0, 1), radius=1e5)
    wall = glowing(1.0, 0.0, 0.0)
    return tracer([slab(1)[0], below], [material, wall], precision, background=WHITE)


def at_angle(angle: float, inside=False) -> Camera:
    """Return a ray that meets the boundary at an angle, in degrees, to its normal."""
    way = np.array([sin(radians(angle)), 0.0, cos(radians(angle)) * (1 if inside else -1)])
    return ray(-2 * way, way)


@BOTH
@pytest.mark.parametrize("fresnel", [False, True])
def test_total_reflection_begins_at_the_critical_angle(precision, fresnel):
    """From inside, all is red, the mirrored wall, beyond it; just before, light comes in."""
    index = 1.5
    critical = degrees(asin(1 / index))
    by = surface(glass(index, fresnel=fresnel), precision)
    apart = 0.01 if precision == "float64" else 0.2
    for angle in (critical + apart, 60.0, 85.0):
        assert seen(by, at_angle(angle, inside=True)) == pytest.approx([1, 0, 0], abs=1e-12)
    for angle in (critical - apart, 20.0, 0.0):
        through = 1 - returned(angle, index, 1.0) if fresnel else 1.0
        pixel = seen(by, at_angle(angle, inside=True))
        assert pixel == pytest.approx([through] * 3, abs=30 * EXACT[precision])


def returned(angle: float, before: float, behind: float) -> float:
    """Return Fresnel's reflected share at an angle in degrees, by sines and tangents."""
    if angle == 0:
        return ((before - behind) / (before + behind)) ** 2
    one = radians(angle)
    two = asin(before / behind * sin(one))
    upright = sin(one - two) / sin(one + two)
    parallel = tan(one - two) / tan(one + two)
    return (upright**2 + parallel**2) / 2


@BOTH
@pytest.mark.parametrize("index", [1.33, 1.5, 2.4])
def test_fresnel(precision, index):
    """White is what is mirrored, red what comes through."""
    by = surface(glass(index, reflection=WHITE, fresnel=True), precision)
    for angle in (0.0, 45.0, degrees(np.arctan(index)), 80.0, 89.9):
        share = returned(angle, 1.0, index)
        pixel = seen(by, at_angle(angle))
        assert pixel == pytest.approx([1, share, share], abs=10 * EXACT[precision])
    assert share > 0.98  # near grazing nearly all is mirrored


def test_fresnel_of_glass_by_numbers():
    """4 percent at normal incidence, and at Brewster's angle half of the upright light's share."""
    by = surface(glass(1.5, reflection=WHITE, fresnel=True))
    assert seen(by, at_angle(0.0))[1] == pytest.approx(0.04, abs=1e-12)
    brewster = ((1.5**2 - 1) / (1.5**2 + 1)) ** 2 / 2
    assert seen(by, at_angle(degrees(np.arctan(1.5))))[1] == pytest.approx(brewster, abs=1e-9)


@pytest.mark.parametrize("depth", [1, 2, 3, 6])
def test_a_plate_in_a_white_world_is_white_but_for_what_the_depth_cuts(depth):
    """R + (1 - R)^2 (1 + R + R^2 ...): in generation ``depth`` (1 - R) R^(depth - 1) is left."""
    index = 2.4
    by = tracer(
        slab(1), [glass(index, reflection=WHITE, fresnel=True)], background=WHITE, depth=depth
    )
    for angle in (0.0, 60.0):
        share = returned(angle, 1.0, index)
        lost = (1 - share) * share ** (depth - 1)
        assert seen(by, at_angle(angle)) == pytest.approx([1 - lost] * 3, abs=1e-9)


@BOTH
def test_a_mirror_shows_the_image_behind_it(precision):
    """A mirror at z = 0 against a scene in which all that is before it stands behind it."""
    mirror = Material(diffuse=BLACK, reflection=WHITE)
    ball = Material(ambient=(0.1, 0.0, 0.0), diffuse=(0.7, 0.5, 0.2), specular=(0.3, 0.3, 0.3))

    def before(sign, objects):
        light = Light(position=(5, 4, 3 * sign))
        things = [
            Sphere(material=0, center=(2.0, 0.3, 2.5 * sign), radius=0.8),
            Disc(material=0, center=(2.5, -1.0, 2.0 * sign), normal=(0, 1, 0.2 * sign), radius=2.0),
        ]
        camera = Camera((-4, 0.5, 4), (2.0, 0.0, -2.5), angle=20.0, width=33, height=33)
        return tracer(
            [*things, *objects], [ball, mirror], precision, lights=[light], camera=camera, depth=2
        ).render()

    wall = rectangle((0, 0, 0), (60, 0, 0), (0, 60, 0), material=1)
    pixels, expected = before(1, [wall]).pixels, before(-1, []).pixels
    assert (expected.max(axis=2) > 0.05).mean() > 0.15  # there is something to see
    different = (np.abs(pixels - expected) > 20 * EXACT[precision]).any(axis=2)
    assert different.mean() <= (0 if precision == "float64" else 0.01)


@pytest.mark.parametrize("concave", [True, False])
def test_a_round_mirror_makes_its_image_at_the_mirror_equations_distance(concave):
    """1 / s + 1 / s' = 2 / R: rays near the axis go to, or come from, a place s' away from it."""
    radius, s, far = 2.0, 3.0, 3.5
    centre = radius if concave else -radius
    by = tracer(
        [
            Sphere(material=0, center=(0, 0, centre), radius=radius),
            ruler((0, 0, far), (0.1, 0, 0), (0, 0.1, 0), material=1),
        ],
        [Material(diffuse=BLACK, reflection=WHITE), RULER],
        depth=1,
    )
    image = 1 / ((2 if concave else -2) / radius - 1 / s)
    for angle in (1e-4, 1e-3):
        height = s * angle
        red, green, blue = seen(by, ray((0, 0, s), (angle, 0, -1)))
        assert 0.2 * red - 0.1 == pytest.approx(height * (1 - far / image), rel=2e-5)
        assert green == pytest.approx(0.5) and blue == 1


def test_a_mirror_behind_glass_takes_the_colours_of_both():
    """Through a tinted pane twice: weights multiply."""
    pane = Material(diffuse=BLACK, transmission=(0.5, 1.0, 0.25))
    by = tracer(
        [slab(1)[0], rectangle((0, 0, -1), (50, 0, 0), (0, 50, 0), material=1)],
        [pane, Material(diffuse=BLACK, reflection=(0.5, 0.5, 1.0))],
        background=(1.0, 0.5, 1.0),
    )
    assert seen(by, at_angle(30.0)) == pytest.approx([0.125, 0.25, 0.0625], abs=1e-15)


def test_light_through_glass_is_dimmed_without_bending():
    """A shadow ray keeps its way, times the transmission of each surface in it."""
    pane = Material(diffuse=BLACK, transmission=(0.5, 1.0, 0.25), index=1.5)
    floor = Material(diffuse=WHITE)
    way = np.array([0.6, 0.0, 0.8])
    by = tracer(
        [*slab(0.5), rectangle((0, 0, -3), (50, 0, 0), (0, 50, 0), material=1)],
        [pane, floor],
        lights=[Light(position=tuple((np.array([0, 0, -3]) + 10 * way).tolist()))],
    )
    pixel = seen(by, ray((0, 1, -2), (0, -1, -1), up=(0, 0, 1)))
    assert pixel == pytest.approx(0.8 * np.array([0.25, 1.0, 0.0625]), abs=1e-12)
    assert hypot(*way) == 1
