"""Trees whose cells are halved, or cut at the median of their triangles."""

import numpy as np
import pytest
import tree_rules
import tree_scenes

from rtbench.trees import cost
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import AXES, ENDINGS, Options

RULES = ("spatial_median", "object_median")


def made(triangles, rule, **more):
    """Return geometry, tree, cells and depths."""
    geometry = Geometry.of(triangles)
    tree = build(geometry, Options(rule=rule, overlap="box", **more))
    return geometry, tree, *tree_rules.cells_of(tree)


def held_by(boxes, cell):
    """Return which boxes share more than a side with a cell, or lie inside it."""
    low, high = boxes[:, :3], boxes[:, 3:]
    flat = (low == high) & (low >= cell[:3]) & (low <= cell[3:])
    return (flat | ((low < cell[3:]) & (high > cell[:3]))).all(axis=1)


@pytest.mark.parametrize("axes", AXES)
def test_spatial_median_halves_the_cell(axes):
    _, tree, cells, depths = made(tree_scenes.soup(1, 200), "spatial_median", axes=axes)
    inner = np.flatnonzero(~tree.is_leaf)
    assert len(inner) > 30
    chosen = set()
    for node in inner:
        axis, cell = tree.nodes["link"][node] & 3, cells[node]
        assert tree.nodes["split"][node] == np.float32((cell[axis] + cell[axis + 3]) / 2)
        size = cell[3:] - cell[:3]
        if axes == "longest":
            assert size[axis] == size.max()
        if axes == "round_robin":
            chosen.add((int(axis), int(depths[node] % 3)))
    if axes == "round_robin":  # another axis where the wanted one separates nothing
        assert {(0, 0), (1, 1), (2, 2)} <= chosen


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("seed", range(3))
def test_object_median_leaves_half_and_straddlers_on_a_side(axes, seed):
    triangles = tree_scenes.soup(seed, 300, 0.02 * (seed + 1))
    geometry, tree, cells, _ = made(triangles, "object_median", axes=axes)
    boxes = geometry.boxes.astype(float)
    inner = np.flatnonzero(~tree.is_leaf)
    assert len(inner) > 30
    for node in inner:
        cell, plane = cells[node], float(tree.nodes["split"][node])
        axis = tree.nodes["link"][node] & 3
        here = boxes[held_by(boxes, cell)]
        low = np.maximum(here[:, axis], cell[axis])
        high = np.minimum(here[:, axis + 3], cell[axis + 3])
        median = np.sort((low + high) / 2)[(len(here) - 1) // 2]
        assert plane == np.float32(median)
        straddlers = ((low < plane) & (high > plane)).sum()
        planar = ((low == plane) & (high == plane)).sum()
        most = len(here) / 2 + straddlers + planar
        assert (low < plane).sum() <= most
        assert (high > plane).sum() <= most


def test_all_axes_are_compared_by_cost():
    triangles = tree_scenes.soup(2, 200, 0.05) * [1, 2, 3]
    geometry, tree, cells, _ = made(triangles, "spatial_median", axes="all", empty_bonus=1.0)
    boxes, cell = geometry.boxes.astype(float), cells[0]
    costs = []
    for axis in range(3):
        plane = (cell[axis] + cell[axis + 3]) / 2
        left, right = (boxes[:, axis] < plane).sum(), (boxes[:, axis + 3] > plane).sum()
        size = cell[3:] - cell[:3]
        model = cost.model(tree.options)
        costs.append(cost.split_cost(*size, axis, size[axis] / 2, left, right, model))
    assert np.argmin(costs) == tree.nodes["link"][0] & 3


@pytest.mark.parametrize("rule", RULES)
def test_every_triangle_is_in_the_leaves_it_reaches(rule):
    triangles = np.concatenate([tree_scenes.soup(3, 150), tree_scenes.stairs(6) / 5])
    geometry, tree, cells, _ = made(triangles, rule)
    boxes = geometry.boxes.astype(float)
    pairs = 0
    for node in np.flatnonzero(tree.is_leaf):
        link, split = tree.nodes[node]
        there = tree.refs[link >> 2 : (link >> 2) + int(split)]
        low, high, cell = boxes[:, :3], boxes[:, 3:], cells[node]
        # A flat one in a common side is in one of the two cells: that it is in one, see below.
        inside = np.where(
            low == high,
            (low > cell[:3]) & (low < cell[3:]),
            (low < cell[3:]) & (high > cell[:3]),
        ).all(axis=1)
        assert set(np.flatnonzero(inside)) <= set(there)
        touched = ((low <= cell[3:]) & (high >= cell[:3])).all(axis=1)
        assert touched[there].all()
        pairs += inside.sum()
    assert pairs > len(triangles)
    assert set(tree.refs) == set(range(len(triangles)))


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("axes", AXES)
def test_hard_scenes_end(rule, ending, axes):
    for name, triangles in tree_scenes.HARD.items():
        _, tree, _, _ = made(triangles, rule, ending=ending, axes=axes)
        assert set(tree.refs) == set(range(len(triangles))), name
        assert len(tree.refs) < 5000 * len(triangles), name


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("axes", AXES)
def test_what_no_plane_separates_is_a_leaf(rule, axes):
    copies = np.repeat(tree_scenes.ONE, 3000, axis=0)
    _, tree, _, _ = made(copies, rule, ending="ad_hoc", axes=axes)
    assert tree.nodes["split"].max() == 3000
    assert len(tree.refs) == 3000
    concentric = tree_scenes.HARD["equal centroids"]
    _, tree, _, _ = made(concentric, "object_median", ending="ad_hoc", axes=axes)
    assert set(tree.refs) == set(range(len(concentric)))
    assert len(tree.refs) < 500 * len(concentric)


@pytest.mark.parametrize("rule", RULES)
def test_endings(rule):
    triangles = tree_scenes.soup(5, 400, 0.05)
    _, ad_hoc, _, depths = made(triangles, rule, ending="ad_hoc", max_leaf=6, max_depth=8)
    counts = ad_hoc.nodes["split"][ad_hoc.is_leaf]
    assert (counts[depths[ad_hoc.is_leaf] < 8] <= 6).all()
    assert ad_hoc.depth == 8
    _, automatic, cells, _ = made(triangles, rule, ending="automatic", max_leaf=6, max_depth=2)
    assert automatic.depth > 2
    # Every cut pays: equation 3.8.
    boxes = Geometry.of(triangles).boxes.astype(float)
    model = cost.model(automatic.options)
    for node in np.flatnonzero(~automatic.is_leaf):
        axis, plane = automatic.nodes["link"][node] & 3, float(automatic.nodes["split"][node])
        size = cells[node][3:] - cells[node][:3]
        here = boxes[held_by(boxes, cells[node])]
        left, right = (here[:, axis] < plane).sum(), (here[:, axis + 3] > plane).sum()
        below = plane - cells[node][axis]
        assert cost.split_cost(*size, axis, below, left, right, model) < len(here)
