"""A bounding volume hierarchy in memory: nodes of 8 boxes, and what its leaves hold.

Sources: Wald, Benthin & Boulos 2008; Ernst & Greiner 2008.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from rtbench.compiled.sources import dtype_source
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import Kernel
from rtbench.trees import leaves
from rtbench.trees.geometry import Geometry
from rtbench.trees.leaves import IN_BLOCKS, ONE_BY_ONE, WIDTH, Leaves
from rtbench.trees.options import Options

CHILDREN = 8
# The boxes as rows: least x, y, z, then greatest; the box of an empty slot begins at infinity and
# ends before it. ``count`` is 0 for a node, whose number is ``child``, and for a leaf how much it
# holds, from ``child`` on.
WIDE = np.dtype(
    [
        ("boxes", np.float32, (6, CHILDREN)),
        ("child", np.int32, CHILDREN),
        ("count", np.int32, CHILDREN),
    ],
    align=True,
)
WIDE_SOURCE = dtype_source(WIDE)


LINE = 64  # bytes of a cache line


def aligned(count: int, dtype: np.dtype) -> np.ndarray:
    """Return records, not set, of which the first begins a cache line: no row of 8 lies in two."""
    raw = np.empty(count * dtype.itemsize + LINE, np.uint8)
    begin = -raw.ctypes.data % LINE
    return raw[begin : begin + count * dtype.itemsize].view(dtype)


@dataclass(frozen=True, eq=False)
class Bvh:
    """A bounding volume hierarchy.

    Attributes
    ----------
    nodes : (n,) WIDE array
        Node 0 is the root; the nodes among a node's children lie side by side.
    refs : (M,) int32 array
        Triangles of the leaves, leaf after leaf, each once.
    box : (6,) float32 array
        Of all triangles, local.
    depth : int
        How many nodes lie above the deepest leaf.
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
        """Which children are leaves, (n, CHILDREN) bool."""
        return self.nodes["count"] > 0

    @property
    def is_node(self) -> np.ndarray:
        """Which children are nodes, (n, CHILDREN) bool."""
        return (self.nodes["count"] == 0) & (self.nodes["child"] > 0)

    @property
    def leaves(self) -> tuple[np.ndarray, np.ndarray]:
        """Where each leaf's references begin and how many they are, two (l,) int64 arrays."""
        there = self.is_leaf
        held = self.nodes["count"][there]
        return self.nodes["child"][there].astype(np.int64), held.astype(np.int64)


def leaves_of(
    kernel: Kernel, precision: str, geometry: Geometry, bvh: Bvh, form: str | None = None
) -> Leaves:
    """Return a tree as `rtbench.trees.bvh.wide.walk` reads it.

    Parameters
    ----------
    kernel, precision
    geometry : Geometry
        That the tree was built of.
    bvh : Bvh
    form : str, optional
        IN_BLOCKS or ONE_BY_ONE, see `rtbench.trees.leaves`; blocks where the kernel can be taken
        so if not given.

    Raises
    ------
    RtbenchError
        For an unknown form, and what `rtbench.trees.leaves` refuses.
    """
    form = form or leaves.form_of(kernel, precision)
    if form not in (ONE_BY_ONE, IN_BLOCKS):
        raise RtbenchError(unknown("form of leaves", form, (ONE_BY_ONE, IN_BLOCKS)))
    if form == ONE_BY_ONE:
        return leaves.one_by_one(kernel, precision, geometry, bvh)
    places, nodes = _blocks(bvh)
    records = leaves.block_records(kernel, precision, geometry, places)
    return Leaves(nodes, np.zeros(0, np.int32), records)


def _blocks(bvh: Bvh) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangle of each lane of each block, -1: none, and nodes that name blocks."""
    there = bvh.is_leaf
    begin, count = bvh.leaves
    order = np.argsort(begin)
    begin, count = begin[order], count[order]
    needed = -(-count // WIDTH)
    first = np.cumsum(needed) - needed
    if needed.sum() > np.iinfo(np.int32).max:
        raise RtbenchError("the tree has more blocks of triangles than its nodes can name")
    places = np.full(int(needed.sum()) * WIDTH, -1, np.int64)
    # Leaves lie in the order of their references, so these need no index of their own.
    shift = np.repeat(first * WIDTH - begin, count)
    places[np.arange(len(bvh.refs)) + shift] = bvh.refs
    nodes = aligned(len(bvh.nodes), WIDE)
    nodes[:] = bvh.nodes
    for name, values in (("child", first), ("count", needed)):
        changed = nodes[name]
        in_order = np.empty(len(order), np.int32)
        in_order[order] = values
        changed[there] = in_order
    return places, nodes
