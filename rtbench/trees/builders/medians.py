"""Trees whose cells are cut in their middle, or at the median of their triangles.

Spatial median: the cell is halved. Object median: the plane goes through the lower median of the
triangles' middles, each the middle of the triangle's box in this cell, which always lies in it.

With axes ``all`` the three planes are compared by their SAH cost, and the cheapest is taken. With
the others the next axes stand in where the wanted one has no plane that is allowed and separates:
one that leaves every triangle on both sides does not, and cells of duplicates would be cut to
the greatest depth for nothing. The ending ``automatic`` asks for the SAH cost too.

Source: Kaplan 1985; Šilhavý 2010, sections 3.3.1 and 3.3.2
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtbench.trees.builders import per_node, planes, sorting
from rtbench.trees.builders.planes import count_at, extents, judge, wanted_axes
from rtbench.trees.builders.sorting import lower_median
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import KdTree
from rtbench.trees.options import Options

NEVER = planes.NEVER
SPATIAL, OBJECT = 0, 1


def median_plane(held, begin, count, axis, low, high, of_objects, doubles):
    """Return where a cell is cut along an axis, float32."""
    if of_objects:
        for i in range(count):
            at = begin + i
            doubles[i] = (np.float64(held[at, axis]) + np.float64(held[at, axis + 3])) * 0.5
        return np.float32(lower_median(doubles, count))
    return np.float32((np.float64(low) + np.float64(high)) * 0.5)


def find_plane(held, begin, count, depth, cell, choice, model, floats, doubles, unfinished):
    """Find the median plane of a cell: see `rtbench.trees.builders.per_node`."""
    best, best_axis, position, best_side = NEVER, -1, np.float32(0), 0
    first, last = wanted_axes(cell, depth, choice[0])
    size = extents(cell)
    for k in range(3):
        if k > 0 and last - first == 1 and best_axis >= 0:
            break
        axis = (first + k) % 3
        low, high = cell[axis], cell[axis + 3]
        if not low < high:
            continue
        plane = median_plane(held, begin, count, axis, low, high, choice[3] != 0, doubles)
        below, beyond, planar = count_at(held, begin, count, axis, plane)
        cost, side = judge(
            low, high, size, axis, plane, below, beyond, planar, count, choice[2] != 0, model
        )
        if cost < best and (below < count or beyond < count):
            best, best_axis, position, best_side = cost, axis, plane, side
    return best, best_axis, position, best_side


CALLEES = (*sorting.CALLEES, *planes.CALLEES, median_plane)


def build(
    geometry: Geometry, options: Options, progress: Callable[[float], None] | None = None
) -> KdTree:
    """Build a k-d tree by the rule of the options: see `rtbench.trees.building.build`.

    Builder and candidates have no effect.
    """
    own = OBJECT if options.rule == "object_median" else SPATIAL
    return per_node.build(find_plane, CALLEES, geometry, options, progress, own=own)
