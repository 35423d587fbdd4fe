"""What the leaves of a tree hold: triangles one by one as the kernel reads them, or in blocks."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np

from rtbench.compiled import embedded, lanes, packets, packing
from rtbench.compiled.embedded import Embedded
from rtbench.compiled.layout import fill, record_types
from rtbench.compiled.packing import Packing
from rtbench.compiled.sources import dtype_source
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import TMAX, Kernel
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import LEAF, NODE, KdTree

WIDTH = 8
BLOCKS = Packing("triangles", WIDTH)
ONE_BY_ONE, IN_BLOCKS = "one_by_one", "in_blocks"
OF_RAY = ("orig", "dir", TMAX)  # what a walk reads of a ray, whatever the kernel does


@functools.cache
def in_blocks(kernel: Kernel, precision: str) -> bool:
    """Tell whether a kernel can test a block of triangles at a time.

    One that projects along an axis of each triangle's own does not: a block would need one axis.
    """
    if precision not in packing.PRECISIONS:
        return False
    try:
        lanes.must_fit(kernel)
    except RtbenchError:
        return False
    return not packing.axis_fields(kernel)


def form_of(kernel: Kernel, precision: str) -> str:
    """Return the better form of a kernel's leaves."""
    return IN_BLOCKS if in_blocks(kernel, precision) else ONE_BY_ONE


def must_be_fit(kernel: Kernel) -> None:
    """Raise RtbenchError for a kernel that no leaf can use: it must give t of a line or a ray."""
    if "t" not in kernel.outputs or kernel.domain not in ("line", "ray", "segment"):
        raise RtbenchError(
            f"kernel {kernel.name!r} returns no t along a ray: a tree cannot tell what is nearest"
        )


def ray_type(kernel: Kernel, precision: str) -> np.dtype:
    """Return the dtype of the rays that a walk reads."""
    return record_types(kernel, "own", precision, OF_RAY)[1]


def rays(
    kernel: Kernel,
    precision: str,
    origins: np.ndarray,
    directions: np.ndarray,
    tmax: float | np.ndarray = np.inf,
) -> np.ndarray:
    """Return rays (N,) as a walk reads them, of origins and directions (N, 3)."""
    none = (np.zeros((1, 3)),) * 3
    return fill(kernel, "own", precision, none, origins, directions, tmax=tmax, keeps=OF_RAY)[1]


def test_of(kernel: Kernel, precision: str, form: str, taken: tuple[str, ...] = ()) -> Embedded:
    """Return a kernel's ``test`` for the leaves of a form, over rays of `ray_type`."""
    must_be_fit(kernel)
    ray = ray_type(kernel, precision)
    if form == ONE_BY_ONE:
        triangle = record_types(kernel, "own", precision)[0]
        return embedded.in_numbers(kernel, precision, triangle, ray, taken)
    found = packets.embedded_test(kernel, precision, BLOCKS, taken=taken)
    return dataclasses.replace(found, constants=found.constants | {"RAY": dtype_source(ray)})


@dataclass(frozen=True, eq=False)
class Leaves:
    """A tree's nodes and leaves as walks of one form read them.

    Attributes
    ----------
    nodes : (n,) NODE array
    refs : (R,) int32 array
        Triangles, leaf after leaf; with blocks empty, their records say what they hold.
    triangles : structured array
        One record a triangle (M,), or one a block.
    """

    nodes: np.ndarray
    refs: np.ndarray
    triangles: np.ndarray

    @property
    def bytes(self) -> int:
        """What all of it takes."""
        return self.nodes.nbytes + self.refs.nbytes + self.triangles.nbytes


def one_by_one(kernel: Kernel, precision: str, geometry: Geometry, tree: KdTree) -> Leaves:
    """Return a tree whose leaves name triangles."""
    corners = tuple(geometry.corners[:, k] for k in range(3))
    none = np.zeros((1, 3))
    triangles, _ = fill(kernel, "own", precision, corners, none, none)
    return Leaves(tree.nodes, tree.refs, triangles)


def blocks(kernel: Kernel, precision: str, geometry: Geometry, tree: KdTree) -> Leaves:
    """Return a tree whose leaves are blocks of WIDTH triangles, filled up with such as none hits.

    A triangle is copied into every leaf that it lies in: what a leaf needs lies side by side.
    """
    begin, count = tree.leaves
    needed = -(-count // WIDTH)
    first = np.cumsum(needed) - needed
    if needed.sum() >= 1 << 30:
        raise RtbenchError("the tree has more blocks of triangles than its links can name")
    nodes = tree.nodes.copy()
    leaf = tree.is_leaf
    nodes["link"][leaf] = (first.astype(np.uint32) << 2) | LEAF
    nodes["split"][leaf] = needed
    places = _places(tree.refs, begin, count, first, int(needed.sum()))
    return Leaves(nodes, np.zeros(0, np.int32), block_records(kernel, precision, geometry, places))


def _places(refs, begin, count, first, blocks: int) -> np.ndarray:
    """Return the triangle in each lane of each block, -1 where there is none."""
    places = np.full(blocks * WIDTH, -1, np.int64)
    # Where each reference goes: after those of its leaf that come before it.
    order = np.argsort(begin, kind="stable")
    begin, count, first = begin[order], count[order], first[order]
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    places[np.repeat(first * WIDTH, count) + within] = refs[np.repeat(begin, count) + within]
    return places


def block_records(
    kernel: Kernel, precision: str, geometry: Geometry, places: np.ndarray
) -> np.ndarray:
    """Return records of blocks that hold these triangles (B * WIDTH,), -1: one that none hits."""
    corners = np.full((len(places), 3, 3), np.nan, geometry.corners.dtype)
    there = places >= 0
    corners[there] = geometry.corners[places[there]]
    records = packing.fill_triangles(kernel, precision, BLOCKS, corners)
    records["index"] = np.where(there, places, 0x7FFFFFFF).reshape(-1, WIDTH)
    return records


NODE_SOURCE = dtype_source(NODE)
