"""Events: where the boxes of a cell's references begin and end along an axis, in order.

An event is one uint64, ordered(position) << 32 | kind << 30 | triangle, so that sorting integers
puts at one position ends before planar references (l == u, one event) before starts: what Wald &
Havran 2006 ask of a sweep. Reference and triangle are one here: of each triangle a cell has at most
one reference.

What becomes of a triangle's events when a cell is cut is a row of 14 bits, its ``fates``: for axis
a, whether its end (or planar event) goes on in the left and in the right part are bits 4 a and
4 a + 1, its start 4 a + 2 and 4 a + 3; whether it belongs to the left and to the right part at all
are bits 12 and 13. Events of boxes that were fitted to a part anew do not go on, but are made,
sorted and merged in.

Plain functions that go into compiled code. Indices are uint64: numba checks signed ones for
being negative.
"""

import numpy as np

# Constants of the generated module; kinds, bits and masks as uint64.
CONSTANTS = {
    "ZERO": "uint64(0)",
    "ONE": "uint64(1)",
    "END": "uint64(0)",
    "PLANAR": "uint64(1)",
    "START": "uint64(2)",
    "TRIANGLE": "uint64(0x3FFFFFFF)",
    "SIGN": "uint64(0x80000000)",
    "BITS": "uint64(0xFFFFFFFF)",
    "GOES_LEFT": "np.uint16(0x1555)",
    "GOES_RIGHT": "np.uint16(0x2AAA)",
    "GOES_BOTH": "np.uint16(0x3FFF)",
}
ZERO, ONE, END, PLANAR, START = (np.uint64(i) for i in (0, 1, 0, 1, 2))
TRIANGLE, SIGN, BITS = (np.uint64(i) for i in (0x3FFFFFFF, 0x80000000, 0xFFFFFFFF))
GOES_LEFT, GOES_RIGHT, GOES_BOTH = (np.uint16(i) for i in (0x1555, 0x2AAA, 0x3FFF))


def ordered(x):
    """Return a float32 as 32 bits that have its order, in uint64; -0.0 must not come up."""
    bits = np.uint64(np.float32(x).view(np.uint32))
    return bits ^ (SIGN if bits < SIGN else BITS)


def position(place):
    """Return the float32 of such bits, as float64."""
    bits = place ^ (SIGN if place >= SIGN else BITS)
    return np.float64(np.uint32(bits).view(np.float32))


def event(x, kind, triangle):
    """Return an event."""
    return ordered(x) << np.uint64(32) | kind << np.uint64(30) | np.uint64(triangle)


def first_events(boxes, axis, events):
    """Write the events of all triangles, not sorted; return how many."""
    n = ZERO
    for i in range(boxes.shape[0]):
        low, high = boxes[i, axis], boxes[i, axis + 3]
        if low == high:
            events[axis, n] = event(low, PLANAR, i)
            n += ONE
        else:
            events[axis, n] = event(low, START, i)
            events[axis, n + ONE] = event(high, END, i)
            n += ONE + ONE
    return n


def parted(events, axis, begin, end, where, at, leftward, fates, across, first):
    """Write to which part each reference goes; return how many lie across the plane, and left.

    Parameters
    ----------
    where, at, leftward
        The plane, as `sweep` returns it.
    fates : (M,) uint16 array
    across : (n,) int32 array
        Gets the triangles that lie on both sides, to be fitted to each, from ``first`` on.

    Returns
    -------
    across, left : int64
        Those that lie across, and those that are only left; -1 if the former need more room.
    """
    plane = where << np.uint64(2) | PLANAR
    while at < end and events[axis, at] >> np.uint64(30) < plane:
        at += ONE
    both, left = np.int64(0), np.int64(0)
    for i in range(begin, at):
        key = events[axis, i]
        kind = key >> np.uint64(30) & np.uint64(3)
        fates[key & TRIANGLE] = GOES_BOTH if kind == START else GOES_LEFT
        left += kind != START
        both += np.int64(kind) - 1
    while at < end and events[axis, at] >> np.uint64(30) == plane:
        fates[events[axis, at] & TRIANGLE] = GOES_LEFT if leftward else GOES_RIGHT
        left += leftward
        at += ONE
    if first + both >= across.shape[0]:
        return both, np.int64(-1)
    to = first
    for i in range(at, end):
        key = events[axis, i]
        fate = fates[key & TRIANGLE]
        ends = key >> np.uint64(30) & np.uint64(3) == END
        fates[key & TRIANGLE] = fate if ends else GOES_RIGHT
        across[to] = np.int32(key & TRIANGLE)
        to += ends & (fate == GOES_BOTH)
    return both, left


def fate_in(part, own, box):
    """Return the bits of a triangle that belongs to a part, 0 left and 1 right, with a new box."""
    fate = np.uint32(1 << 12)
    for axis in range(3):
        low, high = box[axis], box[axis + 3]
        if own[axis] == own[axis + 3]:
            fate |= np.uint32(1 << 4 * axis)
        elif low != high:
            fate |= np.uint32((high == own[axis + 3]) << 4 * axis)
            fate |= np.uint32((low == own[axis]) << 4 * axis + 2)
    return fate << np.uint32(part)


def pass_on(events, axis, begin, end, fates, part):
    """Keep, in place, the events that go on in one part; return where they end now."""
    shift = np.uint64(4 * axis + part)
    to = begin
    for i in range(begin, end):
        key = events[axis, i]
        fate = np.uint64(fates[key & TRIANGLE])
        events[axis, to] = key
        to += fate >> (shift + (key >> np.uint64(30) & START)) & ONE
    return to


def pass_on_both(events, axis, begin, end, fates):
    """Keep, in place, the right part's events and write the left part's behind; return the ends."""
    shift = np.uint64(4 * axis)
    right, left = begin, end
    for i in range(begin, end):
        key = events[axis, i]
        fate = np.uint64(fates[key & TRIANGLE]) >> (shift + (key >> np.uint64(30) & START))
        events[axis, left] = key
        left += fate & ONE
        events[axis, right] = key
        right += fate >> ONE & ONE
    return left, right


def renewed(axis, part, across, first, n, fates, left_boxes, right_boxes, fresh):
    """Write the events that newly fitted boxes brought, in order; return how many."""
    made = np.int64(0)
    for k in range(first, first + n):
        triangle = across[k]
        fate = np.uint64(fates[triangle]) >> np.uint64(part)
        if fate >> np.uint64(12) & ONE == ZERO:
            continue
        if part == 0:
            low, high = left_boxes[triangle, axis], left_boxes[triangle, axis + 3]
        else:
            low, high = right_boxes[k, axis], right_boxes[k, axis + 3]
        kept = fate >> np.uint64(4 * axis)
        if low == high:
            if kept & ONE == ZERO:
                fresh[made] = event(low, PLANAR, triangle)
                made += 1
            continue
        if kept & np.uint64(4) == ZERO:
            fresh[made] = event(low, START, triangle)
            made += 1
        if kept & ONE == ZERO:
            fresh[made] = event(high, END, triangle)
            made += 1
    ascend(fresh, 0, made)
    return made


def merged(events, axis, begin, end, fresh, n):
    """Merge new events into old ones, from the back, in place."""
    i, to = end, end + np.uint64(n)
    while n > 0:
        n -= 1
        key = fresh[n]
        to -= ONE
        while i > begin and events[axis, i - ONE] > key:
            i -= ONE
            events[axis, to] = events[axis, i]
            to -= ONE
        events[axis, to] = key


def ascend(keys, begin, n):
    """Sort a few in place: by insertion, and as a heap where they are many."""
    if n <= 24:
        for i in range(begin + 1, begin + n):
            key = keys[i]
            j = i
            while j > begin and keys[j - 1] > key:
                keys[j] = keys[j - 1]
                j -= 1
            keys[j] = key
        return
    top = n >> 1
    last = n
    while last > 1:
        if top > 0:
            top -= 1
            key = keys[begin + top]
        else:
            last -= 1
            key = keys[begin + last]
            keys[begin + last] = keys[begin]
        hole = top
        child = 2 * hole + 1
        while child < last:
            if child + 1 < last and keys[begin + child + 1] > keys[begin + child]:
                child += 1
            if keys[begin + child] <= key:
                break
            keys[begin + hole] = keys[begin + child]
            hole = child
            child = 2 * hole + 1
        keys[begin + hole] = key


CALLEES = (
    *(ordered, position, event, parted, fate_in, pass_on, pass_on_both, ascend, renewed, merged),
)
