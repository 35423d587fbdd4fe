"""The tests by name, and what a generated module needs of each."""

from collections.abc import Callable

from rtbench.compiled import syntax
from rtbench.compiled.sources import named
from rtbench.errors import RtbenchError, unknown
from rtbench.trees.overlap import clipping, rounding, separating_axes, three_stage
from rtbench.trees.overlap.rounding import shared_box

BOX = (rounding.shared_box,)
OUTWARD = (rounding.downward, rounding.upward, rounding.shared_box, rounding.within_bounds)
STAGES = (
    *BOX,
    three_stage.surely_beyond,
    three_stage.beyond_sides,
    three_stage.in_cell,
    three_stage.beyond_edges,
    three_stage.beyond_corners,
    three_stage.passes_stages,
)
WIDENED = (*OUTWARD, clipping.widening)


def box_fit(triangle, own, cell, room):
    """Take a triangle to be its box.

    Parameters, Returns: see `rtbench.trees.overlap.clipping.clipped_fit`.
    """
    lx, ly, lz, ux, uy, uz = shared_box(own, cell)
    return (lx <= ux) & (ly <= uy) & (lz <= uz), lx, ly, lz, ux, uy, uz


FITS: dict[str, tuple[Callable, tuple[Callable, ...]]] = {
    "box": (box_fit, BOX),
    "three_stage_world": (three_stage.three_stage_world_fit, STAGES),
    "three_stage": (three_stage.three_stage_fit, STAGES),
    "separating_axes": (
        separating_axes.separating_axes_fit,
        (
            *BOX,
            clipping.least_of_three,
            clipping.greatest_of_three,
            separating_axes.apart_along_axis,
            separating_axes.apart_along_edge,
            separating_axes.apart_along_normal,
        ),
    ),
    "clipped": (
        clipping.clipped_fit,
        (
            *WIDENED,
            clipping.least_of_three,
            clipping.greatest_of_three,
            clipping.cut_edge,
            clipping.clipped_to_slab,
        ),
    ),
    "plane_clipped": (
        clipping.plane_clipped_fit,
        (
            *WIDENED,
            clipping.least_of_three,
            clipping.greatest_of_three,
            clipping.in_order,
            clipping.bounds_between,
        ),
    ),
}
"""Each test's function and what it calls, callees first."""


def fit_sources(name: str) -> tuple[Callable | str, ...]:
    """Return a test as callees for `rtbench.compiled.instantiate`, the last of them named ``fit``.

    Parameters
    ----------
    name : str
        One of ``FITS``.

    Returns
    -------
    tuple of callables and str

    Raises
    ------
    RtbenchError
        For an unknown test.
    """
    if name not in FITS:
        raise RtbenchError(unknown("overlap test", name, FITS))
    function, callees = FITS[name]
    return (*callees, named(syntax.parse(function), "fit"))
