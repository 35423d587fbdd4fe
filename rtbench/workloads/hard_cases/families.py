"""The families of hard cases: number, name, what their difficulty means, what holds in a group."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rtbench.workloads.hard_cases import (
    boundaries,
    extremes,
    field_edges,
    field_pairs,
    scales,
    shapes,
    shared,
    singular,
    starts,
    symmetry,
    text9,
)
from rtbench.workloads.hard_cases.geometry import Format, Geometry, Random

ALONE, ONE, ODD, SAME = range(4)
"""Rules of groups: none; at least one hit, ideally exactly one; an odd number; the same answer."""


@dataclass(frozen=True)
class Family:
    """Cases that are hard for one reason.

    Attributes
    ----------
    name : str
    difficulty : str
        What the number means; for an axis. Greater is harder, but for kinds and counts.
    hard : str
        What is hard.
    draw : callable
        Of a generator, a format and a number of cases, or groups.
    rule : int
        What holds in a group; see `Cases`.
    sizes : tuple of two int
        Cases, or groups, that are drawn in float32 and in float64.
    core : bool
        Whether precision is asked for, not range: see `CORE`.
    """

    name: str
    difficulty: str
    hard: str
    draw: Callable[[Random, Format, int], Geometry]
    rule: int = ALONE
    sizes: tuple[int, int] = (340, 170)
    core: bool = True


_PAIRS, _FANS = {"rule": ONE, "sizes": (180, 90)}, {"rule": ONE, "sizes": (100, 50)}
_BITS, _OFFSET = "bits of whole coordinates", "k: scene 10^k from the origin"
_NONE = "none"

FAMILIES = (
    Family("control_random", _NONE, "nothing", boundaries.control_random),
    Family("near_edge", "k: weight of a corner 10^-k", "sign of one weight", boundaries.near_edge),
    Family(
        "near_vertex", "k: weights of corners 10^-k", "signs of two weights", boundaries.near_vertex
    ),
    Family("exact_edge", _BITS, "exact tie", boundaries.exact_edge),
    Family("exact_vertex", _BITS, "exact tie of two", boundaries.exact_vertex),
    Family("shared_edge_exact", _BITS, "leak or double hit", shared.shared_edge_exact, **_PAIRS),
    Family("shared_edge_near", _OFFSET, "leak or double hit", shared.shared_edge_near, **_PAIRS),
    Family(
        "vertex_fan_exact", _BITS, "leak at a corner of 3 to 8", shared.vertex_fan_exact, **_FANS
    ),
    Family(
        "vertex_fan_near", _OFFSET, "leak at a corner of 3 to 8", shared.vertex_fan_near, **_FANS
    ),
    Family(
        "closed_mesh_far",
        _OFFSET,
        "leak of a closed mesh",
        shared.closed_mesh_far,
        rule=ODD,
        sizes=(42, 24),
    ),
    Family(
        "parallel_offplane",
        "k: height 2^-k of the size",
        "determinant 0, in floats not",
        singular.parallel_offplane,
    ),
    Family("grazing", "k: angle to the plane 10^-k", "small determinant", singular.grazing),
    Family("coplanar", _BITS, "determinant 0, in floats not", singular.coplanar),
    Family("needle", "k: shortest edge 10^-k", "ill-conditioned normal", shapes.needle),
    Family("cap", "k: height 10^-k", "ill-conditioned normal", shapes.cap),
    Family(
        "near_degenerate",
        "k: 2^-k ulps off a line",
        "area of rounding size",
        shapes.near_degenerate,
    ),
    Family("far_triangle", _OFFSET, "absolute coordinates", scales.far_triangle),
    Family("far_origin", "k: ray from 10^k away", "cancellation in the point", scales.far_origin),
    Family("tiny_triangle", "k: edges 10^-k", "absolute epsilons", scales.tiny_triangle),
    Family("huge_triangle", "k: edges 10^k", "absolute epsilons", scales.huge_triangle),
    Family("log_uniform", "k: coordinates 10^-k to 10^k", "mixed scales", scales.log_uniform),
    Family("degenerate_collinear", _BITS, "no area, in floats some", singular.degenerate_collinear),
    Family(
        "degenerate_coincident",
        "kind: which corners are one",
        "no area",
        singular.degenerate_coincident,
    ),
    Family("origin_on", _BITS, "t = 0 exactly", starts.origin_on),
    Family("self_intersection", _OFFSET, "sign of t at a hit point", starts.self_intersection),
    Family("near_origin", "k: start 10^-k away", "sign of t", starts.near_origin),
    Family("behind", "k: triangle 10^k behind", "t < 0", starts.behind),
    Family("subnormal", "k: scale 10^-k", "underflow", extremes.subnormal, core=False),
    Family("overflow", "k: scale 10^k", "overflow", extremes.overflow, core=False),
    Family("inf_nan", "kind: which, and where", "must miss", extremes.inf_nan, core=False),
    Family("zero_dir", "kind: signs of the zeros", "must miss", extremes.zero_dir, core=False),
    Family("signed_zero_axis", "count of -0", "zeros of either sign", symmetry.signed_zero_axis),
    Family("dir_scale", "k: direction of length 10^k", "length of direction", scales.dir_scale),
    Family(
        "permutation",
        "k: weight of a corner 10^-k",
        "six orders of corners",
        symmetry.permutation,
        rule=SAME,
        sizes=(63, 45),
    ),
    Family("axis_tie", "kind: which are equal", "choice of an axis", symmetry.axis_tie),
    Family("field", _NONE, "what users reported", field_pairs.field),
    Family("text9", "kind: which number is 0", "sign bits of zeros", text9.text9),
    Family("field_shared", _NONE, "what users reported", field_edges.field_shared, rule=ONE),
    Family("field_closed", _NONE, "what users reported", field_edges.field_closed, rule=ODD),
    Family("field_range", _NONE, "what users reported", field_pairs.field_range, core=False),
)
"""By number. Field families have as many cases as were reported."""

CORE = tuple(family.name for family in FAMILIES if family.core)
"""Families in which precision is asked for: all numbers and products are in the formats' range."""
