"""What the leaves of a tree over triangles and shapes hold, as the compiled tracer reads it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtbench.compiled.layout import fill
from rtbench.kernels.contract import Kernel
from rtbench.trees import leaves, ways
from rtbench.trees.bvh.nodes import WIDE, aligned
from rtbench.trees.geometry import Geometry
from rtbench.trees.leaves import IN_BLOCKS, WIDTH
from rtbench.trees.nodes import LEAF, KdTree

# A leaf that holds both blocks of triangles, from begin to end, and shapes: refs first to last.
BOTH = np.dtype([(name, np.int64) for name in ("begin", "end", "first", "last")], align=True)


@dataclass(frozen=True, eq=False)
class Table:
    """A tree's nodes and leaves.

    Attributes
    ----------
    nodes : (n,) NODE or WIDE array
        Leaves say from where to where they reach: in ``triangles`` where there are only blocks of
        them, in ``leaves`` where there are shapes too, else in ``refs``.
    refs : (R,) int32 array
        Primitives: triangles, then shapes.
    triangles : structured array
        As the kernel reads them: a record each, or a block.
    leaves : (l,) BOTH array
    places : (P,) int64 array
        Where each primitive is held: in a run of one from there on, as leaves name runs.
    """

    nodes: np.ndarray
    refs: np.ndarray
    triangles: np.ndarray
    leaves: np.ndarray
    places: np.ndarray


def table_of(
    kernel: Kernel,
    precision: str,
    geometry: Geometry,
    built: object,
    count: int,
    form: str,
    bounded: bool,
) -> Table:
    """Return what a tree over ``count`` triangles and then shapes holds.

    Parameters
    ----------
    bounded : bool
        Whether the tracer looks for shapes in it.
    """
    none = np.zeros(1, BOTH)
    if form == IN_BLOCKS and not bounded:
        read = ways.leaves_of(kernel, precision, geometry, built, _way(built))
        held = read.triangles["index"].reshape(-1)
        return Table(
            read.nodes,
            np.zeros(1, np.int32),
            read.triangles,
            none,
            _places(held, np.arange(len(held)) // WIDTH, count),
        )
    refs = np.ascontiguousarray(built.refs, np.int32)
    refs = refs if len(refs) else np.zeros(1, np.int32)
    if form != IN_BLOCKS:
        corners = tuple(geometry.corners[:, k] for k in range(3))
        if not count:
            corners = (np.zeros((1, 3)),) * 3
        zeros = np.zeros((1, 3))
        triangles, _ = fill(kernel, "own", precision, corners, zeros, zeros)
        places = _places(refs, np.arange(len(refs)), len(geometry.boxes))
        return Table(built.nodes, refs, triangles, none, places)
    begin, size = built.leaves
    where = np.repeat(np.arange(len(begin)), size)
    held = np.concatenate([refs[:0], *(refs[b : b + n] for b, n in zip(begin, size, strict=True))])
    places = _places(held, where, len(geometry.boxes))
    refs, lanes, table = _parted(refs, begin, size, count)
    triangles = leaves.block_records(kernel, precision, geometry, lanes)
    return Table(_naming_leaves(built), refs, triangles, table if len(table) else none, places)


def _places(held: np.ndarray, where: np.ndarray, count: int) -> np.ndarray:
    """Return one place of each of ``count`` primitives, of which ``held`` are ``where``."""
    places = np.zeros(count, np.int64)
    there = (held >= 0) & (held < count)
    places[held[there]] = where[there]
    return places


def _way(built: object) -> str:
    return "blocks" if isinstance(built, KdTree) else "wide"


def _parted(refs, begin, size, count):
    """Part each leaf into blocks of triangles and a run of shapes."""
    table = np.zeros(len(begin), BOTH)
    kept, places, blocks = [], [], 0
    held = 0
    for k, (first, many) in enumerate(zip(begin, size, strict=True)):
        inside = refs[first : first + many]
        triangles, shapes = inside[inside < count], inside[inside >= count]
        needed = -(-len(triangles) // WIDTH)
        table[k] = blocks, blocks + needed, held, held + len(shapes)
        filled = np.full(needed * WIDTH, -1, np.int64)
        filled[: len(triangles)] = triangles
        places.append(filled)
        kept.append(shapes)
        blocks, held = blocks + needed, held + len(shapes)
    kept = np.concatenate([*kept, np.zeros(1, np.int32)]).astype(np.int32)
    # A block that is never asked, so that there is one.
    return kept, np.concatenate([*places, np.full(WIDTH, -1, np.int64)]), table


def _naming_leaves(built: object) -> np.ndarray:
    """Return nodes of which leaf k names record k, one of them."""
    there = built.is_leaf
    numbers = np.arange(int(there.sum()))
    empty = built.leaves[1] == 0
    if isinstance(built, KdTree):
        nodes = built.nodes.copy()
        nodes["link"][there] = (numbers.astype(np.uint32) << 2) | LEAF
        nodes["split"][there] = np.where(empty, 0, 1)
        return nodes
    nodes = aligned(len(built.nodes), WIDE)
    nodes[:] = built.nodes
    child, count = nodes["child"], nodes["count"]
    child[there], count[there] = numbers, 1
    return nodes
