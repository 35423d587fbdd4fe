"""Where in a picture things may be seen: tiles that are left out would have shown nothing."""

import numpy as np
import pytest

from rtbench.scenes.model import Camera, Light, Plane, Scene, Settings, Sphere, Triangles
from rtbench.tracer import view
from rtbench.tracer.options import Options, Subsampling
from rtbench.tracer.render import Renderer

BACKGROUND = (0.1, 0.2, 0.3)


def scene(objects, **camera):
    given = {"position": (0.0, 0.0, 9.0), "target": (0.0, 0.0, 0.0), "width": 200, "height": 150}
    return Scene(
        name="scattered",
        camera=Camera(**given | camera),
        lights=(Light(position=(4.0, 5.0, 9.0)),),
        objects=tuple(objects),
        settings=Settings(samples=4),
        background=BACKGROUND,
    )


def scattered(seed, spread=2.0):
    """Return small triangles and a sphere here and there."""
    random = np.random.default_rng(seed)
    corners = random.normal(size=(40, 1, 3)) * spread + random.normal(size=(40, 3, 3)) * 0.1
    return [Triangles(corners=corners), Sphere(center=(1.0, 2.0, 0.5), radius=0.4)]


CAMERAS = {
    "before": {},
    "aside": {"target": (3.0, 1.0, 0.0), "angle": 25.0},
    "among": {"position": (0.5, 0.2, 0.3), "target": (3.0, 0.0, 0.0), "angle": 100.0},
    "away": {"target": (0.0, 0.0, 20.0)},
    "far": {"position": (900.0, 0.0, 2000.0), "angle": 0.3},
    "tilted": {"up": (1.0, 1.0, 0.0), "width": 90, "height": 230},
}


def with_all_tiles(monkeypatch, renderer):
    """Return the picture of all tiles, none of them left out."""
    parted = view.tiles_of

    def all_of(*given):
        traced, empty = parted(*given)
        return np.concatenate([traced, empty]), empty[:0]

    with monkeypatch.context() as patched:
        patched.setattr(view, "tiles_of", all_of)
        return renderer.render(threads=2)


@pytest.mark.parametrize("structure", ["bvh", "kd"])
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_what_is_left_out_shows_the_background_alone(monkeypatch, precision, structure):
    left_out = 0
    for name, camera in CAMERAS.items():
        renderer = Renderer(
            scene(scattered(1), **camera), Options(precision=precision, structure=structure)
        )
        seen = view.camera_of(renderer.scene.camera, renderer.world.base, np.dtype(precision).type)
        traced, empty = view.tiles_of(renderer.world, seen, 32)
        covers = np.zeros((renderer.scene.camera.height, renderer.scene.camera.width), int)
        for left, upper, right, lower in np.concatenate([traced, empty]):
            covers[upper:lower, left:right] += 1
        assert (covers == 1).all(), name
        got, whole = renderer.render(threads=2), with_all_tiles(monkeypatch, renderer)
        assert np.array_equal(got.pixels, whole.pixels), name
        assert (got.rays, got.saved) == (whole.rays, whole.saved), name
        left_out += len(empty)
    assert left_out > 50


def test_where_all_may_be_seen_nothing_is_left_out():
    plane = Plane(point=(0.0, -3.0, 0.0))
    for objects, camera in (
        ([*scattered(2), plane], {}),
        (scattered(2), {"lens_radius": 0.5}),
        (scattered(2), {"position": (0.0, 0.0, 0.0), "target": (1.0, 0.0, 0.0)}),
    ):
        renderer = Renderer(scene(objects, **camera), later=True)
        seen = view.camera_of(renderer.scene.camera, renderer.world.base, np.float64)
        assert len(view.tiles_of(renderer.world, seen, 32)[1]) == 0


def test_an_empty_picture_is_the_background():
    renderer = Renderer(scene(scattered(3), target=(0.0, 0.0, 20.0)))
    picture = renderer.render()
    assert np.allclose(picture.pixels, BACKGROUND, rtol=1e-15)
    assert picture.rays["primary"] == 4 * 200 * 150


def test_subsampling_asks_for_pixels_beyond_a_tile(monkeypatch):
    options = Options(subsampling=Subsampling((8, 8), 0.1))
    renderer = Renderer(scene(scattered(4)), options)
    assert np.array_equal(renderer.render().pixels, with_all_tiles(monkeypatch, renderer).pixels)


def test_boxes_are_covered_where_their_points_are_seen():
    """The points' places in the picture are computed the other way round: by the ray's equation."""
    random = np.random.default_rng(5)
    boxes = np.sort(random.normal(size=(200, 2, 3)), axis=1).reshape(-1, 6).astype(np.float32)
    camera = Camera(position=(1.0, 2.0, 7.0), target=(0.0, 0.0, 0.0), width=320, height=200)
    record = view.camera_of(camera, np.zeros(3), np.float64)
    found = view.covered(boxes, np.zeros(3), record)
    right, up, forward = (record[name][0] for name in ("right", "up", "forward"))
    for box, (left, upper, end_x, end_y) in zip(boxes.astype(float), found, strict=True):
        points = box[:3] + random.random((50, 3)) * (box[3:] - box[:3])
        a, b, scale = np.linalg.solve(
            np.stack([right, up, forward], axis=1), (points - camera.position).T
        )
        x, y = (a / scale + 1) * 160, (1 - b / scale) * 100
        assert (
            (x >= left).all() and (x <= end_x).all() and (y >= upper).all() and (y <= end_y).all()
        )
        assert end_x - left < 2 * (x.max() - x.min()) + 60
