"""All hard scenes by name."""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np

from rtbench.workloads.hard_scenes import crowds, planes, scales
from rtbench.workloads.hard_scenes.scene import Scene

SCENES: dict[str, Callable[[np.random.Generator], Scene]] = {
    draw.__name__: draw
    for draw in (
        crowds.empty,
        crowds.single_triangle,
        crowds.single_flat_triangle,
        planes.flat_in_planes,
        planes.coplanar,
        planes.coplanar_slanted,
        crowds.duplicates,
        crowds.identical_centroids,
        planes.box,
        scales.on_box_faces,
        scales.signed_zeros,
        planes.grid,
        planes.abutting,
        planes.staircase,
        planes.integer_grid,
        planes.layers,
        scales.offset,
        scales.small_in_large,
        scales.tiny_and_huge,
        crowds.slivers,
        crowds.with_degenerate,
        crowds.vertex_fan,
        scales.direction_scale,
    )
}


def scenes(seed: int = 1) -> dict[str, Scene]:
    """Return the hard scenes by name: each of up to about 2,000 triangles and 2,000 rays.

    Parameters
    ----------
    seed : int
        Not negative. A scene stays the same when others are added.
    """
    return {
        name: draw(np.random.default_rng((zlib.crc32(name.encode()), seed)))
        for name, draw in SCENES.items()
    }
