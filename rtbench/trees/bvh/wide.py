"""Rays walk through a bounding volume hierarchy of 8-wide nodes: 8 boxes at a time.

Sixteen rays are on their way at once, by turns: one ray would wait most of the time for what it
reads and for what it computed last, sixteen keep the processor busy. All that are at nodes take a
step, then all that are at leaves; what a ray needs next is asked for when that is known, a turn
before it is used.

The boxes that a ray meets go on its stack, sorted by a network, the nearest on top: no branch
depends on how many are met, or which. A box is widened by moving the origin, against the ray for
planes that it enters by and along it for those that it leaves by, see
`rtbench.trees.traversal.entering`; that rounds once more, which the margins there hold.

Sources: Wald, Benthin & Boulos 2008, Ernst & Greiner 2008 (wide nodes); Williams et al. 2005
(signs); Batcher 1968 (sorting).
"""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled import packets, syntax, vector_memory
from rtbench.compiled.embedded import refused_in_a_line
from rtbench.compiled.instantiate import Instance, instantiate, source_of
from rtbench.compiled.sources import named
from rtbench.compiled.vector_bits import lowest_bit
from rtbench.compiled.vector_functions import spread
from rtbench.compiled.vector_memory import load, save
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import ZERO, Kernel
from rtbench.trees import leaves
from rtbench.trees.bvh.nodes import WIDE_SOURCE
from rtbench.trees.bvh.steps import (
    CALLEES,
    CHILD,
    CONSTANTS,
    HERE,
    LANES,
    LIMIT,
    NEARS,
    ROOM,
    SIZE,
    TOP,
    WAITING,
    come_in,
    go_back,
    meet,
    take,
)
from rtbench.trees.traversal import groups, walks

BY_VECTORS = ("any_lane", "choose", "greater", "lesser", "opposite", "row", "spread")
BY_MEMORY = (*groups.NAMES, "descending", "prefetch_either", "told_apart")
# Stand-ins for what each generated module puts at its top.
REAL = np.float64
NEAREST = COUNTED = RETURNS_THREE = False
TRUE, NONE = np.int32(1), np.int32(-1)


def limit_of(t, start, size, slack):
    return np.float32(0)


def in_leaf(refs, triangles, begin, end, ray, index, t, u, v):
    return index, t, u, v


def walked(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    numbers = np.ones(7 * LANES, REAL)
    who, next_who = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    state, ready = np.zeros(ROOM, np.float32), np.zeros(3 * LANES, np.float64)
    words = state.view(np.int32)
    index, best = np.empty(LANES, np.int32), np.empty(LANES, REAL)
    best_u, best_v = np.zeros(LANES, REAL), np.zeros(LANES, REAL)
    steps, leaves = np.zeros(LANES, np.int32), np.zeros(LANES, np.int32)
    tests = np.zeros(LANES, np.int32)
    a = np.int64(0 if second.shape[0] else first.shape[0])
    taken, a, b = take(rays, first, second, a, np.int64(0), numbers, next_who)
    while taken > 0:
        here = taken
        at_nodes = come_in(numbers, scene, state, words, ready)
        at_nodes &= (np.uint32(1) << here) - np.uint32(1)
        at_leaves = np.uint32(0)
        save(best, 0, load(numbers, 6 * LANES, LANES))
        save(index, 0, spread(NONE, LANES))
        if RETURNS_THREE and NEAREST:
            save(best_u, 0, spread(ZERO, LANES))
            save(best_v, 0, spread(ZERO, LANES))
        if COUNTED:
            save(steps, 0, spread(HERE, LANES))
            save(leaves, 0, spread(HERE, LANES))
            save(tests, 0, spread(HERE, LANES))
        # The next rays are read now, so that no one waits for what was just written.
        who, next_who = next_who, who
        taken, a, b = take(rays, first, second, a, b, numbers, next_who)
        while at_nodes | at_leaves != np.uint32(0):
            turn = at_nodes
            while turn != np.uint32(0):
                lane = np.uint32(lowest_bit(turn))
                turn &= turn - np.uint32(1)
                meet(nodes, state, words, lane)
                if COUNTED:
                    steps[lane] += 1
                at_nodes, at_leaves = go_back(
                    nodes, triangles, state, words, lane, at_nodes, at_leaves
                )
            turn = at_leaves
            while turn != np.uint32(0):
                lane = np.uint32(lowest_bit(turn))
                turn &= turn - np.uint32(1)
                begin, size = np.uint32(words[CHILD + lane]), np.uint32(words[SIZE + lane])
                if COUNTED:
                    leaves[lane] += 1
                    tests[lane] += size
                ray = rays[np.uint64(who[lane])]
                if NEAREST:
                    found = in_leaf(
                        refs,
                        triangles,
                        begin,
                        begin + size,
                        ray,
                        index[lane],
                        best[lane],
                        best_u[lane],
                        best_v[lane],
                    )
                    if found[0] != index[lane]:
                        index[lane], best[lane], best_u[lane], best_v[lane] = found
                        state[LIMIT + lane] = limit_of(
                            found[1], ready[lane], ready[LANES + lane], ready[2 * LANES + lane]
                        )
                elif in_leaf(refs, triangles, begin, begin + size, ray):
                    index[lane] = TRUE
                    words[TOP + lane] = NEARS + lane * WAITING
                at_nodes, at_leaves = go_back(
                    nodes, triangles, state, words, lane, at_nodes, at_leaves
                )
        for lane in range(here):
            k = who[lane]
            outcome[k] = index[lane]
            if NEAREST:
                t[k] = best[lane]
                if RETURNS_THREE:
                    u[k], v[k] = best_u[lane], best_v[lane]
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = steps[lane], leaves[lane], tests[lane]


@functools.cache
def walk(
    kernel: Kernel,
    precision: str = "float32",
    query: str = "nearest",
    form: str = leaves.ONE_BY_ONE,
    counted: bool = False,
) -> Instance:
    """Return a compiled walk through a bounding volume hierarchy.

    Parameters
    ----------
    kernel, precision, query, form, counted
        As for `rtbench.trees.traversal.walks.walk`.

    Returns
    -------
    Instance
        Called as that of `rtbench.trees.traversal.walks.walk`, with what
        `rtbench.trees.bvh.nodes.leaves_of` makes of a tree. A step is a node of 8 boxes.

    Raises
    ------
    RtbenchError
    """
    if query not in walks.QUERIES:
        raise RtbenchError(unknown("query", query, walks.QUERIES))
    own = own_constants(query)
    taken = (*walks.TAKEN, *own, *BY_VECTORS, *BY_MEMORY, *(each.__name__ for each in CALLEES))
    leaves.test_of(kernel, precision, form, tuple(dict.fromkeys(taken)))  # refuses what clashes
    parts = walks.leaf_parts(kernel, precision, query, form, counted)
    imported = [parts.imports, vector_memory.imports(BY_MEMORY)]
    if "vector_functions" not in parts.imports:
        names = ", ".join(BY_VECTORS)
        imported.append(f"from rtbench.compiled.vector_functions import {names}")
    callees = (*groups.entering_in_lanes(), *(source_of(each) for each in CALLEES))
    text = named(syntax.parse(walked), f"{kernel.name}_wide_{query}")
    with refused_in_a_line(kernel, " in a walk"):
        return instantiate(
            text.replace("in_leaf(", f"{query}_in_leaf("),
            callees=(*parts.callees, *callees),
            constants=parts.constants | own,
            signature=walks.signature(parts.constants["REAL"].removeprefix("np.")),
            title=f"{kernel.name} in {precision}: {query}, BVH, {form}",
            forceinline=True,
            outlined=parts.outlined,
            imports="\n".join(each for each in imported if each),
        )


def own_constants(query: str) -> dict[str, str]:
    """Return the constants of a walk's module besides those of `walks.leaf_parts`."""
    return CONSTANTS | {
        "NEAREST": str(query == "nearest"),
        "NONE": "np.int32(-1)" if query == "nearest" else "np.int32(0)",
        "NODE": WIDE_SOURCE,
        "VECTORS": repr(packets.vectors_digest()),
        "MEMORY": repr(vector_memory.digest()),
    }
