"""The loops around a kernel taken in lanes: pairs, packets of rays, groups of triangles.

Havel 2008, sections 4.2.2 (Text 3), 4.2.3 to 4.2.5 and 5.1.3. In every form each lane does what
the scalar loops of `rtbench.compiled.loops` do, operation by operation. Two things may differ in
the last place where division comes last, since there tmax times a denominator is rounded: with
groups of triangles, and with triangles sorted by axis, a lane's tmax is not yet that of the
nearest hit of all triangles of lower index.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtbench.compiled import (
    embedded,
    lanes,
    packet_loops,
    packing,
    sources,
    syntax,
    vector_functions,
    vectors,
)
from rtbench.compiled.embedded import Embedded
from rtbench.compiled.instantiate import HEADER_NAMES, Instance, instantiate
from rtbench.compiled.layout import REAL_TYPE
from rtbench.compiled.packing import Packing
from rtbench.compiled.sources import dtype_source, named
from rtbench.kernels.contract import HIT, NO_T, ZERO, Kernel

NAMES = ("any_lane", "choose", "column", "first_lane", "flipped", "greater", "lane", "least")
NAMES += ("lesser", "next_up", "one_of", "opposite", "reciprocal", "replaced", "row", "spread")
NAMES += ("store",)
STAND_INS = ("test", "filtered", "resolved", "fallback", "start")


@functools.cache
def loop(kernel: Kernel, precision: str, chosen: Packing, count: int = 0) -> Instance:
    """Return the compiled loop over a kernel in lanes.

    Parameters
    ----------
    kernel : Kernel
        One that takes tmax and does not branch but for exits; these become masks.
    precision : str
        float32 or float64.
    chosen : Packing
    count : int
        With layout soa: how many triangles (form triangles), rays (rays) or pairs there are, as
        `packing.fill_triangles` and `fill_rays` lay them out.

    Returns
    -------
    Instance
        ``call(triangles, rays, first, second, outcome, t, u, v)``: records of `packing`, uint64
        indices of packets, blocks or (form triangles) rays, and the outputs: (P, W), in form
        triangles (R,), u and v of no length where the kernel does not return them. outcome is 0
        for a hit and 1 for a miss in form pairs, else the index of the nearest triangle, -1 for
        none; t is then the ray's tmax, u and v 0.

    Raises
    ------
    RtbenchError
        For a kernel that cannot be taken in lanes, and what `Packing` does not allow.
    """
    entry = f"{kernel.name}_{chosen.form}"
    inside = embedded_test(kernel, precision, chosen, count, (entry,))
    function = packet_loops.placed(chosen, list(inside.names), count)
    real = inside.constants["REAL"].removeprefix("np.")
    outputs = "[::1]" if chosen.form == "triangles" else "[:, ::1]"
    with embedded.refused_in_a_line(kernel, " in lanes"):
        return instantiate(
            inside.source(function, entry),
            callees=inside.callees,
            constants=inside.constants | {"SORTED": str(packing.is_sorted(kernel, chosen))},
            signature=(
                "void(TRIANGLE[::1], RAY[::1], uint64[::1], uint64[::1], "
                f"int32{outputs}, {real}{outputs}, {real}{outputs}, {real}{outputs})"
            ),
            title=_title(kernel, precision, chosen),
            forceinline=True,
            outlined=inside.outlined,
            imports=inside.imports,
        )


@dataclass(frozen=True)
class EmbeddedLanes(Embedded):
    """A kernel's ``test`` in lanes; ``source`` gives that of a function around it under a name."""

    names: tuple[str, ...]
    source: Callable[[ast.FunctionDef, str], str]


def embedded_test(
    kernel: Kernel, precision: str, chosen: Packing, count: int = 0, taken: tuple[str, ...] = ()
) -> EmbeddedLanes:
    """Return a kernel's test over W lanes as a generated module calls it.

    Parameters
    ----------
    kernel, precision, chosen, count
        As for `loop`.
    taken : tuple of str
        Names that the module needs for itself.

    Raises
    ------
    RtbenchError
        As `loop`.
    """
    packing.check_precision(precision, chosen.reciprocal)
    kept = lanes.masked(kernel, chosen.exit)
    triangle = packing.triangle_type(kernel, precision, chosen, count)
    ray = packing.ray_type(kernel, precision, chosen, count)
    sides = packing.tri_side(kernel, chosen, triangle), packing.ray_side(chosen, ray)
    estimate = chosen.reciprocal == "estimate"
    constants = {
        "REAL": f"np.{REAL_TYPE[precision].__name__}",
        "WIDTH": str(chosen.width),
        "RETURNS_THREE": str(len(kernel.outputs) == 3),
        "DIVIDED_LAST": str(kernel.divided_last),
        "TRIANGLE": dtype_source(triangle),
        "RAY": dtype_source(ray),
        "VECTORS": repr(vectors_digest()),
    }
    constants |= {
        f"TABLE_{name.upper()}": f"np.array({values}, np.uint32)"
        for name, values in packing.axis_fields(kernel).items()
        if chosen.axes == "table"
    }
    taken = {*constants, *HEADER_NAMES, *NAMES, *STAND_INS, *taken} - {"flipped"}
    found = {"ZERO": ZERO, "NO_T": NO_T, "HIT": HIT} | syntax.outside_names(kernel)
    told, helpers = sources.outside(f"kernel {kernel.name!r}", found, taken)
    behind, outlined = embedded.behind_filter(kernel, taken)
    outlined = {name: text for name, text in outlined.items() if name not in helpers}
    constants |= behind | told

    def source(function: ast.FunctionDef, name: str) -> str:
        return named(syntax.typed(lanes.in_lanes(function, *sides, estimate)), name)

    if chosen.layout == "soa":
        kept.args.args.append(ast.arg("start"))
    tests = {"test": source(kept, "test")}
    if kernel.fallback:
        outlined = {"filtered": source(kept, "filtered")} | outlined
        asking = packet_loops.behind(chosen, count)
        outlined["resolved"] = source(asking["resolved"], "resolved")
        tests["test"] = source(asking["test"], "test")
    if chosen.axes == "fixed" and packing.axis_fields(kernel):
        tests = {f"test_{axis}": _fixed(tests["test"], kernel, axis) for axis in range(3)}
    return EmbeddedLanes(
        constants,
        (
            *(source(each, name) for name, each in helpers.items()),
            *outlined.values(),
            *tests.values(),
        ),
        tuple(name for name in outlined if name != "filtered"),
        f"from rtbench.compiled.vector_functions import {', '.join(NAMES)}",
        tuple(tests),
        source,
    )


def run_once(
    instance: Instance,
    kernel: Kernel,
    precision: str,
    chosen: Packing,
    records: tuple[np.ndarray, np.ndarray],
    count: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Run a loop once over all packets, blocks or rays.

    Parameters
    ----------
    instance : Instance
        What `loop` made of the kernel, precision and packing.
    kernel, precision, chosen
        What it was made of.
    records : two structured arrays
        Triangles and rays as `packing` fills them.
    count : int
        How many rays or pairs they hold.

    Returns
    -------
    outcome, t, u, v
        As `loop` says: (P, W), or (R,) with groups of triangles; u and v of no length where the
        kernel does not return them.
    """
    alone = chosen.form == "triangles"
    shape = (count,) if alone else (count // chosen.width, chosen.width)
    none = (0,) * len(shape)
    real = REAL_TYPE[precision]
    outcome, t = np.full(shape, -2, np.int32), np.zeros(shape, real)
    u, v = (np.zeros(shape if len(kernel.outputs) == 3 else none, real) for _ in range(2))
    places = np.arange(shape[0], dtype=np.uint64)
    instance.call(*records, np.zeros(1, np.uint64), places, outcome, t, u, v)
    return outcome, t, u, v


def vectors_digest() -> str:
    """Return a digest of what a generated module imports and does not hold itself."""
    sources = [inspect.getsource(each) for each in (vectors, vector_functions)]
    return hashlib.sha256("".join(sources).encode()).hexdigest()[:16]


def _title(kernel: Kernel, precision: str, chosen: Packing) -> str:
    what = [f"{kernel.name} in {precision}", f"{packing.FORMS[chosen.form]}, W = {chosen.width}"]
    what += [f"{chosen.packet} packets"] if chosen.form == "rays" else []
    what += [f"records: {chosen.layout}", f"exit: {chosen.exit}", f"axes: {chosen.axes}"]
    return "; ".join([*what, f"reciprocal: {chosen.reciprocal}"])


def _fixed(text: str, kernel: Kernel, axis: int) -> str:
    """Return the test of one axis of projection, its axes written out."""
    for name, values in packing.axis_fields(kernel).items():
        text = text.replace(f"FIXED_{name.upper()}", str(values[axis]))
    return text.replace("def test(", f"def test_{axis}(")
