"""How often each branch of a kernel is taken, counted by running its source."""

from __future__ import annotations

import ast
from types import FunctionType, SimpleNamespace

import numpy as np

from rtbench.compiled import syntax
from rtbench.kernels.contract import Kernel


def branches(kernel: Kernel, triangles: np.ndarray, rays: np.ndarray) -> list[tuple[int, int]]:
    """Return how often each branch was not taken and taken, in the order of the first meeting.

    Branches as the machine code has them: each comparison of an ``or`` is one, met where those
    before it were false; an ``and`` is one (a range about zero becomes one comparison of the
    magnitude). The kernel runs as plain Python in double precision.

    Parameters
    ----------
    kernel : Kernel
    triangles, rays : (N,) structured arrays
        As :func:`rtbench.compiled.layout.fill` makes them, in float64.

    Returns
    -------
    list of (int, int)
        A branch that is never met is not in it.
    """
    ways: dict[int, list[int]] = {}

    def note(branch: int, condition: bool) -> bool:
        ways.setdefault(branch, [0, 0])[bool(condition)] += 1
        return condition

    names: dict[str, object] = {"note": note}
    for name, value in syntax.outside_names(kernel).items():
        if not isinstance(value, FunctionType):
            names[name] = np.float64(value) if isinstance(value, float) else value
    marker = _Noted()
    functions = [*syntax.helpers(kernel).values(), syntax.tree(kernel)]
    module = ast.Module([marker.visit(syntax.copy(function)) for function in functions], [])
    exec(compile(ast.fix_missing_locations(module), f"<branches {kernel.name}>", "exec"), names)
    with np.errstate(all="ignore"):  # a kernel may divide by zero and sort it out later
        for tri, ray in zip(_rows(triangles), _rows(rays), strict=True):
            names[kernel.name](tri, ray, *([ray.tmax] if kernel.takes_tmax else []))
    return [tuple(counts) for counts in ways.values()]


class _Noted(ast.NodeTransformer):
    """Put every branch's condition through ``note``."""

    branches = 0

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        return self._note(node) if isinstance(node.op, ast.And) else self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        return self._note(node)

    def _note(self, node: ast.expr) -> ast.Call:
        self.branches += 1
        return ast.Call(ast.Name("note", ast.Load()), [ast.Constant(self.branches), node], [])


def _rows(records: np.ndarray) -> list[SimpleNamespace]:
    columns = {name: records[name] for name in records.dtype.names}
    # numpy's numbers, not Python's: those raise an exception where they divide by zero.
    return [SimpleNamespace(**{k: c[i] for k, c in columns.items()}) for i in range(len(records))]
