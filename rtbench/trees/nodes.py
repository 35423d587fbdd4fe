"""A k-d tree in memory: nodes of 8 bytes, depth first, and one array of the leaves' triangles.

Wald 2004, section 7.2.3: axis, kind and link share four bytes, the split plane has the other four.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from rtbench.trees.options import Options

# An inner node: link = child << 2 | axis, its children are nodes child (below the plane) and
# child + 1. A leaf: link = begin << 2 | LEAF, and split is how many references it has.
NODE = np.dtype([("link", np.uint32), ("split", np.float32)], align=True)
LEAF = 3
MOST_LINKS = 1 << 30
MOST_IN_LEAF = 1 << 24  # beyond, float32 does not count


@dataclass(frozen=True, eq=False)
class KdTree:
    """A k-d tree.

    Attributes
    ----------
    nodes : (n,) NODE array
        Node 0 is the root; the pair of a node's children takes the next two numbers when it is
        cut, the left subtree before the right.
    refs : (R,) int32 array
        Triangles of the leaves, leaf after leaf, in each in ascending order.
    box : (6,) float32 array
        The root's cell, local.
    depth : int
        Of the deepest leaf; a tree of one leaf has 0.
    options : Options
    """

    nodes: np.ndarray
    refs: np.ndarray
    box: np.ndarray
    depth: int
    options: Options

    @property
    def digest(self) -> str:
        """Sixteen digits that two trees share only if they are equal, node for node."""
        made = hashlib.sha256(self.nodes.tobytes())
        made.update(self.refs.tobytes())
        return made.hexdigest()[:16]

    @property
    def is_leaf(self) -> np.ndarray:
        """Which nodes are leaves, (n,) bool."""
        return (self.nodes["link"] & 3) == LEAF

    @property
    def leaves(self) -> tuple[np.ndarray, np.ndarray]:
        """Where each leaf's references begin and how many they are, two (l,) int64 arrays."""
        found = self.nodes[self.is_leaf]
        return (found["link"] >> 2).astype(np.int64), found["split"].astype(np.int64)


def one_leaf(triangles: int, box: np.ndarray, options: Options) -> KdTree:
    """Return the tree of a single leaf that has all triangles."""
    nodes = np.zeros(1, NODE)
    nodes["link"], nodes["split"] = LEAF, triangles
    return KdTree(nodes, np.arange(triangles, dtype=np.int32), box, 0, options)
