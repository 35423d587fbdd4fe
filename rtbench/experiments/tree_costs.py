"""K_T and K_I of the cost model, measured: what a step and a test of a kernel take here."""

from __future__ import annotations

import numpy as np

from rtbench.kernels.contract import Kernel
from rtbench.measure.sampler import timed
from rtbench.trees import leaves
from rtbench.trees.options import RULES
from rtbench.trees.quality import COUNTS
from rtbench.trees.tree import Tree, run
from rtbench.trees.ways import walk
from rtbench.workloads.generated_models import scanned
from rtbench.workloads.ray_sets import random_rays

# Trees of few and of many tests a step.
RATIOS = (0.5, 2.0, 8.0, 24.0)
RAYS, ROUNDS = 20_000, 5


def measured(kernel: Kernel, precision: str = "float32", triangles: int = 20_000) -> dict:
    """Measure the cost of a step and of a test, in walks of one ray through leaves one by one.

    The time of a ray is taken to be a constant and so much for each of its steps and its tests:
    least squares over random rays in several trees over a scanned surface, relative to the times.

    Parameters
    ----------
    kernel : Kernel
    precision : str
    triangles : int

    Returns
    -------
    dict
        ``traversal_cost``, ``intersection_cost``, ``per_ray`` in ``unit`` ns; ``points``: the
        ``steps``, ``tests`` and ``ns`` per ray of each tree; ``kernel``, ``precision``.
    """
    mesh = scanned(triangles)
    origins, directions = random_rays(mesh, RAYS, 1)
    rays = leaves.rays(kernel, precision, origins, directions, np.inf)
    told = [{"traversal_cost": ratio, "rule": "sah"} for ratio in RATIOS]
    told += [{"traversal_cost": 2.0, "rule": rule, "axes": "longest"} for rule in RULES]
    trees = [
        Tree(mesh.triangles, kernel=kernel, precision=precision, block=1, max_leaf=1, **each)
        for each in told
    ]
    points = [_met(tree, rays) for tree in trees]
    times = [
        [timed(lambda tree=tree: run(tree, "stack", "nearest", rays))[2] for tree in trees]
        for _ in range(ROUNDS)
    ]
    ns = np.median(times, axis=0) / RAYS
    steps, tests = np.array([[each["steps"], each["tests"]] for each in points]).T
    per_ray, step, test = _fitted(steps, tests, ns)
    return {
        "kernel": kernel.name,
        "precision": precision,
        "traversal_cost": step,
        "intersection_cost": test,
        "per_ray": per_ray,
        "unit": "ns",
        "points": [each | {"ns": float(t)} for each, t in zip(points, ns, strict=True)],
    }


def _met(tree: Tree, rays: np.ndarray) -> dict[str, float]:
    """Return the mean steps, leaves and tests of all rays."""
    counts = np.zeros((len(rays), 3), np.int32)
    read = tree.leaves("stack")
    outputs = np.empty(len(rays), np.int32), *(np.empty(len(rays), rays["tmax"].dtype),) * 3
    walk(tree.kernel, tree.precision, "stack", "nearest", tree.form, True).call(
        *(read.nodes, read.refs, read.triangles, tree.scene, rays, np.zeros(1, np.uint64)),
        *(np.arange(len(rays), dtype=np.uint64), *outputs, counts),
    )
    return dict(zip(COUNTS, counts.mean(axis=0).tolist(), strict=True))


def _fitted(steps: np.ndarray, tests: np.ndarray, ns: np.ndarray) -> tuple[float, float, float]:
    """Return the constant and the costs of a step and a test, none below a hundredth of ns."""
    from scipy.optimize import nnls

    known = np.stack([np.ones(len(ns)), steps, tests], axis=1) / ns[:, None]
    found, _ = nnls(known, np.ones(len(ns)))
    per_ray, step, test = found.tolist()
    return per_ray, max(step, 0.01), max(test, 0.01)
