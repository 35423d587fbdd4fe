"""Walks through trees, compiled around a kernel."""

from __future__ import annotations

import functools

from rtbench.compiled import syntax
from rtbench.compiled.embedded import Embedded, refused_in_a_line
from rtbench.compiled.instantiate import Instance, instantiate, source_of
from rtbench.compiled.sources import named
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import HIT, ZERO, Kernel
from rtbench.trees import leaves
from rtbench.trees.traversal import (
    brute_force,
    entering,
    leaf_tests,
    mailboxes,
    recursive,
    stack,
)

WAYS = {
    "stack": "one ray at a time, a stack of far halves",
    "recursive": "Šilhavý's algorithm 2",
    "mailboxes": "as stack, but no triangle is tested twice",
    "brute_force": "no tree: every triangle",
}
QUERIES = {"nearest": "the nearest hit", "any": "whether there is a hit"}
_IN_PLAIN = {
    "stack": stack,
    "recursive": recursive,
    "mailboxes": mailboxes,
    "brute_force": brute_force,
}
_LEAF_TESTS = {
    ("nearest", leaves.ONE_BY_ONE): (leaf_tests.ask, leaf_tests.nearest_one_by_one),
    ("any", leaves.ONE_BY_ONE): (leaf_tests.ask, leaf_tests.any_one_by_one),
    ("nearest", leaves.IN_BLOCKS): (leaf_tests.nearest_in_blocks,),
    ("any", leaves.IN_BLOCKS): (leaf_tests.any_in_blocks,),
}
# Names of a walk's module that a kernel must not use for its own.
TAKEN = (
    "ask",
    "halves",
    "limit_of",
    "enter",
    "not_slower",
    "not_greater",
    "nearest_side",
    "DEPTH",
    "NODE",
)
TAKEN += ("nearest_in_leaf", "any_in_leaf", "NO_INDEX", "COUNTED", "TRUE", "FALSE", "ROOT")
TAKEN += ("descend", "nearest_below", "any_below", "nearest_with_mailboxes", "any_with_mailboxes")
TAKEN += tuple(entering.constants("float32"))


@functools.cache
def walk(
    kernel: Kernel,
    precision: str = "float32",
    way: str = "stack",
    query: str = "nearest",
    form: str = leaves.ONE_BY_ONE,
    counted: bool = False,
) -> Instance:
    """Return a compiled walk.

    Parameters
    ----------
    kernel : Kernel
    precision : str
    way : str
        One of WAYS.
    query : str
        One of QUERIES.
    form : str
        How leaves are tested, see `rtbench.trees.leaves`.
    counted : bool
        Count each ray's steps, leaves and tests.

    Returns
    -------
    Instance
        ``call(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts)``:
        what `rtbench.trees.leaves` makes of a tree, the scene as
        `rtbench.trees.traversal.entering.enter` wants it, rays (N,), uint64 indices (A,) and (B,)
        whose sums are the rays to be walked; int32 (N,) for the triangle that is hit (-1: none)
        or, of any hit, 1 or 0; t, u, v (N,) in the precision of the arithmetic, of length 0
        where nothing is written; int32 (N, 3) steps, leaves and tests, or (0, 3).

    Raises
    ------
    RtbenchError
    """
    for what, value, allowed in (("way", way, WAYS), ("query", query, QUERIES)):
        if value not in allowed:
            raise RtbenchError(unknown(what, value, allowed))
    if way == "mailboxes" and form != leaves.ONE_BY_ONE:
        raise RtbenchError(f"mailboxes are for leaves one_by_one, not {form}")
    module = _IN_PLAIN[way]
    parts = leaf_parts(kernel, precision, query, form, counted)
    entry = f"{kernel.name}_{way}_{query}"
    with refused_in_a_line(kernel, " in a walk"):
        return instantiate(
            named(syntax.parse(module.QUERIES[query]), entry),
            callees=(*parts.callees, *module.CALLEES),
            constants=parts.constants
            | {"DEPTH": "64", "NODE": leaves.NODE_SOURCE}
            | getattr(module, "CONSTANTS", {}),
            signature=signature(parts.constants["REAL"].removeprefix("np.")),
            title=f"{kernel.name} in {precision}: {query}, {way}, {form}",
            forceinline=True,
            outlined=(*parts.outlined, *getattr(module, "OUTLINED", ())),
            imports=parts.imports,
        )


def signature(
    real: str, nodes: str = "NODE[::1]", rays: str = "RAY[::1]", of: str = "[::1]"
) -> str:
    """Return the signature of a walk whose arithmetic is ``real``."""
    return (
        f"void({nodes}, int32[::1], TRIANGLE[::1], float64[::1], {rays}, uint64[::1], uint64[::1], "
        f"int32{of}, {real}{of}, {real}{of}, {real}{of}, int32[:, ::1])"
    )


def leaf_parts(kernel: Kernel, precision: str, query: str, form: str, counted: bool):
    """Return what every walk's module holds: the kernel, its leaf test, how rays enter."""
    inside = leaves.test_of(kernel, precision, form, TAKEN)
    *before, leaf_test = _LEAF_TESTS[query, form]
    leaf_source = inside.source if form == leaves.IN_BLOCKS else named
    constants = {
        **entering.constants(precision),
        "HIT": str(HIT),
        "NO_INDEX": "np.int32(0x7FFFFFFF)",
        "COUNTED": str(counted),
        "TRUE": "np.int32(1)",
        "FALSE": "np.int32(0)",
    }
    constants |= {"ZERO": f"REAL({ZERO!r})"}
    return Embedded(
        inside.constants | {k: v for k, v in constants.items() if k not in inside.constants},
        (
            *inside.callees,
            *(source_of(each) for each in before),
            leaf_source(syntax.parse(leaf_test), f"{query}_in_leaf"),
            *(source_of(each) for each in entering.CALLEES),
        ),
        (*inside.outlined, "enter"),
        inside.imports,
    )
