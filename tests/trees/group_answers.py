"""What walks of many rays at a time answer, and rays that are hard for them."""

import itertools

import numpy as np

from rtbench.compiled.layout import REAL_TYPE
from rtbench.kernels import registry
from rtbench.trees import leaves
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import Options

OPTIONS = Options(block=8, max_leaf=2, traversal_cost=0.5)  # deep enough to go wrong
NOTHING = -7


def asked(walk, kernel, precision, geometry, tree, rays, query="nearest", counted=True, order=None):
    """Return outcome, t, u, v (N,) and counts (N, 3) of a walk over (origins, directions, tmax).

    ``order``: uint64 arrays ``first`` and ``second``; all rays in their order where not given.
    """
    chosen = registry.find(kernel)
    read = leaves.blocks(chosen, precision, geometry, tree)
    records = leaves.rays(chosen, precision, *rays)
    n, real = len(records), REAL_TYPE[precision]
    scene = np.concatenate([geometry.base, geometry.box, [geometry.reach]]).astype(np.float64)
    outcome, counts = np.full(n, NOTHING, np.int32), np.full((n, 3), NOTHING, np.int32)
    t, u, v = (np.zeros(n, real) for _ in range(3))
    # Guards: any hit writes nothing but the outcome.
    written = [each[: n if query == "nearest" else 0] for each in (t, u, v)]
    order = (np.zeros(1, np.uint64), np.arange(n, dtype=np.uint64)) if order is None else order
    walk(chosen, precision, query, counted).call(
        *(read.nodes, read.refs, read.triangles, scene, records),
        *(*order, outcome, *written, counts[: n if counted else 0]),
    )
    if query == "any":
        assert not (t.any() or u.any() or v.any())
    return outcome, t, u, v, counts


def hard_rays(seed=0):
    """Return rays in the planes of a lattice of unit cubes and along its edges; origins on it.

    All signs and both zeros, in random order, so that no packet has one sign; some are not finite
    or have no direction, some end at or before what they would hit.
    """
    rng = np.random.default_rng(seed)
    directions = np.array(list(itertools.product((-1.0, -0.0, 0.0, 1.0), repeat=3)))
    slanted = rng.choice([-1.0, -0.5, 1e-30, 0.25, 1.0], (200, 3))
    directions = np.concatenate([directions, directions, slanted])
    origins = rng.choice([-1.0, -0.0, 0.0, 0.5, 1.0, 1.25, 2.0, 3.0], directions.shape)
    tmax = rng.choice([np.inf, np.inf, 1.0, 0.5, 2.0, 1e30, 0.0], len(directions))
    strange = rng.permutation(len(directions))[:30]
    origins[strange[:10], strange[:10] % 3] = np.nan
    directions[strange[10:20], strange[:10] % 3] = np.inf
    origins[strange[20:], 1] = -np.inf
    order = rng.permutation(len(directions))
    return origins[order], directions[order], tmax[order]


def some(rays, kept):
    return tuple(each[kept] for each in rays)


def made(triangles, precision="float32", options=OPTIONS):
    geometry = Geometry.of(triangles, precision)
    return geometry, build(geometry, options)


def assert_same(found, expected, what=""):
    for name, one, other in zip(("triangle", "t", "u", "v"), found, expected, strict=False):
        np.testing.assert_array_equal(one, other, err_msg=f"{name}: {what}")
