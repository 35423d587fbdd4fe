"""What is said of a tree, against a tree made by hand, and against rays that walk through it."""

import numpy as np
import pytest
import tree_scenes

from rtbench.kernels import registry
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import LEAF, NODE, KdTree, one_leaf
from rtbench.trees.options import Options
from rtbench.trees.quality import chords, counted, leaf_depths, leaf_sizes, per_ray, quality


def by_hand(**options):
    """Return four triangles in a box of 4 x 2 x 1: cut at x = 1, its right part at y = -0.5.

    Left {0, 1}; right: below nothing, above {1, 2, 3}.
    """
    box = np.array([-2, -1, -0.5, 2, 1, 0.5], np.float32)
    nodes = np.array(
        [
            (1 << 2 | 0, 1.0),
            (0 << 2 | LEAF, 2),
            (3 << 2 | 1, -0.5),
            (2 << 2 | LEAF, 0),
            (2 << 2 | LEAF, 3),
        ],
        NODE,
    )
    corners = np.array([[[-2, -1, -0.5], [0, 0, 0], [2, 1, 0.5]]] * 4)
    refs = np.array([0, 1, 1, 2, 3], np.int32)
    return KdTree(nodes, refs, box, 2, Options(**options)), Geometry.of(corners)


def test_of_a_tree_made_by_hand():
    # Half surfaces: root 4*2 + 2*1 + 1*4 = 14; left 3*2 + 2 + 3 = 11; right 1*2 + 2 + 1 = 5;
    # below 1*0.5 + 0.5 + 1 = 2; above 1*1.5 + 1.5 + 1 = 4.
    tree, geometry = by_hand(traversal_cost=3.0, intersection_cost=2.0)
    found = quality(tree, geometry)
    assert found["expected_steps"] == pytest.approx(1 + 5 / 14)
    assert found["expected_leaves"] == pytest.approx(11 / 14 + 4 / 14)
    assert found["expected_tests"] == pytest.approx(2 * 11 / 14 + 3 * 4 / 14)
    assert found["sah_cost"] == pytest.approx(3 * 19 / 14 + 2 * 34 / 14)
    assert found["mean_leaf_depth"] == pytest.approx(5 / 3)
    assert found["references_per_triangle"] == 1.25 and found["triangles_per_full_leaf"] == 2.5
    counts = {
        "nodes": 5,
        "leaves": 3,
        "empty_leaves": 1,
        "full_leaves": 2,
        "references": 5,
        "depth": 2,
        "largest_leaf": 3,
        "bytes": 60,
    }
    assert {name: found[name] for name in counts} == counts
    assert leaf_sizes(tree).tolist() == [1, 0, 1, 1]
    assert leaf_depths(tree).tolist() == [0, 1, 2]


def test_blocks_cost_what_they_hold_at_most():
    tree, geometry = by_hand(traversal_cost=3.0, intersection_cost=2.0, block=2)
    # One block at the left, two above: 1 * 11 + 2 * 4.
    assert quality(tree, geometry)["sah_cost"] == pytest.approx(3 * 19 / 14 + 2 * 19 / 14)


def test_of_trees_of_one_leaf():
    for triangles, references in ((np.zeros((0, 3, 3)), 0), (tree_scenes.ONE, 1)):
        geometry = Geometry.of(triangles)
        found = quality(one_leaf(references, geometry.box, Options()), geometry)
        assert found["leaves"] == 1 and found["depth"] == found["expected_steps"] == 0
        assert found["expected_tests"] == found["sah_cost"] == references
        assert np.isnan(found["references_per_triangle"]) == (not references)


def test_a_scene_without_surface_has_finite_numbers():
    geometry = Geometry.of(np.ones((12, 3, 3)))
    tree = build(geometry, Options())
    assert quality(tree, geometry)["expected_tests"] == 12


def test_the_cost_of_the_root_cut_once_is_the_builders():
    """The tree's cost is what the cost model told when it chose the plane (equation 3.7)."""
    geometry = Geometry.of(tree_scenes.soup(3, 30))
    options = Options(max_depth=1, ending="ad_hoc", empty_bonus=1.0)
    found = quality(build(geometry, options), geometry)
    assert found["leaves"] == 2
    leaf = quality(one_leaf(30, geometry.box, options), geometry)["sah_cost"]
    assert found["sah_cost"] < leaf == 30


@pytest.mark.parametrize("scene, error", [("soup", 0.02), ("stairs", 0.06)])
def test_chords_meet_what_is_expected(scene, error):
    """Lines of equal chance, ending nowhere, meet cells with the ratio of surfaces."""
    triangles = tree_scenes.soup(4, 300, 0.1) if scene == "soup" else tree_scenes.stairs(40)
    geometry = Geometry.of(triangles + np.array([1e3, -50.0, 0.5]))
    tree = build(geometry, Options())
    found = quality(tree, geometry)
    kernel = registry.find("moller_trumbore_uv")
    lines = chords(geometry, 40_000, seed=5)
    met = counted(kernel, "float32", geometry, tree, *lines, through=True)
    assert 10_000 < met["rays"] < 40_000
    for name in ("steps", "leaves", "tests"):
        # The error of the mean of so many rays: on the stairs few meet a leaf, but then many.
        assert met[name] == pytest.approx(found[f"expected_{name}"], rel=error)
    ending = counted(kernel, "float32", geometry, tree, *lines)
    assert ending["rays"] == met["rays"] and 0 < ending["tests"] < 0.9 * met["tests"]


def test_rays_that_miss_the_box_do_not_count():
    counts = np.array([[4, 1, 2], [0, 0, 0], [2, 0, 0]], np.int32)
    assert per_ray(counts) == {"rays": 2, "steps": 3.0, "leaves": 0.5, "tests": 1.0}
    assert np.isnan(per_ray(counts[1:2])["steps"])
