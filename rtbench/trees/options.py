"""What can be chosen of a tree."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtbench.errors import RtbenchError, unknown

STRUCTURES = {"kd": "k-d tree", "bvh": "bounding volume hierarchy, 8 boxes a node"}
RULES = {"sah": "SAH", "object_median": "object median", "spatial_median": "spatial median"}
# Of the rule sah; the medians have one builder.
BUILDERS = {
    "nlogn": "O(N log N), sorted once (Wald & Havran 2006)",
    "nlog2n": "O(N log² N), sorted in each node",
    "n2": "O(N²), every triangle counted at every candidate",
    "binned": "32 bins a cell, then sorted in small cells",
    "as_printed": "Šilhavý's algorithm 3 as printed: starts before ends, no planar triangles",
}
AXES = {
    "all": "all three",
    "longest": "the cell's longest",
    "round_robin": "one after the other by depth",
}
CANDIDATES = {
    "all": "both sides of every triangle's box",
    "half": "of each box the side nearer to the object median (Havran 2000)",
}
OVERLAPS = {
    "box": "its bounding box",
    "three_stage": "the thesis's three stages, in the space of the box",
    "three_stage_world": "the thesis's three stages, in world space",
    "separating_axes": "separating axes",
    "clipped": "clipped to the cell",
    "plane_clipped": "clipped by the split plane",
}
ENDINGS = {
    "automatic": "where a split costs more than the leaf",
    "ad_hoc": "by count and depth",
    "both": "whichever comes first",
}
DEEPEST = 62  # however a tree ends: what the stacks hold


@dataclass(frozen=True)
class Options:
    """How a tree is built.

    Attributes
    ----------
    structure, rule, builder, axes, candidates, overlap, ending : str
        Of STRUCTURES, RULES, BUILDERS, AXES, CANDIDATES, OVERLAPS, ENDINGS.
    max_leaf : int
        A cell of so few triangles is a leaf, with endings ad_hoc and both.
    max_depth : int or None
        None: 8 + 1.3 log2 N (Havran 2000; Pharr & Humphreys 2004).
    traversal_cost, intersection_cost : float
        K_T and K_I of equation 3.7: the cost of a step and of a test, in any unit.
    empty_bonus : float
        By how much the cost of both sides is multiplied where one of them is empty; 1: no bonus.
    flat_cells : bool
        Whether planes at a cell's own side may cut off triangles that lie in it.
    block : int
        Triangles are tested so many at a time: the cost of a leaf is counted in blocks.

    Raises
    ------
    RtbenchError
        For values that are not allowed.
    """

    structure: str = "kd"
    rule: str = "sah"
    builder: str = "nlogn"
    axes: str = "all"
    candidates: str = "all"
    overlap: str = "clipped"
    ending: str = "both"
    max_leaf: int = 1
    max_depth: int | None = None
    traversal_cost: float = 2.0
    intersection_cost: float = 1.0
    empty_bonus: float = 0.8
    flat_cells: bool = True
    block: int = 1

    def __post_init__(self) -> None:
        for what, allowed in (
            ("structure", STRUCTURES),
            ("rule", RULES),
            ("builder", BUILDERS),
            ("axes", AXES),
            ("candidates", CANDIDATES),
            ("overlap", OVERLAPS),
            ("ending", ENDINGS),
        ):
            if getattr(self, what) not in allowed:
                raise RtbenchError(unknown(what, str(getattr(self, what)), allowed))
        for what, low, high in (
            ("max_leaf", 1, 1 << 24),
            ("max_depth", 0, DEEPEST),
            ("block", 1, 16),
            ("empty_bonus", 0.0, 1.0),
        ):
            value = getattr(self, what)
            if value is not None and not low <= value <= high:
                raise RtbenchError(f"{what} {value} is not allowed (allowed: {low} to {high})")
        for what in ("traversal_cost", "intersection_cost"):
            value = getattr(self, what)
            if not (value > 0 and math.isfinite(value)):
                raise RtbenchError(f"{what} {value} is not allowed (allowed: above 0)")

    def deepest(self, triangles: int) -> int:
        """Return the depth below which no cell of a tree over so many triangles is cut."""
        if self.ending == "automatic":
            return DEEPEST
        if self.max_depth is not None:
            return self.max_depth
        return min(DEEPEST, int(8.5 + 1.3 * math.log2(max(1, triangles))))
