"""Packets: their angles, what their rays share, and that they hit as often as the soup's rays."""

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads.bundles import KINDS, bundles
from rtbench.workloads.soup import SETS, soup

ANGLES = (0, 0.1, 5, 30, 90)


@pytest.fixture(scope="module")
def sets():
    return {name: soup(name, 256, 1024, seed=1) for name in SETS}


def openings(vectors):
    """Return the greatest angle in degrees between two unit vectors of each row (P, W, 3)."""
    vectors = vectors.astype(float)
    apart = np.linalg.norm(vectors[:, :, None] - vectors[:, None], axis=3).max(axis=(1, 2))
    return np.degrees(2 * np.arcsin(apart / 2))


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("kind", ["general", "common"])
def test_opening_angle_is_the_one_asked_for(sets, kind, angle):
    found = bundles(kind, sets["dense"], packets=20, width=8, angle=angle)
    np.testing.assert_allclose(openings(found.dir), angle, rtol=1e-6, atol=2e-5)
    # Lanes fill the cone: the nearest ones are well inside.
    if angle:
        inner = openings(found.dir[:, 2:])
        assert (inner <= angle * (1 + 1e-6) + 2e-5).all()
        assert inner.mean() < 0.97 * angle


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("width", [1, 4, 16])
def test_arrays_and_what_lanes_share(sets, kind, width):
    found = bundles(kind, sets["sparse"], packets=9, width=width, angle=20)
    for array in (found.orig, found.dir):
        assert array.shape == (9, width, 3)
        assert array.dtype == np.float32
        assert array.flags.c_contiguous
    np.testing.assert_allclose(np.linalg.norm(found.dir.astype(float), axis=2), 1, atol=2e-7)
    same_origin = (found.orig == found.orig[:, :1]).all()
    same_direction = (found.dir == found.dir[:, :1]).all()
    alone = width == 1
    assert same_origin == (kind == "common" or alone)
    assert same_direction == (kind == "parallel" or alone)
    assert len(np.unique(found.dir[:, 0], axis=0)) == 9
    assert found.soup.nearest.shape == (9 * width,)
    assert found.soup.triangles.tobytes() == sets["sparse"].triangles.tobytes()


def test_parallel_rays_move_apart_as_the_angle_grows(sets):
    def breadth(angle):
        orig = bundles("parallel", sets["dense"], 50, 8, angle).orig.astype(float)
        return np.linalg.norm(orig - orig[:, :1], axis=2).max(axis=1)

    assert (breadth(0) == 0).all()
    assert (breadth(10) > 2 * breadth(1)).all()
    # Two places on a sphere about the centre, 10 degrees apart at most.
    spread = sets["dense"].spread
    assert breadth(10).max() <= spread * 2 * np.sin(np.radians(5)) * (1 + 1e-5)
    assert breadth(10).max() > spread * 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_no_angle_makes_every_lane_the_same_ray(sets, kind):
    found = bundles(kind, sets["dense"], packets=5, width=4, angle=0)
    assert (found.orig == found.orig[:, :1]).all()
    assert (found.dir == found.dir[:, :1]).all()
    assert found.reach == 1


@pytest.mark.parametrize("name", sorted(SETS))
@pytest.mark.parametrize("kind", KINDS)
def test_hit_ratio_stays_about_that_of_the_set(sets, kind, name):
    for angle in ANGLES:
        found = bundles(kind, sets[name], packets=150, width=4, angle=angle, seed=3)
        hits = found.soup.pairs_hit
        assert found.hit_ratio == hits / (600 * 256)
        assert abs(found.hit_ratio - sets[name].hit_ratio) < 0.15 * sets[name].hit_ratio


def test_wide_packets_of_one_origin_come_nearer(sets):
    wide = bundles("common", sets["dense"], 100, 4, 90)
    narrow = bundles("common", sets["dense"], 100, 4, 1)
    assert wide.reach < narrow.reach <= 1
    far = [np.linalg.norm(found.orig.astype(float), axis=2).mean() for found in (wide, narrow)]
    assert far[0] < 0.5 * far[1]


def test_digest_is_stable(sets):
    # A change here changes every workload: raise it to the reader of old records.
    digests = {kind: bundles(kind, sets["dense"], 16, 8, 30, seed=2).digest for kind in KINDS}
    assert digests == DIGESTS
    assert bundles("general", sets["dense"], 16, 8, 30, seed=3).digest != digests["general"]


def test_what_is_not_allowed(sets):
    with pytest.raises(RtbenchError, match="general"):
        bundles("genral", sets["dense"])
    for given in ({"packets": 0}, {"width": 0}, {"angle": -1}, {"angle": 91}, {"seed": -1}):
        with pytest.raises(RtbenchError, match="is not allowed"):
            bundles("general", sets["dense"], **given)
    with pytest.raises(RtbenchError, match="angle nan"):
        bundles("general", sets["dense"], angle=float("nan"))


DIGESTS = {
    "general": "2221894c9f5924cd2af18976558d20f2ef6333eb8237d7a9334c0f54cc0d4ac4",
    "common": "aa37b50d946e8908e4ba8ef3b9a94784fd220e9bacb8082f4c5a4a11596f520e",
    "parallel": "b1d842b06a5d9a9ab687d2d185d998601b35a71f5d2d65fb9b4d0c8e4b5775df",
}
