"""The walk with a stack against brute force and against all pairs, bit for bit, on hard scenes.

Brute force here is the same kernel over all triangles, compiled into a loop without a tree; it is
itself compared with `rtbench.intersect` and numpy's least t, then lowest index.
"""

import itertools

import numpy as np
import pytest
from tree_answers import BUILDERS, EXACT, KERNELS, assert_equal, by_pairs, walked

from rtbench.compiled.layout import PRECISIONS
from rtbench.kernels import registry
from rtbench.trees import leaves
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import Options
from rtbench.workloads.hard_scenes import SCENES, scenes

FEW = 40  # rays that are asked pair by pair
# In the normal run: kernels and precisions, and builders by turns.
SAMPLE = (("moller_trumbore_uv", "float32"), ("watertight_safe", "float32"))
IN_TURN = ({}, {"rule": "spatial_median"})


def best_form(kernel, precision):
    return leaves.form_of(registry.find(kernel), precision)


def forms(kernel, precision):
    return {leaves.ONE_BY_ONE, best_form(kernel, precision)}


def every(scene, count):
    """Return about so many rays of a scene, spread over it."""
    kept = slice(None, None, max(1, len(scene.origins) // count))
    return scene.origins[kept], scene.directions[kept], scene.tmax[kept]


@pytest.mark.parametrize("kernel, precision", SAMPLE)
def test_nearest_is_that_of_all_pairs(kernel, precision):
    """Every hard scene, few rays, builders by turns, against pairs."""
    for k, (name, scene) in enumerate(scenes(1).items()):
        geometry = Geometry.of(scene.triangles, precision)
        tree = build(geometry, Options(**IN_TURN[k % len(IN_TURN)]))
        rays = every(scene, FEW)
        found = walked(kernel, precision, geometry, tree, rays)[:4]
        expected = by_pairs(kernel, precision, scene.triangles, *rays)
        assert_equal(found, expected, geometry, rays, name, kernel == EXACT)


def test_nearest_and_any_are_those_of_brute_force():
    """Every hard scene, all rays, with the kernel that is fastest."""
    kernel, precision = SAMPLE[0]
    hits = 0
    for k, (name, scene) in enumerate(scenes(1).items()):
        geometry = Geometry.of(scene.triangles, precision)
        tree = build(geometry, Options(**IN_TURN[(k + 1) % len(IN_TURN)]))
        rays = scene.origins, scene.directions, scene.tmax
        expected = walked(kernel, precision, geometry, tree, rays, "brute_force")[:4]
        found = walked(kernel, precision, geometry, tree, rays)[:4]
        assert_equal(found, expected, geometry, rays, name)
        any_hit = walked(kernel, precision, geometry, tree, rays, query="any")[0]
        np.testing.assert_array_equal(any_hit, found[0] >= 0, err_msg=name)
        hits += (expected[0] >= 0).sum()
    assert hits > 10_000


@pytest.mark.full
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_brute_force_is_that_of_all_pairs(kernel, precision):
    """In each of its forms, both queries, on every hard scene."""
    for (name, scene), form in itertools.product(scenes(3).items(), forms(kernel, precision)):
        geometry = Geometry.of(scene.triangles, precision)
        tree = build(geometry, Options(ending="ad_hoc", max_depth=0))
        rays = every(scene, 4 * FEW)
        expected = by_pairs(kernel, precision, scene.triangles, *rays)
        arguments = kernel, precision, geometry, tree, rays, "brute_force"
        found = walked(*arguments, "nearest", form)[:4]
        assert_equal(found, expected, geometry, rays, (name, form), exact=True)
        np.testing.assert_array_equal(walked(*arguments, "any", form)[0], expected[0] >= 0)


@pytest.mark.full
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("precision", PRECISIONS)
def test_hard_scenes_whole(name, precision):
    """Every builder, kernel, form and query, on hard scenes of two seeds."""
    for seed in (1, 2):
        scene = scenes(seed)[name]
        geometry = Geometry.of(scene.triangles, precision)
        trees = {each: build(geometry, Options(**how)) for each, how in BUILDERS.items()}
        rays = scene.origins, scene.directions, scene.tmax
        for kernel in KERNELS:
            expected = walked(
                *(kernel, precision, geometry, trees["nlogn"], rays, "brute_force", "nearest"),
                best_form(kernel, precision),
            )[:4]
            for (each, tree), form in itertools.product(trees.items(), forms(kernel, precision)):
                what = f"{name}, seed {seed}, {each}, {kernel}, {form}"
                arguments = kernel, precision, geometry, tree, rays, "stack"
                found = walked(*arguments, "nearest", form)[:4]
                assert_equal(found, expected, geometry, rays, what, kernel == EXACT)
                any_hit = walked(*arguments, "any", form)[0]
                np.testing.assert_array_equal(any_hit, found[0] >= 0, err_msg=what)
