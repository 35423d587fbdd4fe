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


def check(kernel: Kernel, precision: str, pairs: Pairs, hit: np.ndarray, t: np.ndarray) -> None:
    """Compare a kernel's hits and t with what was decided without any kernel.

    Parameters
    ----------
    kernel, precision
        Whose answers they are.
    pairs : Pairs
        N pairs that are safe to judge.
    hit : (N,) bool array
    t : (N,) float array

    Raises
    ------
    WrongAnswers
        Naming the first pair about which the kernel is wrong.
    """
    wrong = np.flatnonzero(hit != _right(kernel, precision, pairs, hit))
    if len(wrong):
        said = "hits" if hit[wrong[0]] else "misses"
        raise WrongAnswers(
            f"kernel {kernel.name} in {precision} is wrong about {len(wrong)} of {len(hit)} pairs; "
            f"the first is pair {wrong[0]}, which it {said}"
        )
    at = np.flatnonzero(hit)
    error, allowed = np.abs(t[at] - pairs.t[at]), _allowed(precision, pairs, at)
    far = np.flatnonzero(~(error <= allowed))
    if len(far):
        i = far[0]
        raise WrongAnswers(
            f"kernel {kernel.name} in {precision} is wrong about t of {len(far)} of {len(at)} "
            f"hits; the first is pair {at[i]}: {t[at[i]]}, and {pairs.t[at[i]]} "
            f"+- {allowed[i]:.2g} is right"
        )


def _right(kernel: Kernel, precision: str, pairs: Pairs, hit: np.ndarray) -> np.ndarray:
    """Return which pairs hit in the kernel's domain; at its very ends the kernel is believed."""
    right = pairs.hit.copy()
    if kernel.domain == "line":
        return right
    at = np.flatnonzero(right)
    t, allowed = pairs.t[at], _allowed(precision, pairs, at)
    ends = [np.zeros(len(at))]
    if kernel.domain == "segment":
        ends.append(np.linalg.norm(pairs.end[at].astype(float) - pairs.orig[at], axis=1))
    right[at] = (t > 0) & (t < ends[-1] if len(ends) > 1 else True)
    close = at[np.any([np.abs(t - end) <= allowed for end in ends], axis=0)]
    right[close] = hit[close]
    return right


def _allowed(precision: str, pairs: Pairs, at: np.ndarray) -> np.ndarray:
    """Return how far t may be off: rounded determinants of rounded data, over |det|."""
    v0, v1, v2, orig, direction = (
        np.asarray(a[at], dtype=np.float64)
        for a in (pairs.v0, pairs.v1, pairs.v2, pairs.orig, pairs.dir)
    )
    e1, e2, s = v1 - v0, v2 - v0, orig - v0
    det = np.abs(np.einsum("ij,ij->i", np.cross(e1, e2), direction))
    weight = np.abs(e1).sum(1) * np.abs(e2).sum(1) / det
    unit = np.finfo(DATA_TYPE[precision]).eps / 2
    # The plane's offset is stored as -N.V0 and compared with N.O: positions count, not s alone.
    above = np.abs(s).sum(1) + np.abs(orig).sum(1) + np.abs(v0).sum(1)
    return ROUNDINGS * unit * weight * (above + np.abs(pairs.t[at]) * np.abs(direction).sum(1))
