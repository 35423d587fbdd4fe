"""First hits by rasterising: the same picture and the same rays, from wherever it is taken."""

import dataclasses

import numpy as np
import pytest
from tracer_scenes import KINDS, many, mesh, options

from rtbench.errors import RtbenchError
from rtbench.scenes.model import Camera, Material, Settings
from rtbench.tracer.options import Options
from rtbench.tracer.render import Renderer

# From outside, close by, among the objects (some are behind the camera), from below the floor,
# along an axis, from far.
PLACES = (
    (0.4, 0.9, 4),
    (0.9, 0.2, 1.1),
    (0.05, 0.1, 0.02),
    (0.3, -2.5, 0.4),
    (0, 0, 3),
    (30, 40, 9),
)
ANGLES = (5.0, 45.0, 120.0)


def cameras(size=(70, 50)):
    return [
        Camera(place, (0, 0, 0), (0.1, 1, 0), angle, *size) for place in PLACES for angle in ANGLES
    ]


def assert_equal_pictures(scene, precision, cameras, plain=None, **given):
    plain = Renderer(scene, plain or Options(precision=precision, **given))
    first = Renderer(scene, Options(precision=precision, first_hit=True, **given))
    for camera in cameras:
        one, other = plain.render(camera), first.render(camera, threads=2)
        np.testing.assert_array_equal(one.pixels, other.pixels, err_msg=str(camera))
        assert one.rays == other.rays and one.saved == other.saved


def test_all_kinds_of_primitives_from_everywhere():
    assert_equal_pictures(many(triangles=200), "float64", cameras(), options(), kinds=KINDS)


@pytest.mark.full
@pytest.mark.parametrize(
    ("kernel", "structure", "precision"),
    [
        ("watertight_safe", "bvh", "float32"),
        ("watertight_safe", "kd", "float64"),
        ("moller_trumbore", "kd", "float32"),
        ("adaptive_exact_uv", "bvh", "float64"),
    ],
)
def test_kernels_structures_precisions(kernel, structure, precision):
    given = {"kernel": kernel, "structure": structure, "kinds": KINDS}
    given["force"] = ("shadows", "reflection")
    whole = dataclasses.replace(many(), materials=(Material(),), objects=(mesh("scanned:4000"),))
    mirror = (Material(reflection=(0.5, 0.5, 0.5)),) * len(many().materials)
    mirrors = dataclasses.replace(many(), materials=mirror)
    for scene in (many(triangles=200), whole, mirrors):
        assert_equal_pictures(scene, precision, cameras((131, 75)), **given)
    assert_equal_pictures(many(triangles=0, planes=False), precision, cameras(), **given)


def test_rays_beside_the_middles_of_pixels_are_refused():
    scene = dataclasses.replace(many(), settings=Settings(samples=4))
    with pytest.raises(RtbenchError, match=r"first_hit .* antialiasing") as told:
        Renderer(scene, Options(first_hit=True))
    assert "\n" not in str(told.value)
