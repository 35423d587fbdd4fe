"""Algorithm 2 in its recursive form: the same walk as with a stack."""

import numpy as np
import pytest
from tree_answers import KERNELS, walked

from rtbench.compiled.layout import PRECISIONS
from rtbench.kernels import registry
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import Options
from rtbench.trees.traversal.walks import walk
from rtbench.workloads.hard_scenes import scenes

SCENES = ("single_triangle", "flat_in_planes", "layers", "small_in_large", "vertex_fan", "empty")


@pytest.mark.parametrize("query", ["nearest", "any"])
def test_walks_as_the_stack_does(query):
    """The same answers after the same steps, leaves and tests."""
    for name in SCENES:
        scene = scenes(2)[name]
        geometry = Geometry.of(scene.triangles)
        tree = build(geometry, Options())
        rays = scene.origins, scene.directions, scene.tmax
        arguments = "moller_trumbore_uv", "float32", geometry, tree, rays
        found = walked(*arguments, "recursive", query, counted=True)
        expected = walked(*arguments, "stack", query, counted=True)
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other, err_msg=name)


def test_is_whole_in_the_cache():
    """A call that numba leaves to be resolved is not, where the code comes from the cache."""
    kernel = registry.find("moller_trumbore_uv")
    for query in ("nearest", "any"):
        made = walk(kernel, "float32", "recursive", query, counted=True)
        assert "numba.unresolved" not in made.assembly


@pytest.mark.full
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("kernel", KERNELS)
def test_is_whole_in_the_cache_whatever_the_kernel(kernel, precision):
    for query in ("nearest", "any"):
        made = walk(registry.find(kernel), precision, "recursive", query)
        assert "numba.unresolved" not in made.assembly
