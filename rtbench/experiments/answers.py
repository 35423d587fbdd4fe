"""Whether a kernel is right about pairs whose answers are known."""

from __future__ import annotations

import numpy as np

from rtbench.compiled.layout import DATA_TYPE
from rtbench.errors import WrongAnswers
from rtbench.kernels.contract import Kernel
from rtbench.workloads.pairs import Pairs

# t = N.(V0 - O) / N.D has about ten roundings above and below, each weighted by the sum of the
# magnitudes of the terms; a stored normal adds as much again. 64 leaves room for any order of them.
ROUNDINGS = 64


def check(
    kernel: Kernel,
    precision: str,
    pairs: Pairs,
    hit: np.ndarray,
    outputs: tuple[np.ndarray, ...],
) -> None:
    """Compare a kernel's hits, t, u and v with what was decided without any kernel.

    Parameters
    ----------
    kernel, precision
        Whose answers they are.
    pairs : Pairs
        N pairs that are safe to judge.
    hit : (N,) bool array
    outputs : (N,) float arrays
        t, and u and v if the kernel returns them.

    Raises
    ------
    WrongAnswers
        Naming the first pair about which the kernel is wrong.
    """
    right, sure = _right(kernel, precision, pairs)
    wrong = np.flatnonzero((hit != right) & sure)
    if len(wrong):
        said = "hits" if hit[wrong[0]] else "misses"
        raise WrongAnswers(
            f"kernel {kernel.name} in {precision} is wrong about {len(wrong)} of {len(hit)} pairs; "
            f"the first is pair {wrong[0]}, which it {said}"
        )
    if kernel.domain is None:  # the point has no t, and its u, v are as good as its rounding
        return
    at = np.flatnonzero(hit)
    for name, values, bound in zip(
        kernel.outputs, outputs, _bounds(precision, pairs, at), strict=False
    ):
        right = getattr(pairs, name)[at]
        far = np.flatnonzero(~(np.abs(values[at] - right) <= bound))
        if len(far):
            i = far[0]
            raise WrongAnswers(
                f"kernel {kernel.name} in {precision} is wrong about {name} of {len(far)} of "
                f"{len(at)} hits; the first is pair {at[i]}: {values[at[i]]}, and {right[i]} "
                f"+- {bound[i]:.2g} is right"
            )


def _right(kernel: Kernel, precision: str, pairs: Pairs) -> tuple[np.ndarray, np.ndarray]:
    """Return the right answers in the kernel's own domain, and of which of them it is sure.

    Whether the line hits is exact; where on it the domain ends is as sure as t can be.
    """
    right, sure = pairs.hit.copy(), np.ones(len(pairs.hit), bool)
    if kernel.domain in ("line", None):
        return right, sure
    at = np.flatnonzero(pairs.hit)
    length = np.linalg.norm(pairs.end[at].astype(float) - pairs.orig[at], axis=1)
    bound = _bounds(precision, pairs, at)[0]
    for end, inside in ((0.0, pairs.t[at] > 0), (length, pairs.t[at] < length)):
        if kernel.domain == "segment" or np.ndim(end) == 0:
            right[at] &= inside
            sure[at] &= np.abs(pairs.t[at] - end) > bound
    return right, sure


def _bounds(precision: str, pairs: Pairs, at: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return how far t, u and v may be off: rounded determinants of rounded data, over |det|."""
    v0, v1, v2, orig, direction = (
        np.asarray(a[at], dtype=np.float64)
        for a in (pairs.v0, pairs.v1, pairs.v2, pairs.orig, pairs.dir)
    )
    e1, e2, s = v1 - v0, v2 - v0, orig - v0
    normal = np.cross(e1, e2)
    det = np.abs(np.einsum("ij,ij->i", normal, direction))
    unit = ROUNDINGS * np.finfo(DATA_TYPE[precision]).eps / 2
    edges, length = np.abs(e1).sum(1) * np.abs(e2).sum(1), np.abs(direction).sum(1)
    # The plane's offset is stored as -N.V0 and compared with N.O: positions count, not s alone.
    reach = np.abs(s).sum(1) + np.abs(orig).sum(1) + np.abs(v0).sum(1)
    reach += np.abs(pairs.t[at]) * length
    t = unit * edges / det * reach
    # u and v are areas of the point that t leads to, over an area that is at least |N| / sqrt 3.
    across = 2 * (np.abs(e1).sum(1) + np.abs(e2).sum(1)) / np.linalg.norm(normal, axis=1)
    # Origin and end are another line than origin and direction, by the rounding of the latter.
    single = ROUNDINGS * np.finfo(np.float32).eps / 2
    uv = (t * length + single * reach) * across
    return t, uv, uv
