"""The loop around a kernel, and a kernel made into it.

One loop nest serves every order of the tests, so that the compiler can lift nothing out:
k = first[a] + second[b]. In repeat order ``first`` holds the pairs and ``second`` zeros (each
pair many times in a row, as ray_test.exe of 2007 did it); in sweep order ``first`` holds zeros
and ``second`` the shuffled pairs, or a longer list in which each stands many times.
"""

from __future__ import annotations

import ast
import functools
from types import FunctionType, ModuleType

import numpy as np

from rtbench.compiled import syntax
from rtbench.compiled.instantiate import Instance, instantiate, source_of
from rtbench.compiled.layout import DATA_TYPE, REAL_TYPE, record_types
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
    function = syntax.tree(chosen) if stage is None else syntax.cut(chosen, stage)
    constants = {
        "REAL": f"np.{REAL_TYPE[precision].__name__}",
        "RETURNS_UV": str(chosen.outputs == ("t", "u", "v")),
        "TRIANGLE": _dtype_source(triangle),
        "RAY": _dtype_source(ray),
    }
    helpers = []
    for name, value in ({"ZERO": ZERO} | syntax.outside_names(chosen)).items():
        if isinstance(value, FunctionType):
            helpers.append(source_of(value))
        elif isinstance(value, ModuleType):
            if value.__name__ not in ("numpy", "math"):
                raise RtbenchError(f"kernel {chosen.name!r} uses module {value.__name__!r}")
            constants[name] = value.__name__.replace("numpy", "np")
        else:
            constants[name] = _constant_source(value)
    if DATA_TYPE[precision] is not REAL_TYPE[precision]:
        integers = {
            name
            for dtype in (triangle, ray)
            for name in dtype.names
            if dtype[name].base.kind in "iu"
        }
        function = syntax.widened(function, frozenset(integers))
    what = f"{chosen.name} in {precision}, records: {layout}, tests: {kind}"
    real = constants["REAL"].removeprefix("np.")
    return instantiate(
        _named(syntax.parse(LOOPS[kind]), chosen.name),
        callees=(*helpers, _named(function, "test")),
        constants=constants,
        signature=(
            "void(TRIANGLE[::1], RAY[::1], uint64[::1], uint64[::1], int32[::1], "
            f"{real}[::1], {real}[::1], {real}[::1])"
        ),
        title=what if stage is None else f"{what}, cut off after {stage!r}",
        forceinline=True,
    )


def _named(function: ast.FunctionDef, name: str) -> str:
    source = ast.unparse(function)
    return source.replace(f"def {function.name}(", f"def {name}(", 1) + "\n"


def _dtype_source(dtype: np.dtype) -> str:
    columns = [(name, dtype[name].base.str, dtype[name].shape) for name in dtype.names]
    return f"from_dtype(np.dtype({columns!r}, align=True))"


def _constant_source(value: float) -> str:
    if isinstance(value, float):
        return f"REAL({value!r})" if np.isfinite(value) else f"REAL('{value!r}')"
    return repr(value)


def machine_code(chosen: Kernel, precision: str, layout: str) -> str:
    """Return the machine code of a kernel's loop as text, written when it was compiled."""
    lines = loop(chosen, precision, layout).assembly.splitlines()
    # The Python wrapper around the loop is of no interest, nor are the linker's tables.
    begin = next(i for i, line in enumerate(lines) if line.endswith(":") and line.startswith("_Z"))
    end = next(i for i, line in enumerate(lines) if ".Lfunc_end" in line and i > begin)
    return "\n".join(lines[begin:end])
