"""The builders of SAH trees: the exact ones against each other and against the rules."""

import dataclasses
import itertools

import numpy as np
import pytest
import tree_rules
import tree_scenes

from rtbench.errors import RtbenchError
from rtbench.trees.builders import n2, per_node
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import AXES, CANDIDATES, ENDINGS, Options

VARIANTS = [
    {"axes": axes, "candidates": candidates, "ending": ending, **more}
    for (axes, candidates, ending), more in zip(
        itertools.product(AXES, CANDIDATES, ENDINGS),
        itertools.cycle(
            (
                {},
                {"flat_cells": False},
                {"block": 4, "max_leaf": 4},
                {"empty_bonus": 1.0, "traversal_cost": 0.5},
                {"max_depth": 5},
            )
        ),
        strict=False,
    )
]


def tree_of(triangles, builder="nlog2n", **more):
    return build(Geometry.of(triangles), Options(builder=builder, **more))


def assert_is(tree, nodes, refs):
    assert len(tree.nodes) == len(nodes)
    links, splits = zip(*nodes, strict=True)
    np.testing.assert_array_equal(tree.nodes["link"], links)
    np.testing.assert_array_equal(tree.nodes["split"], splits)
    np.testing.assert_array_equal(tree.refs, refs)


@pytest.mark.parametrize("number", range(len(VARIANTS)))
def test_follows_the_rules_on_soups(number):
    options = Options(builder="nlog2n", **VARIANTS[number])
    geometry = Geometry.of(tree_scenes.soup(number, 4 + number))
    assert_is(build(geometry, options), *tree_rules.build(geometry, options))


@pytest.mark.parametrize("name", tree_scenes.HARD)
def test_follows_the_rules_on_hard_scenes(name):
    options = Options(builder="nlog2n", traversal_cost=0.7)
    geometry = Geometry.of(tree_scenes.HARD[name])
    assert_is(build(geometry, options), *tree_rules.build(geometry, options))


def same_trees(builder, scenes, variants):
    """Assert that a builder makes the trees of nlog2n, and that these are trees at all."""
    cut = 0
    for triangles, variant in itertools.product(scenes, variants):
        tree, other = (tree_of(triangles, of, **variant) for of in ("nlog2n", builder))
        assert tree.digest == other.digest, variant
        assert tree.depth == other.depth
        cut += len(tree.nodes) > 1
    assert cut > len(scenes) // 2


@pytest.mark.parametrize("builder", ("n2", "nlogn"))
def test_exact_builders_make_one_tree_of_20_soups(builder):
    pytest.importorskip(f"rtbench.trees.builders.{builder}")
    scenes = [tree_scenes.soup(seed, 20 + 40 * seed, 1 / (1 + seed)) for seed in range(20)]
    same_trees(builder, scenes, [{}, {"flat_cells": False, "axes": "longest"}])


@pytest.mark.parametrize("builder", ("n2", "nlogn"))
def test_exact_builders_make_one_tree_of_hard_scenes(builder):
    pytest.importorskip(f"rtbench.trees.builders.{builder}")
    scenes = [*tree_scenes.HARD.values(), tree_scenes.floor(20), tree_scenes.lattice(5)]
    same_trees(builder, scenes, [{}, *VARIANTS])


def test_depth_and_numbering():
    tree = tree_of(tree_scenes.soup(1, 200))
    inner = ~tree.is_leaf
    _, depths = tree_rules.cells_of(tree)
    assert tree.depth == depths.max()
    # Each node but the root is a child once, and pairs are taken in depth-first order.
    children = tree.nodes["link"][inner] >> 2
    assert sorted([*children, *(children + 1)]) == list(range(1, len(tree.nodes)))
    waiting, taken = [0], 1
    while waiting:
        node = waiting.pop()
        if inner[node]:
            assert tree.nodes["link"][node] >> 2 == taken
            waiting += [taken + 1, taken]
            taken += 2
    begins, counts = tree.leaves
    for begin, count in zip(begins, counts, strict=True):
        assert (np.diff(tree.refs[begin : begin + count]) > 0).all()


def test_a_cell_is_cut_at_its_best_plane():
    triangles = tree_scenes.soup(3, 300, 0.05)
    geometry, options = Geometry.of(triangles), Options(builder="nlog2n", empty_bonus=1.0)
    tree = build(geometry, options)
    cells, _ = tree_rules.cells_of(tree)
    link, split = tree.nodes[0]
    assert link & 3 != 3
    boxes, cell = geometry.boxes.astype(float), cells[0]

    def areas(size):
        return (
            size[..., 0] * size[..., 1] + size[..., 1] * size[..., 2] + size[..., 2] * size[..., 0]
        )

    costs = {}
    for axis in range(3):
        low, high = boxes[:, axis], boxes[:, axis + 3]
        for plane in np.unique(np.concatenate([low, high])):
            left = right = cell[3:] - cell[:3]
            left, right = left.copy(), right.copy()
            left[axis], right[axis] = plane - cell[axis], cell[axis + 3] - plane
            tests = areas(left) * (low < plane).sum() + areas(right) * (high > plane).sum()
            costs[axis, plane] = 2.0 + tests / areas(cell[3:] - cell[:3])
    assert len(costs) == 1800
    assert costs[link & 3, split] == pytest.approx(min(costs.values()), rel=1e-12)
    assert min(costs, key=costs.get) == (link & 3, split)


@pytest.mark.parametrize("builder", ("nlog2n", "binned"))
def test_points_of_triangles_are_in_the_leaves_around_them(builder):
    triangles = np.concatenate([tree_scenes.soup(4, 150), tree_scenes.lattice(2) / 2])
    geometry = Geometry.of(triangles)
    tree = build(geometry, Options(builder=builder))
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), 40)
    weights = np.concatenate([np.eye(3), weights])
    corners = geometry.corners.astype(float) - geometry.base
    nodes = tree.nodes.tolist()
    leaves = 0
    for i, triangle in enumerate(corners):
        for point in weights @ triangle:
            node, belongs = [0], False
            while node:  # where it lies in a plane, either side will do
                link, split = nodes[node.pop()]
                if link & 3 == 3:
                    leaves += 1
                    belongs |= i in tree.refs[link >> 2 : (link >> 2) + int(split)]
                else:
                    x = point[link & 3]
                    node += [link >> 2] * bool(x <= split + 1e-12) + [(link >> 2) + 1] * bool(
                        x >= split - 1e-12
                    )
            assert belongs, i
    assert leaves >= len(corners) * len(weights)


def test_endings():
    triangles = tree_scenes.soup(5, 300, 0.1)
    ad_hoc = tree_of(triangles, ending="ad_hoc", max_leaf=8, max_depth=9)
    _, depths = tree_rules.cells_of(ad_hoc)
    counts = ad_hoc.nodes["split"][ad_hoc.is_leaf]
    assert (counts[depths[ad_hoc.is_leaf] < 9] <= 8).all()
    assert depths.max() == ad_hoc.depth == 9
    automatic = tree_of(triangles, ending="automatic", max_leaf=8, max_depth=2)
    assert automatic.depth > 2
    both = tree_of(triangles, ending="both", max_leaf=8, max_depth=7)
    assert 1 < len(both.nodes) < min(len(ad_hoc.nodes), len(automatic.nodes))
    assert both.depth <= 7
    assert tree_of(triangles, max_depth=0).nodes.tolist() == [(3, 300.0)]


def test_flat_cells_cut_off_what_lies_in_a_side():
    """Source: the cell of Wald & Havran 2006, figure 2."""
    triangles = np.concatenate([tree_scenes.floor(3), tree_scenes.soup(2, 30, 0.1) * 3 + [0, 0, 1]])
    with_them = tree_of(triangles)
    cells, _ = tree_rules.cells_of(with_them)
    flat = with_them.is_leaf & (cells[:, 2] == cells[:, 5])
    assert with_them.nodes["split"][flat].sum() >= 18
    without = tree_of(triangles, flat_cells=False)
    cells, _ = tree_rules.cells_of(without)
    assert (cells[:, 2] < cells[:, 5]).all()


def test_zero_has_one_sign():
    tree = tree_of(np.concatenate([tree_scenes.lattice(4) - 2, 2 - tree_scenes.lattice(4)]))
    splits = tree.nodes["split"]
    assert (splits == 0).sum() > 3
    assert not np.signbit(splits[splits == 0]).any()


@pytest.mark.parametrize("builder", ("nlog2n", "n2", "binned"))
def test_works_in_steps(builder, monkeypatch):
    triangles = tree_scenes.soup(6, 500)
    whole = tree_of(triangles, builder)
    monkeypatch.setattr(per_node, "WORK", 100)
    fractions = []
    options = Options(builder=builder)
    tree = build(Geometry.of(triangles), options, fractions.append)
    assert tree.digest == whole.digest
    assert len(fractions) > 20
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] < 0.5 < fractions[-1] <= 1 + 1e-9


def test_can_be_interrupted(monkeypatch):
    def interrupt(fraction):
        raise KeyboardInterrupt

    monkeypatch.setattr(per_node, "WORK", 100)
    with pytest.raises(KeyboardInterrupt):
        build(Geometry.of(tree_scenes.soup(6, 500)), Options(builder="nlog2n"), interrupt)


def test_a_tree_beyond_its_links_is_refused(monkeypatch):
    monkeypatch.setattr(per_node, "MOST_LINKS", 1001)
    with pytest.raises(RtbenchError, match=r"nodes, more than 1,001: end earlier \(max_leaf"):
        tree_of(tree_scenes.soup(6, 500), ending="ad_hoc", max_depth=30)


def test_n2_says_why_it_refuses():
    geometry = Geometry.of(np.zeros((n2.MOST + 1, 3, 3)))
    with pytest.raises(RtbenchError) as refused:
        build(geometry, Options(builder="n2"))
    said = str(refused.value)
    assert "100,001 triangles at 600,006 planes" in said
    assert "1 minutes in all (allowed: 100,000 triangles); nlogn gives the same tree" in said
    assert "\n" not in said


@pytest.mark.parametrize("kind", ("even", "clustered", "lattice"))
def test_binned_trees_are_nearly_as_good(kind):
    triangles = {
        "even": lambda: tree_scenes.soup(7, 3000, 0.01),
        "clustered": lambda: tree_scenes.soup(7, 3000, 0.01) ** 3,
        "lattice": lambda: tree_scenes.lattice(9),
    }[kind]()
    exact, binned = (
        tree_rules.expected_cost(tree_of(triangles, builder)) for builder in ("nlog2n", "binned")
    )
    assert exact * 0.9 < binned < exact * 1.1
    assert tree_of(triangles, "binned").digest != tree_of(triangles, "nlog2n").digest


def test_small_cells_are_cut_exactly_where_others_are_binned():
    triangles = tree_scenes.soup(8, 32)
    assert tree_of(triangles, "binned").digest == tree_of(triangles, "nlog2n").digest


@pytest.mark.parametrize("name", tree_scenes.HARD)
@pytest.mark.parametrize("builder", ("binned", "as_printed"))
def test_hard_scenes_end(builder, name):
    for ending in ENDINGS:
        tree = tree_of(np.tile(tree_scenes.HARD[name], (3, 1, 1)), builder, ending=ending)
        assert set(tree.refs) == set(range(3 * len(tree_scenes.HARD[name])))


def test_as_printed_costs_where_abutting_triangles_lie_in_the_plane():
    for triangles, refs, dearer in (
        (tree_scenes.lattice(6), 1.5, 1.3),
        (tree_scenes.stairs(30), 1.5, 1.2),
    ):
        printed, exact = (tree_of(triangles, builder) for builder in ("as_printed", "nlog2n"))
        assert len(printed.refs) > refs * len(exact.refs)
        costs = [tree_rules.expected_cost(tree) for tree in (printed, exact)]
        assert costs[0] > dearer * costs[1]


@pytest.mark.parametrize("candidates", CANDIDATES)
def test_as_printed_is_exact_where_no_triangle_is_flat(candidates):
    """Abutting alone does no harm: starts are taken before ends, but the cost is asked between."""
    for triangles in (tree_scenes.floor(12), tree_scenes.soup(9, 200)):
        printed, exact = (
            tree_of(triangles, builder, candidates=candidates)
            for builder in ("as_printed", "nlog2n")
        )
        assert printed.digest == exact.digest
        assert len(printed.nodes) > 100


def test_options_are_kept():
    options = Options(builder="nlog2n", max_leaf=3)
    tree = build(Geometry.of(tree_scenes.soup(1)), options)
    assert tree.options == options
    assert dataclasses.replace(tree.options, max_leaf=1) == Options(builder="nlog2n")
