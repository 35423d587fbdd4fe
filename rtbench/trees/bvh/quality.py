"""How good a bounding volume hierarchy is, in the terms of `rtbench.trees.quality`."""

from __future__ import annotations

import numpy as np

from rtbench.trees.bvh.nodes import Bvh
from rtbench.trees.geometry import Geometry


def quality(bvh: Bvh, geometry: Geometry) -> dict[str, object]:
    """Return what a tree is made of and what a ray is expected to meet in it.

    Parameters
    ----------
    bvh : Bvh
    geometry : Geometry
        That it was built over.

    Returns
    -------
    dict
        What `rtbench.trees.quality.quality` returns; a step is a node of 8 boxes, K_T that of one,
        depth the number of nodes above a leaf. There are no empty leaves, and one reference a
        triangle. ``boxes_per_node`` is added.

    Source
    ------
    MacDonald & Booth 1990; Šilhavý 2010, section 3.3.3; Wald, Benthin & Boulos 2008.
    """
    is_leaf, options = bvh.is_leaf, bvh.options
    count = bvh.nodes["count"][is_leaf].astype(np.float64)
    chance = chances(bvh)
    steps = 1.0 + float(chance[bvh.is_node].sum())
    blocks = float(chance[is_leaf] @ np.ceil(count / options.block))
    depths = np.broadcast_to(_depths(bvh)[:, None], is_leaf.shape)[is_leaf]
    with np.errstate(invalid="ignore"):
        each, per_leaf, depth = np.array([len(bvh.refs), len(bvh.refs), depths.sum()]) / np.array(
            [len(geometry), len(count), len(count)]
        )
    return {
        "nodes": len(bvh.nodes),
        "leaves": len(count),
        "empty_leaves": 0,
        "full_leaves": len(count),
        "references": len(bvh.refs),
        "references_per_triangle": float(each),
        "depth": bvh.depth,
        "mean_leaf_depth": float(depth),
        "triangles_per_full_leaf": float(per_leaf),
        "largest_leaf": int(count.max(initial=0)),
        "bytes": bvh.nodes.nbytes + bvh.refs.nbytes,
        "sah_cost": options.traversal_cost * steps + options.intersection_cost * blocks,
        "expected_steps": steps,
        "expected_leaves": float(chance[is_leaf].sum()),
        "expected_tests": float(chance[is_leaf] @ count),
        "boxes_per_node": float((is_leaf | bvh.is_node).sum() / len(bvh.nodes)),
    }


def chances(bvh: Bvh) -> np.ndarray:
    """Return the chance that a line that meets the scene's box meets each box of each node.

    Returns
    -------
    (n, 8) float64 array
        Of an empty slot 0; 1 everywhere in a scene whose box has no surface.
    """
    there = bvh.is_leaf | bvh.is_node
    boxes = bvh.nodes["boxes"].astype(np.float64)
    low, high = np.where(there[:, None], boxes[:, :3], 0), np.where(there[:, None], boxes[:, 3:], 0)
    surface = _half_surface(np.moveaxis(high - low, 1, 0))
    whole = _half_surface(bvh.box[3:].astype(np.float64) - bvh.box[:3])
    return surface / whole if whole > 0 else there.astype(np.float64)


def _half_surface(sides: np.ndarray) -> np.ndarray:
    x, y, z = sides
    return x * y + y * z + z * x


def _depths(bvh: Bvh) -> np.ndarray:
    """Return how many nodes lie on the way to the leaves of each node, (n,) int64."""
    found = np.ones(len(bvh.nodes), np.int64)
    level, depth = np.zeros(1, np.int64), 1
    is_node = bvh.is_node
    while len(level):
        found[level] = depth
        level, depth = bvh.nodes["child"][level][is_node[level]], depth + 1
    return found
