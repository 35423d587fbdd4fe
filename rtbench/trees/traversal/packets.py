"""Sixteen rays that go through a k-d tree together: for rays that lie close, as primary rays do.

A packet goes where any of its rays must, each of them keeping from where to where it lies in the
cell; one for which that is nothing takes no part. In a leaf each ray that takes part is tested
against eight triangles at a time. Rays go together if their directions have the same signs, so
that all meet the halves of a cell in the same order; a packet of others is taken in parts.

Each ray visits every leaf that it visits in `rtbench.trees.traversal.stack`, and maybe more.
Source: Wald, Slusallek, Benthin & Wagner 2001 (packets and their signs).
"""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled.instantiate import Instance
from rtbench.compiled.vector_bits import bits_of, lowest_bit, mask_of
from rtbench.compiled.vector_functions import any_lane, choose, greater, lesser, spread
from rtbench.compiled.vector_memory import load, save
from rtbench.kernels.contract import ZERO, Kernel
from rtbench.trees.traversal import groups
from rtbench.trees.traversal.groups import fetch

LANES = 16

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
DEPTH = 64
COUNTED = RETURNS_THREE = NEAREST = False
TRUE = np.int32(1)
NONE = np.int32(-1)


def limit_of(t, start, size, slack):
    return np.float32(0)


def in_leaf(refs, triangles, begin, end, ray, index, t, u, v):
    return index, t, u, v


def alike(left, lines):
    """Return those of the rays whose directions have the signs of the first, and these signs."""
    j = lowest_bit(left)
    same, signs = left, np.uint32(0)
    for axis in range(3):
        up = bits_of(load(lines, (3 + axis) * LANES, LANES) > np.float32(0))
        above = (up >> np.uint32(j)) & np.uint32(1)
        signs |= above << np.uint32(axis)
        same &= up if above != np.uint32(0) else ~up
    return same, signs


def through(
    nodes, refs, triangles, rays, group, signs, who, lines, limit, ready,
    index, best, best_u, best_v, steps, visits, tests, far_nodes, nears, fars,
):  # fmt: skip
    """Take the rays of a group through the tree."""
    begins = spread(np.float32(0), LANES)
    ends = choose(mask_of(group, LANES), load(limit, 0, LANES), spread(np.float32(-1), LANES))
    node, top = np.int64(0), 0
    while True:
        while True:
            link = np.int64(nodes[node].link)
            axis, child = link & 3, link >> 2
            if axis == 3:
                break
            if COUNTED:
                done = load(steps, 0, LANES)
                save(steps, 0, choose(begins <= ends, done + np.int32(1), done))
            from_origin = spread(nodes[node].split, LANES) - load(lines, axis * LANES, LANES)
            crossing = from_origin * load(lines, (3 + axis) * LANES, LANES)
            pad = load(lines, (6 + axis) * LANES, LANES)
            until, since = lesser(ends, crossing + pad), greater(begins, crossing - pad)
            up = (np.int64(signs) >> axis) & 1
            if any_lane(begins <= until):
                if any_lane(since <= ends):
                    far_nodes[top] = child + up
                    save(nears, top * LANES, since)
                    save(fars, top * LANES, ends)
                    top += 1
                node = child + 1 - up
                ends = until
            else:
                node = child + up
                begins = since
        count = nodes[node].split
        if count > 0:
            begin = np.int64(nodes[node].link >> np.uint32(2))
            end = begin + np.int64(count)
            left = bits_of(begins <= ends)
            while left != np.uint32(0):
                j = lowest_bit(left)
                left &= left - np.uint32(1)
                if COUNTED:
                    visits[j] += 1
                    tests[j] += end - begin
                ray = rays[who[j]]
                if NEAREST:
                    found = in_leaf(
                        refs, triangles, begin, end, ray, index[j], best[j], best_u[j], best_v[j]
                    )
                    if found[0] != index[j]:
                        index[j], best[j], best_u[j], best_v[j] = found
                        limit[j] = limit_of(
                            best[j], ready[j], ready[LANES + j], ready[2 * LANES + j]
                        )
                elif in_leaf(refs, triangles, begin, end, ray):
                    index[j] = TRUE
                    limit[j] = np.float32(-1)
        # Back to the nearest of the halves that were left for later.
        while True:
            if top == 0:
                return
            top -= 1
            begins = load(nears, top * LANES, LANES)
            ends = lesser(load(fars, top * LANES, LANES), load(limit, 0, LANES))
            if any_lane(begins <= ends):
                break
        node = far_nodes[top]


def walked(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    lines, ready = np.empty(10 * LANES, np.float32), np.empty(3 * LANES, np.float64)
    limit = np.empty(LANES, np.float32)
    who, numbers = np.zeros(LANES, np.int64), np.zeros(7 * LANES, REAL)
    index, best = np.zeros(LANES, np.int32), np.zeros(LANES, REAL)
    best_u, best_v = np.zeros(LANES, REAL), np.zeros(LANES, REAL)
    steps, visits = np.zeros(LANES, np.int32), np.zeros(LANES, np.int32)
    tests = np.zeros(LANES, np.int32)
    far_nodes = np.empty(DEPTH, np.int64)
    nears, fars = np.empty(DEPTH * LANES, np.float32), np.empty(DEPTH * LANES, np.float32)
    a = np.int64(0 if second.shape[0] else first.shape[0])
    b = np.int64(0)
    while a < first.shape[0]:
        left, missing, a, b = fetch(rays, first, second, a, b, scene, who, numbers, lines, ready)
        all_rays = left | missing
        save(limit, 0, load(lines, 9 * LANES, LANES))
        save(index, 0, spread(NONE, LANES))
        save(best, 0, load(numbers, 6 * LANES, LANES))
        save(best_u, 0, spread(ZERO, LANES))
        save(best_v, 0, spread(ZERO, LANES))
        if COUNTED:
            for of_rays in (steps, visits, tests):
                of_rays[:] = 0
        while left != np.uint32(0):
            group, signs = alike(left, lines)
            left ^= group
            through(
                nodes, refs, triangles, rays, group, signs, who, lines, limit, ready,
                index, best, best_u, best_v, steps, visits, tests, far_nodes, nears, fars,
            )  # fmt: skip
        j = 0
        while all_rays >> np.uint32(j) != np.uint32(0):
            k = who[j]
            outcome[k] = index[j]
            if NEAREST:
                t[k] = best[j]
                if RETURNS_THREE:
                    u[k], v[k] = best_u[j], best_v[j]
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = steps[j], visits[j], tests[j]
            j += 1


@functools.cache
def walk(
    kernel: Kernel, precision: str = "float32", query: str = "nearest", counted: bool = False
) -> Instance:
    """Return a compiled walk of packets of sixteen rays.

    Parameters
    ----------
    kernel : Kernel
        One that `rtbench.trees.leaves.in_blocks` accepts; leaves are in blocks.
    precision : str
        float32 or float64.
    query : str
        One of `rtbench.trees.traversal.walks.QUERIES`.
    counted : bool
        Count each ray's steps, leaves and tests.

    Returns
    -------
    Instance
        With the call of `rtbench.trees.traversal.walks.walk`; sixteen rays that follow each other
        in it are a packet.

    Raises
    ------
    RtbenchError
    """
    title, constants = f"packets of {LANES} rays", {"LANES": str(LANES)}
    callees = (alike, through)
    return groups.compiled(kernel, precision, query, counted, walked, callees, constants, title)
