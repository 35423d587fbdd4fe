"""The loops around a kernel in lanes, as they stand in the generated modules.

Where the records of a packet or block lie differs from layout to layout: `placed` writes it in the
place of the stand-ins `of_lanes`, `begin` and `blocks`.
"""

from __future__ import annotations

import ast

import numpy as np

from rtbench.compiled import syntax
from rtbench.compiled.packing import Packing
from rtbench.compiled.vector_functions import (
    any_lane,
    choose,
    first_lane,
    lane,
    least,
    next_up,
    one_of,
    opposite,
    replaced,
    spread,
    store,
)
from rtbench.kernels.contract import HIT, ZERO

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
WIDTH = 16
DIVIDED_LAST = RETURNS_THREE = SORTED = False


def test(tri, ray, tmax, start):  # the kernel; with layout soa it must know where lanes begin
    return False, 0.0, 0.0, 0.0


def filtered(tri, ray, tmax, start):  # the kernel where it has a fallback
    return False, False, 0.0, 0.0, 0.0


def fallback(v0, v1, v2, orig, dir, tmax):  # its fallback
    return 0, 0.0, 0.0, 0.0


def decided(tri, ray, tmax, start):  # becomes ``test`` then
    result = filtered(tri, ray, tmax, start)
    if any_lane(result[1]):
        return resolved(tri, ray, tmax, start, result)
    if RETURNS_THREE:
        return result[0], result[2], result[3], result[4]
    return result[0], result[2]


def resolved(tri, ray, tmax, start, result):  # each undecided lane by the fallback
    hit, undecided, t = result[0], result[1], result[2]
    if RETURNS_THREE:
        u, v = result[3], result[4]
    for k in range(WIDTH):
        if one_of(undecided, k):
            sure = fallback(
                (one_of(tri.v0[0], k), one_of(tri.v0[1], k), one_of(tri.v0[2], k)),
                (one_of(tri.v1[0], k), one_of(tri.v1[1], k), one_of(tri.v1[2], k)),
                (one_of(tri.v2[0], k), one_of(tri.v2[1], k), one_of(tri.v2[2], k)),
                (one_of(ray.orig[0], k), one_of(ray.orig[1], k), one_of(ray.orig[2], k)),
                (one_of(ray.dir[0], k), one_of(ray.dir[1], k), one_of(ray.dir[2], k)),
                one_of(tmax, k),
            )
            hit = replaced(hit, k, sure[0] == HIT)
            t = replaced(t, k, REAL(sure[1]))
            if RETURNS_THREE:
                u = replaced(u, k, REAL(sure[2]))
                v = replaced(v, k, REAL(sure[3]))
    if RETURNS_THREE:
        return hit, t, u, v
    return hit, t


def of_lanes(records, number):  # the record, or the first one, of a packet or block
    return records[number]


def begin(number):  # the place of its first lane
    return number * WIDTH


def blocks(records):  # how many there are
    return len(records)


def pairs(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            start = begin(k)
            tri, ray = of_lanes(triangles, k), of_lanes(rays, k)
            result = test(tri, ray, ray.tmax, start)
            store(outcome, k, choose(result[0], np.int32(0), np.int32(1)))
            store(t, k, result[1])
            if RETURNS_THREE:
                store(u, k, result[2])
                store(v, k, result[3])


def rays(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            start = begin(k)
            ray = of_lanes(rays, k)
            tmax = ray.tmax
            limit = next_up(tmax)
            hit = spread(np.int32(-1), WIDTH)
            hit_u = hit_v = spread(ZERO, WIDTH)
            for i in range(triangles.shape[0]):
                tri = triangles[i]
                if SORTED:
                    # Not in the order of the indices: a tie may go to a lower index that comes now.
                    # The limit is kept beside tmax, since the next test waits for it.
                    result = test(tri, ray, limit, start)
                    lower = (result[1] == tmax) & (tri.index < hit)
                    nearer = result[0] & ((result[1] < tmax) | lower)
                    limit = choose(nearer, next_up(result[1]), limit)
                else:
                    result = test(tri, ray, tmax, start)
                    nearer = result[0]
                    if DIVIDED_LAST:  # t is rounded after tmax let it pass: a tie may have too
                        nearer = nearer & (result[1] < tmax)
                hit = choose(nearer, tri.index, hit)
                tmax = choose(nearer, result[1], tmax)
                if RETURNS_THREE:
                    hit_u = choose(nearer, result[2], hit_u)
                    hit_v = choose(nearer, result[3], hit_v)
            store(outcome, k, hit)
            store(t, k, tmax)
            if RETURNS_THREE:
                store(u, k, hit_u)
                store(v, k, hit_v)


def triangles(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            ray = rays[k]
            # Each lane keeps the nearest of its own triangles.
            tmax = spread(ray.tmax, WIDTH)
            limit = next_up(tmax)
            hit = spread(np.int32(-1), WIDTH)
            hit_u = hit_v = spread(ZERO, WIDTH)
            for i in range(blocks(triangles)):
                start = begin(i)
                tri = of_lanes(triangles, i)
                if SORTED:
                    result = test(tri, ray, limit, start)
                    lower = (result[1] == tmax) & (tri.index < hit)
                    nearer = result[0] & ((result[1] < tmax) | lower)
                    limit = choose(nearer, next_up(result[1]), limit)
                else:
                    result = test(tri, ray, tmax, start)
                    nearer = result[0]
                    if DIVIDED_LAST:  # t is rounded after tmax let it pass: a tie may have too
                        nearer = nearer & (result[1] < tmax)
                hit = choose(nearer, tri.index, hit)
                tmax = choose(nearer, result[1], tmax)
                if RETURNS_THREE:
                    hit_u = choose(nearer, result[2], hit_u)
                    hit_v = choose(nearer, result[3], hit_v)
            # The horizontal minimum: of the lanes nearest of all, the lowest index.
            nearest = opposite(tmax > least(tmax))
            index = least(choose(nearest, hit, np.int32(0x7FFFFFFF)))
            place = first_lane(nearest & (hit == index))
            outcome[k] = index
            t[k] = lane(tmax, place)
            if RETURNS_THREE:
                u[k] = lane(hit_u, place)
                v[k] = lane(hit_v, place)


LOOPS = {"pairs": pairs, "rays": rays, "triangles": triangles}


def placed(chosen: Packing, tests: list[str], count: int) -> ast.FunctionDef:
    """Return the loop of a packing.

    Parameters
    ----------
    chosen : Packing
    tests : list of str
        Names of the kernel's functions: one, or one for each axis of projection.
    count : int
        With layout soa: how many lanes there are in all.
    """
    function = _Placed(chosen.layout, count).visit(syntax.parse(LOOPS[chosen.form]))
    return function if len(tests) == 1 else _Spans(chosen, tests).visit(function)


def behind(chosen: Packing, count: int) -> dict[str, ast.FunctionDef]:
    """Return what asks the fallback for undecided lanes: ``resolved``, and ``test`` that calls it.

    Parameters
    ----------
    chosen : Packing
    count : int
        With layout soa: how many lanes there are in all.
    """
    found = {}
    for name, function in (("resolved", resolved), ("test", decided)):
        tree = _Placed(chosen.layout, count).visit(syntax.parse(function))
        if chosen.layout != "soa":
            tree.args.args = [each for each in tree.args.args if each.arg != "start"]
        found[name] = tree
    return found


class _Placed(ast.NodeTransformer):
    """Puts what a layout makes of them in the place of the stand-ins; ``start`` is soa's alone."""

    def __init__(self, layout: str, count: int) -> None:
        place = {"soa": "0", "aos": "int64({}) * WIDTH", "blocks": "{}"}[layout]
        size = {
            "soa": f"{count} // WIDTH",
            "aos": "{}.shape[0] // WIDTH",
            "blocks": "{}.shape[0]",
        }[layout]
        self._starts = layout == "soa"
        self._calls = {
            "of_lanes": lambda records, number: f"{records}[{place.format(number)}]",
            "begin": lambda number: f"int64({number}) * WIDTH",
            "blocks": size.format,
        }

    def visit_Assign(self, node: ast.Assign) -> ast.stmt | None:
        if ast.unparse(node.targets[0]) == "start" and not self._starts:
            return None
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        name = ast.unparse(node.func)
        if name in self._calls:
            text = self._calls[name](*map(ast.unparse, node.args))
            return ast.parse(text, mode="eval").body
        if name in ("test", "filtered", "resolved") and not self._starts:
            node.args = [each for each in node.args if ast.unparse(each) != "start"]
        return self.generic_visit(node)


class _Spans(ast.NodeTransformer):
    """Makes of the loop over triangles sorted by axis one for each axis, or chooses by a pair's."""

    def __init__(self, chosen: Packing, tests: list[str]) -> None:
        self._axis = "tri.axis[start]" if chosen.layout == "soa" else "tri.axis"
        self._tests = tests

    def visit_For(self, node: ast.For) -> ast.stmt | list[ast.stmt]:
        if ast.unparse(node.target) != "i":
            return self.generic_visit(node)
        begin = next(n for n, s in enumerate(node.body) if ast.unparse(s).startswith("tri ="))
        spans = ast.parse("i = 0").body
        count = ast.unparse(node.iter.args[0])
        for axis, name in enumerate(self._tests):
            span = ast.parse(f"while i < {count}:\n    pass").body[0]
            body = [_called(statement, name) for statement in node.body]
            body.insert(begin + 1, ast.parse(f"if {self._axis} != {axis}:\n    break").body[0])
            span.body = [*body, *ast.parse("i += 1").body]
            spans.append(span)
        return spans

    def visit_Assign(self, node: ast.Assign) -> ast.stmt:
        if not ast.unparse(node).startswith("result = test("):
            return node
        first, second, third = (_called(node, name) for name in self._tests)
        return ast.If(
            ast.parse(f"{self._axis} == 0", mode="eval").body,
            [first],
            [ast.If(ast.parse(f"{self._axis} == 1", mode="eval").body, [second], [third])],
        )


def _called(statement: ast.stmt, name: str) -> ast.stmt:
    return ast.parse(ast.unparse(statement).replace("test(", f"{name}(")).body[0]
