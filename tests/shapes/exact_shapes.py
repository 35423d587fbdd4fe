"""Where rays hit shapes, computed from the rounded inputs with 100 digits, and how far off is fair.

What is fair: to answer exactly for a ray that is moved by ``delta``, some roundings of the distance
from where it starts to the shape, and of the shape's size; the vector between the two is rounded
itself, so that no test in this arithmetic could do better. Along the ray that may come to delta
over the cosine to the normal, or, where a ray grazes, to a square root of delta.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal as D
from decimal import localcontext

import numpy as np

from rtbench.shapes.records import CONE, DISC, PLANE, SPHERE

DIGITS = 100


@dataclass
class Root:
    """Where a ray meets a shape.

    Attributes
    ----------
    t, slack : Decimal
        And how far from it an answer may be.
    sure : bool
        Whether it is a hit for all rays that near.
    """

    t: D
    slack: D
    sure: bool


def numbers(values) -> list[D]:
    return [D(float(each)) for each in values]


def dot(p, q) -> D:
    return sum((x * y for x, y in zip(p, q, strict=True)), D(0))


def length(p) -> D:
    return dot(p, p).sqrt()


def scaled(p, s) -> list[D]:
    return [x * s for x in p]


def plus(p, q) -> list[D]:
    return [x + y for x, y in zip(p, q, strict=True)]


def unit(p) -> list[D]:
    return scaled(p, 1 / length(p))


class Shape:
    """A record, its numbers exact, its axis made a unit vector."""

    def __init__(self, record) -> None:
        self.kind = int(record["kind"])
        self.point = numbers(record["point"])
        self.axis = unit(numbers(record["axis"]))
        self.radius, self.height, self.slope = numbers(
            record[name] for name in ("radius", "height", "slope")
        )

    @property
    def size(self) -> D:
        return max(self.radius, self.radius + self.slope * self.height) + self.height

    def distance(self, p: list[D]) -> D:
        """From a point to the surface, without its ends."""
        w = plus(p, scaled(self.point, -1))
        h = dot(w, self.axis)
        if self.kind == SPHERE:
            return abs(length(w) - self.radius)
        if self.kind == CONE:
            across = length(plus(w, scaled(self.axis, -h)))
            return abs(across - self.radius - self.slope * h) / (1 + self.slope**2).sqrt()
        return abs(h)


def roots(record, ray, roundings: int) -> tuple[list[Root], D]:
    """Return where a ray may hit a shape, in no order, and delta of that many roundings."""
    roundoff = D(float(np.finfo(record["radius"].dtype).eps)) / 2
    with localcontext() as context:
        context.prec = DIGITS
        shape = Shape(record)
        orig, dir = numbers(ray["orig"]), numbers(ray["dir"])
        w = plus(orig, scaled(shape.point, -1))
        delta = roundings * roundoff * (length(w) + shape.size)
        if shape.kind in (DISC, PLANE):
            found = [] if ray["itself"] else _flat(shape, w, dir, delta)
        else:
            found = _curved(shape, w, dir, delta, bool(ray["itself"]))
        return found, delta


def _flat(shape: Shape, w, dir, delta: D) -> list[Root]:
    across = dot(dir, shape.axis)
    size = length(dir)
    if not delta:  # from the very point of the plane
        return []
    least = delta * size / (length(w) + shape.size)
    if abs(across) <= least:  # parallel, as far as can be known
        return [Root(-dot(w, shape.axis) / (across or least), D("Infinity"), False)]
    t = -dot(w, shape.axis) / across
    slack = (delta + least * abs(t)) / abs(across)  # the way to it may be longer than that to point
    sure = t > slack
    if shape.kind == DISC:
        beyond = length(plus(w, scaled(dir, t))) - shape.radius
        if beyond > slack * size:
            return []
        sure = sure and beyond < -slack * size
    return [Root(t, slack, sure)] if t > -slack else []


def _curved(shape: Shape, w, dir, delta: D, itself: bool) -> list[Root]:
    a, b, c = dot(dir, dir), dot(w, dir), dot(w, w)
    size = a.sqrt()
    h = rise = D(0)
    radius, growth = shape.radius, D(0)
    if shape.kind == CONE:
        h, rise = dot(w, shape.axis), dot(dir, shape.axis)
        radius, growth = shape.radius + shape.slope * h, shape.slope * rise
        a, b, c = a - rise * rise, b - h * rise, c - h * h
    a, b, c = a - growth * growth, b - radius * growth, c - radius * radius
    steep = delta * (1 + abs(shape.slope))

    def change(t: D) -> D:
        """By how much the left side of a t^2 + 2 b t + c = 0 may be off."""
        return steep * (2 * abs(radius + growth * t) + steep)

    discriminant = b * b - a * c
    if discriminant >= 0:
        root = discriminant.sqrt()
        q = -b - root if b > 0 else root - b
        found = [x / y for x, y in ((q, a), (c, q)) if y != 0]
    else:
        root = D(0)
        found = [-b / a]
    known = D(0)
    if itself:
        known = min((abs(t) for t in found), default=D(0))
        found = [-2 * b / a] if a != 0 else []
    result = []
    for t in found:
        off = change(t)
        grazes = discriminant < 4 * abs(a) * off
        if discriminant < -abs(a) * off and not itself:
            continue
        sides = [off / root] if root else []
        sides += [(off / abs(a)).sqrt()] if a else []
        slack = 3 * min(sides, default=D("Infinity")) + delta / size + 2 * known
        ends = abs(rise) * slack + delta
        inside = min(h + rise * t, shape.height - h - rise * t) if shape.kind == CONE else 2 * ends
        if t < -slack or inside < -ends:
            continue
        result.append(Root(t, slack, not grazes and t > slack and inside > ends))
    return result


def judged(record, ray, t: float, roundings: int) -> str:
    """Return what is wrong with an answer; empty if it is fair."""
    found, delta = roots(record, ray, roundings)
    sure = [each for each in found if each.sure]
    if not t > 0:
        return f"{t} where {sure[0].t:.20g} is a hit" if sure or t != -1 else ""
    given = D(float(t))
    fair = [each for each in found if abs(given - each.t) <= each.slack]
    if not fair:
        return f"{t} is no hit; hits: {[(f'{e.t:.20g}', f'{e.slack:.3g}') for e in found]}"
    before = [each for each in sure if each.t + each.slack < given - fair[0].slack]
    if before:
        return f"{t} where {before[0].t:.20g} is nearer"
    with localcontext() as context:
        context.prec = DIGITS
        shape = Shape(record)
        orig, dir = numbers(ray["orig"]), numbers(ray["dir"])
        start, p = length(plus(orig, scaled(shape.point, -1))), plus(orig, scaled(dir, given))
        off = shape.distance(p)
        if shape.kind in (DISC, PLANE):
            delta += delta / (start + shape.size) * length(scaled(dir, given))
        if off > delta and not ray["itself"]:
            return f"{t} is {off:.3g} above the surface, {off / delta:.3g} times what is fair"
    return ""
