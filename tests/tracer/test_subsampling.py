"""Adaptive subsampling: what is traced, what is interpolated, and what that costs."""

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest
from tracer_scenes import KINDS, many, picture

from rtbench.errors import RtbenchError
from rtbench.scenes.model import Camera, Material, Plane, Scene, Sphere, Triangles
from rtbench.tracer.options import Options, Subsampling
from rtbench.tracer.render import Renderer, render

SHARED = {"force": ("shadows",), "kinds": KINDS}


def subsampled(scene, grid=(4, 4), tolerance=0.05, interpolation="bilinear", threads=1, **given):
    chosen = Subsampling(grid, tolerance, interpolation)
    return render(scene, Options(subsampling=chosen, **(SHARED | given)), threads)


def flat(width, height, objects):
    """Return a scene in which everything shines in one colour of its own."""
    colours = ((1, 0, 0), (0, 1, 0), (0, 0.5, 1))
    objects = tuple(dataclasses.replace(each, material=i) for i, each in enumerate(objects))
    return Scene(
        "flat",
        Camera((0, 0.5, 5), (0, 0, 0), (0, 1, 0), 40, width, height),
        (),
        tuple(Material(emission=c, diffuse=(0, 0, 0)) for c in colours),
        (*objects, Triangles(corners=np.zeros((1, 3, 3)))),
        background=(0.5, 0.5, 0.5),
    )


def counted(shown):
    """Return how many pixels were traced, and check that the rest was interpolated."""
    height, width = shown.pixels.shape[:2]
    # Corners beyond the picture, and beyond a tile, are traced too.
    assert shown.saved["interpolated"] <= height * width
    assert shown.rays["primary"] + shown.saved["interpolated"] >= height * width
    return shown.rays["primary"]


def test_a_grid_of_one_pixel_is_the_full_picture():
    scene = many()
    expected = picture(scene)
    shown = subsampled(scene, (1, 1), 1.0)
    np.testing.assert_array_equal(shown.pixels, expected.pixels)
    assert shown.rays == expected.rays and shown.saved == expected.saved


def test_nothing_tolerated_between_flat_colours():
    """Edges that corners see are followed down to the pixel: large objects come out whole."""
    scene = flat(96, 64, (Plane(point=(0, -1, 0)), Plane(point=(0, 0, -30), normal=(0.3, 0.1, 1))))
    expected = picture(scene)
    assert len(np.unique(expected.pixels.reshape(-1, 3), axis=0)) >= 2
    for grid in ((2, 2), (4, 4), (8, 8), (4, 8)):
        for interpolation in ("bilinear", "nearest"):
            shown = subsampled(scene, grid, 0.0, interpolation)
            np.testing.assert_array_equal(shown.pixels, expected.pixels)
            assert counted(shown) < 96 * 64


def test_one_colour_costs_only_the_corners():
    """Of each tile of 32 pixels and each grid: (32 / x + 1) (32 / y + 1) rays."""
    scene = flat(64, 32, (Sphere(radius=50.0),))
    for x, y in ((2, 2), (4, 4), (4, 8), (16, 2)):
        shown = subsampled(scene, (x, y), 0.0)
        assert (shown.pixels == (1, 0, 0)).all()
        assert counted(shown) == 2 * (32 // x + 1) * (32 // y + 1)
        # What lies on a corner inside the tile was traced.
        assert shown.saved["interpolated"] == 64 * 32 - (64 // x) * (32 // y)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (5, 3), (33, 31), (37, 65), (64, 7)])
def test_sizes_that_are_no_multiples_of_the_grid(width, height):
    scene = flat(width, height, (Sphere(radius=50.0),))
    for grid in ((4, 4), (8, 16)):
        shown = subsampled(scene, grid, 0.5)
        assert (shown.pixels == (1, 0, 0)).all()
        counted(shown)
    changing = dataclasses.replace(many(), camera=dataclasses.replace(many().camera, width=width))
    changing = dataclasses.replace(
        changing, camera=dataclasses.replace(changing.camera, height=height)
    )
    expected = picture(changing)
    np.testing.assert_array_equal(subsampled(changing, (1, 1), 0.0).pixels, expected.pixels)
    shown = subsampled(changing, (4, 4), 0.1)
    same = (shown.pixels == expected.pixels).all(axis=2).sum()
    assert same >= height * width - shown.saved["interpolated"]


def test_between_corners_by_hand():
    """A slanted white wall before which the light falls: along a line colours are linear."""
    scene = many()
    expected = picture(scene).pixels
    for interpolation in ("bilinear", "nearest"):
        shown = subsampled(scene, (4, 4), 1.0, interpolation).pixels
        # Corners are pixels of the full picture; what is between follows from them. Red is above 1
        # everywhere, which a picture cannot show, and so makes no difference.
        x, y = 8, 4
        a, b, c, d = (expected[y + j, x + i] for j in (0, 4) for i in (0, 4))
        for j in range(4):
            for i in range(4):
                s, t = i / 4, j / 4
                if interpolation == "nearest":
                    s, t = float(s >= 0.5), float(t >= 0.5)
                between = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d)
                np.testing.assert_allclose(shown[y + j, x + i], between, rtol=1e-14)


def test_threads_change_nothing():
    made = Renderer(many(), Options(subsampling=Subsampling((4, 8), 0.1), **SHARED))
    first = made.render()
    for threads in (2, 3):
        other = made.render(threads=threads)
        np.testing.assert_array_equal(other.pixels, first.pixels)
        assert other.rays == first.rays and other.saved == first.saved


def test_more_tolerance_fewer_rays():
    """What a tolerance interpolates, a larger one interpolates too."""
    scene = many()
    scene = dataclasses.replace(
        scene, camera=dataclasses.replace(scene.camera, width=160, height=128)
    )
    expected = picture(scene).pixels
    rays, errors = [], []
    for tolerance in (0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0):
        shown = subsampled(scene, (8, 8), tolerance)
        rays.append(counted(shown))
        errors.append(np.abs(np.minimum(shown.pixels, 1) - np.minimum(expected, 1)).mean())
    assert rays == sorted(rays, reverse=True) and rays[0] > 2 * rays[-1]
    assert errors == sorted(errors)


@pytest.mark.full
@pytest.mark.parametrize("name", ["balls", "teapot", "tetra"])
def test_shipped_scenes(name):
    from rtbench.scenes.reading import read

    folder = os.environ.get("RTBENCH_SCENES")
    if not folder or not (Path(folder) / f"{name}.nff").exists():
        pytest.skip(f"RTBENCH_SCENES names no folder with {name}.nff")
    scene = read(Path(folder) / f"{name}.nff")
    expected = np.minimum(render(scene).pixels, 1)
    rays, errors = [], []
    for tolerance in (0.0, 0.05, 0.1, 0.2):
        shown = render(scene, Options(subsampling=Subsampling((4, 4), tolerance)), 2)
        rays.append(counted(shown))
        errors.append(np.sqrt(((np.minimum(shown.pixels, 1) - expected) ** 2).mean()))
    print(name, rays, errors)
    assert rays == sorted(rays, reverse=True)
    assert errors[0] < 0.02 and errors[0] <= errors[-1] < 0.1


@pytest.mark.parametrize(
    "given", [{"grid": (3, 4)}, {"grid": (32, 32)}, {"tolerance": 1.5}, {"tolerance": float("nan")}]
)
def test_what_is_refused(given):
    with pytest.raises(RtbenchError) as told:
        Subsampling(**given)
    assert "\n" not in str(told.value)


def test_unknown_interpolation():
    with pytest.raises(RtbenchError, match="bilinear"):
        Subsampling(interpolation="bilinaer")
