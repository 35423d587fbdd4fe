"""What walks of many rays at a time share: how rays enter, what is done in leaves, how one is made.

Rays are fetched W at a time and enter in lanes, as `rtbench.trees.traversal.entering.enter` lets
one enter; leaves are in blocks, each of which is tested against one ray.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable

import numpy as np

from rtbench.compiled import packing, syntax, vector_memory
from rtbench.compiled.embedded import refused_in_a_line
from rtbench.compiled.instantiate import Instance, instantiate, source_of
from rtbench.compiled.lanes import Side, in_lanes
from rtbench.compiled.sources import named
from rtbench.compiled.vector_bits import bits_of
from rtbench.compiled.vector_functions import any_lane, choose, first_lane, lane, least, spread
from rtbench.compiled.vector_memory import load, save
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import ZERO, Kernel
from rtbench.trees import leaves
from rtbench.trees.traversal import entering, walks

OF_ENTERING = ("not_greater", "enter")
NAMES = ("bits_and", "bits_of", "bits_or", "float_of_bits", "gather", "high_half", "how_many")
NAMES += ("as_double", "as_single", "joined_halves", "load", "low_half", "lowest_bit", "mask_of")
NAMES += ("prefetch", "save", "scatter", "shifted_left", "shifted_right", "signed")
IMPORT = vector_memory.imports(NAMES)
LINE = 64  # bytes that come from memory at once
MOST_LINES = 12

# Stand-ins for what each generated module puts at its top.
LANES, WIDTH = 16, 8
RETURNS_THREE = False
NO_INDEX = np.int32(0x7FFFFFFF)


def test(tri, ray, tmax):  # the kernel
    return False, 0.0, 0.0, 0.0


def lanes_enter(orig, dir, tmax, scene, line):  # what `entering_in_lanes` makes
    return False, np.float32(0), 0.0, 0.0, 0.0, 0.0


def nearest_of_blocks(refs, triangles, begin, end, ray, index, t, u, v):
    """Return index, t, u, v of the nearest hit after blocks begin to end were asked.

    Each lane keeps its own nearest: there is one branch in all, not one a block.
    """
    best, found = spread(t, WIDTH), spread(index, WIDTH)
    best_u = best_v = spread(ZERO, WIDTH)
    for k in range(begin, end):
        tri = triangles[k]
        result = test(tri, ray, spread(ray.tmax, WIDTH))
        near = result[0] & (result[1] > ZERO) & (result[1] < ray.tmax)
        near = near & ((result[1] < best) | ((result[1] == best) & (tri.index < found)))
        best, found = choose(near, result[1], best), choose(near, tri.index, found)
        if RETURNS_THREE:
            best_u, best_v = choose(near, result[2], best_u), choose(near, result[3], best_v)
    changed = found != index
    if any_lane(changed):
        nearest = least(best)
        changed = changed & (best == nearest)
        i = least(choose(changed, found, NO_INDEX))
        if nearest < t or i < index:
            index, t = i, nearest
            if RETURNS_THREE:
                place = first_lane(changed & (found == i))
                u, v = lane(best_u, place), lane(best_v, place)
    return index, t, u, v


def fetch(rays, first, second, a, b, scene, who, numbers, ready_lines, ready):
    """Let the next rays enter, as many as there are lanes; return which do, which do not, a, b."""
    there = np.uint32(0)
    for j in range(LANES):
        if a < first.shape[0]:
            k = np.int64(first[a] + second[b])
            there |= np.uint32(1) << np.uint32(j)
            who[j] = k
            ray = rays[k]
            for axis in range(3):
                numbers[axis * LANES + j] = ray.orig[axis]
                numbers[(3 + axis) * LANES + j] = ray.dir[axis]
            numbers[6 * LANES + j] = ray.tmax
            b += 1
            if b == second.shape[0]:
                a, b = a + 1, 0
    enters, exit, start, size, slack, _ = lanes_enter(
        (load(numbers, 0, LANES), load(numbers, LANES, LANES), load(numbers, 2 * LANES, LANES)),
        (
            load(numbers, 3 * LANES, LANES),
            load(numbers, 4 * LANES, LANES),
            load(numbers, 5 * LANES, LANES),
        ),
        load(numbers, 6 * LANES, LANES),
        scene,
        ready_lines,
    )
    save(ready_lines, 9 * LANES, exit)
    save(ready, 0, start)
    save(ready, LANES, size)
    save(ready, 2 * LANES, slack)
    return there & bits_of(enters), there & ~bits_of(enters), a, b


class _OfLanes(ast.NodeTransformer):
    """Rewrites functions of `rtbench.trees.traversal.entering` that `in_lanes` has rewritten."""

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        told = ast.unparse(node.func)
        name = {"np.float64": "as_double", "np.float32": "as_single"}.get(told, told)
        if name in OF_ENTERING:
            name = f"lanes_{name}"
        return ast.Call(ast.Name(name, ast.Load()), node.args, [])

    def visit_Assign(self, node: ast.Assign) -> ast.stmt:
        self.generic_visit(node)
        (target,) = node.targets
        if not isinstance(target, ast.Subscript):
            return node
        place = f"{ast.unparse(target.slice)} * LANES"
        return ast.parse(f"save(line, {place}, {ast.unparse(node.value)})").body[0]


def entering_in_lanes() -> tuple[str, ...]:
    """Return the source of ``lanes_enter``, which is `entering.enter` of lanes, and its callees."""
    functions = [syntax.parse(getattr(entering, name)) for name in OF_ENTERING]
    return tuple(
        named(_OfLanes().visit(in_lanes(each, Side(), Side())), f"lanes_{each.name}")
        for each in functions
    )


def compiled(
    kernel: Kernel,
    precision: str,
    query: str,
    counted: bool,
    entry: Callable,
    callees: tuple[Callable, ...],
    constants: dict[str, str],
    title: str,
) -> Instance:
    """Return a compiled walk.

    Parameters
    ----------
    kernel, precision, query, counted
        As for `rtbench.trees.traversal.walks.walk`; leaves are in blocks.
    entry : callable
        The walk; ``in_leaf`` stands for what is done in a leaf, for which query.
    callees : tuple of callables
        Functions that it calls, besides those of every walk.
    constants : dict of str to str
        What they read; LANES among it.
    title : str
        For the module's first line.

    Raises
    ------
    RtbenchError
        Also for a kernel that `rtbench.trees.leaves.in_blocks` does not accept.
    """
    if query not in walks.QUERIES:
        raise RtbenchError(unknown("query", query, walks.QUERIES))
    own = {
        "NEAREST": str(query == "nearest"),
        "NONE": "np.int32(-1)" if query == "nearest" else "np.int32(0)",
        "DEPTH": "64",
        "NODE": leaves.NODE_SOURCE,
        "MEMORY": repr(vector_memory.digest()),
        **constants,
    }
    taken = (*walks.TAKEN, *own, *NAMES, *(each.__name__ for each in (entry, *callees)))
    inside = leaves.test_of(kernel, precision, leaves.IN_BLOCKS, taken)
    parts = walks.leaf_parts(kernel, precision, query, leaves.IN_BLOCKS, counted)
    functions = {re.match(r"def (\w+)", text)[1]: text for text in parts.callees}
    if query == "nearest":
        leaf = syntax.parse(nearest_of_blocks)
        functions["nearest_in_leaf"] = inside.source(leaf, "nearest_in_leaf")

    def source(function: Callable) -> str:
        return source_of(function).replace("in_leaf(", f"{query}_in_leaf(")

    name = f"{kernel.name}_{entry.__module__.rpartition('.')[2]}_{query}"
    with refused_in_a_line(kernel, " in a walk"):
        return instantiate(
            source(entry).replace(f"def {entry.__name__}(", f"def {name}("),
            callees=(
                *functions.values(),
                *entering_in_lanes(),
                *(source(each) for each in (fetch, *callees)),
            ),
            constants=parts.constants | own,
            signature=walks.signature(parts.constants["REAL"].removeprefix("np.")),
            title=f"{kernel.name} in {precision}: {query}, {title}",
            forceinline=True,
            outlined=parts.outlined,
            imports=f"{parts.imports}\n{IMPORT}",
        )


def lines_of_block(kernel: Kernel, precision: str) -> int:
    """Return how many pieces of memory a block of triangles takes, at most MOST_LINES."""
    size = packing.triangle_type(kernel, precision, leaves.BLOCKS, leaves.WIDTH).itemsize
    return min(-(-size // LINE), MOST_LINES)
