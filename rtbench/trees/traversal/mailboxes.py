"""The plain walk with mailboxes: no ray is tested against a triangle twice.

A triangle may lie in many cells. Each has a mailbox with the number of the ray that was last tested
against it, and a ray that finds its own number passes on. What is saved is the test; what is
paid is a look into an array as long as there are triangles, in the order of the leaf. Since every
triangle is asked with the ray's own tmax, a second test could not answer otherwise: the walk and
its answer are those of `rtbench.trees.traversal.stack`, step for step.

Source: Arnaldi, Priol & Bouatouch 1987; Amanatides & Woo 1987; Havran 2000, section 4.6.
"""

from __future__ import annotations

import numpy as np

from rtbench.kernels.contract import HIT, ZERO
from rtbench.trees.traversal import stack

# Stand-ins for what each generated module puts at its top.
DEPTH = 64
COUNTED = RETURNS_THREE = False
TRUE, FALSE = np.int32(1), np.int32(0)


def enter(orig, dir, tmax, scene, line):
    return False, np.float32(0), 0.0, 0.0, 0.0, 0.0


def limit_of(t, start, size, slack):
    return np.float32(0)


def ask(tri, ray):
    return 0, 0.0, 0.0, 0.0


def nearest_with_mailboxes(refs, triangles, begin, end, ray, index, t, u, v, mailboxes, number):
    """Return index, t, u, v of the nearest hit after triangles refs[begin:end], and the tests."""
    tests = 0
    for k in range(begin, end):
        i = refs[k]
        if mailboxes[i] == number:
            continue
        mailboxes[i] = number
        tests += 1
        result = ask(triangles[i], ray)
        hit = (result[0] == HIT) & (result[1] > ZERO) & (result[1] < ray.tmax)
        if hit and (result[1] < t or (result[1] == t and i < index)):
            index, t = i, result[1]
            if RETURNS_THREE:
                u, v = result[2], result[3]
    return index, t, u, v, tests


def any_with_mailboxes(refs, triangles, begin, end, ray, mailboxes, number):
    """Return whether any of the triangles refs[begin:end] is hit, and the tests."""
    tests = 0
    for k in range(begin, end):
        i = refs[k]
        if mailboxes[i] == number:
            continue
        mailboxes[i] = number
        tests += 1
        result = ask(triangles[i], ray)
        if (result[0] == HIT) & (result[1] > ZERO) & (result[1] < ray.tmax):
            return True, tests
    return False, tests


def descend(nodes, line, node, near, far, far_nodes, nears, fars, top):
    return node, top, 0


def nearest(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    line = np.empty(9, np.float32)
    far_nodes = np.empty(DEPTH, np.uint32)
    nears = np.empty(DEPTH, np.float32)
    fars = np.empty(DEPTH, np.float32)
    mailboxes = np.full(triangles.shape[0], -1, np.int32)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            number = np.int32(a * second.shape[0] + b)
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
                    count = np.int64(nodes[node].split)
                    if count > 0:
                        begin = np.int64(nodes[node].link >> np.uint32(2))
                        leaves += 1
                        found = nearest_with_mailboxes(
                            refs,
                            triangles,
                            begin,
                            begin + count,
                            ray,
                            index,
                            best,
                            best_u,
                            best_v,
                            mailboxes,
                            number,
                        )
                        tests += found[4]
                        if found[0] != index:
                            index, best, best_u, best_v = found[0], found[1], found[2], found[3]
                            limit = limit_of(best, entered[2], entered[3], entered[4])
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
    mailboxes = np.full(triangles.shape[0], -1, np.int32)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            number = np.int32(a * second.shape[0] + b)
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
                    count = np.int64(nodes[node].split)
                    if count > 0:
                        begin = np.int64(nodes[node].link >> np.uint32(2))
                        leaves += 1
                        found = any_with_mailboxes(
                            refs, triangles, begin, begin + count, ray, mailboxes, number
                        )
                        tests += found[1]
                        if found[0]:
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
CALLEES = (*stack.CALLEES, nearest_with_mailboxes, any_with_mailboxes)
OUTLINED = ()
