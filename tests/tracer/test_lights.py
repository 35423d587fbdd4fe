"""Lights, their shadows and what surfaces answer, against geometry by hand."""

from __future__ import annotations

from math import asin, cos, degrees, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from tiny_scenes import EXACT, figure, made, ray, rectangle, renderer, ruler, seen

from rtbench.scenes.model import BLACK, WHITE, Camera, Disc, Light, Material, Plane, Texture

EFFECTS = ("shadows", "specular", "texture", "smooth_normals", "soft_shadows")
KINDS = ("triangles", "discs", "planes")
MATTE = Material(diffuse=WHITE)
FLOOR = Plane(material=0, point=(0, 0, 0), normal=(0, 1, 0))
BOTH = pytest.mark.parametrize(
    "precision", ["float64", pytest.param("float32", marks=pytest.mark.full)]
)


def tracer(lights, objects=(FLOOR,), materials=(MATTE,), precision="float64", speck=True):
    return renderer(made(objects, materials, lights=lights, speck=speck), EFFECTS, KINDS, precision)


def on_floor(x=0.0, z=0.0) -> Camera:
    """Return a ray that meets the floor y = 0 at a place, aslant."""
    return ray((x, 0.3, z + 0.4), (0, -0.3, -0.4))


def row(by, low: float, high: float, count: int, view=(0, 1, 0)) -> tuple[np.ndarray, ...]:
    """Return places in a row along x on the floor, and how bright each is, seen from ``view``."""
    wide = (high - low) * (count / (count - 1))
    far = 1e4 * wide  # from so far that pixels lie evenly
    away = far * np.array(view) / np.linalg.norm(view)
    here = np.array([(low + high) / 2, 0.0, 0.0])
    one_pixel = degrees(2 * np.arctan(wide / count / 2 / far))
    camera = Camera(tuple(here + away), tuple(here), (0, 0, -1), one_pixel, count, 1)
    assert camera.axes[0] @ (1, 0, 0) == pytest.approx(1)
    return np.linspace(low, high, count), by.render(camera).pixels[0, :, 0].astype(np.float64)


@BOTH
@pytest.mark.parametrize("kind", ["point", "spot", "sphere"])
def test_light_falls_off_with_the_square_of_the_distance(precision, kind):
    """Color at distance 1, a quarter at 2, a ninth at 3; a sphere as if from its middle."""
    samples = 1 if kind == "sphere" else 0
    for distance in (1.0, 2.0, 3.0, 7.0):
        light = Light(
            kind,
            (0, distance, 0),
            color=(0.5, 1.0, 2.0),
            falloff="inverse_square",
            radius=0.6,
            grid=24,
        )
        pixel = seen(tracer([light], precision=precision), on_floor())
        expected = np.array([0.5, 1.0, 2.0]) / distance**2
        assert pixel == pytest.approx(expected, rel=1e-3 if samples else 10 * EXACT[precision])


def test_light_without_falloff_does_not():
    for distance in (1.0, 7.0):
        assert seen(tracer([Light(position=(0, distance, 0))]), on_floor()) == pytest.approx(1.0)


@BOTH
def test_matte_surfaces_answer_with_the_cosine(precision):
    for angle in (0.0, 30.0, 60.0, 85.0):
        way = -sin(radians(angle)), -cos(radians(angle)), 0.0
        by = tracer([Light("directional", direction=way)], precision=precision)
        assert seen(by, on_floor()) == pytest.approx(cos(radians(angle)), abs=EXACT[precision])


def test_an_inclined_light_falls_with_cosine_and_distance():
    """cos / d^2 of a lamp at height h over the floor: h / (h^2 + x^2)^(3/2)."""
    h = 2.0
    x, found = row(tracer([Light(position=(0, h, 0), falloff="inverse_square")]), -5, 5, 41)
    np.testing.assert_allclose(found, h / (h * h + x * x) ** 1.5, rtol=1e-6)


def test_a_spot_ends_at_its_angles():
    """All light up to the inner angle, none from the outer on, and between them ever less."""
    h, inner, outer = 2.0, 20.0, 30.0
    light = Light("spot", (0, h, 0), (0, -3, 0), inner=inner, outer=outer)
    x, found = row(tracer([light]), 0, 2, 401)
    angle = np.degrees(np.arctan(x / h))
    share = found / np.cos(np.radians(angle))
    np.testing.assert_allclose(share[angle < inner - 0.1], 1.0, rtol=1e-9)
    assert not share[angle > outer + 0.1].any()
    between = share[(angle > inner + 0.1) & (angle < outer - 0.1)]
    assert (np.diff(between) < 0).all() and between[0] > 0.99 and between[-1] < 0.01


def test_shadows_of_the_sun_are_as_large_as_what_casts_them():
    """A disc of radius 0.5 at height 2 under light that comes 45 degrees aslant: moved by 2."""
    light = Light("directional", direction=(1, -1, 0))
    disc = Disc(material=0, center=(0, 2, 0), normal=(0, 1, 0), radius=0.5)
    by = tracer([light], [FLOOR, disc])
    for x, z in [(2, 0), (1.51, 0), (2.49, 0), (2, 0.49), (2, -0.49)]:
        assert not seen(by, on_floor(x, z)).any()
    for x, z in [(1.49, 0), (2.51, 0), (2, 0.51), (2, -0.51), (0, 0)]:
        assert seen(by, on_floor(x, z)) == pytest.approx(sqrt(0.5))


def test_shadows_of_a_lamp_grow_with_the_distance():
    """A disc half way between lamp and floor: a shadow of twice its radius."""
    disc = Disc(material=0, center=(0, 1, 0), normal=(0, 1, 0), radius=0.5)
    by = tracer([Light(position=(0, 2, 0))], [FLOOR, disc])
    for x, dark in [(0.99, True), (1.01, False), (-0.99, True), (-1.01, False)]:
        assert (not seen(by, on_floor(x)).any()) == dark
    assert seen(tracer([Light(position=(0, 2, 0), shadows=False)], [FLOOR, disc]), on_floor()).all()


def edge(height: float):
    """Return a black screen over all x < 0, its edge along z at x = 0; `UNDER` looks below it."""
    return rectangle((-500, height, 0), (500, 0, 0), (0, 0, -20), material=1)


UNDER = (0, 1, 40)
BLACKENED = (MATTE, Material(diffuse=BLACK))


@BOTH
@pytest.mark.parametrize("high", [1.0, 2.5])
def test_penumbra_of_a_rectangle(precision, high):
    """Behind an edge as wide as the light times the distances' ratio, and linear across it."""
    size, top = 0.4, 5.0
    wide = size * high / (top - high)
    light = Light("rectangle", (0, top, 0), edge_u=(size, 0, 0), edge_v=(0, 0, size), grid=32)
    by = tracer([light], [FLOOR, edge(high)], BLACKENED, precision)
    x, found = row(by, -wide, wide, 81, UNDER)
    bare = row(tracer([light], precision=precision), -wide, wide, 81, UNDER)[1]
    share = found / bare
    assert not share[x < -wide / 2 * 1.001].any()
    np.testing.assert_allclose(share[x > wide / 2 * 1.001], 1.0, rtol=1e-5)
    inside = abs(x) < wide / 2
    # One of 32 columns of cells is only partly seen: the random places in it decide.
    np.testing.assert_allclose(share[inside], (x / wide + 0.5)[inside], atol=1 / 32)
    assert abs((share - (x / wide + 0.5))[inside].mean()) < 2e-3


def test_penumbra_of_a_sphere():
    """As wide as the lines that touch both the sphere and the edge leave it; half at the middle."""
    radius, top, high = 0.3, 5.0, 2.0
    light = Light("sphere", (0, top, 0), radius=radius, grid=32)
    by = tracer([light], [FLOOR, edge(high)], BLACKENED)
    half = high * tan(asin(radius / (top - high)))
    x, found = row(by, -1.2 * half, 1.2 * half, 97, UNDER)
    bare = row(tracer([light]), -1.2 * half, 1.2 * half, 97, UNDER)[1]
    share = found / bare
    assert not share[x < -1.01 * half].any()
    np.testing.assert_allclose(share[x > 1.01 * half], 1.0, rtol=1e-9)
    # What is seen of a disc beyond an edge: a segment of a circle.
    s = np.clip(x / half, -1, 1)
    segment = 1 - (np.arccos(s) - s * np.sqrt(1 - s * s)) / pi
    np.testing.assert_allclose(share, segment, atol=0.03)
    assert abs((share - segment).mean()) < 3e-3


def test_each_ray_of_an_area_light_with_one_cell_goes_to_another_place():
    """With a grid of 1, pixels in the penumbra are black or white, as many as the light is seen."""
    light = Light("rectangle", (0, 5, 0), edge_u=(0.4, 0, 0), edge_v=(0, 0, 0.4), grid=1)
    by = tracer([light], [FLOOR, edge(2.5)], BLACKENED)
    x, found = row(by, -0.2, 0.2, 2001, UNDER)
    expected = x / 0.4 + 0.5
    assert set(np.unique(found > 0)) == {False, True}
    lit = found > 0
    for part in np.array_split(np.arange(len(x)), 5):
        spread = sqrt((expected[part] * (1 - expected[part])).sum()) / len(part)
        assert abs(lit[part].mean() - expected[part].mean()) < 4 * spread


def test_light_of_a_rectangle_against_its_integral():
    """The mean of cos / d^2 over the light, by a fine sum."""
    light = Light(
        "rectangle",
        (0.5, 1.5, 0),
        edge_u=(2, 0.5, 0),
        edge_v=(0, 0, 1),
        falloff="inverse_square",
        grid=32,
    )
    s, t = np.meshgrid(*[(np.arange(400) + 0.5) / 400 - 0.5] * 2)
    for x in (0.0, 2.0):
        way = np.stack([0.5 + 2 * s - x, 1.5 + 0.5 * s, t])
        expected = (way[1] / (way**2).sum(axis=0) ** 1.5).mean()
        assert seen(tracer([light]), on_floor(x)) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("highlight", ["phong", "blinn_phong"])
@BOTH
def test_highlights(precision, highlight):
    """cos(angle from the mirrored way)^e, and cos(angle from half-way)^e, by angles alone."""
    shiny = Material(diffuse=BLACK, specular=(1, 0.5, 0), exponent=40.0, highlight=highlight)
    for light, viewer in [(30.0, 30.0), (30.0, 42.0), (50.0, 35.0), (10.0, -10.0)]:
        way = sin(radians(light)), -cos(radians(light)), 0.0
        by = tracer([Light("directional", direction=way)], materials=[shiny], precision=precision)
        to = -sin(radians(viewer)), -cos(radians(viewer)), 0.0
        off = light - viewer if highlight == "phong" else (light - viewer) / 2
        shine = cos(radians(off)) ** 40
        pixel = seen(by, ray((-3 * to[0], -3 * to[1], 0), to, up=(0, 0, 1)))
        assert pixel == pytest.approx([shine, shine / 2, 0], abs=50 * EXACT[precision])


@BOTH
def test_a_smooth_patch_shines_where_its_normal_is_half_way(precision):
    """Corner normals that part by 2 x 30 degrees: the normal at x is that of the blend."""
    lean = radians(30)
    left, right = (-sin(lean), cos(lean), 0), (sin(lean), cos(lean), 0)
    patch = figure(
        (-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1), normals=[left, right, right, left]
    )
    shiny = Material(diffuse=(0.5, 0.5, 0.5), specular=WHITE, exponent=200.0, highlight="phong")
    turned = radians(20)
    light = Light("directional", direction=(-sin(turned), -cos(turned), 0))
    by = tracer([light], [patch], [shiny], precision, speck=False)
    x, found = row(by, -0.99, 0.99, 101)
    # The blend of the corners: x sin 30 to the side, cos 30 up.
    angle = np.arctan2(x * sin(lean), cos(lean))
    away = 2 * angle - turned  # of the mirrored light from the vertical, where the camera is
    shine = np.where(np.cos(away) > 0, np.abs(np.cos(away)) ** 200, 0)
    expected = 0.5 * np.cos(turned - angle) + shine
    np.testing.assert_allclose(found, expected, atol=1e-3 if precision == "float64" else 1e-2)
    top = x[np.argmax(found - 0.5 * np.cos(turned - angle))]
    assert top == pytest.approx(tan(turned / 2) / tan(lean), abs=0.02)


def test_rough_matte_surfaces_against_oren_and_nayars_angles():
    """Their equation 30, with alpha, beta and phi as they write it; flatter than Lambert's."""
    sigma = radians(30)
    a = 1 - 0.5 * sigma**2 / (sigma**2 + 0.33)
    b = 0.45 * sigma**2 / (sigma**2 + 0.09)
    clay = Material(diffuse=WHITE, diffuse_roughness=30.0)
    for light, viewer in [(60, 60), (60, -60), (30, 70), (0, 50)]:
        way = -sin(radians(light)), -cos(radians(light)), 0.0
        by = tracer([Light("directional", direction=way)], materials=[clay])
        to = -sin(radians(viewer)), -cos(radians(viewer)), 0.0
        alpha, beta = radians(max(abs(light), abs(viewer))), radians(min(abs(light), abs(viewer)))
        same = max(0.0, 1.0 if light * viewer > 0 else -1.0 if light * viewer < 0 else 0.0)
        expected = cos(radians(light)) * (a + b * same * sin(alpha) * tan(beta))
        pixel = seen(by, ray((-3 * to[0], -3 * to[1], 0), to, up=(0, 0, 1)))
        assert pixel == pytest.approx(expected, abs=1e-12)


@BOTH
def test_checkers_are_cubes(precision):
    """Red and green by turns, wherever the scene lies; the first begins just below 0."""
    checker = Texture("checker", 0.5, (1, 0, 0), (0, 1, 0))
    tiled = Material(ambient=WHITE, diffuse=BLACK, texture=checker)
    by = tracer([], [FLOOR], [tiled], precision)
    for x in (-1.2, -0.7, -0.2, 0.1, 0.3, 0.6, 1.3):
        for z in (-0.9, -0.1, 0.2, 0.8):
            odd = (int(np.floor(x / 0.5)) + int(np.floor(z / 0.5))) % 2
            assert seen(by, on_floor(x, z)) == pytest.approx([1 - odd, odd, 0])


def test_an_image_has_its_first_row_on_top():
    """u to the right, v up: the corners of a picture of two by two pixels."""
    colours = np.array([[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 1]]], np.float32)
    picture = Material(ambient=WHITE, diffuse=BLACK, texture=Texture("image", pixels=colours))
    by = tracer([], [ruler((0, 0, 0), (1, 0, 0), (0, 1, 0))], [picture], speck=False)
    for x, y, expected in [(-1, 1, (0, 0)), (1, 1, (0, 1)), (-1, -1, (1, 0)), (1, -1, (1, 1))]:
        pixel = seen(by, ray((0.9999999 * x, 0.9999999 * y, 3), (0, 0, -1)))
        assert pixel == pytest.approx(colours[expected], abs=1e-6)
    assert seen(by, ray((0, 0, 3), (0, 0, -1))) == pytest.approx([0.5, 0.5, 0.5])
