"""A kernel in rational arithmetic: the same function called with fractions.

Signs and hits only need rational operations: what ``prepare`` stores stays un-normalised, EPSILON
is a positive rational below every nonzero determinant of float inputs, and a division by zero
gives a value for which every comparison is false.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable
from fractions import Fraction
from types import FunctionType, SimpleNamespace

import numpy as np

from rtbench.compiled import syntax
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import Kernel

EPSILON = Fraction(1, 2**10000)


class Undefined:
    """What a division by zero gives: no comparison holds, and so is all computed from it."""

    def _comparison(self, other: object) -> bool:
        return False

    def _operation(self, other: object = None) -> Undefined:
        return self

    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = _comparison
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _operation
    __truediv__ = __rtruediv__ = __neg__ = __abs__ = _operation
    __hash__ = None

    def __repr__(self) -> str:
        return "undefined"


UNDEFINED = Undefined()


def divide(a: Fraction, b: Fraction) -> Fraction | Undefined:
    """Return a / b, or UNDEFINED where b is zero."""
    if isinstance(a, Undefined) or isinstance(b, Undefined) or b == 0:
        return UNDEFINED
    return Fraction(a) / b


@functools.cache
def exact_form(kernel: Kernel) -> Callable:
    """Return the kernel as a function of rationals: ``f(tri, ray) -> (outcome, *outputs)``.

    Raises
    ------
    RtbenchError
        For a method that needs roots or an arccos.
    """
    if not kernel.exact:
        raise RtbenchError(f"kernel {kernel.name!r} has no exact form: it needs irrational numbers")
    names: dict[str, object] = {"divide": divide, "Fraction": Fraction}
    for name, value in syntax.outside_names(kernel).items():
        if isinstance(value, FunctionType):
            continue
        if name == "EPSILON":
            names[name] = EPSILON
        elif isinstance(value, float) and np.isnan(value):
            names[name] = UNDEFINED
        else:
            names[name] = _rational(value)
    functions = [*syntax.helpers(kernel).values(), syntax.tree(kernel)]
    module = ast.Module([_Rational().visit(syntax.copy(f)) for f in functions], [])
    exec(compile(ast.fix_missing_locations(module), f"<exact {kernel.name}>", "exec"), names)
    return names[kernel.name]


def _rational(value: object) -> object:
    return Fraction(value) if isinstance(value, float) and np.isfinite(value) else value


class _Rational(ast.NodeTransformer):
    """Make every division total and every number in the source a rational."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.op, ast.Div):
            return ast.Call(ast.Name("divide", ast.Load()), [node.left, node.right], [])
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt:
        if not (isinstance(node.op, ast.Div) and isinstance(node.target, ast.Name)):
            return self.generic_visit(node)
        target = ast.Name(node.target.id, ast.Load())
        return ast.Assign([node.target], self.visit(ast.BinOp(target, node.op, node.value)))

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if not isinstance(node.value, float):
            return node
        return ast.Call(ast.Name("Fraction", ast.Load()), [node], [])


def exact_records(
    kernel: Kernel,
    vertices: tuple[np.ndarray, np.ndarray, np.ndarray],
    origins: np.ndarray,
    directions: np.ndarray,
) -> tuple[list[SimpleNamespace], list[SimpleNamespace]]:
    """Return triangles and rays of rationals, as :func:`exact_form` takes them.

    Parameters
    ----------
    kernel : Kernel
    vertices : three (N, 3) float arrays
    origins, directions : (N, 3) float arrays
        ``end`` is origin + direction, exactly.
    """
    v0, v1, v2, orig, direction = (_fractions(a) for a in (*vertices, origins, directions))
    stored = {"v0": v0, "v1": v1, "v2": v2}
    if kernel.prepare is not None:
        stored |= kernel.prepare(v0, v1, v2)
    rays = {"orig": orig, "end": orig + direction, "dir": direction}
    return _rows(stored), _rows(rays)


def _fractions(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values)
    exact = np.empty(values.shape, dtype=object)
    exact.ravel()[:] = [Fraction(float(x)) for x in values.ravel()]
    return exact


def _rows(columns: dict[str, np.ndarray]) -> list[SimpleNamespace]:
    length = len(next(iter(columns.values())))
    return [SimpleNamespace(**{k: c[i] for k, c in columns.items()}) for i in range(length)]
