"""A kernel as plain Python over the records that it reads, in float64: no compiler needed."""

from __future__ import annotations

import ast
from collections.abc import Callable
from types import FunctionType, SimpleNamespace

import numpy as np

from rtbench.compiled import syntax
from rtbench.compiled.layout import fill
from rtbench.kernels.contract import Kernel


def as_python(kernel: Kernel) -> Callable:
    """Return the function that is compiled, with its ending woven in."""
    names: dict[str, object] = {}
    for name, value in syntax.outside_names(kernel).items():
        if not isinstance(value, FunctionType):
            names[name] = np.float64(value) if isinstance(value, float) else value
    functions = [*syntax.helpers(kernel).values(), syntax.tree(kernel)]
    module = ast.Module([syntax.copy(function) for function in functions], [])
    exec(compile(ast.fix_missing_locations(module), f"<{kernel.name}>", "exec"), names)
    return names[kernel.name]


def run(kernel: Kernel, triangles, origins, directions, tmax=np.inf) -> list[tuple]:
    """Return outcome and outputs of every pair; arrays as `rtbench.intersect` takes them."""
    triangles = np.asarray(triangles, float)
    vertices = tuple(np.ascontiguousarray(triangles[:, i]) for i in range(3))
    with np.errstate(all="ignore"):
        records = fill(
            kernel,
            "own",
            "float64",
            vertices,
            np.asarray(origins, float),
            np.asarray(directions, float),
            tmax=tmax if kernel.takes_tmax else None,
        )
        function = as_python(kernel)
        return [
            function(tri, ray, *([ray.tmax] if kernel.takes_tmax else []))
            for tri, ray in zip(*map(_rows, records), strict=True)
        ]


def _rows(records: np.ndarray) -> list[SimpleNamespace]:
    return [SimpleNamespace(**{n: r[n] for n in records.dtype.names}) for r in records]
