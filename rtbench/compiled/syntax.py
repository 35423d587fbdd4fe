"""A kernel's own syntax tree: what of it is needed, what it reads, how it is widened."""

from __future__ import annotations

import ast
import builtins
import functools
import inspect
import textwrap
from collections.abc import Callable
from copy import copy as shallow
from types import FunctionType, ModuleType

from rtbench.compiled.nodes import names, nodes
from rtbench.compiled.weave import INSTEAD, woven
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import ARGUMENTS, Kernel

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
    if kernel.ending is None:
        function = parse(kernel.function)
    else:
        instead = kernel.outputs if kernel.outputs in INSTEAD else None
        function = _woven(kernel.function, kernel.ending, instead)
    body = _returning(kernel, function.body)
    if not any(isinstance(node, ast.Return) for node in nodes(function)):
        raise RtbenchError(f"kernel {kernel.name!r} returns nothing")
    body, _ = needed(body, set())
    return ast.FunctionDef(kernel.name, function.args, body, [], lineno=1)


@functools.cache
def _woven(function: Callable, ending: object, instead: tuple[str, ...] | None) -> ast.FunctionDef:
    """Return a method with an ending, the same for all of t, u and v; not to be changed."""
    return woven(parse(function), parse(ending.text), ending, instead)


def _returning(kernel: Kernel, body: list[ast.stmt]) -> list[ast.stmt]:
    """Return statements with no more than the declared outputs; the ones given stay as they are."""
    found = []
    for statement in body:
        if isinstance(statement, ast.Return):
            count = 1 + len(kernel.outputs)
            values = getattr(statement.value, "elts", [])
            if not isinstance(statement.value, ast.Tuple) or len(values) < count:
                raise RtbenchError(
                    f"kernel {kernel.name!r} must return its outcome, "
                    f"{', '.join(kernel.outputs)}; it has {ast.unparse(statement)!r}"
                )
            statement = ast.Return(ast.Tuple(values[:count], ast.Load()))
        elif hasattr(statement, "body"):
            statement = shallow(statement)
            statement.body = _returning(kernel, statement.body)
            statement.orelse = _returning(kernel, getattr(statement, "orelse", []))
        found.append(statement)
    return found


@functools.cache
def _source(function: Callable) -> str:
    return textwrap.dedent(inspect.getsource(function))


def parse(function: Callable) -> ast.FunctionDef:
    """Return the syntax of a plain function without its decorators and docstring."""
    node = ast.parse(_source(function)).body[0]
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
        reads, stores = names(statement)
        if isinstance(statement, ast.Return):
            kept, live = [], reads
        elif isinstance(statement, ast.Assign):
            if stores and not stores & live:
                continue
            live = live - stores | reads
        elif isinstance(statement, ast.AugAssign):
            if stores and not stores & live:
                continue
            live = live | reads
        elif isinstance(statement, ast.If):
            body_kept, body_live = needed(statement.body, live)
            else_kept, else_live = needed(statement.orelse, live)
            if not body_kept and not else_kept:
                continue
            statement = ast.If(statement.test, body_kept or [ast.Pass()], else_kept)
            live = body_live | else_live | read(statement.test)
        else:  # a loop may read in its next round what it stores in this one: all of it stays
            live = live | reads
        kept.insert(0, statement)
    return kept, live


def read(node: ast.AST) -> set[str]:
    """Return the names that a piece of syntax reads."""
    return names(node)[0]


def stored(node: ast.AST) -> set[str]:
    """Return the names that a piece of syntax assigns."""
    return names(node)[1]


def outside_names(kernel: Kernel) -> dict[str, object]:
    """Return what a kernel and its helpers read from their modules: names and values.

    Functions stand after those that they call.

    Raises
    ------
    RtbenchError
        For a name that is not there, or a value that cannot be put into a module.
    """
    around = kernel.function.__globals__
    if kernel.ending is not None:
        around = kernel.ending.text.__globals__ | around
    return gathered(f"kernel {kernel.name!r}", tree(kernel), around, kernel.function)


def fallback_names(kernel: Kernel) -> dict[str, object]:
    """Return what a kernel's fallback and its helpers read from their modules; none without one.

    Raises
    ------
    RtbenchError
        As `outside_names`.
    """
    if kernel.fallback is None:
        return {}
    around = kernel.fallback.__globals__
    what = f"fallback of kernel {kernel.name!r}"
    return gathered(what, parse(kernel.fallback), around, kernel.fallback)


def gathered(
    what: str, function: ast.FunctionDef, around: dict, called: Callable
) -> dict[str, object]:
    """Return what a function and its helpers read from their modules; see `outside_names`.

    Parameters
    ----------
    what : str
        The function, for an error.
    function : ast.FunctionDef
    around : dict
        The names of its module.
    called : callable
        The function itself, which may not call itself.
    """
    found: dict[str, object] = {}

    def gather(node: ast.FunctionDef, around: dict, callers: tuple[Callable, ...]) -> None:
        reads, own = names(node)
        for name in sorted(reads - own - {argument.arg for argument in node.args.args}):
            if name not in around:
                if hasattr(builtins, name):
                    continue
                raise RtbenchError(f"{what} reads {name!r}, which is not defined")
            value = around[name]
            if name in found:
                if found[name] is not value and found[name] != value:
                    raise RtbenchError(f"{what} reads two different {name!r}: rename one of them")
                continue
            if isinstance(value, FunctionType):
                if value in callers:
                    raise RtbenchError(f"{what}: {name!r} calls itself")
                gather(parse(value), value.__globals__, (*callers, value))
            elif not _is_allowed(value):
                kind = (
                    f"module {value.__name__!r}"
                    if isinstance(value, ModuleType)
                    else f"{name!r} of type {type(value).__name__}"
                )
                raise RtbenchError(
                    f"{what} reads {kind}: numbers, plain functions, numpy and math are allowed"
                )
            found[name] = value

    gather(function, around, (called,))
    return found


def _is_allowed(value: object) -> bool:
    if isinstance(value, ModuleType):
        return value.__name__ in MODULES
    return isinstance(value, (bool, int, float))


@functools.cache
def helpers(kernel: Kernel) -> dict[str, ast.FunctionDef]:
    """Return the syntax of the plain functions that a kernel calls, callees first; read-only."""
    found = {k: parse(v) for k, v in outside_names(kernel).items() if isinstance(v, FunctionType)}
    for name, function in found.items():
        function.name = name
    return found


@functools.cache
def fields(kernel: Kernel) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the fields of the triangle and of the ray that a kernel reads."""
    fields_read: dict[str, list[str]] = {"tri": [], "ray": []}
    for function in (tree(kernel), *helpers(kernel).values()):
        whole = nodes(function)
        attributes = [node for node in whole if isinstance(node, ast.Attribute)]
        _must_keep_names(kernel, function, whole, attributes)
        for attribute in attributes:
            if isinstance(attribute.value, ast.Name):
                names = fields_read.get(attribute.value.id)
                if names is not None and attribute.attr not in names:
                    names.append(attribute.attr)
    return tuple(fields_read["tri"]), tuple(fields_read["ray"])


def _must_keep_names(
    kernel: Kernel, function: ast.FunctionDef, whole: list[ast.AST], attributes: list[ast.Attribute]
) -> None:
    """Refuse tri or ray under another name: their fields would be read unseen."""
    known = {name: [a.arg for a in helper.args.args] for name, helper in helpers(kernel).items()}
    fine = {attribute.value for attribute in attributes}
    for call in (n for n in whole if isinstance(n, ast.Call)):
        parameters = known.get(call.func.id, []) if isinstance(call.func, ast.Name) else []
        pairs = zip(parameters, call.args, strict=False)
        fine |= {arg for name, arg in pairs if isinstance(arg, ast.Name) and arg.id == name}
    for name in (n for n in whole if isinstance(n, ast.Name)):
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
