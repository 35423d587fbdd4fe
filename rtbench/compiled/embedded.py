"""A kernel's test as generated modules call it: its sources, constants and records.

Whoever makes a module around a kernel (loops, packets, walks through trees) writes ``test`` and
gets the kernel in its place: ``test(tri, ray, tmax)`` or, of kernels that take no tmax,
``test(tri, ray)``, which gives ``(outcome, *outputs)``; in lanes, see `rtbench.compiled.packets`,
``(hit, *outputs)``. Where the kernel is a filter, its fallback stands behind it.
"""

from __future__ import annotations

import ast
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from rtbench.compiled import sources, syntax
from rtbench.compiled.instantiate import HEADER_NAMES
from rtbench.compiled.layout import DATA_TYPE, REAL_TYPE
from rtbench.compiled.sources import OF_ARITHMETIC, dtype_source, named
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import UNDECIDED, ZERO, Kernel

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
RETURNS_THREE = False

STAND_INS = ("test", "filtered", "fallback")
IN_REAL = {*OF_ARITHMETIC, "ZERO", "ONE", "EPSILON"}  # also where a fallback reads them


def filtered(tri, ray, tmax):  # the kernel where it has a fallback
    return 0, 0.0, 0.0, 0.0


def fallback(v0, v1, v2, orig, dir, tmax):  # the fallback
    return 0, 0.0, 0.0, 0.0


def decided(tri, ray, tmax):  # becomes ``test`` then
    result = filtered(tri, ray, tmax)
    if result[0] != UNDECIDED:
        return result
    sure = fallback(
        (REAL(tri.v0[0]), REAL(tri.v0[1]), REAL(tri.v0[2])),
        (REAL(tri.v1[0]), REAL(tri.v1[1]), REAL(tri.v1[2])),
        (REAL(tri.v2[0]), REAL(tri.v2[1]), REAL(tri.v2[2])),
        (REAL(ray.orig[0]), REAL(ray.orig[1]), REAL(ray.orig[2])),
        (REAL(ray.dir[0]), REAL(ray.dir[1]), REAL(ray.dir[2])),
        tmax,
    )
    if RETURNS_THREE:
        return sure[0], REAL(sure[1]), REAL(sure[2]), REAL(sure[3])
    return sure[0], REAL(sure[1])


@dataclass(frozen=True)
class Embedded:
    """What a generated module needs to call a kernel's ``test``.

    Attributes
    ----------
    constants : dict of str to str
    callees : tuple of str
        Sources, each after what it calls; the last is ``test``.
    outlined : tuple of str
        Those of them that need not be inlined.
    imports : str
        A line for the module's top; empty where nothing is imported.
    """

    constants: dict[str, str]
    callees: tuple[str, ...]
    outlined: tuple[str, ...]
    imports: str


def in_numbers(
    kernel: Kernel,
    precision: str,
    triangle: np.dtype,
    ray: np.dtype,
    taken: tuple[str, ...] = (),
    function: ast.FunctionDef | None = None,
) -> Embedded:
    """Return a kernel over records of one triangle and one ray.

    Parameters
    ----------
    kernel : Kernel
    precision : str
        float32, float64 or mixed.
    triangle, ray : dtype
        Records, as `rtbench.compiled.layout.record_types` gives them.
    taken : tuple of str
        Names that the module needs for itself.
    function : ast.FunctionDef, optional
        In place of the kernel's own, such as one of its stages.
    """
    function = syntax.tree(kernel) if function is None else function
    constants = {
        "REAL": f"np.{REAL_TYPE[precision].__name__}",
        "TAKES_TMAX": str(kernel.takes_tmax),
        "DIVIDED_LAST": str(kernel.divided_last),
        "RETURNS_T": str(len(kernel.outputs) > 0),
        "RETURNS_THREE": str(len(kernel.outputs) == 3),
        "TRIANGLE": dtype_source(triangle),
        "RAY": dtype_source(ray),
    }
    taken = {*constants, *HEADER_NAMES, *STAND_INS, *taken}
    read = {"ZERO": ZERO} | syntax.outside_names(kernel)
    told, functions = sources.outside(f"kernel {kernel.name!r}", read, taken)
    behind, outlined = behind_filter(kernel, taken)
    told = behind | told
    outlined = {name: text for name, text in outlined.items() if name not in functions}
    imported, digest = sources.imports(read)
    constants |= told | digest
    if DATA_TYPE[precision] is not REAL_TYPE[precision]:
        scalars = frozenset(
            name
            for dtype in (triangle, ray)
            for name in dtype.names
            if dtype[name].kind == "f" and not dtype[name].shape
        )
        function = syntax.widened(function, scalars)
        functions = {name: syntax.widened(each, scalars) for name, each in functions.items()}
    tests = [named(syntax.typed(function), "test")]
    if kernel.fallback is not None:
        filter_alone = named(syntax.typed(function), "filtered")
        tests = [filter_alone, *outlined.values(), named(syntax.parse(decided), "test")]
    called = (named(syntax.typed(each), name) for name, each in functions.items())
    return Embedded(constants, (*called, *tests), tuple(outlined), imported)


def behind_filter(kernel: Kernel, taken: set[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return what a kernel's fallback needs in a generated module; nothing without one.

    Parameters
    ----------
    kernel : Kernel
    taken : set of str
        Names that the module needs for itself.

    Returns
    -------
    constants : dict of str to str
    functions : dict of str to str
        Sources by name, callees first, ``fallback`` last. They say themselves what they compute
        in float64.
    """
    if kernel.fallback is None:
        return {}, {}
    what = f"fallback of kernel {kernel.name!r}"
    found = {"UNDECIDED": UNDECIDED} | syntax.fallback_names(kernel)
    constants, functions = sources.outside(what, found, taken)
    texts = {name: named(each, name) for name, each in functions.items()}
    constants |= {
        name: repr(value)
        for name, value in found.items()
        if isinstance(value, float) and np.isfinite(value) and name not in IN_REAL
    }
    return constants, texts | {"fallback": named(syntax.parse(kernel.fallback), "fallback")}


@contextmanager
def refused_in_a_line(kernel: Kernel, where: str = ""):
    """Turn numba's pages about a kernel that does not compile into one line.

    Raises
    ------
    RtbenchError
    """
    try:
        yield
    except Exception as problem:
        from numba.core.errors import NumbaError  # numba is there by now; nobody else waits for it

        if not isinstance(problem, NumbaError):
            raise
        lines = [line for line in str(problem).splitlines() if line.strip()]
        told = next((line for line in lines if not line.startswith("Failed in")), lines[0])
        raise RtbenchError(f"kernel {kernel.name!r} does not compile{where}: {told}") from problem
