"""How a method's pieces become a test: division first or last, order of the tests, early exit.

Havel 2008, section 4.2.4 (Text 8 and 9): a method is four pieces (`rtbench.kernels.pieces`); where
the division stands and what is tested when are endings that all methods share, written once, here.
A method's pieces are woven into each (`rtbench.compiled.weave`): where an ending reads a name in
capitals, the statements that this piece needs, and that are not there yet, are put before it.

The stable endings take their t from the point that the weights name
(`rtbench.kernels.reached`).

Where a test is left early, conditions that belong together are one comparison of a least value, as
Text 9 makes one of signs: the compiler turns ``a and b``, and ``a & b`` too, into two branches,
each of which can be mispredicted. The difference comes first in ``min``, which returns it where it
is NaN; where the weight of v0 stands there, the test of the denominator keeps NaN out.

All comparisons fail on NaN, so that a zero denominator, an infinity or a NaN is a miss. With the
division moved an infinite denominator has to be refused: b + c <= infinity would hold. Text 9 as
printed keeps none of this, see `text9`.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass

from rtbench.kernels.contract import HIT, NO_T, ONE, ZERO

INFINITY = math.inf

# Stand-ins for what weaving puts in their place.
DENOMINATOR = T = A = B = C = AREA = REACHED = 0.0
POINT = SECOND = THREE = False  # meets the plane first; has an area; has an a

T_FIRST = ("hit", "t outside (0, tmax)", "u or v outside")
UV_FIRST = ("hit", "t outside (0, tmax)", "u outside", "v outside")


def flipped(x, sign):
    """Return x, its sign changed where ``sign`` is negative: an exclusive or, no arithmetic."""
    return -x if sign < ZERO else x


def sign_bit(x):
    """Return the bit that Text 9 tests, set for -0 too."""
    return math.copysign(ONE, x) < ZERO


def first_tuv(tri, ray, tmax):  # Text 8
    inverse = ONE / DENOMINATOR
    "division"
    t = T * inverse
    if not min(tmax - t, t) > ZERO:
        return 1, NO_T, NO_T, NO_T
    "condition: t"
    weight = (ONE / AREA if SECOND else ONE) if POINT else inverse
    u = B * weight
    v = C * weight
    if not min(A * weight if THREE else ONE - u - v, u, v) >= ZERO:
        return 2, NO_T, NO_T, NO_T
    "condition: u, v"
    return HIT, t, u, v


def first_uvt(tri, ray, tmax):
    inverse = ONE / DENOMINATOR
    "division"
    if POINT:
        t = T * inverse
    weight = (ONE / AREA if SECOND else ONE) if POINT else inverse
    u = B * weight
    if not min(ONE - u, u) >= ZERO:
        return 2, NO_T, NO_T, NO_T
    "condition: u"
    v = C * weight
    if not min(A * weight if THREE else ONE - u - v, v) >= ZERO:
        return 3, NO_T, NO_T, NO_T
    "condition: v"
    if not POINT:
        t = T * inverse
    if not min(tmax - t, t) > ZERO:
        return 1, NO_T, NO_T, NO_T
    "condition: t"
    return HIT, t, u, v


def first_whole(tri, ray, tmax):
    inverse = ONE / DENOMINATOR
    "division"
    t = T * inverse
    weight = (ONE / AREA if SECOND else ONE) if POINT else inverse
    u = B * weight
    v = C * weight
    inside = (u >= ZERO) & (v >= ZERO) & (A * weight >= ZERO if THREE else u + v <= ONE)
    hit = (t > ZERO) & (t < tmax) & inside
    return HIT if hit else 1, t, u, v


def last_tuv(tri, ray, tmax):  # the idea of Text 9, by comparisons that NaN fails
    size = abs(DENOMINATOR)
    t = flipped(T, DENOMINATOR)
    if not min(tmax * size - t, t) > ZERO:
        return 1, NO_T, NO_T, NO_T
    "condition: t"
    total = DENOMINATOR * AREA if SECOND else DENOMINATOR
    whole = abs(total) if SECOND else size
    u = flipped(B, total)
    v = flipped(C, total)
    inside = min(flipped(A, total) if THREE else whole - u - v, u, v) >= ZERO
    if not (inside & ((whole > ZERO) & (whole < INFINITY) if SECOND else size < INFINITY)):
        return 2, NO_T, NO_T, NO_T
    "condition: u, v"
    inverse = ONE / size
    weight = ONE / whole if SECOND else inverse
    return HIT, t * inverse, u * weight, v * weight


def last_uvt(tri, ray, tmax):
    size = abs(DENOMINATOR)
    total = DENOMINATOR * AREA if SECOND else DENOMINATOR
    whole = abs(total) if SECOND else size
    u = flipped(B, total)
    if not min(whole - u, u) >= ZERO:
        return 2, NO_T, NO_T, NO_T
    "condition: u"
    v = flipped(C, total)
    inside = min(flipped(A, total) if THREE else whole - u - v, v) >= ZERO
    if not (inside & ((whole > ZERO) & (whole < INFINITY) if SECOND else size < INFINITY)):
        return 3, NO_T, NO_T, NO_T
    "condition: v"
    t = flipped(T, DENOMINATOR)
    if not min(tmax * size - t, t) > ZERO:
        return 1, NO_T, NO_T, NO_T
    "condition: t"
    inverse = ONE / size
    weight = ONE / whole if SECOND else inverse
    return HIT, t * inverse, u * weight, v * weight


def last_whole(tri, ray, tmax):
    size = abs(DENOMINATOR)
    t = flipped(T, DENOMINATOR)
    total = DENOMINATOR * AREA if SECOND else DENOMINATOR
    whole = abs(total) if SECOND else size
    u = flipped(B, total)
    v = flipped(C, total)
    inside = (u >= ZERO) & (v >= ZERO) & (flipped(A, total) >= ZERO if THREE else u + v <= whole)
    near = (t > ZERO) & (t < tmax * size)
    hit = near & inside & ((whole > ZERO) & (whole < INFINITY) if SECOND else size < INFINITY)
    inverse = ONE / size
    weight = ONE / whole if SECOND else inverse
    return HIT if hit else 1, t * inverse, u * weight, v * weight


def text9(tri, ray, tmax):
    # As printed, sign bits and all: a triangle without area whose numerators are all 0 is "hit",
    # a tmax of inf makes 0 * inf of a zero denominator, and a -0 counts as negative.
    t = T
    if sign_bit(t) != sign_bit(DENOMINATOR * tmax - t):
        return 1, NO_T, NO_T, NO_T
    "condition: t"
    total = DENOMINATOR * AREA if SECOND else DENOMINATOR
    u = B
    v = C
    if (sign_bit(u) != sign_bit(v)) | (sign_bit(u) != sign_bit(total - u - v)):
        return 2, NO_T, NO_T, NO_T
    "condition: u, v"
    inverse = ONE / DENOMINATOR
    weight = ONE / total if SECOND else inverse
    return HIT, t * inverse, u * weight, v * weight


def stable(tri, ray, tmax):
    inverse = ONE / DENOMINATOR
    "division"
    u = B * inverse
    if not min(ONE - u, u) >= ZERO:
        return 2, NO_T, NO_T, NO_T
    "condition: u"
    v = C * inverse
    inside = min(A * inverse if THREE else ONE - u - v, v) >= ZERO
    if not (inside & (abs(DENOMINATOR) < INFINITY)):
        return 3, NO_T, NO_T, NO_T
    "condition: v"
    t = REACHED
    if not min(tmax - t, t) > ZERO:
        return 1, NO_T, NO_T, NO_T
    "condition: t"
    return HIT, t, u, v


def stable_whole(tri, ray, tmax):
    inverse = ONE / DENOMINATOR
    "division"
    u = B * inverse
    v = C * inverse
    inside = (u >= ZERO) & (v >= ZERO) & (A * inverse >= ZERO if THREE else u + v <= ONE)
    t = REACHED
    hit = (t > ZERO) & (t < tmax) & inside & (abs(DENOMINATOR) < INFINITY)
    return HIT if hit else 1, t, u, v


def inside(tri, ray):
    # Point in triangle alone: the point is ray.orig, brought into the plane along the direction
    # in which the method projects.
    weight = ONE / AREA if SECOND else ONE
    u = B * weight
    v = C * weight
    # No min here: a point at infinity makes u NaN and A infinite.
    if not ((u >= ZERO) & (v >= ZERO) & (A * weight >= ZERO if THREE else u + v <= ONE)):
        return 1, NO_T, NO_T, NO_T
    return HIT, NO_T, u, v


@dataclass(frozen=True)
class Ending:
    """One way to end.

    Attributes
    ----------
    name : str
        Its part of a kernel's name where it differs from the method's own way; see `suffix`.
    title : str
    text : callable
        The function above that the pieces are woven into.
    outcomes : tuple of str
        Labels of the codes it returns.
    along, scale : str
        What a point method's parameters stand for: names of the text, of pieces, ONE or ZERO.
    division : str
        ``first``, ``last`` or ``none``.
    early : bool
        Whether it leaves as soon as the test has failed.
    reads_vertices : bool
        Whether it is of methods that keep the vertices and find no point of the plane first.
    """

    name: str
    title: str
    text: Callable
    outcomes: tuple[str, ...]
    along: str
    scale: str
    division: str
    early: bool = True
    reads_vertices: bool = False

    @property
    def takes_tmax(self) -> bool:
        """Whether distances are tested: not of a point."""
        return len(inspect.signature(self.text).parameters) == 3


_FIRST = {"along": "t", "scale": "ONE", "division": "first"}
_LAST = {"along": "T", "scale": "DENOMINATOR", "division": "last"}
_ALL = {"outcomes": ("hit", "miss"), "early": False}

ENDINGS = (
    Ending("tuv", "division first, t first", first_tuv, T_FIRST, **_FIRST),
    Ending("uvt", "division first, u, v first", first_uvt, UV_FIRST, **_FIRST),
    Ending("last_tuv", "division last, t first", last_tuv, T_FIRST, **_LAST),
    Ending("last_uvt", "division last, u, v first", last_uvt, UV_FIRST, **_LAST),
    Ending("whole", "division first, nothing skipped", first_whole, **_FIRST, **_ALL),
    Ending("last_whole", "division last, nothing skipped", last_whole, **_LAST, **_ALL),
    Ending("stable", "t of the point found", stable, UV_FIRST, **_FIRST, reads_vertices=True),
    Ending(
        "stable_whole",
        "t of the point found, nothing skipped",
        stable_whole,
        **_FIRST,
        **_ALL,
        reads_vertices=True,
    ),
    Ending("text9", "sign bits as in Havel's Text 9", text9, T_FIRST, **_LAST),
    Ending(
        "inside",
        "point in triangle alone",
        inside,
        ("hit", "miss"),
        along="ZERO",
        scale="ONE",
        division="none",
    ),
)


def suffix(ending: Ending, order: str) -> str:
    """Return what an ending adds to the name of a method whose own order of tests is given."""
    parts = [part for part in ending.name.split("_") if part != order]
    return "".join(f"_{part}" for part in parts)
