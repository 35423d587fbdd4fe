"""Which triangles a kernel with an absolute EPSILON can never hit: a scan's, mostly."""

from __future__ import annotations

import numpy as np

from rtbench.compiled import syntax
from rtbench.kernels import moller
from rtbench.kernels.contract import EPSILON, Kernel


def has_epsilon(kernel: Kernel) -> bool:
    """Tell whether a kernel calls a ray parallel where a determinant is below EPSILON.

    Badouel's listing also reads EPSILON, but compares it with the cosine to a unit normal.
    """
    return kernel.function.__module__ == moller.__name__ and "EPSILON" in syntax.outside_names(
        kernel
    )


def never_hit(kernel: Kernel, corners: np.ndarray) -> np.ndarray:
    """Return which triangles no ray of a unit direction hits, whatever its direction.

    The determinant is at most the length of e1 x e2 times that of the direction.

    Parameters
    ----------
    kernel : Kernel
    corners : (M, 3, 3) array

    Returns
    -------
    (M,) bool array
        All False for a kernel without an absolute EPSILON.
    """
    if not has_epsilon(kernel):
        return np.zeros(len(corners), bool)
    v0, v1, v2 = (corners[:, k].astype(np.float64) for k in range(3))
    with np.errstate(over="ignore", invalid="ignore"):
        greatest = np.linalg.norm(np.cross(v1 - v0, v2 - v0), axis=1)
    return greatest < EPSILON


def remark(kernel: Kernel, corners: np.ndarray) -> str | None:
    """Return a line that says how many triangles a kernel can never hit; None where it can all."""
    count = int(np.count_nonzero(never_hit(kernel, corners)))
    if not count:
        return None
    share = 100 * count / len(corners)
    return (
        f"kernel {kernel.name}: its EPSILON of {EPSILON:g} is absolute, and {count} of "
        f"{len(corners)} triangles ({share:.0f} %) are too small ever to be hit by a ray of unit "
        "length (moller_trumbore has no EPSILON)"
    )
