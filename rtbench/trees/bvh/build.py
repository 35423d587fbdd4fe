"""From geometry to a bounding volume hierarchy: cut in two by binned SAH, then 8 boxes a node.

Each triangle is in one leaf. Cells are cut between bins of the middles of their triangles' boxes,
all three axes compared; where no cut tells triangles apart, half of them goes to either side.

Sources: Wald 2007 (binned SAH); Wald, Benthin & Boulos 2008, Ernst & Greiner 2008 (wide nodes).
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from rtbench.compiled import vector_memory
from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.compiled.packets import vectors_digest
from rtbench.errors import RtbenchError
from rtbench.trees import cost
from rtbench.trees.bvh import collapsing, cutting
from rtbench.trees.bvh.nodes import WIDE, Bvh, aligned
from rtbench.trees.geometry import Geometry
from rtbench.trees.leaves import WIDTH
from rtbench.trees.options import Options

WORK = 500_000  # boxes looked at in a step: some hundredths of a second
HALVED = 40  # from this depth on cells are halved, whatever it costs ...
DEEPEST = 72  # ... so that no binary tree, and no wide one, is deeper
NUMBERED = 0x40000000  # with this bit a triangle's number is a usual float; there are fewer than it
DEFAULT = Options(structure="bvh", max_leaf=WIDTH, block=WIDTH)
IMPORTS = (
    "from rtbench.compiled.vector_functions import lane, lesser, spread\n"
    + vector_memory.imports(("halves_swapped", "load", "save", "truncated"))
)


def build(
    geometry: Geometry,
    options: Options = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> Bvh:
    """Build a bounding volume hierarchy.

    Parameters
    ----------
    geometry : Geometry
    options : Options
        Of these count the costs, block, ending, max_leaf and, if it is given, max_depth, the depth
        of the tree of two boxes a node. What the costs end is a leaf of 8 triangles at most.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Bvh

    Raises
    ------
    RtbenchError
        For more triangles than it can name.
    """
    count = len(geometry)
    if count >= NUMBERED:
        raise RtbenchError(f"{count:,} triangles: a BVH has fewer than {NUMBERED:,}")
    if not count:
        none = np.zeros(1, WIDE)
        none["boxes"] = np.repeat([np.inf, -np.inf], 3)[None, :, None]
        return Bvh(none, np.zeros(0, np.int32), geometry.box, 1, options)
    held = np.zeros((count, 8), np.float32)
    held[:, :3] = geometry.boxes[:, :3]
    np.negative(geometry.boxes[:, 3:], out=held[:, 4:7])
    held.view(np.int32)[:, 3] = np.arange(NUMBERED, NUMBERED + count)
    tree = _cut(held, options, progress)
    refs = held.view(np.int32)[:, 3] - np.int32(NUMBERED)
    del held
    inner = (len(tree) - 1) // 2
    nodes = aligned(max(1, inner), WIDE)
    made, depth = compiled_collapse().call(
        *_both(tree), *_both(nodes.view(np.float32).reshape(-1, WIDE.itemsize // 4))
    )
    kept = aligned(made, WIDE)
    kept[:] = nodes[:made]
    return Bvh(kept, refs, geometry.box, int(depth), options)


def _cut(held: np.ndarray, options: Options, progress) -> np.ndarray:
    """Return the binary tree over boxes, which are put in its order."""
    count = len(held)
    tree = np.empty((2 * count, 8), np.float32)
    cells, middles = np.zeros((DEEPEST + 2, 4), np.int64), np.empty((DEEPEST + 2, 8), np.float32)
    state = np.zeros(cutting.STATE, np.int64)
    by_count = options.ending != "automatic"
    given = by_count and options.max_depth is not None
    ending = np.array(
        [
            options.ending != "ad_hoc",
            options.max_leaf * by_count,
            max(WIDTH, options.max_leaf * by_count),
            options.max_depth if given else DEEPEST,
            HALVED,
        ],
        np.int64,
    )
    step, costs = compiled_step().call, np.array(cost.model(options))
    while step(held, *_both(tree), cells, middles, state, ending, costs, WORK) != cutting.DONE:
        if progress is not None:
            progress(float(state[cutting.IN_LEAVES] / count))
    return tree[: state[cutting.NODES]]


def _both(array: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows of float32, and the same as int32."""
    return array, array.view(np.int32)


@functools.cache
def compiled_step() -> Instance:
    """Return `rtbench.trees.bvh.cutting.step`, compiled."""
    return instantiate(
        cutting.step,
        signature=(
            "int64(float32[:, ::1], float32[:, ::1], int32[:, ::1], int64[:, ::1], "
            "float32[:, ::1], int64[::1], int64[::1], float64[::1], int64)"
        ),
        callees=(*cost.CALLEES, *cutting.CALLEES),
        constants=cutting.CONSTANTS | _digests(),
        title="A step of building a bounding volume hierarchy",
        imports=IMPORTS,
        forceinline=True,
    )


@functools.cache
def compiled_collapse() -> Instance:
    """Return `rtbench.trees.bvh.collapsing.collapse`, compiled."""
    return instantiate(
        collapsing.collapse,
        signature=(
            "UniTuple(int64, 2)(float32[:, ::1], int32[:, ::1], float32[:, ::1], int32[:, ::1])"
        ),
        callees=(cost.area, *collapsing.CALLEES),
        constants={"NOTHING": "np.float32(np.inf)"} | _digests(),
        title="Nodes of two boxes become nodes of eight",
        imports=f"{IMPORTS}\nfrom numba.types import UniTuple",
    )


def _digests() -> dict[str, str]:
    """Return constants that change with what a module imports."""
    return {"VECTORS": repr(vectors_digest()), "MEMORY": repr(vector_memory.digest())}
