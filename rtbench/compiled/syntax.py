"""A kernel's own syntax tree: what of it is needed, what it reads, how it is widened."""

from __future__ import annotations

import ast
import builtins
import functools
import inspect
import textwrap
from collections.abc import Callable
from types import FunctionType, ModuleType

from rtbench.errors import RtbenchError
from rtbench.kernels.contract import Kernel

ARGUMENTS = ("tri", "ray")
MODULES = ("numpy", "math")


@functools.cache
def tree(kernel: Kernel) -> ast.FunctionDef:
    """Return a kernel's syntax: no decorator, its name, only its declared outputs.

    What only the outputs left out need is left out too, so that the t-only form of a listing
    is the listing as printed. Treat the tree as read-only; transforms copy it.

    Raises
    ------
    RtbenchError
        Where the function does not return what it declares.
    """
    function = parse(kernel.function)
    function.name = kernel.name
    count = 1 + len(kernel.outputs)
    returns = [node for node in ast.walk(function) if isinstance(node, ast.Return)]
    for node in returns:
        if not isinstance(node.value, ast.Tuple) or len(node.value.elts) < count:
            raise RtbenchError(
                f"kernel {kernel.name!r} must return its outcome, {', '.join(kernel.outputs)}; "
                f"it has {ast.unparse(node)!r}"
            )
        node.value.elts = node.value.elts[:count]
    if not returns:
        raise RtbenchError(f"kernel {kernel.name!r} returns nothing")
    function.body, _ = needed(function.body, set())
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


def copy(function: ast.FunctionDef) -> ast.FunctionDef:
    """Return a copy of a function's syntax that may be changed."""
    return ast.parse(ast.unparse(function)).body[0]


def needed(body: list[ast.stmt], after: set[str]) -> tuple[list[ast.stmt], set[str]]:
    """Return a block without the assignments that nothing reads, and what is live before it.

    Parameters
    ----------
    body : list of ast.stmt
    after : set of str
        The names that are read after the block.

    Returns
    -------
    list of ast.stmt
        Statements that stay; the ones given are not changed.
    set of str
        The names whose values the block, or what stands after it, reads.
    """
    kept: list[ast.stmt] = []
    live = set(after)
    for statement in reversed(body):
        stores = stored(statement)
        if isinstance(statement, ast.Return):
            kept, live = [], read(statement)
        elif isinstance(statement, ast.Assign):
            if stores and not stores & live:
                continue
            live = live - stores | read(statement)
        elif isinstance(statement, ast.AugAssign):
            if stores and not stores & live:
                continue
            live = live | read(statement)
        elif isinstance(statement, ast.If):
            body_kept, body_live = needed(statement.body, live)
            else_kept, else_live = needed(statement.orelse, live)
            if not body_kept and not else_kept:
                continue
            statement = ast.If(statement.test, body_kept or [ast.Pass()], else_kept)
            live = body_live | else_live | read(statement.test)
        else:  # a loop may read in its next round what it stores in this one: all of it stays
            live = live | read(statement)
        kept.insert(0, statement)
    return kept, live


def read(node: ast.AST) -> set[str]:
    """Return the names that a piece of syntax reads."""
    names = (n for n in ast.walk(node) if isinstance(n, ast.Name))
    return {n.id for n in names if isinstance(n.ctx, ast.Load)}


def stored(node: ast.AST) -> set[str]:
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

    def gather(node: ast.FunctionDef, function: Callable, callers: tuple[Callable, ...]) -> None:
        own = stored(node) | {argument.arg for argument in node.args.args}
        for name in sorted(read(node) - own):
            if name not in function.__globals__:
                if hasattr(builtins, name):
                    continue
                raise RtbenchError(f"kernel {kernel.name!r} reads {name!r}, which is not defined")
            value = function.__globals__[name]
            if name in found:
                if found[name] is not value and found[name] != value:
                    raise RtbenchError(
                        f"kernel {kernel.name!r} reads two different {name!r}: rename one of them"
                    )
                continue
            if isinstance(value, FunctionType):
                if value in callers:
                    raise RtbenchError(f"kernel {kernel.name!r}: {name!r} calls itself")
                gather(parse(value), value, (*callers, value))
            elif not _is_allowed(value):
                what = (
                    f"module {value.__name__!r}"
                    if isinstance(value, ModuleType)
                    else f"{name!r} of type {type(value).__name__}"
                )
                raise RtbenchError(
                    f"kernel {kernel.name!r} reads {what}: "
                    "numbers, plain functions, numpy and math are allowed"
                )
            found[name] = value

    gather(tree(kernel), kernel.function, (kernel.function,))
    return found


def _is_allowed(value: object) -> bool:
    if isinstance(value, ModuleType):
        return value.__name__ in MODULES
    return isinstance(value, (bool, int, float))


def helpers(kernel: Kernel) -> dict[str, ast.FunctionDef]:
    """Return the syntax of the plain functions that a kernel calls, callees first."""
    found = {k: parse(v) for k, v in outside_names(kernel).items() if isinstance(v, FunctionType)}
    for name, function in found.items():
        function.name = name
    return found


def fields(kernel: Kernel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the fields of the triangle and of the ray that a kernel reads."""
    fields_read: dict[str, list[str]] = {"tri": [], "ray": []}
    for node in (tree(kernel), *helpers(kernel).values()):
        _must_keep_names(kernel, node)
        for attribute in ast.walk(node):
            if isinstance(attribute, ast.Attribute) and isinstance(attribute.value, ast.Name):
                names = fields_read.get(attribute.value.id)
                if names is not None and attribute.attr not in names:
                    names.append(attribute.attr)
    return tuple(fields_read["tri"]), tuple(fields_read["ray"])


def _must_keep_names(kernel: Kernel, function: ast.FunctionDef) -> None:
    """Refuse tri or ray under another name: their fields would be read unseen."""
    known = {name: [a.arg for a in helper.args.args] for name, helper in helpers(kernel).items()}
    fine = {n.value for n in ast.walk(function) if isinstance(n, ast.Attribute)}
    for call in (n for n in ast.walk(function) if isinstance(n, ast.Call)):
        parameters = known.get(call.func.id, []) if isinstance(call.func, ast.Name) else []
        pairs = zip(parameters, call.args, strict=False)
        fine |= {arg for name, arg in pairs if isinstance(arg, ast.Name) and arg.id == name}
    for name in (n for n in ast.walk(function) if isinstance(n, ast.Name)):
        if name.id in ARGUMENTS and name not in fine:
            raise RtbenchError(
                f"kernel {kernel.name!r} gives {name.id} another name in line {name.lineno} of "
                f"{function.name}: call it {name.id} there too, so that its fields are seen"
            )


def typed(function: ast.FunctionDef) -> ast.FunctionDef:
    """Return a function with its float literals put into REAL.

    Beside a float32 an untyped literal would turn the expression into float64, unnoticed.
    """

    class Typed(ast.NodeTransformer):
        def visit_Constant(self, node: ast.Constant) -> ast.expr:
            return _in_real(node) if isinstance(node.value, float) else node

    return ast.fix_missing_locations(Typed().visit(copy(function)))


def widened(function: ast.FunctionDef, scalars: frozenset[str]) -> ast.FunctionDef:
    """Return a function with every number that it reads put into REAL, for mixed precision.

    Parameters
    ----------
    function : ast.FunctionDef
        A kernel or what it calls.
    scalars : frozenset of str
        The fields that hold one float; what is subscripted, outside an index, is widened too.
    """

    class Widen(ast.NodeTransformer):
        def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
            return _in_real(node) if isinstance(node.ctx, ast.Load) else node

        def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
            of_record = isinstance(node.value, ast.Name) and node.value.id in ARGUMENTS
            return _in_real(node) if of_record and node.attr in scalars else node

    return ast.fix_missing_locations(Widen().visit(copy(function)))


def _in_real(node: ast.expr) -> ast.Call:
    return ast.Call(ast.Name("REAL", ast.Load()), [node], [])
