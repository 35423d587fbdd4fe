"""How long it takes to prepare a triangle: what a kernel stores of it, computed once."""

from __future__ import annotations

import numpy as np

from rtbench.compiled import preparation
from rtbench.compiled.layout import arithmetics
from rtbench.kernels.contract import Kernel
from rtbench.measure.sampler import stopwatch

# At least FEWEST times, then until ENOUGH seconds are over.
FEWEST, MOST, ENOUGH = 11, 50, 0.02
# So many triangles at least, copies among them: a call then costs nothing beside them.
TRIANGLES = 1 << 14


def preparation_times(
    kernel: Kernel, precision: str, corners: tuple[np.ndarray, ...], prepared: str = "own"
) -> np.ndarray:
    """Return how long a kernel's stored data take to prepare, several times.

    Each time in another random order: a triangle is prepared but once, and so a processor must
    not have learned along which axes the triangles before it were projected.

    Parameters
    ----------
    kernel : Kernel
        One that has a ``prepare``.
    precision, prepared : str
        As for `rtbench.compiled.layout.fill`.
    corners : three (T, 3) arrays
        v0, v1, v2.

    Returns
    -------
    (times,) float64 array
        ns a triangle, by the compiled loop alone.
    """
    types = arithmetics(precision, prepared)
    triangles = preparation.triangles(corners, types[0])
    call = preparation.loop(kernel.prepare, *types).call
    places = np.resize(np.arange(len(triangles)), max(len(triangles), TRIANGLES))
    stored = np.empty(len(places), preparation.stored_type(kernel.prepare, types[2]))
    draw = np.random.default_rng(1)

    def once() -> float:
        shuffled = triangles[draw.permutation(places)]
        return stopwatch(lambda: call(shuffled, stored))[1]

    once()
    times = [once() for _ in range(FEWEST)]
    while sum(times) < ENOUGH and len(times) < MOST:
        times.append(once())
    return np.array(times) * 1e9 / len(places)
