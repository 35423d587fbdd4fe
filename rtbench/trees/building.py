"""From geometry and options to a tree."""

from __future__ import annotations

from collections.abc import Callable

from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import KdTree, one_leaf
from rtbench.trees.options import Options


def build(
    geometry: Geometry,
    options: Options,
    progress: Callable[[float], None] | None = None,
) -> KdTree:
    """Build a k-d tree, or a BVH.

    Parameters
    ----------
    geometry : Geometry
    options : Options
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    KdTree or Bvh
        Of one empty leaf where there are no triangles.

    Raises
    ------
    RtbenchError
        Where a builder refuses so many triangles, and for a tree larger than its links can name.
    """
    if options.structure == "bvh":
        from rtbench.trees.bvh.build import build as chosen

        return chosen(geometry, options, progress)
    if not len(geometry):
        return one_leaf(0, geometry.box, options)
    if options.rule != "sah":
        from rtbench.trees.builders.medians import build as chosen
    elif options.builder == "nlogn":
        from rtbench.trees.builders.nlogn import build as chosen
    elif options.builder == "nlog2n":
        from rtbench.trees.builders.nlog2n import build as chosen
    elif options.builder == "n2":
        from rtbench.trees.builders.n2 import build as chosen
    elif options.builder == "binned":
        from rtbench.trees.builders.binned import build as chosen
    else:
        from rtbench.trees.builders.as_printed import build as chosen
    return chosen(geometry, options, progress)
