"""What a kernel's own syntax tree says: its operations, its stages, the fields it reads.

Operation counts follow Blecha 2007, tables 4.4, 4.6 and 4.8: the greatest number on any path
through the code, one condition an ``if``, a unary minus is a subtraction, calls of helpers are
inlined.
"""

from __future__ import annotations

import ast
import builtins
import functools
import inspect
import itertools
import textwrap
from collections.abc import Callable, Iterator
from types import FunctionType, ModuleType

from rtbench.errors import RtbenchError
from rtbench.kernels.contract import Kernel

OPERATIONS = ("add", "sub", "mul", "div", "cond")
VECTOR_OPERATIONS = ("differences", "crosses", "dots")
_KINDS = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}


@functools.cache
def tree(kernel: Kernel) -> ast.FunctionDef:
    """Return a kernel's syntax: no decorator, its name, only its declared outputs.

    What only the outputs left out need is left out too, so that the t-only form of a listing
    is the listing as printed. Treat the tree as read-only; transforms copy it.
    """
    function = parse(kernel.function)
    function.name = kernel.name
    for node in ast.walk(function):
        if isinstance(node, ast.Return):
            node.value.elts = node.value.elts[: 1 + len(kernel.outputs)]
    _drop_unread(function)
    return function


def parse(function: Callable) -> ast.FunctionDef:
    """Return the syntax of a plain function without its decorators and docstring."""
    node = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    if not isinstance(node, ast.FunctionDef):
        raise RtbenchError(f"{function!r} is no plain function (def ...)")
    node.decorator_list = []
    if ast.get_docstring(node) is not None:
        node.body = node.body[1:]
    return node


def _drop_unread(function: ast.FunctionDef) -> None:
    """Remove assignments to names that nothing reads, until none is left."""

    class Drop(ast.NodeTransformer):
        def visit_Assign(self, node: ast.Assign) -> ast.Assign | None:
            (target,) = node.targets
            return node if not isinstance(target, ast.Name) or target.id in read else None

    while True:
        before = ast.dump(function)
        read = _read(function)
        Drop().visit(function)
        if ast.dump(function) == before:
            return


def _read(node: ast.AST) -> set[str]:
    """Return the names that a piece of syntax reads."""
    names = (n for n in ast.walk(node) if isinstance(n, ast.Name))
    return {n.id for n in names if isinstance(n.ctx, ast.Load)}


def _stored(node: ast.AST) -> set[str]:
    """Return the names that a piece of syntax assigns."""
    names = (n for n in ast.walk(node) if isinstance(n, ast.Name))
    return {n.id for n in names if isinstance(n.ctx, ast.Store)}


def outside_names(kernel: Kernel) -> dict[str, object]:
    """Return what a kernel and its helpers read from their modules: names and values.

    Functions stand after those that they call.

    Raises
    ------
    RtbenchError
        For a name that is not there, or a value that cannot be put into a module.
    """
    found: dict[str, object] = {}

    def gather(node: ast.FunctionDef, function: Callable) -> None:
        own = _stored(node) | {argument.arg for argument in node.args.args}
        for name in sorted(_read(node) - own - set(found)):
            if name not in function.__globals__:
                if hasattr(builtins, name):
                    continue
                raise RtbenchError(f"kernel {kernel.name!r} reads {name!r}, which is not defined")
            value = function.__globals__[name]
            if isinstance(value, FunctionType):
                gather(parse(value), value)
            elif not isinstance(value, (bool, int, float, ModuleType)):
                raise RtbenchError(
                    f"kernel {kernel.name!r} reads {name!r} of type {type(value).__name__}: "
                    "numbers, plain functions, numpy and math are allowed"
                )
            found[name] = value

    gather(tree(kernel), kernel.function)
    return found


def fields(kernel: Kernel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the fields of the triangle and of the ray that a kernel reads."""
    nodes = [tree(kernel)]
    nodes += [parse(f) for f in outside_names(kernel).values() if isinstance(f, FunctionType)]
    read: dict[str, list[str]] = {"tri": [], "ray": []}
    for attribute in (n for node in nodes for n in ast.walk(node)):
        if isinstance(attribute, ast.Attribute) and isinstance(attribute.value, ast.Name):
            names = read.get(attribute.value.id)
            if names is not None and attribute.attr not in names:
                names.append(attribute.attr)
    return tuple(read["tri"]), tuple(read["ray"])


def widened(function: ast.FunctionDef, integers: frozenset[str]) -> ast.FunctionDef:
    """Return the kernel with every number it reads put into REAL, for mixed precision.

    Parameters
    ----------
    function : ast.FunctionDef
    integers : frozenset of str
        The fields that hold indices and stay as they are.
    """

    class Widen(ast.NodeTransformer):
        def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
            return self._wrap(node) if _is_field(node.value) else self.generic_visit(node)

        def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
            if _is_field(node) and node.attr not in integers:
                return self._wrap(node)
            return node

        @staticmethod
        def _wrap(node: ast.expr) -> ast.Call:
            return ast.Call(ast.Name("REAL", ast.Load()), [node], [])

    return ast.fix_missing_locations(Widen().visit(copy(function)))


def _is_field(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id in ("tri", "ray")
    )


def copy(function: ast.FunctionDef) -> ast.FunctionDef:
    """Return a copy of a function's syntax that may be changed."""
    return ast.parse(ast.unparse(function)).body[0]


# -- stages ---------------------------------------------------------------------------------


def stages(kernel: Kernel) -> list[str]:
    """Return the names of a kernel's stages, in order, as its bare strings tell them."""
    return list(
        dict.fromkeys(
            mark
            for statement in _statements(tree(kernel).body)
            if (mark := _mark(statement)) is not None
        )
    )


def cut(kernel: Kernel, stage: str) -> ast.FunctionDef:
    """Return the kernel cut off where a stage ends.

    The cut form returns code 0 and the sum of the values that are live there (those computed so
    far that the rest of the kernel reads), so that the compiler can leave nothing out.
    """
    function = copy(tree(kernel))
    outputs = len(kernel.outputs)

    def cut_block(body: list[ast.stmt], assigned: set[str], after: set[str]) -> list[ast.stmt]:
        kept: list[ast.stmt] = []
        for i, statement in enumerate(body):
            rest = set().union(after, *(_read(s) for s in body[i + 1 :]))
            if _mark(statement) == stage:
                live = sorted(assigned & rest) or ["ZERO"]
                total = " + ".join(live)
                return [*kept, *ast.parse(f"return 0, {', '.join([total] * outputs)}").body]
            if isinstance(statement, ast.If):
                statement.body = cut_block(statement.body, set(assigned), rest)
                statement.orelse = cut_block(statement.orelse, set(assigned), rest)
            assigned |= _stored(statement)
            kept.append(statement)
        return kept

    function.body = cut_block(function.body, set(), set())
    return ast.fix_missing_locations(function)


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    for statement in body:
        yield statement
        if isinstance(statement, ast.If):
            yield from _statements(statement.body)
            yield from _statements(statement.orelse)


def _mark(statement: ast.stmt) -> str | None:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return statement.value.value if isinstance(statement.value.value, str) else None
    return None


# -- counts ---------------------------------------------------------------------------------


def operations(kernel: Kernel) -> dict[str, int] | None:
    """Return the greatest number of each operation on any path through a kernel.

    Returns
    -------
    dict or None
        ``add, sub, mul, div, cond`` and the vector operations ``differences, crosses, dots``;
        None for a kernel with loops, whose paths no tree bounds.
    """
    helpers = {k: parse(v) for k, v in outside_names(kernel).items() if isinstance(v, FunctionType)}
    nodes = [tree(kernel), *helpers.values()]
    if any(isinstance(n, (ast.For, ast.While)) for node in nodes for n in ast.walk(node)):
        return None
    return _greatest(tree(kernel).body, helpers)


Counts = dict[str, int]


def _greatest(body: list[ast.stmt], helpers: dict[str, ast.FunctionDef]) -> Counts:
    return {
        name: max(dict(path)[name] for path in _paths(body, helpers))
        for name in (*OPERATIONS, *VECTOR_OPERATIONS)
    }


def _paths(body: list[ast.stmt], helpers: dict[str, ast.FunctionDef]) -> set[tuple]:
    """Return the counts along every path through a block, and whether the path returned."""
    going: set[tuple] = {tuple(_zero().items())}
    ended: set[tuple] = set()
    for position, statement in enumerate(body):
        added = _zero()
        for expression in _expressions(statement):
            _count(expression, added, helpers)
        _count_vectors(body, position, added)
        if isinstance(statement, ast.If):
            added["cond"] += 1
        going = {_plus(path, tuple(added.items())) for path in going}
        if isinstance(statement, ast.Return):
            return ended | going
        if isinstance(statement, ast.If):
            through = set()
            for branch in (statement.body, statement.orelse):
                for inner in _paths(branch, helpers):
                    joined = {_plus(path, inner) for path in going}
                    (ended if _returns(inner) else through).update(joined)
            going = through
    return ended | {(*path, ("open", 1)) for path in going}


def _returns(path: tuple) -> bool:
    return ("open", 1) not in path


def _zero() -> Counts:
    return dict.fromkeys((*OPERATIONS, *VECTOR_OPERATIONS), 0)


def _plus(a: tuple, b: tuple) -> tuple:
    first, second = dict(a), dict(b)
    return tuple((name, first[name] + second[name]) for name in _zero())


def _expressions(statement: ast.stmt) -> Iterator[ast.expr]:
    """Yield the expressions that a statement itself evaluates (an ``if``: its test)."""
    for _, value in ast.iter_fields(statement):
        for item in value if isinstance(value, list) else [value]:
            if isinstance(item, ast.expr):
                yield item


def _count(node: ast.expr, into: Counts, helpers: dict[str, ast.FunctionDef]) -> None:
    if isinstance(node, ast.BinOp) and type(node.op) in _KINDS:
        into[_KINDS[type(node.op)]] += 1
        into["dots"] += _is_dot(node)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        into["sub"] += 1
    if isinstance(node, ast.IfExp):
        into["cond"] += 1
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in helpers:
        for name, count in _greatest(helpers[node.func.id].body, helpers).items():
            into[name] += count
    for child in ast.iter_child_nodes(node):
        _count(child, into, helpers)


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


def _count_vectors(body: list[ast.stmt], position: int, into: Counts) -> None:
    """Count a cross product or a difference of vectors that begins at this statement."""
    values = []
    for statement in itertools.islice(body, position, position + 3):
        value = statement.value if isinstance(statement, ast.Assign) else None
        if not (isinstance(value, ast.BinOp) and isinstance(value.op, ast.Sub)):
            return
        values.append(value)
    if len(values) < 3:
        return
    into["crosses"] += all(_is_product(v.left) and _is_product(v.right) for v in values)
    into["differences"] += all(
        _component(v.left) == axis == _component(v.right) for axis, v in enumerate(values)
    )


def _component(node: ast.expr) -> int | None:
    """Return the constant index of ``vector[0]``, ``[1]`` or ``[2]``."""
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
        return node.slice.value
    return None
