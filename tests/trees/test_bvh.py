"""The bounding volume hierarchy: what it holds, and walks through it against brute force."""

import itertools

import numpy as np
import pytest
from group_answers import assert_same, hard_rays, some
from tree_answers import EXACT, assert_equal, by_pairs, walked
from tree_scenes import HARD, lattice, soup

from rtbench.compiled import vector_memory
from rtbench.compiled.layout import REAL_TYPE
from rtbench.errors import RtbenchError
from rtbench.kernels import registry
from rtbench.trees import leaves
from rtbench.trees.bvh import steps, wide
from rtbench.trees.bvh.build import DEEPEST, build
from rtbench.trees.bvh.nodes import aligned, leaves_of
from rtbench.trees.bvh.quality import chances, quality
from rtbench.trees.geometry import Geometry
from rtbench.trees.leaves import IN_BLOCKS, ONE_BY_ONE
from rtbench.trees.options import Options
from rtbench.trees.quality import chords
from rtbench.trees.traversal import walks
from rtbench.workloads.hard_scenes import scenes
from rtbench.workloads.solids import icosphere

BLOCKS = Options(structure="bvh", block=8, max_leaf=8)
SINGLE = Options(structure="bvh")
FULL, FORMS = pytest.mark.full, (IN_BLOCKS, ONE_BY_ONE)
MADE = {
    **HARD,
    "a thousand duplicates": np.repeat(soup(1, 1), 1000, axis=0),
    "two points, many each": np.repeat(soup(2, 2)[:, :1], 3, axis=1).repeat(200, axis=0),
    "exponents": soup(3, 300) * 2.0 ** -np.arange(0, 120, 0.4)[:, None, None],
    "huge": soup(4, 100) * 1e26,
    "tiny": soup(5, 100) * 1e-37,
    "a soup": soup(6, 1500, 0.02),
    "icosphere": icosphere(3).triangles,
}


def asked(kernel, precision, geometry, bvh, rays, query="nearest", form=IN_BLOCKS, order=None):
    """Return outcome, t, u, v (N,) and counts (N, 3) of a walk over (origins, directions, tmax)."""
    chosen = registry.find(kernel)
    read = leaves_of(chosen, precision, geometry, bvh, form)
    records = leaves.rays(chosen, precision, *rays)
    n, real = len(records), REAL_TYPE[precision]
    scene = np.concatenate([geometry.base, geometry.box, [geometry.reach]])
    outcome, counts = np.full(n, -7, np.int32), np.full((n, 3), -7, np.int32)
    t, u, v = (np.zeros(n, real) for _ in range(3))
    order = (np.zeros(1, np.uint64), np.arange(n, dtype=np.uint64)) if order is None else order
    wide.walk(chosen, precision, query, form, True).call(
        *(read.nodes, read.refs, read.triangles, scene, records, *order),
        *(outcome, t, u, v, counts),
    )
    return outcome, t, u, v, counts


def below(bvh, node=0, depth=1, low=None, high=None):
    """Yield the leaves below a node: its references and depth, and the boxes around it (B, 6)."""
    record = bvh.nodes[node]
    for k in range(8):
        box = record["boxes"][:, k]
        if box[0] > box[3]:
            assert record["count"][k] == 0, "an empty slot holds something"
            continue
        around = box[None] if low is None else np.concatenate([low, box[None]])
        child, count = record["child"][k], record["count"][k]
        if count:
            yield bvh.refs[child : child + count], depth, around
        else:
            assert child > node, "a node lies before its parent"
            yield from below(bvh, child, depth + 1, around)


@pytest.mark.parametrize("options", [BLOCKS, SINGLE], ids=["blocks", "single"])
@pytest.mark.parametrize("name", MADE)
def test_every_triangle_is_in_one_leaf_and_inside_all_boxes_above(name, options):
    geometry = Geometry.of(MADE[name], "float32")
    bvh = build(geometry, options)
    found, depths = [], []
    for refs, depth, around in below(bvh):
        assert 0 < len(refs) <= 8
        boxes = geometry.boxes[refs]
        assert (around[:, None, :3] <= boxes[None, :, :3]).all()
        assert (around[:, None, 3:] >= boxes[None, :, 3:]).all()
        # The innermost box has nothing to spare.
        np.testing.assert_array_equal(around[-1, :3], boxes[:, :3].min(axis=0))
        np.testing.assert_array_equal(around[-1, 3:], boxes[:, 3:].max(axis=0))
        found.append(refs)
        depths.append(depth)
    np.testing.assert_array_equal(np.sort(np.concatenate(found)), np.arange(len(geometry)))
    assert bvh.depth == max(depths) <= DEEPEST
    assert len(bvh.nodes) == 1 + bvh.is_node.sum()
    assert build(geometry, options).digest == bvh.digest
    told = quality(bvh, geometry)
    assert told["leaves"] == len(found)
    assert told["mean_leaf_depth"] == pytest.approx(np.mean(depths))


def test_options_count():
    geometry = Geometry.of(soup(6, 1500, 0.02))
    sizes = {
        name: quality(build(geometry, options), geometry)["largest_leaf"]
        for name, options in {
            "max_leaf 1": Options(structure="bvh", ending="ad_hoc", max_leaf=1),
            "max_leaf 40": Options(structure="bvh", ending="ad_hoc", max_leaf=40),
            "max_depth 0": Options(structure="bvh", max_depth=0),
            "max_depth 1": Options(structure="bvh", max_depth=1),
            "dear steps": Options(structure="bvh", traversal_cost=100.0, ending="automatic"),
        }.items()
    }
    assert sizes["max_leaf 1"] == 1
    assert 8 < sizes["max_leaf 40"] <= 40
    assert sizes["max_depth 0"] == 1500 > sizes["max_depth 1"] > 400
    assert 4 < sizes["dear steps"] <= 8


def test_progress_is_told(monkeypatch):
    monkeypatch.setattr("rtbench.trees.bvh.build.WORK", 1000)
    told = []
    geometry = Geometry.of(soup(6, 1500, 0.02))
    stopped = build(geometry, BLOCKS, told.append)
    assert len(told) > 10 and told == sorted(told) and 0 <= told[0] < told[-1] <= 1
    monkeypatch.undo()
    assert stopped.digest == build(geometry, BLOCKS).digest


def test_a_good_cut_is_found():
    """Two clusters far apart share no node but the root, and cost what their own roots do."""
    one = soup(1, 400, 0.01) * 0.01
    geometry = Geometry.of(np.concatenate([one, one + 100.0]))
    bvh = build(geometry, BLOCKS)
    halves = [set((refs >= 400).tolist()) for refs, *_ in below(bvh)]
    assert all(len(each) == 1 for each in halves)
    assert quality(bvh, geometry)["expected_steps"] < 1.001


def test_expected_steps_are_those_of_random_lines():
    """Lines that nothing stops meet as many nodes and leaves as the surfaces of boxes say."""
    geometry = Geometry.of(icosphere(4).triangles, "float32")
    bvh = build(geometry, BLOCKS)
    told = quality(bvh, geometry)
    gone = Geometry(
        np.full_like(geometry.corners, np.nan), geometry.base, geometry.boxes, geometry.box, 1.0
    )
    lines = *chords(geometry, 40_000), np.inf
    counts = asked("moller_trumbore_uv", "float32", gone, bvh, lines)[4]
    counts = counts[counts.any(axis=1)]
    assert len(counts) > 15_000
    means = counts.mean(axis=0)
    assert means[0] == pytest.approx(told["expected_steps"], rel=0.03)
    assert means[1] == pytest.approx(told["expected_leaves"], rel=0.03)


def test_chances_of_two_halves():
    flat = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[3, 0, 0], [4, 0, 0], [3, 1, 0]]])
    bvh = build(Geometry.of(flat), Options(structure="bvh", ending="ad_hoc"))
    np.testing.assert_allclose(np.sort(chances(bvh)[0])[-2:], 0.25)
    assert (np.sort(chances(bvh)[0])[:6] == 0).all()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("count", [0, 1])
def test_no_triangle_and_one(form, count):
    triangles = HARD["one triangle"][:count]
    geometry = Geometry.of(triangles)
    bvh = build(geometry, SINGLE)
    rays = hard_rays()
    found = asked("moller_trumbore_uv", "float32", geometry, bvh, rays, form=form)
    assert_same(found, by_pairs("moller_trumbore_uv", "float32", triangles, *rays))
    if form == IN_BLOCKS:
        any_hit = asked("moller_trumbore_uv", "float32", geometry, bvh, rays, "any")
        np.testing.assert_array_equal(any_hit[0], found[0] >= 0)
    assert (found[0] >= 0).any() == bool(count)


def test_hard_scenes():
    """Nearest and any hit of all rays of every hard scene."""
    hits = 0
    for name, scene in scenes(1).items():
        agree(name, scene.triangles, scene, "moller_trumbore_uv", "float32", IN_BLOCKS)
        hits += 1
    assert hits > 20


def agree(name, triangles, scene, kernel, precision, form, queries=("nearest", "any")):
    geometry = Geometry.of(triangles, precision)
    bvh = build(geometry, BLOCKS if form == IN_BLOCKS else SINGLE)
    rays = scene.origins, scene.directions, scene.tmax
    expected = walked(kernel, precision, geometry, build_kd(), rays, "brute_force", form=form)
    answers = None
    for query in queries:
        found = asked(kernel, precision, geometry, bvh, rays, query, form)
        if query == "nearest":
            assert_equal(found[:4], expected[:4], geometry, rays, name, kernel == EXACT)
            answers = found[0] >= 0
        else:
            np.testing.assert_array_equal(found[0], answers, err_msg=name)


class build_kd:
    """What `walked` reads of a tree when it asks brute force: its options."""

    options = Options()


@pytest.mark.parametrize(
    "kernel, precision, form, queries",
    [
        ("watertight_safe", "float32", IN_BLOCKS, ("nearest",)),
        ("wald", "float32", ONE_BY_ONE, ("nearest",)),
        pytest.param("moller_trumbore_uv", "mixed", ONE_BY_ONE, ("nearest", "any"), marks=FULL),
        pytest.param("moller_trumbore_uv", "float64", IN_BLOCKS, ("nearest", "any"), marks=FULL),
        pytest.param("adaptive_exact_uv", "float64", IN_BLOCKS, ("nearest", "any"), marks=FULL),
        pytest.param("watertight_safe", "float64", IN_BLOCKS, ("nearest", "any"), marks=FULL),
        pytest.param("adaptive_exact_uv", "float32", IN_BLOCKS, ("nearest", "any"), marks=FULL),
        pytest.param("wald", "float64", ONE_BY_ONE, ("nearest", "any"), marks=FULL),
    ],
)
def test_other_kernels(kernel, precision, form, queries):
    for name, scene in scenes(2).items():
        agree(name, scene.triangles, some_of(scene), kernel, precision, form, queries)


def some_of(scene):
    """Return some of a scene's rays."""

    class Some:
        kept = slice(None, None, max(1, len(scene.origins) // 300))
        origins, directions = scene.origins[kept], scene.directions[kept]
        tmax = np.broadcast_to(scene.tmax, len(scene.origins))[kept]

    return Some


@pytest.mark.parametrize("offset", [0.0, 1e5])
def test_rays_in_planes_and_on_surfaces_against_pairs(offset):
    """Parallel to axes, zeros of both signs, starts on vertices, ends in triangles."""
    triangles = (lattice(2) + offset).astype(np.float32).astype(np.float64)
    origins, directions, tmax = hard_rays()
    rays = (origins + offset).astype(np.float32).astype(np.float64), directions, tmax
    geometry = Geometry.of(triangles)
    bvh = build(geometry, SINGLE)
    expected = by_pairs("moller_trumbore_uv", "float32", triangles, *rays)
    assert (expected[0] >= 0).sum() > 50
    for form in FORMS:
        found = asked("moller_trumbore_uv", "float32", geometry, bvh, rays, form=form)
        assert_same(found, expected, form)


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17])
def test_few_rays(count):
    triangles, rays = soup(3, 60), some(hard_rays(1), slice(count))
    geometry = Geometry.of(triangles)
    found = asked("moller_trumbore_uv", "float32", geometry, build(geometry, BLOCKS), rays)
    assert len(found[0]) == count
    if count:
        assert_same(found, by_pairs("moller_trumbore_uv", "float32", triangles, *rays))


def test_only_the_rays_asked_for_in_any_order():
    triangles, rays = lattice(2), hard_rays(2)
    geometry = Geometry.of(triangles)
    bvh = build(geometry, BLOCKS)
    order = np.array([200, 0, 40], np.uint64), np.arange(31, dtype=np.uint64)[::-1].copy()
    expected = by_pairs("moller_trumbore_uv", "float32", triangles, *rays)
    found = asked("moller_trumbore_uv", "float32", geometry, bvh, rays, order=order)
    there = np.zeros(len(rays[0]), bool)
    there[(order[0][:, None] + order[1]).ravel().astype(int)] = True
    assert_same(some(found[:4], there), some(expected, there))
    assert (found[0][~there] == -7).all()


def test_no_box_seems_to_begin_later_than_it_does():
    """What a walk takes off is more than what its children's numbers in the last bits may add."""
    told_apart = {each.__name__: plain for each, plain in vector_memory.PLAIN.items()}["told_apart"]
    rows = np.random.default_rng(1).choice([1.0, 1.5, 2.0, 1 - 2**-24], (500, 8))
    rows = (rows * 2.0 ** np.arange(-50, 50, 0.2)[:, None].round()).astype(np.float32)
    assert all((told_apart(each * steps.LESS) <= each).all() for each in rows)


def test_records_begin_cache_lines():
    for count in (1, 3):
        made = aligned(count, np.dtype("(64,)f4").base)
        assert made.ctypes.data % 64 == 0 and len(made) == count


def test_stacks_hold_what_the_deepest_tree_can_leave():
    """A node of 8 leaves 7 boxes on the stack, and writes 8."""
    assert steps.WAITING >= 7 * DEEPEST + 8
    assert 40 + np.log2(1 << 30) < DEEPEST


def test_a_walk_has_no_name_that_its_parts_have():
    """Nothing of a kernel or of how rays enter is given another value."""
    for kernel, form in itertools.product(("moller_trumbore_uv", "watertight_safe"), FORMS):
        chosen = registry.find(kernel)
        parts = walks.leaf_parts(chosen, "float32", "nearest", form, False)
        own = wide.own_constants("nearest")
        same = {name for name in own if parts.constants.get(name, own[name]) != own[name]}
        assert not same, kernel


def test_mistakes_are_told_in_a_line():
    geometry = Geometry.of(soup(1, 10))
    bvh = build(geometry, BLOCKS)
    with pytest.raises(RtbenchError, match="unknown query 'nearst'"):
        wide.walk(registry.find("moller_trumbore_uv"), query="nearst")
    with pytest.raises(RtbenchError, match="unknown form of leaves 'in_block'"):
        leaves_of(registry.find("moller_trumbore_uv"), "float32", geometry, bvh, "in_block")
