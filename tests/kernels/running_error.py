"""A kernel run with running error bounds: what it computes, and what it might without rounding.

The rounding band of a kernel, as the tests mean it: a pair lies in it where a comparison that
decides between hit and miss could come out otherwise without rounding, by the bounds of `bounded`.
It is derived from the kernel's own formula, step by step, stored data included; no number in it was
chosen. EPSILON, TOLERANCE, ROUNDOFF and TINY count as errors of their own size: without rounding
they would be 0. A filter's UNDECIDED lies in the band, whatever its fallback comes to.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass, field
from types import FunctionType, ModuleType, SimpleNamespace

import numpy as np
from bounded import Bounded, Truth, choose, greatest, least, pick, sign

from rtbench.compiled import syntax
from rtbench.compiled.layout import DATA_TYPE, REAL_TYPE
from rtbench.kernels.contract import HIT, UNDECIDED, Kernel

STANDS_FOR_0 = ("EPSILON", "TOLERANCE", "ROUNDOFF", "TINY")
OF_ARITHMETIC = {
    "ROUNDOFF": lambda real: np.finfo(real).eps / 2,
    "TINY": lambda real: np.finfo(real).smallest_normal,
}
MATH = SimpleNamespace(sqrt=np.sqrt, acos=np.arccos, copysign=sign)
CALLS = {
    "choose": choose,
    "pick": pick,
    "either": lambda *tests: _reduced(tests, Truth.__or__),
    "both": lambda *tests: _reduced(tests, Truth.__and__),
    "math": MATH,
    "max": greatest,
    "min": least,
}


@dataclass
class Run:
    """What a kernel computes of N pairs, and between which answers rounding may have chosen.

    Attributes
    ----------
    outcome : (N,) int array
        As the kernel itself computes it, UNDECIDED where its fallback is asked.
    may_hit, may_miss : (N,) bool arrays
        What its formula may come to without rounding.
    outputs : dict of str to (values, bounds)
        Where the kernel hits; NaN elsewhere.
    """

    outcome: np.ndarray
    may_hit: np.ndarray
    may_miss: np.ndarray
    outputs: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    @property
    def hit(self) -> np.ndarray:
        """Where the kernel hits."""
        return self.outcome == HIT

    @property
    def in_band(self) -> np.ndarray:
        """Where a rounding may have decided."""
        return self.may_hit & self.may_miss


def run(
    kernel: Kernel,
    precision: str,
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    tmax: float = np.inf,
    prepared: str = "own",
) -> Run:
    """Run a kernel over pairs with the bounds of its rounding errors.

    Parameters
    ----------
    kernel : Kernel
    precision : str
        float32, float64 or mixed.
    triangles : (N, 3, 3) array
    origins, directions : (N, 3) arrays
        All of the precision of the kernel's data, or rounded to it first.
    tmax : float
    prepared : str
        As `rtbench.compiled.layout.fill` takes it.
    """
    real = REAL_TYPE[precision]
    corners, orig, direction = (
        np.asarray(a, DATA_TYPE[precision]).astype(real) for a in (triangles, origins, directions)
    )
    with np.errstate(all="ignore"):
        tri = SimpleNamespace(**{f"v{i}": _vector(corners[:, i]) for i in range(3)})
        if kernel.prepare is not None:
            arithmetic = np.float64 if prepared == "double" else real
            given = {name: _rounded(corner, arithmetic) for name, corner in vars(tri).items()}
            stored = _eager(kernel.prepare)(SimpleNamespace(**given))
            tri = SimpleNamespace(
                **vars(tri) | {name: _rounded(value, real) for name, value in stored.items()}
            )
        orig, direction = _vector(orig), _vector(direction)
        end = tuple(o + d for o, d in zip(orig, direction, strict=True))
        ray = SimpleNamespace(orig=orig, dir=direction, end=end)
    names = _names(syntax.outside_names(kernel), real)
    names |= {"tri": tri, "ray": ray, "tmax": Bounded(real(tmax))}
    n = len(corners)
    found = Run(np.full(n, -1), np.zeros(n, bool), np.zeros(n, bool))
    nothing = np.full(n, np.nan)
    found.outputs = {name: (nothing.copy(), nothing.copy()) for name in kernel.outputs}
    everywhere = np.ones(n, bool)
    with np.errstate(all="ignore"):
        _follow(kernel, syntax.tree(kernel).body, names, everywhere, everywhere, found)
    return found


def _vector(columns: np.ndarray) -> tuple[Bounded, ...]:
    return tuple(Bounded(np.ascontiguousarray(column)) for column in columns.T)


def _rounded(stored: object, dtype: type) -> object:
    if isinstance(stored, tuple):
        return tuple(each.astype(dtype) for each in stored)
    return stored.astype(dtype) if isinstance(stored, Bounded) else stored


def _names(read: dict[str, object], real: type) -> dict[str, object]:
    """Return what stands for the names that a kernel reads from its module."""
    found = dict(CALLS)
    for name, value in read.items():
        if isinstance(value, FunctionType):
            found[name] = _eager(value, real)
        elif isinstance(value, float):
            value = float(OF_ARITHMETIC[name](real)) if name in OF_ARITHMETIC else value
            found[name] = Bounded(real(value), abs(value) if name in STANDS_FOR_0 else 0.0)
        elif not isinstance(value, ModuleType):
            found[name] = value
    return found


def _eager(function: Callable, real: type = np.float64) -> Callable:
    """Return a plain function that takes and returns Bounded numbers."""
    tree = syntax.parse(function)
    around = function.__globals__
    read = {name: around[name] for name in syntax.names(tree)[0] if name in around}
    names = _names(read, real)
    module = ast.Module([_Eager().visit(tree)], [])
    exec(compile(ast.fix_missing_locations(module), f"<{function.__name__}>", "exec"), names)
    return names[tree.name]


def _follow(kernel, body, names, computed, possible, found) -> None:
    """Follow statements for the pairs that come here, and for those that might without rounding.

    Bounds hold wherever values are computed: what pairs that are elsewhere come to is not used.
    """
    if not (computed.any() or possible.any()):
        return
    for position, statement in enumerate(body):
        if isinstance(statement, ast.Assign):
            target, value = statement.targets[0], _evaluated(statement.value, names)
            if isinstance(target, ast.Tuple):
                names |= {each.id: one for each, one in zip(target.elts, value, strict=True)}
            else:
                names[target.id] = value
        elif isinstance(statement, ast.If):
            test = _evaluated(statement.test, names)
            after = body[position + 1 :]
            for branch, taken in ((statement.body, test), (statement.orelse, ~test)):
                _follow(
                    kernel,
                    [*branch, *after],
                    dict(names),
                    computed & taken.computed,
                    possible & (taken.computed | ~taken.sure),
                    found,
                )
            return
        elif isinstance(statement, ast.Return):
            _end(kernel, statement.value.elts, names, computed, possible, found)
            return
        elif not isinstance(statement, ast.Expr):
            raise NotImplementedError(ast.unparse(statement))


def _end(kernel, returned, names, computed, possible, found) -> None:
    code = returned[0]
    if isinstance(code, ast.IfExp):  # HIT if hit else 1
        test = _evaluated(code.test, names)
        for each, taken in ((code.body, test), (code.orelse, ~test)):
            here = computed & taken.computed, possible & (taken.computed | ~taken.sure)
            _end(kernel, [each, *returned[1:]], names, *here, found)
        return
    code = code.value if isinstance(code, ast.Constant) else names[code.id]
    found.outcome[computed] = code
    found.may_hit[possible] |= code in (HIT, UNDECIDED)
    found.may_miss[possible] |= code != HIT
    if code == HIT:
        for name, node in zip(kernel.outputs, returned[1:], strict=True):
            output = _evaluated(node, names)
            for whole, part in zip(found.outputs[name], (output.value, output.error), strict=True):
                whole[computed] = np.broadcast_to(part, computed.shape)[computed]


def _evaluated(node: ast.expr, names: dict[str, object]) -> object:
    expression = ast.Expression(_Eager().visit(ast.parse(ast.unparse(node), mode="eval").body))
    return eval(compile(ast.fix_missing_locations(expression), "<kernel>", "eval"), names)


def _reduced(tests, combine) -> Truth:
    first, *others = tests
    for other in others:
        first = combine(first, other)
    return first


class _Eager(ast.NodeTransformer):
    """Make calls of what Python decides for one pair at a time: if-else, and, or, not."""

    def visit_IfExp(self, node: ast.IfExp) -> ast.Call:
        self.generic_visit(node)
        return _call("choose", node.test, node.body, node.orelse)

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.slice, ast.Constant):
            return node
        return _call("pick", node.value, node.slice)

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.Call:
        self.generic_visit(node)
        return _call("both" if isinstance(node.op, ast.And) else "either", *node.values)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        return ast.UnaryOp(ast.Invert(), node.operand) if isinstance(node.op, ast.Not) else node


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])
