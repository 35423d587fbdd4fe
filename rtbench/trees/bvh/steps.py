"""What a ray does in `rtbench.trees.bvh.wide`: it enters, meets the boxes of a node, goes back.

Plain functions that go into compiled code. The numbers of the rays lie side by side in one array,
``state``, which as ``words`` is the same in int32.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.vector_bits import as_single, bits_of, descending, how_many, told_apart
from rtbench.compiled.vector_functions import choose, greater, lesser, row, spread
from rtbench.compiled.vector_memory import load, prefetch_either, save
from rtbench.trees.bvh.build import DEEPEST
from rtbench.trees.bvh.nodes import CHILDREN

LANES = 16  # rays on their way
# Where the numbers of the rays lie, three rows of LANES for the axes: where each starts for planes
# that it enters by, 1 over its direction, where it starts for planes that it leaves by; how far it
# goes, which row of a node's boxes it enters by (as a place in the boxes); the node or leaf it is
# at, how much that holds, where its stack ends. Then come the stacks: where boxes begin, with the
# child's place in its node in the last bits, and the nodes.
WAITING = 7 * DEEPEST + 2 * CHILDREN
COME, INVERSE, LEAVE, LIMIT, LOW = 0, 3 * LANES, 6 * LANES, 9 * LANES, 10 * LANES
CHILD, SIZE, TOP, NEARS = 13 * LANES, 14 * LANES, 15 * LANES, 16 * LANES
PARENTS = NEARS + LANES * WAITING
ROOM = PARENTS + LANES * WAITING

# Of other types in compiled code.
LINES = 6  # of 64 bytes that are asked for ahead: of a node 4 are read, of most blocks 6
BEFORE, START, HERE = np.float32(-1), np.float32(0), np.int32(0)
LESS = np.float32(1 - 2**-20)  # more than the last bits of a float32, in which children are told


def lanes_enter(orig, dir, tmax, scene, line):  # as `rtbench.trees.traversal.groups` makes it
    return False, np.float32(0), 0.0, 0.0, 0.0, 0.0


def take(rays, first, second, a, b, numbers, who):
    """Read the next rays, as many as there are lanes; return how many there were, and a, b."""
    taken = np.uint32(0)
    while taken < LANES and a < first.shape[0]:
        k = first[a] + second[b]
        ray = rays[k]
        who[taken] = k
        for axis in range(3):
            numbers[np.uint32(axis * LANES) + taken] = ray.orig[axis]
            numbers[np.uint32((3 + axis) * LANES) + taken] = ray.dir[axis]
        numbers[np.uint32(6 * LANES) + taken] = ray.tmax
        taken += np.uint32(1)
        b += 1
        if b == second.shape[0]:
            a, b = a + 1, 0
    return taken, a, b


def come_in(numbers, scene, state, words, ready):
    """Let rays enter; return the bits of those that do; ``ready`` is what `limit_of` wants."""
    enters, exit, start, size, slack, pad = lanes_enter(
        (load(numbers, 0, LANES), load(numbers, LANES, LANES), load(numbers, 2 * LANES, LANES)),
        (
            load(numbers, 3 * LANES, LANES),
            load(numbers, 4 * LANES, LANES),
            load(numbers, 5 * LANES, LANES),
        ),
        load(numbers, 6 * LANES, LANES),
        scene,
        state,
    )
    wider = as_single(pad)
    for axis in range(3):
        rises = load(state, INVERSE + axis * LANES, LANES) > START
        origin = load(state, COME + axis * LANES, LANES)
        pads = choose(rises, wider, -wider)
        save(state, COME + axis * LANES, origin + pads)
        save(state, LEAVE + axis * LANES, origin - pads)
        low = choose(rises, np.int32(axis * 8), np.int32(axis * 8 + 24))
        save(words, LOW + axis * LANES, low)
    save(state, LIMIT, exit)
    save(words, CHILD, spread(HERE, LANES))
    save(ready, 0, start)
    save(ready, LANES, size)
    save(ready, 2 * LANES, slack)
    for lane in range(LANES):
        words[TOP + lane] = NEARS + lane * WAITING
    return bits_of(enters)


def go_back(nodes, triangles, state, words, lane, at_nodes, at_leaves):
    """Take a ray to the nearest box of its stack; return who is at nodes and who at leaves."""
    bottom = np.uint32(NEARS) + lane * np.uint32(WAITING)
    top = np.uint32(words[TOP + lane])
    limit = state[LIMIT + lane]
    bit = np.uint32(1) << lane
    while top > bottom and state[top - np.uint32(1)] > limit:
        top -= np.uint32(1)
    if top == bottom:
        return at_nodes & ~bit, at_leaves & ~bit
    top -= np.uint32(1)
    words[TOP + lane] = top
    parent = nodes[np.uint32(words[top + np.uint32(PARENTS - NEARS)])]
    place = np.uint32(words[top]) & np.uint32(7)
    child, size = parent.child[place], parent.count[place]
    words[CHILD + lane], words[SIZE + lane] = child, size
    for line in range(LINES):
        prefetch_either(size > 0, triangles, nodes, np.int64(child), 64 * line)
    leaf = np.uint32(size > 0) << lane
    return at_nodes & ~bit | (bit ^ leaf), at_leaves & ~bit | leaf


def meet(nodes, state, words, lane):
    """Put those of a node's boxes that a ray meets on its stack."""
    at = words[CHILD + lane]
    node = nodes[np.uint32(at)]
    x, y, z = (
        state[INVERSE + lane],
        state[INVERSE + LANES + lane],
        state[INVERSE + 2 * LANES + lane],
    )
    low_x, low_y = np.int64(words[LOW + lane]), np.int64(words[LOW + LANES + lane])
    low_z = np.int64(words[LOW + 2 * LANES + lane])
    near_x = (row(node.boxes, 0, low_x, 8) - state[COME + lane]) * x
    near_y = (row(node.boxes, 0, low_y, 8) - state[COME + LANES + lane]) * y
    near_z = (row(node.boxes, 0, low_z, 8) - state[COME + 2 * LANES + lane]) * z
    far_x = (row(node.boxes, 0, 24 - low_x, 8) - state[LEAVE + lane]) * x
    far_y = (row(node.boxes, 0, 40 - low_y, 8) - state[LEAVE + LANES + lane]) * y
    far_z = (row(node.boxes, 0, 56 - low_z, 8) - state[LEAVE + 2 * LANES + lane]) * z
    near = greater(greater(START, near_z), greater(near_x, near_y))
    far = lesser(lesser(far_x, far_y), lesser(far_z, state[LIMIT + lane]))
    met = near <= far
    top = np.int64(words[TOP + lane])
    # Beforehand a little less, so that no box seems to begin later than it does. What is not met
    # comes last, beyond the nearest.
    save(state, top, descending(choose(met, told_apart(near * LESS), BEFORE)))
    save(words, top + (PARENTS - NEARS), spread(at, 8))
    words[TOP + lane] = top + how_many(met)


CALLEES = (take, come_in, go_back, meet)
CONSTANTS = {
    name: repr(globals()[name])
    for name in (
        *("LANES", "WAITING", "COME", "INVERSE", "LEAVE", "LIMIT", "LOW", "CHILD", "SIZE", "TOP"),
        *("NEARS", "PARENTS", "ROOM", "LINES"),
    )
}
CONSTANTS |= {
    "BEFORE": "np.float32(-1)",
    "START": "np.float32(0)",
    "HERE": "np.int32(0)",
    "LESS": "np.float32(1 - 2**-20)",
}
