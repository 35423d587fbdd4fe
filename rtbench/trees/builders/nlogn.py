"""The O(N log N) builder: events sorted once, then swept, parted and merged in order.

Compiled code works in steps that end now and then, so that Python can report progress, be
interrupted, and enlarge arrays; what a step has done so far is all in arrays.

Source: Wald & Havran 2006, section 4.3
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.errors import RtbenchError
from rtbench.trees import cost
from rtbench.trees.builders import event_sweep, events, planes, presorted
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import MOST_IN_LEAF, MOST_LINKS, NODE, KdTree
from rtbench.trees.options import DEEPEST, Options
from rtbench.trees.overlap import fit_sources

AXES = {"all": planes.ALL, "longest": planes.LONGEST, "round_robin": planes.ROUND_ROBIN}
WORK = 1 << 19  # references looked at in a step: some hundredths of a second
MOST = 1 << 28  # beyond, the number of blocks is no longer exact

ARRAYS = (
    "float64[::1], float32[:, ::1], uint64[:, ::1], uint16[::1], int32[::1], float32[:, ::1], "
    "uint64[::1], uint32[:, ::1], int32[::1], int64[:, ::1], float64[:, ::1], int64[::1], "
    "int64[::1], float64[::1], float64[::1], float64[:, :, ::1], int64"
)


@functools.cache
def compiled(overlap: str, real: str, half: bool) -> Instance:
    """Return the step compiled for an overlap test and the type of the corners."""
    ours = (*events.CALLEES, *event_sweep.CALLEES)
    return instantiate(
        presorted.step,
        signature=f"int64({real}[:, :, ::1], {ARRAYS})",
        callees=(*cost.CALLEES, *ours, *fit_sources(overlap), *presorted.CALLEES),
        constants=events.CONSTANTS
        | event_sweep.CONSTANTS
        | presorted.CONSTANTS
        | {"HALF": repr(half)},
        title=f"A step of building a k-d tree (nlogn, {overlap})",
        imports="from numba.types import uint16",
    )


@functools.cache
def sorting() -> Instance:
    """Return what writes the first events, compiled."""
    return instantiate(
        events.first_events,
        signature="uint64(float32[:, ::1], int64, uint64[:, ::1])",
        callees=(events.ordered, events.event),
        constants=events.CONSTANTS,
        title="The events of a scene",
    )


def certain(options: Options) -> int:
    """Return how many references make a leaf whatever a plane costs."""
    few = 0 if options.ending == "automatic" else options.max_leaf
    if options.ending != "ad_hoc":
        # A cut costs K_T at least.
        blocks = int(options.traversal_cost / options.intersection_cost) + 1
        while options.intersection_cost * blocks > options.traversal_cost:
            blocks -= 1
        few = max(few, blocks * options.block)
    return min(few, MOST_LINKS)


def longer(array: np.ndarray, needed: int, axis: int = 0) -> np.ndarray:
    """Return a longer copy of an array, by half at least."""
    shape = list(array.shape)
    shape[axis] = max(needed + 64, shape[axis] * 3 // 2)
    made = np.empty(shape, array.dtype)
    made[tuple(slice(0, n) for n in array.shape)] = array
    return made


def build(
    geometry: Geometry, options: Options, progress: Callable[[float], None] | None = None
) -> KdTree:
    """Build a tree; see `rtbench.trees.building.build`.

    Peak memory: 163 bytes a triangle for dragon in float32, of which 60 are the geometry; 226 with
    K_T = K_I, where the tree has more nodes.
    """
    n = len(geometry)
    if n >= MOST:
        raise RtbenchError(f"{n:,} triangles: the builder nlogn takes fewer than {MOST:,}")
    half = options.candidates == "half"
    run = compiled(options.overlap, geometry.corners.dtype.name, half).call
    boxes = geometry.boxes.copy()
    held = np.empty((3, 5 * n + 64), np.uint64)
    waiting = np.zeros((DEEPEST + 3, 12), np.int64)
    cells = np.zeros((DEEPEST + 3, 6))
    waiting[0, presorted.COUNT], cells[0] = n, geometry.box
    for axis in range(3):
        waiting[0, presorted.STOP + axis] = sorting().call(boxes, axis, held)
        held[axis, : waiting[0, presorted.STOP + axis]].sort()
    arrays = {
        "events": held,
        "fates": np.zeros(n, np.uint16),
        "aside": np.empty(n // 8 + 64, np.int32),
        "kept": np.empty((n // 8 + 64, 6), np.float32),
        "fresh": np.empty(2 * (n // 8 + 64), np.uint64),
        "nodes": np.empty((2 * n + 64, 2), np.uint32),
        "refs": np.empty(2 * n + 64, np.int32),
    }
    del held
    state = np.array([1, 1, 0, 0, 0], np.int64)
    pad, times = options.block - 1, -(-(1 << 36) // options.block)
    choice = np.array(
        [
            *(AXES[options.axes], options.flat_cells, options.ending != "ad_hoc"),
            *(certain(options), options.deepest(n), pad, times),
        ],
        np.int64,
    )
    middles, room = np.empty(n if half else 0), np.empty((2, 12, 3))
    while True:
        ended = run(
            *(geometry.corners, geometry.base, boxes, *arrays.values(), waiting, cells, state),
            *(choice, np.array(cost.model(options)), middles, room, WORK),
        )
        if ended == presorted.DONE:
            break
        if ended == presorted.WORKED:
            if progress is not None:
                written = int(state[presorted.REFS])
                pending = int(waiting[: state[presorted.WAITING], presorted.COUNT].sum())
                progress(written / (written + pending))
            continue
        needed = int(state[presorted.NEEDED])
        if ended == presorted.FULL_EVENTS:
            arrays["events"] = longer(arrays["events"], needed, 1)
        elif ended == presorted.FULL_ASIDE:
            for name, times in (("aside", 1), ("kept", 1), ("fresh", 2)):
                arrays[name] = longer(arrays[name], times * needed)
        else:
            if needed > MOST_LINKS:
                raise RtbenchError(f"the tree has more than {MOST_LINKS} nodes or references")
            name = "nodes" if ended == presorted.FULL_NODES else "refs"
            arrays[name] = longer(arrays[name], needed)
    nodes = arrays["nodes"][: state[presorted.NODES]].copy().view(NODE).reshape(-1)
    refs = arrays["refs"][: state[presorted.REFS]].copy()
    tree = KdTree(nodes, refs, geometry.box, int(state[presorted.DEPTH]), options)
    most = tree.leaves[1].max()
    if most >= MOST_IN_LEAF:
        raise RtbenchError(f"a leaf of {most:,} triangles (allowed: fewer than {MOST_IN_LEAF:,})")
    return tree
