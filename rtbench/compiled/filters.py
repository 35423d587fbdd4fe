"""The filter of a kernel alone: which tests it leaves to the fallback."""

from __future__ import annotations

import dataclasses

import numpy as np

from rtbench.compiled.intersect import run_once
from rtbench.compiled.loops import loop
from rtbench.kernels.contract import UNDECIDED, Kernel


def undecided(
    kernel: Kernel, precision: str, triangles: np.ndarray, rays: np.ndarray, layout: str = "own"
) -> np.ndarray:
    """Return which tests a kernel's filter does not decide.

    Parameters
    ----------
    kernel : Kernel
        One that has a fallback.
    precision : str
        float32, float64 or mixed.
    triangles, rays : (N,) structured arrays
        As `rtbench.compiled.layout.fill` makes them.
    layout : str
        The layout that they are of.

    Returns
    -------
    (N,) bool array
    """
    alone = dataclasses.replace(kernel, fallback=None)
    return run_once(loop(alone, precision, layout), alone, precision, triangles, rays)[0] == (
        UNDECIDED
    )
