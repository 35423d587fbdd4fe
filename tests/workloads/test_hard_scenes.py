"""Hard scenes: each is of its size and kind, and its rays hit and miss."""

import numpy as np
import pytest

from rtbench.workloads.hard_scenes import SCENES, scenes
from rtbench.workloads.meshes import without_area

FLAT = ("flat_in_planes", "grid", "staircase", "box", "layers", "single_flat_triangle")


@pytest.fixture(scope="module")
def all_scenes():
    return scenes()


def hits(scene):
    """Count the triangles that each ray hits at 0 < t < tmax, in float64 (Pluecker's signs)."""
    found = np.zeros(len(scene.origins), np.int64)
    with np.errstate(all="ignore"):
        for k, (o, d) in enumerate(zip(scene.origins, scene.directions, strict=True)):
            a, b, c = np.moveaxis(scene.triangles - o, 1, 0)
            d = d / np.abs(d).max()
            normal = np.cross(b - a, c - a)
            t = (normal * a).sum(axis=1) / (normal @ d)
            sides = np.stack([np.cross(p, q) @ d for p, q in ((a, b), (b, c), (c, a))])
            inside = (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0)
            far = t / np.abs(scene.directions[k]).max()
            found[k] = np.count_nonzero(inside & (far > 0) & (far < scene.tmax[k]))
    return found


def test_names_are_all_there(all_scenes):
    assert list(all_scenes) == list(SCENES) and len(all_scenes) >= 22
    assert all(scene.why and "\n" not in scene.why for scene in all_scenes.values())


@pytest.mark.parametrize("name", SCENES)
def test_arrays_are_as_promised(name, all_scenes):
    scene = all_scenes[name]
    m, n = len(scene.triangles), len(scene.origins)
    assert m <= 2_000 and 100 <= n <= 2_000 and (m > 0) == (name != "empty")
    arrays = scene.triangles, scene.origins, scene.directions, scene.tmax
    assert [a.shape for a in arrays] == [(m, 3, 3), (n, 3), (n, 3), (n,)]
    for a in arrays:
        assert a.dtype == np.float64 and a.flags.c_contiguous
        np.testing.assert_array_equal(a, a.astype(np.float32))
    assert np.isfinite(scene.triangles).all() and np.isfinite(scene.origins).all()
    assert np.isfinite(scene.directions).all() and scene.directions.any(axis=1).all()
    assert (scene.tmax > 0).all() and 0.2 < np.mean(np.isfinite(scene.tmax)) < 0.3


def test_scenes_depend_on_the_seed_alone(all_scenes):
    again, other = scenes(1), scenes(2)
    for name, scene in all_scenes.items():
        for field in ("triangles", "origins", "directions", "tmax"):
            value = getattr(scene, field)
            np.testing.assert_array_equal(value, getattr(again[name], field))
            np.testing.assert_array_equal(
                np.signbit(value), np.signbit(getattr(again[name], field))
            )
        values = np.concatenate([scene.origins, scene.directions])
        changed = np.concatenate([other[name].origins, other[name].directions])
        if name == "box":  # of which only the signs of zeros are drawn
            values, changed = np.signbit(values), np.signbit(changed)
        assert not np.array_equal(values, changed)


@pytest.mark.parametrize("name", SCENES)
def test_rays_hit_and_miss(name, all_scenes):
    scene = all_scenes[name]
    met = hits(scene) > 0
    if name == "empty":
        assert not met.any()
    else:
        assert np.mean(met) > 0.2 and np.count_nonzero(~met) > 20


@pytest.mark.parametrize("name", FLAT)
def test_triangles_that_lie_in_planes_of_the_axes(name, all_scenes):
    scene = all_scenes[name]
    flat = (scene.triangles == scene.triangles[:, :1]).all(axis=1)
    assert (flat.sum(axis=1) == 1).all()
    # Rays that lie in the plane of a triangle: no motion along its axis, from within the plane.
    lying = 0
    for axis in range(3):
        planes = scene.triangles[flat[:, axis]][:, 0, axis]
        within = (scene.directions[:, axis] == 0) & np.isin(scene.origins[:, axis], planes)
        lying += np.count_nonzero(within)
    assert lying > 50


def test_origins_and_directions_at_a_box(all_scenes):
    scene = all_scenes["box"]
    assert np.abs(scene.triangles).max() == 1 and len(scene.triangles) == 12
    starts, count = np.unique(scene.origins, axis=0, return_counts=True)
    assert (count == 26).all()
    on = (np.abs(starts) == 1).sum(axis=1)[np.abs(starts).max(axis=1) == 1]
    assert [np.count_nonzero(on == k) for k in (1, 2, 3)] == [6, 12, 8]
    assert np.count_nonzero(np.abs(starts).max(axis=1) < 1) == 2  # inside
    ways = np.unique(scene.directions, axis=0)
    assert len(ways) == 26 and np.abs(ways).max() == 1


@pytest.mark.parametrize("name", ["box", "signed_zeros", "grid", "integer_grid", "coplanar"])
def test_zeros_have_both_signs(name, all_scenes):
    directions = all_scenes[name].directions
    for axis in range(3) if name != "coplanar" else ():
        zero = directions[:, axis] == 0
        assert 0.2 < np.mean(np.signbit(directions[zero, axis])) < 0.8
    zero = directions == 0
    assert np.signbit(directions[zero]).any() and not np.signbit(directions[zero]).all()


def test_planes_with_everything_in_them(all_scenes):
    assert not all_scenes["coplanar"].triangles[:, :, 2].any()
    lying = all_scenes["coplanar"]
    assert np.count_nonzero((lying.origins[:, 2] == 0) & (lying.directions[:, 2] == 0)) > 100
    slanted = all_scenes["coplanar_slanted"].triangles
    assert not slanted.sum(axis=2).any() and np.ptp(slanted, axis=(0, 1)).min() > 10


def test_what_no_plane_separates(all_scenes):
    triangles = all_scenes["duplicates"].triangles
    same = (triangles == triangles[15]).all(axis=(1, 2))
    assert np.count_nonzero(same) == 40 and len(triangles) == 80
    middles = all_scenes["identical_centroids"].triangles.sum(axis=1)
    assert not middles.any() and len(middles) == 200


def test_layers_are_neighbouring_floats(all_scenes):
    heights = np.unique(all_scenes["layers"].triangles[:, :, 2]).astype(np.float32)
    np.testing.assert_array_equal(np.nextafter(heights[32:-1], np.float32(2)), heights[33:])
    assert len(heights) > 45 and (heights == 1).sum() == 1
    assert np.isin(all_scenes["layers"].origins[:, 2], heights).sum() > 300


def test_scales(all_scenes):
    far = all_scenes["offset"].triangles
    assert np.abs(far).min() > 9e5 and np.ptp(far, axis=(0, 1)).max() < 50

    field = all_scenes["small_in_large"].triangles
    size = np.ptp(field, axis=1).max(axis=1)
    assert np.ptp(field, axis=(0, 1)).max() == 2e5
    small = field[size < 1e-3]
    assert len(small) == 1280 and np.ptp(small, axis=(0, 1)).max() < 1.1e-3

    size = np.ptp(all_scenes["tiny_and_huge"].triangles, axis=1).max(axis=1)
    assert np.flatnonzero(size > 1).tolist() == [0, 500, 1000, 1500]
    assert size[size < 1].max() < 0.02

    length = np.abs(all_scenes["direction_scale"].directions).max(axis=1)
    assert 1e-19 < length.min() < 1e-17 and 1e17 < length.max() < 1e19


def test_shapes(all_scenes):
    slivers = all_scenes["slivers"].triangles
    sides = np.linalg.norm(slivers - np.roll(slivers, 1, axis=1), axis=2)
    thin = sides.min(axis=1) / sides.max(axis=1)
    assert thin.max() < 0.03 and thin.min() < 1e-5
    assert (np.ptp(slivers, axis=1) > 1).all()  # along all three axes: diagonal

    mixed = without_area(all_scenes["with_degenerate"].triangles)
    assert 110 < np.count_nonzero(mixed) < 130 and len(mixed) == 442
    assert mixed[:221].any() and mixed[221:].any()

    fan = all_scenes["vertex_fan"]
    apex = fan.triangles[0, 0]
    assert (fan.triangles[:, 0] == apex).all() and len(fan.triangles) == 256
    np.testing.assert_array_equal(fan.triangles[:, 2], np.roll(fan.triangles[:, 1], -1, axis=0))
    assert np.count_nonzero((fan.origins == apex).all(axis=1)) >= 300

    grid = all_scenes["integer_grid"]
    np.testing.assert_array_equal(grid.triangles, np.round(grid.triangles))
    whole = (grid.origins == np.round(grid.origins)).all(axis=1)
    parallel = (grid.directions == 0).sum(axis=1) == 2
    assert np.count_nonzero(whole & parallel) > 1000


def test_triangles_meet_in_split_planes(all_scenes):
    triangles = all_scenes["abutting"].triangles
    for axis in (0, 1):
        starts, ends = triangles[..., axis].min(axis=1), triangles[..., axis].max(axis=1)
        for plane in range(1, 12):
            assert np.count_nonzero(starts == plane) == np.count_nonzero(ends == plane) == 48
    origins, directions = all_scenes["abutting"].origins, all_scenes["abutting"].directions
    down = (directions[:, 0] == 0) & (directions[:, 1] == 0)
    assert np.count_nonzero(down & (origins[:, 0] == np.round(origins[:, 0]))) > 150


def test_vertical_rays_on_stairs(all_scenes):
    scene = all_scenes["staircase"]
    assert np.count_nonzero((scene.directions == (0, -1, 0)).all(axis=1)) > 700


def test_origins_on_the_faces_of_a_box(all_scenes):
    scene = all_scenes["on_box_faces"]
    lower, upper = scene.triangles.min(axis=(0, 1)), scene.triangles.max(axis=(0, 1))
    on = ((scene.origins == lower) | (scene.origins == upper)).sum(axis=1)
    assert on.min() == 1 and {1, 2, 3} == set(on)
    assert ((scene.origins >= lower) & (scene.origins <= upper)).all()
