"""Everything against brute force, on models: answers bit for bit, and no ray leaks out.

All of it runs by hand only: `pytest -m full tests/trees/test_equal.py`, with RTBENCH_MODELS.
"""

import itertools

import numpy as np
import pytest
from tree_answers import BUILDERS, EXACT, KERNELS, assert_equal, walked

from rtbench.compiled.layout import DATA_TYPE
from rtbench.kernels import registry
from rtbench.trees import leaves
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import Options
from rtbench.trees.traversal.walks import WAYS
from rtbench.workloads.aimed import aimed_rays
from rtbench.workloads.meshes import load_mesh, models
from rtbench.workloads.ray_sets import mixed_rays

pytestmark = pytest.mark.full
MODELS = ("fandisk", "bunny", "armadillo", "teapot_in_stadium", "crytek_sponza_part")
# Rays of a kernel: those that are slow over all triangles get a part.
RAYS = {"moller_trumbore_uv": 100_000, "watertight_safe": 20_000, "adaptive_exact_uv": 5_000}
PART_OF_NONE = 5_000_000_000  # tests of a brute force in float32 that a slow kernel may take


def model(name):
    there = models()
    if name not in there:
        pytest.skip(f"RTBENCH_MODELS has no {name}")
    return load_mesh(there[name])


def best_form(kernel, precision):
    return leaves.form_of(registry.find(kernel), precision)


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", MODELS)
def test_mixed_rays_on_models(name, precision):
    """100,000 rays, a quarter from surfaces, through the trees of every builder but N²."""
    mesh = model(name)
    geometry = Geometry.of(mesh.triangles, precision)
    trees = {k: build(geometry, Options(**how)) for k, how in BUILDERS.items() if k != "n2"}
    origins, directions = mixed_rays(mesh, RAYS["moller_trumbore_uv"], seed=7)
    for kernel, count in RAYS.items():
        # Spread over the kinds of rays; all in the kernel that is fast.
        step = max(1, len(origins) // min(count, PART_OF_NONE * count // 100_000 // len(geometry)))
        if kernel == "moller_trumbore_uv":
            step = 1
        rays = origins[::step], directions[::step], np.inf
        form = best_form(kernel, precision)
        arguments = kernel, precision, geometry
        expected = walked(*arguments, trees["nlogn"], rays, "brute_force", "nearest", form)[:4]
        assert (expected[0] >= 0).mean() > 0.1
        for (each, tree), used in itertools.product(trees.items(), {leaves.ONE_BY_ONE, form}):
            what = f"{name}, {precision}, {each}, {kernel}, {used}"
            found = walked(*arguments, tree, rays, "stack", "nearest", used)[:4]
            astray = assert_equal(found, expected, geometry, rays, what, kernel == EXACT)
            assert astray < 2e-4 * len(expected[0])
            any_hit = walked(*arguments, tree, rays, "stack", "any", used)[0]
            np.testing.assert_array_equal(any_hit, found[0] >= 0, err_msg=what)


@pytest.mark.parametrize("way", [way for way in WAYS if way not in ("stack", "brute_force")])
def test_other_plain_ways_on_a_model(way):
    """Recursion and mailboxes answer as the stack does."""
    mesh = model("bunny")
    rays = *mixed_rays(mesh, 50_000, seed=8), np.inf
    for precision, kernel in itertools.product(("float32", "float64"), KERNELS):
        geometry = Geometry.of(mesh.triangles, precision)
        tree = build(geometry, Options())
        for query in ("nearest", "any"):
            arguments = kernel, precision, geometry, tree, rays
            found = walked(*arguments, way, query)[:4]
            expected = walked(*arguments, "stack", query)[:4]
            for one, other in zip(found, expected, strict=True):
                np.testing.assert_array_equal(one, other, err_msg=(kernel, precision, query))


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", ["armadillo", "fandisk"])
def test_nothing_leaks_out(name, precision):
    """Rays from inside at vertices and edges hit something, through a tree with watertight_safe."""
    aimed = aimed_rays(
        model(name), {"vertex": 100_000, "edge": 100_000, "face": 20_000}, DATA_TYPE[precision]
    )
    geometry = Geometry.of(aimed.mesh.triangles, precision)
    rays = aimed.origins, aimed.directions, np.inf
    for how in (BUILDERS["nlogn"], BUILDERS["binned"], BUILDERS["spatial_median"]):
        tree = build(geometry, Options(**how))
        found = walked("watertight_safe", precision, geometry, tree, rays)[0]
        assert np.count_nonzero(found < 0) == 0
        assert walked("watertight_safe", precision, geometry, tree, rays, query="any")[0].all()
