"""Packets of rays against brute force, bit for bit."""

import numpy as np
import pytest
from group_answers import asked, assert_same, hard_rays, made, some
from tree_answers import EXACT, KERNELS, assert_equal, by_pairs, walked
from tree_scenes import lattice, soup

from rtbench.errors import RtbenchError
from rtbench.kernels import registry
from rtbench.trees.traversal.packets import walk
from rtbench.workloads.hard_scenes import scenes

KERNEL, PRECISION = "moller_trumbore_uv", "float32"


def test_hard_scenes():
    """Nearest and any hit of all rays of every hard scene."""
    hits = 0
    for name, scene in scenes(1).items():
        geometry, tree = made(scene.triangles)
        rays = scene.origins, scene.directions, scene.tmax
        expected = walked(KERNEL, PRECISION, geometry, tree, rays, "brute_force", form="in_blocks")
        found = asked(walk, KERNEL, PRECISION, geometry, tree, rays)[:4]
        assert_equal(found, expected[:4], geometry, rays, name)
        any_hit = asked(walk, KERNEL, PRECISION, geometry, tree, rays, "any")[0]
        np.testing.assert_array_equal(any_hit, found[0] >= 0, err_msg=name)
        hits += (expected[0] >= 0).sum()
    assert hits > 10_000


def test_rays_in_planes_against_pairs():
    triangles, rays = lattice(2), hard_rays()
    geometry, tree = made(triangles)
    expected = by_pairs(KERNEL, PRECISION, triangles, *rays)
    assert (expected[0] >= 0).sum() > 50
    assert_same(asked(walk, KERNEL, PRECISION, geometry, tree, rays), expected)


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17])
def test_few_rays(count):
    """No whole packets."""
    triangles, rays = soup(3, 60), some(hard_rays(1), slice(count))
    geometry, tree = made(triangles)
    found = asked(walk, KERNEL, PRECISION, geometry, tree, rays)
    if count:
        assert_same(found, by_pairs(KERNEL, PRECISION, triangles, *rays))
    assert len(found[0]) == count


def test_only_the_rays_asked_for_in_any_order():
    triangles, rays = lattice(2), hard_rays(2)
    geometry, tree = made(triangles)
    order = np.array([200, 0, 40], np.uint64), np.arange(31, dtype=np.uint64)[::-1].copy()
    expected = by_pairs(KERNEL, PRECISION, triangles, *rays)
    found = asked(walk, KERNEL, PRECISION, geometry, tree, rays, order=order)
    there = np.zeros(len(rays[0]), bool)
    there[(order[0][:, None] + order[1]).ravel().astype(int)] = True
    assert_same(some(found[:4], there), some(expected, there))
    assert (found[0][~there] == -7).all()


def test_packets_of_one_sign_and_of_many():
    """The same rays sorted by signs, and so that every packet has all of them."""
    triangles, rays = soup(5, 300), hard_rays(4)
    geometry, tree = made(triangles)
    expected = by_pairs(KERNEL, PRECISION, triangles, *rays)
    assert (expected[0] >= 0).sum() > 20
    signs = (np.signbit(rays[1]) * [1, 2, 4]).sum(axis=1)
    alike = np.argsort(signs, kind="stable")
    for order in (alike, alike.reshape(8, -1).T.ravel()):
        found = asked(walk, KERNEL, PRECISION, geometry, tree, some(rays, order))
        assert_same(found, some(expected, order))


def test_no_triangles():
    geometry, tree = made(np.zeros((0, 3, 3)))
    rays = hard_rays()
    found = asked(walk, KERNEL, PRECISION, geometry, tree, rays)
    assert (found[0] == -1).all()
    np.testing.assert_array_equal(found[1], rays[2].astype(np.float32))


def test_counts_are_those_of_a_single_ray():
    """Each ray of a packet goes its own way: it counts only the cells in which it lies."""
    triangles, rays = soup(4, 400, 0.05), hard_rays(3)
    rays = some((rays[0] / 2, *rays[1:]), np.isfinite(rays[0] + rays[1]).all(axis=1))
    geometry, tree = made(triangles)
    arguments = KERNEL, PRECISION, geometry, tree, rays
    single = walked(*arguments, "stack", "nearest", "in_blocks", counted=True)[4]
    counts = asked(walk, *arguments)[4]
    np.testing.assert_array_equal(counts, single)
    assert counts.sum() > 1000


@pytest.mark.parametrize("kernel, precision", [("moller_trumbore", "float64")])
def test_other_kernels(kernel, precision):
    """One in double precision, of t alone."""
    agree_everywhere(kernel, precision, ("nearest",))


@pytest.mark.full
@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("kernel", KERNELS)
def test_every_kernel(kernel, precision):
    agree_everywhere(kernel, precision, ("nearest", "any"))


def agree_everywhere(kernel, precision, queries):
    for name, scene in scenes(2).items():
        geometry, tree = made(scene.triangles, precision)
        kept = slice(None, None, max(1, len(scene.origins) // 300))
        rays = some((scene.origins, scene.directions, scene.tmax), kept)
        arguments = kernel, precision, geometry, tree, rays
        expected = walked(*arguments, "brute_force", form="in_blocks")[:4]
        found = asked(walk, *arguments, counted=False)[:4]
        assert_equal(found, expected, geometry, rays, (name, kernel), kernel == EXACT)
        if "any" in queries:
            any_hit = asked(walk, *arguments, "any", counted=False)[0]
            np.testing.assert_array_equal(any_hit, found[0] >= 0, err_msg=name)


def test_kernels_that_do_not_fit_are_refused_in_a_line():
    with pytest.raises(RtbenchError, match="cannot be taken in packets"):
        walk(registry.find("moller1"))
    with pytest.raises(RtbenchError, match="unknown query 'nearst'"):
        walk(registry.find(KERNEL), query="nearst")
