"""rtbench.Tree as users call it: the interface, and that its answers are brute force's."""

from __future__ import annotations

import numpy as np
import pytest

import rtbench
from rtbench.compiled.layout import REAL_TYPE
from rtbench.trees import ways
from rtbench.workloads.solids import icosphere

NEEDED = [
    "nodes",
    "leaves",
    "empty_leaves",
    "references",
    "depth",
    "bytes",
    "sah_cost",
    "build_seconds",
    "digest",
]
RULES = ("sah", "object_median", "spatial_median")


def rays(n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """From anywhere about a sphere of radius 1 to anywhere in its box; a fifth along an axis."""
    rng = np.random.default_rng(seed)
    origins, targets = rng.uniform(-2, 2, (n, 3)), rng.uniform(-1, 1, (n, 3))
    directions = targets - origins
    along = rng.random(n) < 0.2
    directions[along] = np.eye(3)[rng.integers(0, 3, along.sum())] * rng.choice([-1, 1], 1)
    directions[along & (rng.random(n) < 0.5)] *= -1.0  # -0.0 among them
    return origins.astype(np.float32), directions.astype(np.float32)


def by_pairs(kernel, triangles, origins, directions, precision, tmax=np.inf):
    """Return triangle and t of the nearest hit by asking for every pair."""
    n, m = len(origins), len(triangles)
    hits = rtbench.intersect(
        kernel,
        np.repeat(triangles[None], n, axis=0).reshape(-1, 3, 3),
        np.repeat(origins, m, axis=0),
        np.repeat(directions, m, axis=0),
        precision,
        tmax=tmax,
    )
    t = np.where(hits.hit, hits.t, np.inf).reshape(n, m)
    nearest = t.argmin(axis=1)  # of equal ones the first
    hit = np.isfinite(t.min(axis=1))
    return np.where(hit, nearest, -1), np.where(hit, t.min(axis=1), np.nan), hits


@pytest.mark.parametrize("precision", ["float32", "float64", "mixed"])
@pytest.mark.parametrize(
    "structure, rule",
    [("kd", "sah"), ("kd", "object_median"), ("kd", "spatial_median"), ("bvh", "sah")],
)
def test_answers_are_those_of_all_pairs(structure, rule, precision):
    """A tree of any kind gives the hit that asking for every pair gives, bit for bit."""
    triangles = icosphere(1).triangles
    origins, directions = rays(150)
    kernel = "moller_trumbore_uv"
    tree = rtbench.Tree(triangles, structure, rule, kernel=kernel, precision=precision)
    found = tree.nearest(origins, directions)
    triangle, t, pairs = by_pairs(kernel, triangles, origins, directions, precision)
    np.testing.assert_array_equal(found.triangle, triangle)
    np.testing.assert_array_equal(found.t, t)
    assert found.t.dtype == REAL_TYPE[precision] and found.triangle.dtype == np.int64
    assert found.outcome is None and 20 < found.hit.sum() < 150
    place = np.arange(150)[found.hit] * len(triangles) + triangle[found.hit]
    np.testing.assert_array_equal(found.u[found.hit], pairs.u[place])
    np.testing.assert_array_equal(found.v[found.hit], pairs.v[place])
    assert np.isnan(found.u[~found.hit]).all()
    np.testing.assert_array_equal(tree.occluded(origins, directions), found.hit)


@pytest.mark.parametrize("structure", ["kd", "bvh"])
def test_every_way_gives_the_same_answer(structure):
    """However rays walk, and in how many threads: the same hits."""
    triangles = icosphere(2).triangles
    origins, directions = rays(400, seed=2)
    tree = rtbench.Tree(triangles, structure, kernel="moller_trumbore")
    expected = tree.nearest(origins, directions, way="brute_force")
    for way in ways.allowed(tree.options, tree.form):
        for threads in (1, 2):
            found = tree.nearest(origins, directions, way=way, threads=threads)
            np.testing.assert_array_equal(found.triangle, expected.triangle, err_msg=way)
            np.testing.assert_array_equal(found.t, expected.t, err_msg=way)
        shadowed = tree.occluded(origins, directions, way=way)
        np.testing.assert_array_equal(shadowed, expected.hit, err_msg=way)


def test_of_equal_t_the_lowest_index_is_hit():
    """Twenty copies of one triangle: the first is hit, from either side and whatever the tree."""
    one = np.array([[[-1, -1, 0], [1, -1, 0], [0, 1, 0]]], float)
    for structure in ("kd", "bvh"):
        tree = rtbench.Tree(np.repeat(one, 20, axis=0), structure)
        hits = tree.nearest([[0, 0, -1], [0, 0, 1]], [[0, 0, 1], [0, 0, -1]])
        assert hits.triangle.tolist() == [0, 0]


def test_tmax_is_open_and_may_differ_from_ray_to_ray():
    """A hit at t = 1 counts below 1.5 and not below 1."""
    one = np.array([[[-1, -1, 0], [1, -1, 0], [0, 1, 0]]], float)
    origins, directions = np.tile([[0.0, 0, -1]], (3, 1)), np.tile([[0.0, 0, 1]], (3, 1))
    for kernel in ("moller_trumbore", "watertight_safe", "adaptive_exact", "moller1"):
        tree = rtbench.Tree(one, kernel=kernel)
        assert tree.nearest(origins, directions, tmax=[1.5, 1.0, 0.5]).hit.tolist() == [1, 0, 0]
        assert tree.occluded(origins, directions, tmax=[1.5, 1.0, 0.5]).tolist() == [1, 0, 0]
    assert rtbench.Tree(one).nearest(origins, directions, tmax=1.0).triangle.tolist() == [-1] * 3


def test_quality_says_what_it_should():
    """Every promised number is there, and they fit together."""
    for structure in ("kd", "bvh"):
        found = rtbench.Tree(icosphere(2).triangles, structure).quality()
        assert set(NEEDED) <= set(found)
        assert found["leaves"] > 1 and found["references"] >= 320 and found["sah_cost"] > 0
        assert 0 < found["depth"] <= 62 and found["build_seconds"] > 0
        assert not any(isinstance(value, dict | list) for value in found.values())


@pytest.mark.parametrize("structure", ["kd", "bvh"])
def test_without_triangles_and_without_rays(structure):
    """Nothing is hit in an empty scene, and no ray gives no hit."""
    empty = rtbench.Tree(np.zeros((0, 3, 3)), structure)
    assert not empty.nearest([[0, 0, 0]], [[0, 0, 1]]).hit.any()
    assert not empty.occluded([[0, 0, 0]], [[0, 0, 1]]).any()
    assert len(rtbench.Tree(icosphere(0).triangles, structure).nearest(*rays(0)).t) == 0


def test_strange_rays_miss():
    """NaN, infinity and a zero direction hit nothing and do not hang."""
    tree = rtbench.Tree(icosphere(1).triangles)
    bad = [np.nan, np.inf, -np.inf]
    directions = np.array([[0, 0, 0], *[[0, b, 1] for b in bad]])
    assert not tree.nearest(np.zeros((4, 3)), directions).hit.any()
    origins = np.array([[b, 0, 0] for b in bad])
    assert not tree.nearest(origins, np.ones((3, 3))).hit.any()


def test_bad_input_is_one_line():
    """Every mistake is told in a line that names the value and what is allowed."""
    triangles = icosphere(0).triangles
    broken = triangles.copy()
    broken[7, 1, 2] = np.nan
    for arguments, words in (
        ((triangles[:, :2],), ["(20, 2, 3)", "(M, 3, 3)"]),
        ((broken,), ["triangle 7", "1 of 20"]),
        ((triangles, "octree"), ["octree", "kd"]),
        ((triangles, "kd", "sahh"), ["sahh", "sah"]),
        ((triangles, "kd", "sah", "nlog"), ["nlog", "nlogn"]),
        ((triangles, "kd", "sah", "nlogn", "moller9"), ["moller9", "moller"]),
        ((triangles, "kd", "sah", "nlogn", "moller1", "float16"), ["float16", "float32"]),
    ):
        with pytest.raises(ValueError) as told:
            rtbench.Tree(*arguments)
        assert all(word in str(told.value) for word in words) and "\n" not in str(told.value)
    with pytest.raises(ValueError, match="max_leaf"):
        rtbench.Tree(triangles, max_leaf=0)
    with pytest.raises(ValueError, match="max_leafs"):
        rtbench.Tree(triangles, max_leafs=1)
    tree = rtbench.Tree(triangles)
    for call, words in (
        (lambda: tree.nearest(np.zeros((2, 3)), np.ones((3, 3))), "2 origins and 3 directions"),
        (lambda: tree.nearest(np.zeros((2, 3)), np.ones((2, 3)), tmax=[1, 2, 3]), "tmax"),
        (lambda: tree.nearest(np.zeros((2, 2)), np.ones((2, 3))), "origins"),
        (lambda: tree.nearest(np.zeros((2, 3)), np.ones((2, 3)), threads=0), "threads 0"),
        (lambda: tree.nearest(np.zeros((2, 3)), np.ones((2, 3)), way="wide"), "wide"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
