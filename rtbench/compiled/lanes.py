"""A kernel's syntax rewritten for lanes: exits become masks, fields become rows of W numbers.

What a number in the kernel was becomes W numbers (`rtbench.compiled.vectors`), and nothing else
changes: the same operations stand in the same order. What is read of the side that is the same
for all lanes stays a number, so that what depends on it alone is computed once, not W times.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass

from rtbench.compiled import syntax
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import ARGUMENTS, TMAX, Kernel

EXITS = ("none", "any")
LAYOUTS = ("blocks", "soa", "aos")


@dataclass(frozen=True)
class Side:
    """Where the lanes of ``tri`` or ``ray`` lie.

    Attributes
    ----------
    lanes : frozenset of str
        The fields that hold a number a lane; all others are the same for all lanes.
    layout : str
        ``blocks``: a record holds a row of W for each number; ``soa``: one record holds a row of
        all; ``aos``: W records, one after the other, hold one each.
    step : int
        With aos, from one record to the next, in bytes.
    axes : tuple of (str, str)
        What stands for each field that chooses an axis.
    """

    lanes: frozenset[str] = frozenset()
    layout: str = "blocks"
    step: int = 0
    axes: tuple[tuple[str, str], ...] = ()


def must_fit(kernel: Kernel) -> None:
    """Raise RtbenchError for a kernel that cannot be taken in lanes."""
    where = f"kernel {kernel.name!r} cannot be taken in packets"
    if not kernel.takes_tmax:
        raise RtbenchError(f"{where}: it takes no tmax (methods with an ending do)")
    *body, last = syntax.tree(kernel).body
    for statement in body:
        if not (isinstance(statement, ast.Assign) or _is_label(statement) or _is_exit(statement)):
            told = ast.unparse(statement).splitlines()[0]
            raise RtbenchError(f"{where}: it branches ({told}); a whole form is needed")
    if not isinstance(last, ast.Return):
        raise RtbenchError(f"{where}: it does not end in a return")
    functions = [syntax.tree(kernel), *syntax.helpers(kernel).values()]
    for function in functions:
        for node in ast.walk(function):
            if isinstance(node, ast.Attribute) and node.value.id not in ARGUMENTS:
                raise RtbenchError(f"{where}: it calls {ast.unparse(node)} of {function.name}")
    for function in functions[1:]:
        if len(function.body) != 1 or not isinstance(function.body[0], ast.Return):
            raise RtbenchError(f"{where}: {function.name} is more than one expression")


def masked(kernel: Kernel, leave: str = "none") -> ast.FunctionDef:
    """Return a kernel whose exits are masks: it returns whether it hits, and its outputs.

    Parameters
    ----------
    kernel : Kernel
        Branch-free, or one whose only branches are exits.
    leave : str
        ``any``: after its first exit's test it goes on only where any lane does.

    Returns
    -------
    ast.FunctionDef
        ``hit, *outputs``; outputs of a miss are NO_T where the kernel exits early. With a
        fallback ``hit, undecided, *outputs``.

    Raises
    ------
    RtbenchError
        As `must_fit`, and where there is no exit to leave by.
    """
    must_fit(kernel)
    function = syntax.copy(syntax.tree(kernel))
    body: list[ast.stmt] = []
    tests = 0
    for statement in function.body[:-1]:
        if not _is_exit(statement):
            body.append(statement)
            continue
        passed = _opposite(statement.test)
        tests += 1
        body += _statements(f"hit = {'hit & ' * (tests > 1)}({ast.unparse(passed)})")
        if leave == "any" and tests == 1:
            nothing = ["spread(NO_T, WIDTH)" for _ in kernel.outputs]
            nothing = ["hit", *nothing] if kernel.fallback else nothing
            body += _statements(f"if not any_lane(hit):\n    return hit, {', '.join(nothing)}")
    if leave == "any" and not tests:
        raise RtbenchError(f"kernel {kernel.name!r} has no exit that packets could leave by")
    outcome, *outputs = function.body[-1].value.elts
    found = ast.unparse(_condition(kernel, outcome, "UNDECIDED" if kernel.fallback else "1"))
    passed = "hit & " if tests else ""
    outputs = [ast.unparse(each) for each in outputs]
    if tests:
        outputs = [f"choose(hit, {each}, NO_T)" for each in outputs]
    if kernel.fallback:
        body += _statements(f"sure = {found}")
        outputs.insert(0, f"{passed}opposite(sure)")
        found = f"{passed}sure"
    elif tests:
        found = "hit"
    function.body = [*body, *_statements(f"return {', '.join([found, *outputs])}")]
    return function


def _condition(kernel: Kernel, outcome: ast.expr, otherwise: str) -> ast.expr:
    """Return what decides in ``HIT if condition else 1``, or else UNDECIDED."""
    if ast.unparse(outcome) == "HIT":  # whoever has passed the exits hits
        return ast.Constant(True)
    fits = isinstance(outcome, ast.IfExp) and ast.unparse(outcome.body) == "HIT"
    if not (fits and (otherwise == "1" or ast.unparse(outcome.orelse) == otherwise)):
        raise RtbenchError(
            f"kernel {kernel.name!r} cannot be taken in packets: it returns {ast.unparse(outcome)} "
            f"as its outcome; HIT if ... else {otherwise} is needed"
        )
    return outcome.test


def _is_label(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _is_exit(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.If)
        and not statement.orelse
        and len(statement.body) == 1
        and isinstance(statement.body[0], ast.Return)
    )


def _opposite(test: ast.expr) -> ast.expr:
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return test.operand
    return ast.Call(ast.Name("opposite", ast.Load()), [test], [])


def _statements(text: str) -> list[ast.stmt]:
    return ast.parse(text).body


def in_lanes(
    function: ast.FunctionDef, tri: Side, ray: Side, estimate: bool = False
) -> ast.FunctionDef:
    """Return a function with the fields of tri and ray read as lanes where they are lanes.

    Parameters
    ----------
    function : ast.FunctionDef
        It is not changed. Functions that it calls are rewritten on their own.
    tri, ray : Side
    estimate : bool
        Reciprocals by the processor's estimate and a Newton step.
    """
    return ast.fix_missing_locations(
        _InLanes({"tri": tri, "ray": ray}, estimate).visit(syntax.copy(function))
    )


VECTORS = ("v0", "v1", "v2", "orig", "end", "dir")
_OF_TWO = {"min": "lesser", "max": "greater"}


class _InLanes(ast.NodeTransformer):
    def __init__(self, sides: dict[str, Side], estimate: bool) -> None:
        self._sides = sides
        self._estimate = estimate

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        side = self._side(node.value)
        computed = isinstance(node.slice, ast.Name) and side and node.value.attr in VECTORS
        node.slice = self.visit(node.slice)
        if side is None:
            return node
        if computed:  # an axis that may differ from lane to lane
            parts = [
                self._component(ast.Subscript(node.value, ast.Constant(axis), ast.Load()), side)
                for axis in range(3)
            ]
            first, second, third = map(ast.unparse, parts)
            axis = node.slice.id
            text = f"choose({axis} == 0, {first}, choose({axis} == 1, {second}, {third}))"
            return ast.parse(text, mode="eval").body
        return self._component(node, side)

    def _component(self, node: ast.Subscript, side: Side) -> ast.expr:
        if node.value.attr not in side.lanes:
            return node
        return self._lanes(node.value, node.slice, side)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        side = self._side(node)
        if side is None:
            return node
        axes = dict(side.axes)
        if node.attr in axes:
            return ast.parse(axes[node.attr], mode="eval").body
        return self._lanes(node, ast.Constant(0), side) if node.attr in side.lanes else node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        return ast.Call(ast.Name("choose", ast.Load()), [node.test, node.body, node.orelse], [])

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in _OF_TWO:
            return node
        first, *others = node.args
        for each in others:
            first = ast.Call(ast.Name(_OF_TWO[name], ast.Load()), [first, each], [])
        return first

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        sign = ast.BitAnd() if isinstance(node.op, ast.And) else ast.BitOr()
        first, *others = node.values
        for each in others:
            first = ast.BinOp(first, sign, each)
        return first

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        of_one = isinstance(node.left, ast.Name) and node.left.id == "ONE"
        if self._estimate and of_one and isinstance(node.op, ast.Div):
            return ast.Call(ast.Name("reciprocal", ast.Load()), [node.right], [])
        return node

    def _side(self, node: ast.expr) -> Side | None:
        of_record = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
        return self._sides.get(node.value.id) if of_record else None

    def _lanes(self, field: ast.Attribute, index: ast.expr, side: Side) -> ast.Call:
        text = f"{ast.unparse(field)}, {ast.unparse(index)}"
        if side.layout == "aos":
            text = f"column({text}, {side.step}, WIDTH)"
        else:
            text = f"row({text}, {'start' if side.layout == 'soa' else 0}, WIDTH)"
        return ast.parse(text, mode="eval").body


def fields(kernel: Kernel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the fields that a kernel reads of the triangle and of the ray, tmax with these."""
    triangle, ray = syntax.fields(kernel)
    return triangle, (*ray, TMAX)
