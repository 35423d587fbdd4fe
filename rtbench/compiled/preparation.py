"""What a kernel stores of a triangle: its ``prepare``, compiled into a loop as the kernels are.

``prepare(tri)`` reads ``tri.v0``, ``tri.v1``, ``tri.v2`` in the language of the kernels and ends in
``return {"field": ...}``. The names and shapes of the fields are found without a compiler, by
running it as plain Python on one triangle.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable
from types import FunctionType, SimpleNamespace

import numpy as np

from rtbench.compiled import syntax
from rtbench.compiled.instantiate import HEADER_NAMES, Instance, instantiate
from rtbench.compiled.sources import dtype_source, named, outside
from rtbench.errors import RtbenchError

VERTICES = ("v0", "v1", "v2")
AXIS_TYPE = np.uint32
# No two coordinates are alike, and it has an area: nothing computed from it need be undefined.
SAMPLE = np.array([[0.21, 0.55, 0.82], [0.73, 0.11, 0.36], [0.47, 0.92, 0.64]])

# Stand-ins for what the generated module defines.
prepare = fields_into = None


def nest(triangles, stored):
    for k in range(triangles.shape[0]):
        fields_into(stored[k], prepare(triangles[k]))


@functools.cache
def tree(function: Callable) -> ast.FunctionDef:
    """Return the syntax of a ``prepare``, not to be changed.

    Raises
    ------
    RtbenchError
        If it does not take ``tri`` alone and end in ``return {"field": ...}``, its one return.
    """
    found = syntax.parse(function)
    returns = [node for node in ast.walk(found) if isinstance(node, ast.Return)]
    value = getattr(found.body[-1], "value", None)
    good = (
        [argument.arg for argument in found.args.args] == ["tri"]
        and returns == found.body[-1:]
        and isinstance(value, ast.Dict)
        and all(isinstance(k, ast.Constant) and str(k.value).isidentifier() for k in value.keys)
        and value.keys
    )
    if not good:
        raise RtbenchError(
            f'prepare {function.__name__!r} must take (tri) and end in return {{"field": ...}}, '
            "its only return"
        )
    return found


@functools.cache
def outside_names(function: Callable) -> dict[str, object]:
    """Return what a ``prepare`` reads from its module, as `syntax.outside_names` of a kernel."""
    return syntax.gathered(
        f"prepare {function.__name__!r}", tree(function), function.__globals__, function
    )


@functools.cache
def helpers(function: Callable) -> dict[str, ast.FunctionDef]:
    """Return the syntax of the plain functions that a ``prepare`` calls, callees first."""
    called = outside_names(function).items()
    found = {name: syntax.parse(value) for name, value in called if isinstance(value, FunctionType)}
    for name, each in found.items():
        each.name = name
    return found


@functools.cache
def stored_type(function: Callable, real: type) -> np.dtype:
    """Return the dtype of what a ``prepare`` stores of a triangle.

    Parameters
    ----------
    function : callable
    real : numpy type
        Of the numbers; axes are uint32.

    Returns
    -------
    np.dtype
        The fields in the order in which they are returned: scalars, and vectors as nested arrays.

    Raises
    ------
    RtbenchError
        Where it fails on a triangle, or returns what cannot be stored.
    """
    tree(function)
    corners = (tuple(map(np.float64, corner)) for corner in SAMPLE)
    triangle = SimpleNamespace(**dict(zip(VERTICES, corners, strict=True)))
    try:
        with np.errstate(all="ignore"):
            sample = function(triangle)
    except Exception as problem:  # it is the user's
        raise RtbenchError(f"prepare {function.__name__!r} fails: {problem}") from problem
    fields = []
    for name, value in sample.items():
        parts = value if isinstance(value, tuple) else (value,)
        kinds = {AXIS_TYPE if isinstance(part, (int, np.integer)) else real for part in parts}
        numbers = all(isinstance(part, (int, float, np.number)) for part in parts)
        if len(kinds) != 1 or not numbers:
            raise RtbenchError(
                f"prepare {function.__name__!r} stores {name!r} as {value!r}: a number, a tuple "
                "of numbers or an axis is allowed"
            )
        fields.append((name, kinds.pop(), (len(value),) if isinstance(value, tuple) else ()))
    return np.dtype(fields, align=True)


def triangle_type(data: type) -> np.dtype:
    """Return the dtype of the triangles that a ``prepare`` reads: nine numbers."""
    return np.dtype([(name, data, (3,)) for name in VERTICES], align=True)


@functools.cache
def loop(function: Callable, data: type, arithmetic: type, real: type) -> Instance:
    """Return the compiled loop that prepares triangles.

    Parameters
    ----------
    function : callable
        The ``prepare``.
    data, arithmetic, real : numpy types
        Of the vertices, of what is computed from them, and of what of it is stored.

    Returns
    -------
    Instance
        ``call(triangles, stored)``: (T,) records of `triangle_type`, and of `stored_type`, which
        are written.

    Raises
    ------
    RtbenchError
        For what does not compile.
    """
    name = function.__name__
    kinds = stored_type(function, real)
    constants = {
        "REAL": f"np.{arithmetic.__name__}",
        "TRIANGLE": dtype_source(triangle_type(data)),
        "STORED": dtype_source(kinds),
    }
    entry = f"{name}_loop"
    taken = {*constants, *HEADER_NAMES, "prepare", "fields_into", entry}
    told, functions = outside(f"prepare {name!r}", outside_names(function), taken)
    whole = syntax.copy(tree(function))
    whole.body[-1].value = ast.Tuple(whole.body[-1].value.values, ast.Load())
    functions |= {"prepare": whole}
    if data is not arithmetic:
        functions = {k: syntax.widened(each, frozenset()) for k, each in functions.items()}
    try:
        return instantiate(
            named(syntax.parse(nest), entry),
            callees=(
                *(named(syntax.typed(each), k) for k, each in functions.items()),
                _fields_into(kinds),
            ),
            constants=constants | told,
            signature="void(TRIANGLE[::1], STORED[::1])",
            title=f"What {name} stores: {data.__name__} in, {real.__name__} out",
            forceinline=True,
        )
    except Exception as problem:
        from numba.core.errors import NumbaError  # numba is there by now

        if not isinstance(problem, NumbaError):
            raise
        lines = [line for line in str(problem).splitlines() if line.strip()]
        said = next((line for line in lines if not line.startswith("Failed in")), lines[0])
        raise RtbenchError(f"prepare {name!r} does not compile: {said}") from problem


def _fields_into(kinds: np.dtype) -> str:
    """Return the source of a function that writes a tuple of values into a record."""
    lines = ["def fields_into(stored, values):"]
    for place, name in enumerate(kinds.names):
        if kinds[name].shape:
            for axis in range(kinds[name].shape[0]):
                lines.append(f"    stored.{name}[{axis}] = values[{place}][{axis}]")
        else:
            lines.append(f"    stored.{name} = values[{place}]")
    return "\n".join(lines) + "\n"


def triangles(vertices: tuple[np.ndarray, np.ndarray, np.ndarray], data: type) -> np.ndarray:
    """Return three (T, 3) arrays of vertices as (T,) records of `triangle_type`."""
    records = np.empty(len(vertices[0]), triangle_type(data))
    for name, corners in zip(VERTICES, vertices, strict=True):
        records[name] = corners
    return records


def prepared(
    function: Callable,
    vertices: tuple[np.ndarray, np.ndarray, np.ndarray],
    data: type,
    arithmetic: type,
    real: type,
) -> np.ndarray:
    """Return what a ``prepare`` stores of triangles.

    Parameters
    ----------
    function, data, arithmetic, real
        As for `loop`.
    vertices : three (T, 3) arrays
        v0, v1, v2; rounded to ``data`` first.

    Returns
    -------
    (T,) structured array
        Of `stored_type`. Of no triangles: nothing is compiled for them.
    """
    stored = np.empty(len(vertices[0]), stored_type(function, real))
    if len(stored):
        made = loop(function, data, arithmetic, real)
        made.call(triangles(vertices, data), stored)
    return stored
