"""The loop around a kernel, and a kernel made into it.

One loop nest serves every order of the tests, so that the compiler can lift nothing out:
k = first[a] + second[b]. In repeat order ``first`` holds the pairs and ``second`` zeros (each
pair many times in a row, as ray_test.exe of 2007 did it); in sweep order ``first`` holds zeros
and ``second`` the shuffled pairs, or a longer list in which each stands many times.
"""

from __future__ import annotations

import ast
import functools
import re
from types import FunctionType, ModuleType

import numpy as np

from rtbench.compiled import stages, syntax
from rtbench.compiled.instantiate import HEADER_NAMES, Instance, instantiate
from rtbench.compiled.layout import DATA_TYPE, REAL_TYPE, record_types
from rtbench.compiled.machine_code import instructions
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import NO_T, ZERO, Kernel, kernel

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
RETURNS_UV = False


def test(tri, ray):  # the kernel
    return 0, 0.0


def nest(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            result = test(triangles[k], rays[k])
            # Every output reaches memory: one that nobody reads would be optimised away.
            outcome[k] = result[0]
            t[k] = result[1]
            if RETURNS_UV:
                u[k] = result[2]
                v[k] = result[3]


def chain(triangles, rays, first, second, outcome, t, u, v):
    # No t lies below the limit, but only the result itself tells the processor so: the next pair's
    # address waits for it, as a traversal waits for its tmax.
    limit = -REAL(first.shape[0]) * REAL(1e30)
    late = np.uint64(0)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b] + late
            result = test(triangles[k], rays[k])
            late = np.uint64(result[1] < limit)
            outcome[k] = result[0]
            t[k] = result[1]
            if RETURNS_UV:
                u[k] = result[2]
                v[k] = result[3]


LOOPS = {"independent": nest, "dependent": chain}


@kernel(
    title="the loop alone",
    method="empty",
    domain="line",
    outcomes=("hit", "miss"),
    source="what is left of the loop when nothing is tested",
)
def empty(tri, ray):
    return 1, NO_T


@functools.cache
def loop(
    chosen: Kernel,
    precision: str = "float32",
    layout: str = "shared",
    stage: str | None = None,
    kind: str = "independent",
) -> Instance:
    """Return the compiled loop over one kernel.

    Parameters
    ----------
    chosen : Kernel
    precision : str
        float32, float64 or mixed.
    layout : str
        shared or own.
    stage : str, optional
        Cut the kernel off where this stage ends.
    kind : str
        ``independent`` tests, or ``dependent`` ones (each waits for the t of the one before).

    Returns
    -------
    Instance
        ``call(triangles, rays, first, second, outcome, t, u, v)``: records as
        :func:`rtbench.compiled.layout.fill` makes them, uint64 indices (A,) and (B,), and the
        outputs int32 (N,) and three arrays (N,) of the arithmetic's precision; u and v may be
        of length 0 where the kernel does not return them. Runs A x B tests without the GIL.
    """
    triangle, ray = record_types(chosen, layout, precision)
    function = syntax.tree(chosen) if stage is None else stages.cut(chosen, stage)
    entry = f"{chosen.name}_loop"
    constants = {
        "REAL": f"np.{REAL_TYPE[precision].__name__}",
        "RETURNS_UV": str(chosen.outputs == ("t", "u", "v")),
        "TRIANGLE": _dtype_source(triangle),
        "RAY": _dtype_source(ray),
    }
    taken = {*constants, *HEADER_NAMES, "test", entry}
    callees = {}
    for name, value in ({"ZERO": ZERO} | syntax.outside_names(chosen)).items():
        if name in taken and not isinstance(value, ModuleType):
            raise RtbenchError(
                f"kernel {chosen.name!r} reads {name!r}, which the generated module needs for "
                "itself: rename it"
            )
        if isinstance(value, FunctionType):
            callees[name] = value
        elif isinstance(value, ModuleType):
            constants[name] = value.__name__.replace("numpy", "np")
        else:
            constants[name] = _constant_source(value)
    if DATA_TYPE[precision] is REAL_TYPE[precision]:
        sources = [
            _named(syntax.typed(syntax.parse(value)), name) for name, value in callees.items()
        ]
    else:
        scalars = frozenset(
            name
            for dtype in (triangle, ray)
            for name in dtype.names
            if dtype[name].kind == "f" and not dtype[name].shape
        )
        function = syntax.widened(function, scalars)
        sources = [
            _named(syntax.typed(syntax.widened(syntax.parse(value), scalars)), name)
            for name, value in callees.items()
        ]
    what = f"{chosen.name} in {precision}, records: {layout}, tests: {kind}"
    real = constants["REAL"].removeprefix("np.")
    try:
        return instantiate(
            _named(syntax.parse(LOOPS[kind]), entry),
            callees=(*sources, _named(syntax.typed(function), "test")),
            constants=constants,
            signature=(
                "void(TRIANGLE[::1], RAY[::1], uint64[::1], uint64[::1], int32[::1], "
                f"{real}[::1], {real}[::1], {real}[::1])"
            ),
            title=what if stage is None else f"{what}, cut off after {stage!r}",
            forceinline=True,
        )
    except Exception as problem:
        from numba.core.errors import NumbaError  # numba is there by now; nobody else waits for it

        if not isinstance(problem, NumbaError):
            raise
        lines = [line for line in str(problem).splitlines() if line.strip()]
        told = next((line for line in lines if not line.startswith("Failed in")), lines[0])
        raise RtbenchError(f"kernel {chosen.name!r} does not compile: {told}") from problem


def _named(function: ast.FunctionDef, name: str) -> str:
    return _renamed(ast.unparse(function) + "\n", name)


def _renamed(source: str, name: str) -> str:
    return re.sub(r"^def \w+", f"def {name}", source, count=1)


def _dtype_source(dtype: np.dtype) -> str:
    columns = [(name, dtype[name].base.str, dtype[name].shape) for name in dtype.names]
    return f"from_dtype(np.dtype({columns!r}, align=True))"


def _constant_source(value: float) -> str:
    if isinstance(value, float):
        return f"REAL({value!r})" if np.isfinite(value) else f"REAL('{value!r}')"
    return repr(value)


def machine_code(chosen: Kernel, precision: str, layout: str) -> str:
    """Return the machine code of a kernel's loop as text, written when it was compiled."""
    return "\n".join(instructions(loop(chosen, precision, layout).assembly))
