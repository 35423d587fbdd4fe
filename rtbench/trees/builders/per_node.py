"""A k-d tree built cell after cell, depth first: what all builders but the presorted one share.

The references of all cells that wait lie one after the other in one arena, those of the cell
being cut at its end: its right part stays there, its left part goes on top and is cut next. So a
build takes little more memory than the references of the root.

Compiled code works in steps that end now and then, so that Python can report progress, be
interrupted, and enlarge arrays; what a step has done so far is all in arrays.

A builder is a function ``find_plane(held, begin, count, depth, cell, choice, model, floats,
doubles, unfinished) -> (cost, axis, position, side)``:

held : (R, 6) float32 array, the references' boxes; the cell's are ``held[begin:begin + count]``.
depth : int
cell : 6 float32, its bounds: lx, ly, lz, ux, uy, uz.
choice : axes (ALL, LONGEST, ROUND_ROBIN), half, flat_cells, and one number that is the builder's.
model : see `rtbench.trees.cost`.
floats, doubles : scratch, float32 5 times as many as triangles, float64 as many, at least 64.
unfinished : (8,) float64 array, zeros at first: for builders that stop in between; they return
    axis UNFINISHED and are called again.
cost : float64, of the cell if it is cut there.
axis : int, NONE where no plane is allowed.
position : float32
side : int, 0 where triangles in the plane go left, 1 where right.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.errors import RtbenchError
from rtbench.trees import cost
from rtbench.trees.builders import cells, planes, sorting
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import MOST_IN_LEAF, MOST_LINKS, NODE, KdTree
from rtbench.trees.options import DEEPEST, Options
from rtbench.trees.overlap import fit_sources

WORK = 200_000  # references looked at in a step: some hundredths of a second
LEAST_DOUBLES = 64
MOST_IN_ARENA = (1 << 31) - 1
AXES = {"all": planes.ALL, "longest": planes.LONGEST, "round_robin": planes.ROUND_ROBIN}


@functools.cache
def compiled(
    find: Callable, callees: tuple[Callable, ...], overlap: str, real: str, planar_in_both: bool
) -> Instance:
    """Return the step compiled for a builder, an overlap test and the type of the corners."""
    return instantiate(
        cells.step,
        signature=f"int64({real}[:, :, ::1], {cells.ARGUMENTS})",
        callees=(*cost.CALLEES, *callees, find, *fit_sources(overlap), *cells.CALLEES),
        constants=planes.CONSTANTS
        | sorting.CONSTANTS
        | cells.CONSTANTS
        | {"PLANAR_IN_BOTH": repr(planar_in_both)},
        title=f"A step of building a k-d tree ({find.__module__.rsplit('.', 1)[-1]}, {overlap})",
    )


def build(
    find: Callable,
    callees: tuple[Callable, ...],
    geometry: Geometry,
    options: Options,
    progress: Callable[[float], None] | None = None,
    *,
    own: int = 0,
    planar_in_both: bool = False,
) -> KdTree:
    """Build a k-d tree with a builder's ``find_plane``.

    Parameters
    ----------
    find : callable
        A plain function, see above.
    callees : tuple of callables
        What it calls, callees first.
    geometry : Geometry
        Of at least one triangle.
    options : Options
    progress : callable, optional
        Called now and then with the fraction done.
    own : int
        The builder's own number, ``choice[3]``.
    planar_in_both : bool
        Whether triangles that lie in the plane go to both sides, as Šilhavý's do.

    Returns
    -------
    KdTree

    Raises
    ------
    RtbenchError
        For a tree larger than its links can name.
    """
    count = len(geometry)
    real = str(geometry.corners.dtype)
    step = compiled(find, callees, options.overlap, real, planar_in_both).call
    waiting = DEEPEST + 3
    places, boxes = np.zeros((waiting, 4), np.int64), np.zeros((waiting, 6), np.float32)
    shares, state, done = np.zeros(waiting), np.zeros(4, np.int64), np.zeros(1)
    places[0, 1], boxes[0], shares[0] = count, geometry.box, 1.0
    state[cells.WAITING] = state[cells.NODES] = 1
    ids, held = np.empty(2 * count, np.int32), np.empty((2 * count, 6), np.float32)
    ids[:count], held[:count] = np.arange(count), geometry.boxes
    nodes, refs = np.zeros(2 * count + 1, NODE), np.empty(2 * count, np.int32)
    choice = np.array(
        [AXES[options.axes], options.candidates == "half", options.flat_cells, own], np.int64
    )
    by_count = options.ending != "automatic"
    ending = np.array(
        [options.ending != "ad_hoc", options.max_leaf * by_count, options.deepest(count)], np.int64
    )
    floats, doubles = np.empty(5 * count, np.float32), np.empty(max(count, LEAST_DOUBLES))
    scratch = floats, doubles, np.zeros(8), np.empty((2, 12, 3))
    while True:
        words = nodes.view(np.uint32).reshape(-1, 2)
        result = step(
            *(geometry.corners, geometry.base, ids, held, places, boxes, shares),
            *(words, words.view(np.float32), refs, state, done),
            *(choice, ending, np.array(cost.model(options)), *scratch, WORK),
        )
        if result == cells.DONE:
            break
        if result == cells.NODES_FULL:
            nodes = enlarged(nodes, len(nodes) + 2, MOST_LINKS, "nodes")
        elif result == cells.REFS_FULL:
            wanted = state[cells.REFS] + places[state[cells.WAITING] - 1, 1]
            refs = enlarged(refs, int(wanted), MOST_LINKS, "references")
        elif result == cells.ARENA_FULL:
            begin, more = places[state[cells.WAITING] - 1, :2]
            ids = enlarged(ids, int(begin + 2 * more), MOST_IN_ARENA, "waiting references")
            held = enlarged(held, len(ids), len(ids), "")
        elif progress is not None:
            progress(float(done[0]))
    made, written = int(state[cells.NODES]), int(state[cells.REFS])
    tree = KdTree(
        nodes[:made].copy(), refs[:written].copy(), geometry.box, int(state[cells.DEPTH]), options
    )
    if len(tree.leaves[1]) and tree.leaves[1].max() >= MOST_IN_LEAF:
        raise RtbenchError(
            f"a leaf of {tree.leaves[1].max():,} triangles: fewer than {MOST_IN_LEAF:,}"
        )
    return tree


def enlarged(array: np.ndarray, least: int, most: int, what: str) -> np.ndarray:
    """Return an array with more room, at least for so many.

    Raises
    ------
    RtbenchError
        If so many are more than are allowed.
    """
    if least > most:
        raise RtbenchError(
            f"the tree has {least:,} {what}, more than {most:,}: end earlier (max_leaf, max_depth, "
            "a greater traversal_cost)"
        )
    more = np.empty((min(most, max(least, len(array) * 3 // 2)), *array.shape[1:]), array.dtype)
    more[: len(array)] = array
    return more
