"""Many rays in lanes, each on its own way through a k-d tree: for rays that share nothing.

All lanes go down together, one step each, wherever they are; those that have come to a leaf wait
until few others are still on their way. Then each leaf is visited, one ray against eight triangles
at a time, its ray goes back to the nearest half that was left, and where none is, the lane takes
the next ray. What single rays do one after the other, waiting for each node to come from memory,
lanes do at once. There are twice as many as fit in the widest registers: the two halves do not wait
for each other, and while one is waiting for its nodes the other computes.

Each ray visits every leaf that it visits in `rtbench.trees.traversal.stack`, and maybe a few more:
of a half that is left for later only its end is stored, not where it begins, see `back`.
Source: Aila & Laine 2009 (on GPUs, "while-while"); waiting until few are on their way is ours.
"""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled.instantiate import Instance
from rtbench.compiled.vector_bits import (
    bits_and,
    bits_of,
    bits_or,
    float_of_bits,
    high_half,
    how_many,
    joined_halves,
    low_half,
    lowest_bit,
    mask_of,
    shifted_left,
    shifted_right,
    signed,
)
from rtbench.compiled.vector_functions import any_lane, choose, greater, lesser, opposite, spread
from rtbench.compiled.vector_memory import gather, load, prefetch, save, scatter
from rtbench.kernels.contract import ZERO, Kernel
from rtbench.trees.traversal import groups
from rtbench.trees.traversal.groups import LINE, fetch

LANES = 32
FEW = 16  # so many on their way are not waited for

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
DEPTH = 64
LINES = 6
COUNTED = RETURNS_THREE = NEAREST = False
TRUE, NONE = np.int32(1), np.int32(-1)


def limit_of(t, start, size, slack):
    return np.float32(0)


def in_leaf(refs, triangles, begin, end, ray, index, t, u, v):
    return index, t, u, v


def by_axis(lines, first, axis):
    """Return of three rows of ``lines`` that of each lane's axis."""
    x, y = load(lines, first, LANES), load(lines, first + LANES, LANES)
    z = load(lines, first + 2 * LANES, LANES)
    return choose(axis == np.int32(0), x, choose(axis == np.int32(1), y, z))


def back(due, at, begins, ends, tops, limits, lines, stack):
    """Take lanes back to the nearest half that each left for later.

    A half begins where the one before it ended, but for the pads of the plane between them: twice
    the pad, and once more for what is rounded here. By as much, of any plane, those that were left
    earlier may begin before it.

    Returns
    -------
    went, at, begins, ends, tops
        The first tells which did; the others of those that are due are at an end.
    """
    px, py = load(lines, 6 * LANES, LANES), load(lines, 7 * LANES, LANES)
    widest = greater(greater(px, py), load(lines, 8 * LANES, LANES)) * np.float32(3)
    went = due & opposite(due)
    while True:
        place = tops - np.int32(LANES)
        there = due & (place >= np.int32(0))
        word = gather(stack, place, there, spread(np.uint64(0), LANES))
        link = signed(low_half(word))
        begin = ends - by_axis(lines, 6 * LANES, bits_and(link, np.int32(3))) * np.float32(3)
        late = begin > limits
        goes = there & opposite(late)
        at = choose(goes, signed(shifted_right(link, np.int32(2))), at)
        begins = choose(goes, begin, begins)
        ends = choose(goes, lesser(float_of_bits(high_half(word)), limits), ends)
        tops = choose(there, place, tops)
        went = went | goes
        due = there & late & opposite(begin - widest > limits)
        if not any_lane(due):
            return went, at, begins, ends, tops


def go_back(due, node, near, far, top, limit, lines, stack):
    """Take lanes back, their state in arrays; return which are at an end."""
    lanes = mask_of(due, LANES)
    at, begins, ends = load(node, 0, LANES), load(near, 0, LANES), load(far, 0, LANES)
    tops, limits = load(top, 0, LANES), load(limit, 0, LANES)
    went, at, begins, ends, tops = back(lanes, at, begins, ends, tops, limits, lines, stack)
    save(node, 0, at)
    save(near, 0, begins)
    save(far, 0, ends)
    save(top, 0, tops)
    return bits_of(lanes & opposite(went))


def descend(nodes, alive, node, near, far, top, limit, steps, lines, stack):
    """Take lanes down until few are inside; return which wait at leaves and which are at an end."""
    living, over = mask_of(alive, LANES), np.uint32(0)
    at, begins, ends = load(node, 0, LANES), load(near, 0, LANES), load(far, 0, LANES)
    tops, limits = load(top, 0, LANES), load(limit, 0, LANES)
    if COUNTED:
        done = load(steps, 0, LANES)
    while True:
        few = max(min(np.int32(FEW), how_many(living) - np.int32(1)), np.int32(0))
        while True:
            word = gather(nodes, at, living, spread(np.uint64(3), LANES))
            link, split = signed(low_half(word)), float_of_bits(high_half(word))
            axis = bits_and(link, np.int32(3))
            inside = axis != np.int32(3)
            if how_many(inside) <= few:
                break
            inverse, pad = by_axis(lines, 3 * LANES, axis), by_axis(lines, 6 * LANES, axis)
            crossing = (split - by_axis(lines, 0, axis)) * inverse
            early, late = crossing - pad, crossing + pad
            child = shifted_right(link, np.int32(2))
            above = child + np.int32(1)
            up = inverse > np.float32(0)
            one, other = choose(up, child, above), choose(up, above, child)
            passed = inside & (late < begins)
            both = inside & opposite(passed) & (early <= ends)
            scatter(
                stack,
                tops,
                joined_halves(bits_or(shifted_left(other, np.int32(2)), axis), ends),
                both,
            )
            tops = choose(both, tops + np.int32(LANES), tops)
            ends = choose(both, lesser(ends, late), ends)
            at = choose(inside, choose(passed, other, one), at)
            if COUNTED:
                done = choose(inside, done + np.int32(1), done)
        empty = living & opposite(inside) & (split == np.float32(0))
        if not any_lane(empty):
            break
        went, at, begins, ends, tops = back(empty, at, begins, ends, tops, limits, lines, stack)
        ended = empty & opposite(went)
        over |= bits_of(ended)
        living = living & opposite(ended)
    save(node, 0, at)
    save(near, 0, begins)
    save(far, 0, ends)
    save(top, 0, tops)
    if COUNTED:
        save(steps, 0, done)
    return bits_of(living & opposite(inside)), over


def walked(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    lines, ready_lines = np.ones(9 * LANES, np.float32), np.empty(10 * LANES, np.float32)
    node, top = np.zeros(LANES, np.int32), np.zeros(LANES, np.int32)
    near, far = np.zeros(LANES, np.float32), np.zeros(LANES, np.float32)
    limit = np.zeros(LANES, np.float32)
    who, next_who = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    numbers = np.zeros(7 * LANES, REAL)
    index, best = np.zeros(LANES, np.int32), np.zeros(LANES, REAL)
    best_u, best_v = np.zeros(LANES, REAL), np.zeros(LANES, REAL)
    start, size, slack = np.zeros(LANES), np.zeros(LANES), np.zeros(LANES)
    ready = np.empty(3 * LANES, np.float64)
    steps, visits = np.zeros(LANES, np.int32), np.zeros(LANES, np.int32)
    tests = np.zeros(LANES, np.int32)
    stack = np.empty(DEPTH * LANES, np.uint64)
    a = np.int64(0 if second.shape[0] else first.shape[0])
    b = np.int64(0)
    alive = fetched = np.uint32(0)
    over = np.uint32((1 << LANES) - 1)  # lanes that are due a ray
    while True:
        while over != np.uint32(0):
            j = lowest_bit(over)
            bit = np.uint32(1) << np.uint32(j)
            if alive & bit != np.uint32(0):
                k = who[j]
                outcome[k] = index[j]
                if NEAREST:
                    t[k] = best[j]
                    if RETURNS_THREE:
                        u[k], v[k] = best_u[j], best_v[j]
                if COUNTED:
                    counts[k, 0], counts[k, 1], counts[k, 2] = steps[j], visits[j], tests[j]
                alive ^= bit
            while fetched == np.uint32(0) and a < first.shape[0]:
                fetched, missing, a, b = fetch(
                    rays, first, second, a, b, scene, next_who, numbers, ready_lines, ready
                )
                while missing != np.uint32(0):
                    i = lowest_bit(missing)
                    missing &= missing - np.uint32(1)
                    k = next_who[i]
                    outcome[k] = NONE
                    if NEAREST:
                        t[k] = rays[k].tmax
                        if RETURNS_THREE:
                            u[k] = v[k] = ZERO
                    if COUNTED:
                        counts[k, 0] = counts[k, 1] = counts[k, 2] = 0
            over ^= bit
            if fetched != np.uint32(0):
                i = lowest_bit(fetched)
                fetched &= fetched - np.uint32(1)
                alive |= bit
                who[j] = next_who[i]
                for row in range(9):
                    lines[row * LANES + j] = ready_lines[row * LANES + i]
                node[j], top[j], near[j] = 0, j, np.float32(0)
                far[j] = limit[j] = ready_lines[9 * LANES + i]
                start[j], size[j], slack[j] = ready[i], ready[LANES + i], ready[2 * LANES + i]
                index[j], best[j] = NONE, numbers[6 * LANES + i]
                best_u[j] = best_v[j] = ZERO
                steps[j] = visits[j] = tests[j] = 0
        if alive == np.uint32(0):
            break
        waiting, over = descend(nodes, alive, node, near, far, top, limit, steps, lines, stack)
        left = waiting
        while left != np.uint32(0):
            j = lowest_bit(left)
            left &= left - np.uint32(1)
            begin = np.int64(nodes[node[j]].link >> np.uint32(2))
            for piece in range(LINES):
                prefetch(triangles, begin, piece * LINE)
        left = waiting
        while left != np.uint32(0):
            j = lowest_bit(left)
            left &= left - np.uint32(1)
            leaf = nodes[node[j]]
            begin = np.int64(leaf.link >> np.uint32(2))
            end, ray = begin + np.int64(leaf.split), rays[who[j]]
            if COUNTED:
                visits[j] += 1
                tests[j] += end - begin
            if NEAREST:
                found = in_leaf(
                    refs, triangles, begin, end, ray, index[j], best[j], best_u[j], best_v[j]
                )
                if found[0] != index[j]:
                    index[j], best[j], best_u[j], best_v[j] = found
                    limit[j] = limit_of(best[j], start[j], size[j], slack[j])
            elif in_leaf(refs, triangles, begin, end, ray):
                index[j] = TRUE
                top[j] = j
        over |= go_back(waiting, node, near, far, top, limit, lines, stack)


@functools.cache
def walk(
    kernel: Kernel, precision: str = "float32", query: str = "nearest", counted: bool = False
) -> Instance:
    """Return a compiled walk of rays in lanes.

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
        With the call of `rtbench.trees.traversal.walks.walk`.

    Raises
    ------
    RtbenchError
    """
    constants = {
        "LANES": str(LANES),
        "FEW": str(FEW),
        "LINE": str(LINE),
        "LINES": str(groups.lines_of_block(kernel, precision)),
    }
    callees = (by_axis, back, go_back, descend)
    title = f"{LANES} rays in lanes"
    return groups.compiled(kernel, precision, query, counted, walked, callees, constants, title)
