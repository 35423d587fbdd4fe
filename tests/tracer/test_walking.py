"""What a ray meets first, among primitives of all kinds, by any tree: against asking them all."""

import dataclasses
import itertools

import numpy as np
import pytest
from tracer_scenes import many, picture

from rtbench.scenes.model import (
    Camera,
    Cone,
    Disc,
    Light,
    Material,
    Plane,
    Scene,
    Sphere,
    Triangles,
)
from rtbench.shapes import records
from rtbench.shapes.any_shape import hit_shape
from rtbench.tracer.options import Options
from rtbench.tracer.render import Renderer

RULES = ("sah", "object_median", "spatial_median")


def of_camera(camera):
    """Return where a camera's rays start, (3,), and their ways through the pixels, (H, W, 3)."""
    right, up, forward = camera.axes
    half = np.tan(np.radians(camera.angle) / 2)
    x = ((np.arange(camera.width) + 0.5) * 2 - camera.width) / camera.height * half
    y = (1 - (np.arange(camera.height) + 0.5) * 2 / camera.height) * half
    way = forward + x[None, :, None] * right + y[:, None, None] * up
    return np.array(camera.position, float), way / np.linalg.norm(way, axis=2, keepdims=True)


def hits_of_triangle(corners, start, ways):
    """Return t where rays hit a triangle, else infinity: areas as determinants, in float64."""
    a, b, c = corners - start
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (normal @ a) / (ways @ normal)
    sides = np.stack([ways @ np.cross(p, q) for p, q in ((a, b), (b, c), (c, a))])
    inside = (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)
    return np.where(inside & (t > 0), t, np.inf)


def hits_of_shape(shape, start, ways):
    """Return the same of another shape, by its function in plain Python."""
    made = {
        Sphere: lambda s: records.sphere(s.center, s.radius),
        Cone: lambda s: records.cone(s.base, s.apex, s.base_radius, s.apex_radius),
        Disc: lambda s: records.disc(s.center, s.normal, s.radius),
        Plane: lambda s: records.plane(s.point, s.normal),
    }[type(shape)](shape)
    record = np.atleast_1d(made).view(np.recarray)[0]
    found = [hit_shape(record, start, way, False) for way in ways.reshape(-1, 3)]
    return np.where(np.array(found) > 0, found, np.inf).reshape(ways.shape[:2])


def brute_force(scene):
    """Return which object each pixel shows, counted from 1; 0: none."""
    start, ways = of_camera(scene.camera)
    nearest, shown = np.full(ways.shape[:2], np.inf), np.zeros(ways.shape[:2])
    for i, each in enumerate(scene.objects):
        if isinstance(each, Triangles):
            t = hits_of_triangle(each.corners[0], start, ways)
        else:
            t = hits_of_shape(each, start, ways)
        shown[t < nearest] = i + 1
        nearest = np.minimum(nearest, t)
    return shown


@pytest.fixture(scope="module")
def expected():
    return brute_force(many())


def assert_shows(found, expected, strays=0):
    assert (found.pixels[..., 0] != expected).sum() <= strays


def test_every_kind_is_seen(expected):
    """So that the comparisons below compare something."""
    kinds = {type(many().objects[int(i) - 1]) for i in np.unique(expected) if i}
    assert kinds == {Triangles, Sphere, Cone, Disc, Plane}
    assert len(np.unique(expected)) > 40


def test_the_nearest_of_all_kinds(expected):
    """In the precision of this test itself, not a pixel is another."""
    shown = picture(many(), "float64")
    assert_shows(shown, expected)
    # Of float32, a pixel whose ray passes an edge within roundings.
    assert_shows(picture(many(), "float32"), expected, strays=3)


def test_rules_of_the_tree_change_nothing(expected):
    """Of one compiled tracer: pictures, and counters of rays, are the same to the last bit."""
    first = picture(many())
    for rule, builder in ((r, b) for r in RULES for b in ("nlogn", "binned")):
        if builder == "binned" and rule != "sah":
            continue
        other = Renderer(
            many(),
            Options(
                force=("shadows", "reflection", "refraction"),
                kinds=("triangles", "spheres", "cones", "discs", "planes"),
                rule=rule,
                builder=builder,
            ),
        ).render()
        assert_shows(other, expected)
        np.testing.assert_array_equal(other.pixels, first.pixels)
        assert other.rays == first.rays and other.saved == first.saved


def test_a_kd_tree_shows_the_same(expected):
    """Nor does a tracer of only what the scene calls for, or one that keeps no last occluder."""
    first = picture(many())
    for rule in RULES:
        other = picture(many(), structure="kd", rule=rule, shadow_cache=False, force=(), kinds=())
        assert_shows(other, expected)
        np.testing.assert_array_equal(other.pixels, first.pixels)
        assert other.rays == first.rays and other.saved == first.saved


@pytest.mark.full
@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("structure", ["bvh", "kd"])
@pytest.mark.parametrize(
    "kernel", ["watertight_safe", "moller_trumbore", "moller_trumbore_uv", "adaptive_exact_uv"]
)
def test_kernels_structures_precisions(kernel, structure, precision, expected):
    given = {"kernel": kernel, "structure": structure, "force": (), "kinds": ()}
    first = None
    for rule, cache in itertools.product(RULES, (True, False)):
        shown = picture(many(), precision, rule=rule, shadow_cache=cache, **given)
        assert_shows(shown, expected, strays=3 if precision == "float32" else 0)
        first = first or shown
        np.testing.assert_array_equal(shown.pixels, first.pixels)
        assert shown.rays == first.rays and shown.saved == first.saved
    few = picture(many(triangles=0, planes=False), precision, **given)
    assert_shows(few, brute_force(many(triangles=0, planes=False)), strays=3)


def test_coincident_and_degenerate_triangles():
    """Of equal hits the first in the file is seen; what has no area is not seen at all."""
    square = np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    square = square.astype(float)
    line = np.array([[[-1, 0, 1], [0, 0, 1], [1, 0, 1]], [[0, 0, 2], [0, 0, 2], [0, 0, 2]]], float)
    colours = [Material(emission=(i + 1, 0, 0), diffuse=(0, 0, 0)) for i in range(3)]
    scene = Scene(
        "coincident",
        Camera((0.05, 0.02, 5), (0, 0, 0), (0, 1, 0), 20, 33, 33),
        (Light(position=(1, 2, 5)),),
        tuple(colours),
        (
            Triangles(corners=line, material=2),
            Triangles(corners=square, material=1),
            Triangles(corners=square, material=0),
            Triangles(corners=line, material=2),
        ),
    )
    for precision in ("float32", "float64"):
        shown = picture(scene, precision).pixels[..., 0]
        assert (shown == 2).all()
        other = dataclasses.replace(scene, objects=scene.objects[::-1])
        assert (picture(other, precision).pixels[..., 0] == 1).all()
