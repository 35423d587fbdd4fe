"""Mailboxes: the plain walk, without testing a triangle twice."""

import numpy as np
import pytest
from tree_answers import walked

from rtbench.errors import RtbenchError
from rtbench.kernels import registry
from rtbench.trees import leaves
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import Options
from rtbench.trees.traversal.walks import walk
from rtbench.workloads.hard_scenes import scenes

SCENES = ("single_triangle", "coplanar", "identical_centroids", "slivers", "grid", "empty")


@pytest.mark.parametrize("query", ["nearest", "any"])
def test_answers_as_the_stack_does_with_fewer_tests(query):
    saved = 0
    for name in SCENES:
        scene = scenes(3)[name]
        geometry = Geometry.of(scene.triangles)
        tree = build(geometry, Options())
        rays = scene.origins, scene.directions, scene.tmax
        arguments = "moller_trumbore_uv", "float32", geometry, tree, rays
        *found, counts = walked(*arguments, "mailboxes", query, counted=True)
        *expected, plain = walked(*arguments, "stack", query, counted=True)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other, err_msg=name)
        np.testing.assert_array_equal(counts[:, :2], plain[:, :2])
        assert (counts[:, 2] <= np.minimum(plain[:, 2], len(geometry))).all()
        saved += (plain[:, 2] - counts[:, 2]).sum()
        if name == "coplanar":  # rays in the plane: most triangles in several cells of each
            assert plain[:, 2].max() > 2 * len(geometry) >= 2 * counts[:, 2].max()
    assert saved > 0


def test_blocks_have_none():
    kernel = registry.find("moller_trumbore_uv")
    with pytest.raises(RtbenchError, match="one_by_one"):
        walk(kernel, "float32", "mailboxes", form=leaves.IN_BLOCKS)
