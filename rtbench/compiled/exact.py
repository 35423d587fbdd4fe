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

from rtbench.compiled import preparation, syntax
from rtbench.errors import RtbenchError
from rtbench.kernels import exact_signs
from rtbench.kernels.contract import TMAX, UNDECIDED, Kernel
from rtbench.kernels.vectors import length

EPSILON = Fraction(1, 2**10000)
# What an arithmetic without rounding has in the place of these.
OF_ARITHMETIC = {
    "EPSILON": EPSILON,
    "ROUNDOFF": Fraction(0),
    "TINY": Fraction(0),
    "SMALLEST": Fraction(0),
    "LARGEST": np.inf,
}


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

    One that takes tmax takes ``ray.tmax``, a rational or infinity.

    Raises
    ------
    RtbenchError
        For a method that needs roots or an arccos.
    """
    if not kernel.exact:
        raise RtbenchError(f"kernel {kernel.name!r} has no exact form: it needs irrational numbers")
    functions = [*syntax.helpers(kernel).values(), syntax.tree(kernel)]
    function = _in_rationals(syntax.outside_names(kernel), functions)
    if kernel.fallback is not None:
        return _decided(kernel, function)
    if kernel.takes_tmax:
        return lambda tri, ray: function(tri, ray, ray.tmax)
    return function


def _decided(kernel: Kernel, filter_alone: Callable) -> Callable:
    """Return a kernel that asks its fallback where it cannot decide."""
    found = syntax.fallback_names(kernel)
    called = {name: syntax.parse(v) for name, v in found.items() if isinstance(v, FunctionType)}
    for name, function in called.items():
        function.name = name
    fallback = _in_rationals(found, [*called.values(), syntax.parse(kernel.fallback)])

    def function(tri: SimpleNamespace, ray: SimpleNamespace) -> tuple:
        result = filter_alone(tri, ray, ray.tmax)
        if result[0] == UNDECIDED:
            result = fallback(tri.v0, tri.v1, tri.v2, ray.orig, ray.dir, ray.tmax)
        return tuple(result[: 1 + len(kernel.outputs)])

    return function


@functools.cache
def exact_preparation(kernel: Kernel) -> Callable:
    """Return a kernel's ``prepare`` as a function of rationals: ``f(tri) -> dict``.

    Raises
    ------
    RtbenchError
        From the function, where it stores what is no rational; `vectors.length` is 1 there.
    """
    prepare = kernel.prepare
    functions = [*preparation.helpers(prepare).values(), preparation.tree(prepare)]
    function = _in_rationals(preparation.outside_names(prepare), functions)

    def prepared(tri: SimpleNamespace) -> dict[str, object]:
        stored = function(tri)
        for name, value in stored.items():
            if any(isinstance(part, float) for part in np.ravel(np.array(value, dtype=object))):
                raise RtbenchError(
                    f"kernel {kernel.name!r} has no exact form: {prepare.__name__} stores an "
                    f"irrational {name!r}; declare exact=False"
                )
        return stored

    return prepared


def _in_rationals(outside: dict[str, object], functions: list[ast.FunctionDef]) -> Callable:
    """Return the last of some functions, made to compute with rationals."""
    names: dict[str, object] = {"divide": divide, "Fraction": Fraction}
    for name, value in outside.items():
        if name in OF_ARITHMETIC:
            names[name] = OF_ARITHMETIC[name]
        elif isinstance(value, float) and np.isnan(value):
            names[name] = UNDEFINED
        elif not isinstance(value, FunctionType):
            names[name] = _rational(value)
    module = ast.Module([_Rational().visit(syntax.copy(f)) for f in functions], [])
    name = functions[-1].name
    exec(compile(ast.fix_missing_locations(module), f"<exact {name}>", "exec"), names)
    for called, value in outside.items():
        if isinstance(value, FunctionType) and value in _INSTEAD:
            names[called] = _INSTEAD[value]
    return names[name]


def _one(vector: tuple) -> Fraction:
    """Return what a length is taken for: no sign depends on it, and it has no rational value."""
    return Fraction(1)


def _exact_value(a, b, c, o, mode) -> tuple[Fraction, int]:
    """Return what `exact_signs.exact_value` approximates."""
    found = _determinant(a, b, c) - _determinant(a, o, c)
    if mode >= exact_signs.THIRD:
        found -= _determinant(a, b, o)
    if mode == exact_signs.ALL:
        found -= _determinant(o, b, c)
    return found, 0


def _determinant(a, b, c) -> Fraction:
    a, b, c = ([Fraction(x) for x in vector] for vector in (a, b, c))
    return sum(a[i - 2] * (b[i - 1] * c[i] - b[i] * c[i - 1]) for i in range(3))


# What needs no roundabout way in rationals.
_INSTEAD = {
    length: _one,
    exact_signs.double: lambda x: x,
    exact_signs.scaled: lambda x, power: x * Fraction(2) ** power,
    exact_signs.exact_value: _exact_value,
}


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
    triangles = _rows({"v0": v0, "v1": v1, "v2": v2})
    if kernel.prepare is not None:
        prepare = exact_preparation(kernel)
        for triangle in triangles:
            vars(triangle).update(prepare(triangle))
    reach = np.full(len(orig), np.inf, dtype=object)
    rays = {"orig": orig, "end": orig + direction, "dir": direction, TMAX: reach}
    return triangles, _rows(rays)


def _fractions(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values)
    exact = np.empty(values.shape, dtype=object)
    exact.ravel()[:] = [Fraction(float(x)) for x in values.ravel()]
    return exact


def _rows(columns: dict[str, np.ndarray]) -> list[SimpleNamespace]:
    length = len(next(iter(columns.values())))
    return [SimpleNamespace(**{k: c[i] for k, c in columns.items()}) for i in range(length)]
