"""The compiled part of `rtbench.trees.bvh.build` that makes nodes of 8 boxes of such as have two.

A node of 8 takes the place of a part of the binary tree. Which parts is decided from the leaves
up: so that rays visit the fewest nodes, by the surfaces of their boxes. (Opening the child of the
greatest surface until there are 8, as Wald, Benthin & Boulos 2008 do, leaves nodes of two and
three above the leaves.)

Source: Ylitie, Karras & Laine 2017, section 3.1.
"""

from __future__ import annotations

import numpy as np

from rtbench.trees.bvh.cutting import row_of, size_of

NOTHING = np.float32(np.inf)


def choose_parts(tree, links, costs, parts):
    """Find of each node how its part of the tree costs least as at most 1 to 8 nodes of 8.

    Parameters
    ----------
    tree, links
        As `rtbench.trees.bvh.cutting.step` leaves them.
    costs : (n, 8) float64 array
        Is given: the sum of the surfaces of at most 1, ... 7 nodes, and of the children of one.
    parts : (n, 8) uint8 array
        Is given: how many of these belong to the left child, times 16, and to the right; 0 where
        the node is one of 8 itself, or a leaf.
    """
    for node in range(tree.shape[0] - 1, -1, -1):
        if links[node, 7] > 0:
            for most in range(8):
                costs[node, most], parts[node, most] = 0.0, 0
            continue
        left, right = links[node, 3], links[node, 3] + 1
        for most in range(2, 9):
            best, part = np.inf, 0x11
            for k in range(1, most):
                cost = costs[left, k - 1] + costs[right, most - k - 1]
                if cost < best:
                    best, part = cost, k * 16 + most - k
            if most > 2 and not best < costs[node, most - 2]:
                best, part = costs[node, most - 2], parts[node, most - 2]
            costs[node, most - 1], parts[node, most - 1] = best, part
        whole = costs[node, 7] + size_of(row_of(tree, node))
        for most in range(1, 8):
            if most == 1 or not costs[node, most - 1] < whole:
                costs[node, most - 1], parts[node, most - 1] = whole, 0


def opened(links, parts, node, picked, most):
    """Write the up to 8 nodes that become a node's children to ``picked``; return how many."""
    if links[node, 7] > 0:
        picked[0] = node
        return 1
    picked[0], most[0] = node, 8
    count, at = 1, 0
    while at < count:
        part = np.int64(parts[picked[at], most[at] - 1])
        if part == 0:
            at += 1
            continue
        child = links[picked[at], 3]
        for k in range(count, at + 1, -1):  # so that they keep their order
            picked[k], most[k] = picked[k - 1], most[k - 1]
        picked[at], picked[at + 1] = child, child + 1
        most[at], most[at + 1] = part >> 4, part & 15
        count += 1
    return count


def collapse(tree, links, boxes, numbers):
    """Write the nodes of 8 boxes; return how many there are, and the depth.

    Parameters
    ----------
    tree, links
        As `rtbench.trees.bvh.cutting.step` leaves them.
    boxes, numbers : (n, 64) float32 array, and the same as int32
        Records WIDE as rows.
    """
    parts = np.empty((tree.shape[0], 8), np.uint8)
    choose_parts(tree, links, np.empty((tree.shape[0], 8), np.float64), parts)
    waiting, picked, most = (
        np.empty((1024, 3), np.int64),
        np.empty(8, np.int64),
        np.empty(8, np.int64),
    )
    waiting[0] = 0
    top, made, deepest = 1, 1, 1
    while top > 0:
        top -= 1
        node, wide, depth = waiting[top, 0], waiting[top, 1], waiting[top, 2] + 1
        deepest = max(deepest, depth)
        count = opened(links, parts, node, picked, most)
        inside = 0
        for k in range(count):
            inside += links[picked[k], 7] == 0
        next_top, next_wide = top + inside, made
        top, made = top + inside, made + inside
        for k in range(8):
            for row in range(6):
                boxes[wide, row * 8 + k] = NOTHING if row < 3 else -NOTHING
            numbers[wide, 48 + k], numbers[wide, 56 + k] = 0, 0
            if k >= count:
                continue
            child = picked[k]
            for row in range(3):
                boxes[wide, row * 8 + k] = tree[child, row]
                boxes[wide, row * 8 + 24 + k] = -tree[child, row + 4]
            if links[child, 7] > 0:
                numbers[wide, 48 + k], numbers[wide, 56 + k] = links[child, 3], links[child, 7]
            else:
                numbers[wide, 48 + k] = next_wide
                next_top -= 1  # so that the first is next
                waiting[next_top, 0], waiting[next_top, 1] = child, next_wide
                waiting[next_top, 2] = depth
                next_wide += 1
    return made, deepest


CALLEES = (row_of, size_of, choose_parts, opened)
