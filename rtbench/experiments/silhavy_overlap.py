"""How many triangles each overlap test lets into leaves that they do not touch (4.1.1)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from rtbench.records.run import Run

MOST = 200_000  # triangles of a model: larger ones take seconds
PAIRS = 20_000  # of a triangle and a leaf: a random sample
IN_LEAF = 8  # triangles; the thesis ends by count and depth (3.2.4)
GENERATED = "generated"


def count(run: Run, tell: Callable[[float], None] = lambda part: None) -> list[dict]:
    """Put references of a run's models to every test, in trees that take boxes for triangles.

    Parameters
    ----------
    run : Run
        Of the experiment ``trees``; of its models, those that are there and not large.
    tell : callable, optional
        Is given how much is done.

    Returns
    -------
    list of dict
        ``model``, ``rule``, and by test ``passed`` and ``needless``: of a sample of the pairs of a
        triangle and a leaf in whose cell its box lies, those let in, and for nothing.
    """
    from rtbench.trees.options import RULES
    from rtbench.workloads.meshes import models

    there = models()
    told = [
        each
        for each in run.info.get("models") or []
        if each["triangles"] <= MOST and (each["source"] == GENERATED or each["model"] in there)
    ]
    size = run.info["config"]["triangles"]
    jobs = [(each["model"], rule) for each in told for rule in RULES]
    found = []
    for model, rule in jobs:
        found.append({"model": model, "rule": rule} | _over(model, size, rule))
        tell(len(found) / len(jobs))
    return found


@cache
def _over(model: str, triangles: int, rule: str) -> dict:
    from rtbench.trees import leaves, ways
    from rtbench.trees.building import build
    from rtbench.trees.overlap import FITS, let_through, overlapping

    geometry = _geometry(model, triangles)
    told = {"overlap": "box", "ending": "ad_hoc", "max_leaf": IN_LEAF}
    if rule != "sah":
        told["axes"] = "longest"
    tree = build(geometry, ways.options(leaves.ONE_BY_ONE, rule=rule, **told))
    cells, begin, held = leaf_cells(tree)
    leaf = np.repeat(np.arange(len(held)), held)
    within = np.arange(len(leaf)) - np.repeat(np.cumsum(held) - held, held)
    if len(leaf) > PAIRS:
        chosen = np.random.default_rng(1).choice(len(leaf), PAIRS, replace=False)
        leaf, within = leaf[chosen], within[chosen]
    which = tree.refs[begin[leaf] + within]
    corners = geometry.corners[which].astype(np.float64) - geometry.base
    pairs = corners, cells[leaf].astype(np.float64)
    passed = {test: int(np.count_nonzero(overlapping(test, *pairs))) for test in FITS}
    return {"passed": passed, "needless": let_through(*pairs)}


@cache
def _geometry(model: str, triangles: int):
    from rtbench.trees.geometry import Geometry
    from rtbench.workloads.generated_models import find_model

    mesh = find_model(model, triangles, drop_invalid=True).rounded(np.float32)
    return Geometry.of(mesh.triangles, "float32")


def leaf_cells(tree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the cells of a k-d tree's leaves, in no order, and what they hold.

    Parameters
    ----------
    tree : rtbench.trees.nodes.KdTree

    Returns
    -------
    cells : (l, 6) float32 array
        lx, ly, lz, ux, uy, uz; local.
    begin, held : (l,) int64 arrays
        Where in the tree's references a leaf's begin, and how many they are.
    """
    from rtbench.trees.nodes import LEAF

    nodes, boxes = np.zeros(1, np.int64), tree.box[None].astype(np.float32)
    found = []
    while len(nodes):
        link, split = tree.nodes["link"][nodes], tree.nodes["split"][nodes]
        axis = (link & 3).astype(np.int64)
        leaf = axis == LEAF
        found.append((boxes[leaf], link[leaf] >> 2, split[leaf]))
        inner = np.flatnonzero(~leaf)
        child = (link[inner] >> 2).astype(np.int64)
        left, right = boxes[inner], boxes[inner].copy()
        row = np.arange(len(inner))
        left[row, 3 + axis[inner]] = right[row, axis[inner]] = split[inner]
        nodes, boxes = np.concatenate([child, child + 1]), np.concatenate([left, right])
    cells, begin, held = (np.concatenate(part) for part in zip(*found, strict=True))
    return cells, begin.astype(np.int64), held.astype(np.int64)
