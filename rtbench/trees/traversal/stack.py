"""A ray walks through a k-d tree, a stack remembering the far halves: the plain form.

Šilhavý 2010, algorithm 2, without its recursion; Wald 2004, section 7.2. Planes are widened, see
`rtbench.trees.traversal.entering`: a ray enters both halves where it may touch either.
"""

from __future__ import annotations

import numpy as np

from rtbench.kernels.contract import ZERO

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
DEPTH = 64
COUNTED = RETURNS_THREE = False
TRUE, FALSE = np.int32(1), np.int32(0)


def enter(orig, dir, tmax, scene, line):
    return False, np.float32(0), 0.0, 0.0, 0.0, 0.0


def limit_of(t, start, size, slack):
    return np.float32(0)


def nearest_in_leaf(refs, triangles, begin, end, ray, index, t, u, v):
    return index, t, u, v


def any_in_leaf(refs, triangles, begin, end, ray):
    return False


def halves(nodes, node, line):
    """Return the half of a cell that the ray meets first, the other, and from where to where.

    Returns
    -------
    first, second : uint32
        The children; the plane is crossed between ``late`` and ``early``.
    early, late : float32
        Where the second half may begin, and where the first ends at the latest.
    """
    link = nodes[node].link
    axis = link & np.uint32(3)
    crossing = (nodes[node].split - line[axis]) * line[axis + np.uint32(3)]
    child = link >> np.uint32(2)
    up = np.uint32(line[axis + np.uint32(3)] > 0)
    pad = line[axis + np.uint32(6)]
    return child + np.uint32(1) - up, child + up, crossing - pad, crossing + pad


def descend(nodes, line, node, near, far, far_nodes, nears, fars, top):
    """Return the leaf that a ray meets first below a node, the stack's height, the steps."""
    steps = 0
    while nodes[node].link & np.uint32(3) != np.uint32(3):
        steps += 1
        one, other, early, late = halves(nodes, node, line)
        node = one
        if late < near:
            node = other
        elif early <= far:
            far_nodes[top] = other
            nears[top] = max(near, early)
            fars[top] = far
            top += 1
            far = min(far, late)
    return node, top, steps


def nearest(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    line = np.empty(9, np.float32)  # origin, inverse, pad
    far_nodes = np.empty(DEPTH, np.uint32)
    nears = np.empty(DEPTH, np.float32)
    fars = np.empty(DEPTH, np.float32)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            ray = rays[k]
            index, best = np.int32(-1), ray.tmax
            best_u = best_v = ZERO
            entered = enter(ray.orig, ray.dir, ray.tmax, scene, line)
            steps = leaves = tests = 0
            if entered[0]:
                limit = entered[1]
                node = np.uint32(0)
                near, far = np.float32(0), limit
                top = 0
                while True:
                    node, top, more = descend(
                        nodes, line, node, near, far, far_nodes, nears, fars, top
                    )
                    steps += more
                    count = nodes[node].split
                    if count > 0:
                        begin = np.int64(nodes[node].link >> np.uint32(2))
                        end = begin + np.int64(count)
                        leaves += 1
                        tests += end - begin
                        found = nearest_in_leaf(
                            refs, triangles, begin, end, ray, index, best, best_u, best_v
                        )
                        if found[0] != index:
                            index, best, best_u, best_v = found
                            limit = limit_of(best, entered[2], entered[3], entered[4])
                    # Back to the nearest of the halves that were left for later.
                    while top > 0 and nears[top - 1] > limit:
                        top -= 1
                    if top == 0:
                        break
                    top -= 1
                    node, near, far = far_nodes[top], nears[top], min(fars[top], limit)
            outcome[k] = index
            t[k] = best
            if RETURNS_THREE:
                u[k] = best_u
                v[k] = best_v
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = steps, leaves, tests


def any_hit(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    line = np.empty(9, np.float32)
    far_nodes = np.empty(DEPTH, np.uint32)
    nears = np.empty(DEPTH, np.float32)
    fars = np.empty(DEPTH, np.float32)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            ray = rays[k]
            entered = enter(ray.orig, ray.dir, ray.tmax, scene, line)
            steps = leaves = tests = 0
            hit = FALSE
            if entered[0]:
                node = np.uint32(0)
                near, far = np.float32(0), entered[1]
                top = 0
                while True:
                    node, top, more = descend(
                        nodes, line, node, near, far, far_nodes, nears, fars, top
                    )
                    steps += more
                    count = nodes[node].split
                    if count > 0:
                        begin = np.int64(nodes[node].link >> np.uint32(2))
                        end = begin + np.int64(count)
                        leaves += 1
                        tests += end - begin
                        if any_in_leaf(refs, triangles, begin, end, ray):
                            hit = TRUE
                            break
                    if top == 0:
                        break
                    top -= 1
                    node, near, far = far_nodes[top], nears[top], fars[top]
            outcome[k] = hit
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = steps, leaves, tests


QUERIES = {"nearest": nearest, "any": any_hit}
CALLEES = (halves, descend)
