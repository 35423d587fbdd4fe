"""Which triangles belong to a cell: tests that differ in what they let through for nothing.

Each is a plain function ``fit(triangle, own, cell, room) -> (inside, lx, ly, lz, ux, uy, uz)`` in
local coordinates, float64, that goes into compiled code; none is ever wrong about a triangle that
touches the closed cell.
"""

from rtbench.trees.overlap.comparing import fitted, let_through, overlapping
from rtbench.trees.overlap.registry import FITS, fit_sources

__all__ = ["FITS", "fit_sources", "fitted", "let_through", "overlapping"]
