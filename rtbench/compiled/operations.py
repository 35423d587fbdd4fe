"""How many operations a kernel needs at most, counted in its own syntax tree.

Counts follow Blecha 2007, tables 4.4, 4.6 and 4.8: the greatest number on any path through the
code, one condition an ``if``, a unary minus is a subtraction, calls of helpers are inlined. What
only touches a number's sign bit (FREE) is no arithmetic and is not counted.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from rtbench.compiled import preparation, syntax
from rtbench.kernels.contract import Kernel

OPERATIONS = ("add", "sub", "mul", "div", "cond")
VECTOR_OPERATIONS = ("differences", "crosses", "dots")
FREE = ("abs", "flipped", "sign_bit")
_KINDS = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_LOOPS = (ast.For, ast.While, ast.comprehension)

Counts = dict[str, int]
Path = tuple[int, ...]
"""The counts along one path, in the order of all names."""


def operations(kernel: Kernel) -> Counts | None:
    """Return the greatest number of each operation on any path through a kernel.

    Returns
    -------
    dict or None
        ``add, sub, mul, div, cond`` and the vector operations ``differences, crosses, dots``;
        None for a kernel with loops, whose paths no tree bounds.
    """
    helpers = syntax.helpers(kernel)
    functions = [syntax.tree(kernel), *helpers.values()]
    if any(isinstance(n, _LOOPS) for function in functions for n in syntax.nodes(function)):
        return None
    return _greatest(syntax.tree(kernel).body, helpers)


def preparation_operations(kernel: Kernel) -> Counts | None:
    """Return the greatest number of each operation that preparing a triangle takes.

    Returns
    -------
    dict or None
        ``add, sub, mul, div, cond`` (roots and moduli are not counted); None for a kernel that
        prepares nothing, or does it in loops.
    """
    if kernel.prepare is None:
        return None
    helpers = preparation.helpers(kernel.prepare)
    functions = [preparation.tree(kernel.prepare), *helpers.values()]
    if any(isinstance(n, _LOOPS) for function in functions for n in ast.walk(function)):
        return None
    counts = _greatest(functions[0].body, helpers)
    return {name: counts[name] for name in OPERATIONS}


def _greatest(body: list[ast.stmt], helpers: dict[str, ast.FunctionDef]) -> Counts:
    ended, going = _paths(body, helpers)
    greatest = (max(counts) for counts in zip(*(ended | going), strict=True))
    return dict(zip(_zero(), greatest, strict=True))


def _paths(
    body: list[ast.stmt], helpers: dict[str, ast.FunctionDef]
) -> tuple[set[Path], set[Path]]:
    """Return the counts along the paths that return in a block, and those that leave its end."""
    going: set[Path] = {tuple(_zero().values())}
    ended: set[Path] = set()
    vectors = _vectors(body)
    for position, statement in enumerate(body):
        added = _zero() | vectors.get(position, {})
        for expression in _expressions(statement):
            _count(expression, added, helpers)
        if isinstance(statement, ast.AugAssign) and type(statement.op) in _KINDS:
            added[_KINDS[type(statement.op)]] += 1
        if isinstance(statement, ast.If):
            added["cond"] += 1
        going = {_plus(path, tuple(added.values())) for path in going}
        if isinstance(statement, ast.Return):
            return ended | going, set()
        if isinstance(statement, ast.If):
            through: set[Path] = set()
            for branch in (statement.body, statement.orelse):
                inner_ended, inner_going = _paths(branch, helpers)
                ended |= {_plus(path, inner) for path in going for inner in inner_ended}
                through |= {_plus(path, inner) for path in going for inner in inner_going}
            going = through
    return ended, going


def _zero() -> Counts:
    return dict.fromkeys((*OPERATIONS, *VECTOR_OPERATIONS), 0)


def _plus(a: Path, b: Path) -> Path:
    return tuple(x + y for x, y in zip(a, b, strict=True))


def _expressions(node: ast.AST) -> Iterator[ast.expr]:
    """Yield the expressions that a statement itself evaluates (an ``if``: its test), or a part."""
    for part in node._fields:
        inside = getattr(node, part, None)
        if isinstance(inside, list):
            yield from (each for each in inside if isinstance(each, (ast.expr, ast.keyword)))
        elif isinstance(inside, ast.expr):
            yield inside


def _count(node: ast.expr, into: Counts, helpers: dict[str, ast.FunctionDef]) -> None:
    if isinstance(node, (ast.Name, ast.Constant)):
        return
    if isinstance(node, ast.IfExp):
        into["cond"] += 1
        _count(node.test, into, helpers)
        branches = [_zero(), _zero()]
        for counts, branch in zip(branches, (node.body, node.orelse), strict=True):
            _count(branch, counts, helpers)
        for name in into:
            into[name] += max(counts[name] for counts in branches)
        return
    if isinstance(node, ast.BinOp) and type(node.op) in _KINDS:
        into[_KINDS[type(node.op)]] += 1
        into["dots"] += _is_dot(node)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        into["sub"] += 1
    called = node.func.id if _is_call(node) else None
    if called in helpers and called not in FREE:
        for name, count in _greatest(helpers[node.func.id].body, helpers).items():
            into[name] += count
    for child in _expressions(node):
        _count(child, into, helpers)


def _is_call(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name)


def _is_product(node: ast.expr) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult)


def _is_dot(node: ast.BinOp) -> bool:
    """Tell whether this is the sum of exactly three products: a dot product."""
    inner = node.left
    return (
        isinstance(node.op, ast.Add)
        and _is_product(node.right)
        and isinstance(inner, ast.BinOp)
        and isinstance(inner.op, ast.Add)
        and _is_product(inner.left)
        and _is_product(inner.right)
    )


def _vectors(body: list[ast.stmt]) -> dict[int, Counts]:
    """Return where in a block a cross product or a difference of vectors begins.

    Each is three assignments in a row of a difference; no assignment belongs to two of them.
    """
    found: dict[int, Counts] = {}
    position = 0
    while position + 3 <= len(body):
        values = [s.value for s in body[position : position + 3] if isinstance(s, ast.Assign)]
        is_cross = len(values) == 3 and all(
            _is_difference(v) and _is_product(v.left) and _is_product(v.right) for v in values
        )
        is_difference = len(values) == 3 and all(
            _is_difference(v) and _component(v.left) == axis == _component(v.right)
            for axis, v in enumerate(values)
        )
        if is_cross or is_difference:
            found[position] = {"crosses": int(is_cross), "differences": int(is_difference)}
        position += 3 if is_cross or is_difference else 1
    return found


def _is_difference(node: ast.expr) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub)


def _component(node: ast.expr) -> int | None:
    """Return the constant index of ``vector[0]``, ``[1]`` or ``[2]``."""
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        return node.slice.value
    return None
