"""A ray walks through a k-d tree by recursion: the thesis's algorithm 2, kept as the baseline.

Two things are not as printed. Where the direction lies in the split plane, t is infinite or, if the
origin lies in it too, NaN, and then only the far half is entered, with NaN for its beginning: here
planes are widened, see `rtbench.trees.traversal.entering`, and both halves are entered. And a hit
in the near half ends the walk as printed, though it may lie beyond that half, with something
nearer in the other: here the other is left out only if it begins beyond the hit.

Source: Šilhavý 2010, section 3.1.1, algorithm 2; Kaplan 1985.
"""

from __future__ import annotations

import numpy as np

from rtbench.kernels.contract import ZERO
from rtbench.trees.traversal import stack

# Stand-ins for what each generated module puts at its top.
COUNTED = RETURNS_THREE = False
ROOT = np.uint64(0)
TRUE, FALSE = np.int32(1), np.int32(0)


def enter(orig, dir, tmax, scene, line):
    return False, np.float32(0), 0.0, 0.0, 0.0, 0.0


def limit_of(t, start, size, slack):
    return np.float32(0)


def halves(nodes, node, line):
    return node, node, np.float32(0), np.float32(0)


def nearest_in_leaf(refs, triangles, begin, end, ray, index, t, u, v):
    return index, t, u, v


def any_in_leaf(refs, triangles, begin, end, ray):
    return False


def nearest_below(
    nodes, refs, triangles, ray, line, entered, node, near, far, index, t, u, v, k, counts
):
    """Return index, t, u, v of the nearest hit after a node was walked from near to far."""
    # Types are inferred from what comes before the first call of itself.
    if nodes[node].link & np.uint32(3) == np.uint32(3):
        begin = np.int64(nodes[node].link >> np.uint32(2))
        end = begin + np.int64(nodes[node].split)
        if COUNTED and end > begin:
            counts[k, 1] += 1
            counts[k, 2] += end - begin
        return nearest_in_leaf(refs, triangles, begin, end, ray, index, t, u, v)
    if COUNTED:
        counts[k, 0] += 1
    one, other, early, late = halves(nodes, node, line)
    if late < near:
        return nearest_below(
            nodes, refs, triangles, ray, line, entered, other, near, far, index, t, u, v, k, counts
        )
    if early > far:
        return nearest_below(
            nodes, refs, triangles, ray, line, entered, one, near, far, index, t, u, v, k, counts
        )
    ends = min(far, late)
    begins = max(near, early)
    found = nearest_below(
        nodes, refs, triangles, ray, line, entered, one, near, ends, index, t, u, v, k, counts
    )
    if found[0] != index:
        index, t, u, v = found
        far = min(far, limit_of(t, entered[2], entered[3], entered[4]))
        if begins > far:
            return found
    return nearest_below(
        nodes, refs, triangles, ray, line, entered, other, begins, far, index, t, u, v, k, counts
    )


def any_below(nodes, refs, triangles, ray, line, node, near, far, k, counts):
    """Return whether there is a hit in a node between near and far."""
    if nodes[node].link & np.uint32(3) == np.uint32(3):
        begin = np.int64(nodes[node].link >> np.uint32(2))
        end = begin + np.int64(nodes[node].split)
        if COUNTED and end > begin:
            counts[k, 1] += 1
            counts[k, 2] += end - begin
        return any_in_leaf(refs, triangles, begin, end, ray)
    if COUNTED:
        counts[k, 0] += 1
    one, other, early, late = halves(nodes, node, line)
    if late < near:
        return any_below(nodes, refs, triangles, ray, line, other, near, far, k, counts)
    if early > far:
        return any_below(nodes, refs, triangles, ray, line, one, near, far, k, counts)
    if any_below(nodes, refs, triangles, ray, line, one, near, min(far, late), k, counts):
        return True
    return any_below(nodes, refs, triangles, ray, line, other, max(near, early), far, k, counts)


def nearest(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    line = np.empty(9, np.float32)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            ray = rays[k]
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = 0, 0, 0
            found = np.int32(-1), ray.tmax, ZERO, ZERO
            entered = enter(ray.orig, ray.dir, ray.tmax, scene, line)
            if entered[0]:
                found = nearest_below(
                    nodes,
                    refs,
                    triangles,
                    ray,
                    line,
                    entered,
                    ROOT,
                    np.float32(0),
                    entered[1],
                    np.int32(-1),
                    ray.tmax,
                    ZERO,
                    ZERO,
                    k,
                    counts,
                )
            outcome[k] = found[0]
            t[k] = found[1]
            if RETURNS_THREE:
                u[k] = found[2]
                v[k] = found[3]


def any_hit(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    line = np.empty(9, np.float32)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            ray = rays[k]
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = 0, 0, 0
            entered = enter(ray.orig, ray.dir, ray.tmax, scene, line)
            near, far = np.float32(0), entered[1]
            hit = FALSE
            if entered[0] and any_below(
                nodes, refs, triangles, ray, line, ROOT, near, far, k, counts
            ):
                hit = TRUE
            outcome[k] = hit


QUERIES = {"nearest": nearest, "any": any_hit}
CALLEES = (*stack.CALLEES, nearest_below, any_below)
# numba does not restore from its cache a function that calls itself with arguments of other types
# than those that it was called with: a node is a uint64 from the root on, as `halves` gives it.
CONSTANTS = {"ROOT": "np.uint64(0)"}
OUTLINED = ("nearest_below", "any_below")  # what calls itself cannot be inlined
