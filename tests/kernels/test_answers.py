"""Every method with every ending, compiled, against the exact answers.

What a kernel may get wrong is derived for each pair from its own formula by running error bounds
(`bounded`, `running_error`): only where a rounding can have turned a deciding comparison may its
answer differ from the exact one, and t, u and v of a hit are off by no more than their bounds. The
exact answers come from `rtbench.accuracy`, which shares nothing with any kernel.
"""

import numpy as np
import pytest
import running_error
import truth
import workload

from rtbench.accuracy import exact
from rtbench.kernels.contract import HIT, UNDECIDED
from rtbench.kernels.registry import all_kernels

KERNELS = all_kernels()
# What returns u and v decides as what returns t alone does: one tree, cut off later.
TESTED = [n for n, k in KERNELS.items() if k.outputs == ("t", "u", "v") or f"{n}_uv" not in KERNELS]


@pytest.mark.parametrize("precision", workload.DATA)
@pytest.mark.parametrize("name", TESTED)
def test_answers_are_exact_but_for_pairs_in_their_rounding_band(name, precision):
    kernel = KERNELS[name]
    differ = 0
    for what, group in workload.groups(precision).items():
        if what == "points" and kernel.domain is not None:
            continue
        pairs = group.triangles, group.origins, group.directions
        outcome, outputs = group.answers(kernel, precision)
        run = running_error.run(kernel, precision, *pairs, group.tmax)
        # The bounds speak of this very code: it computes the same, bit by bit.
        decided = run.outcome != UNDECIDED
        assert np.array_equal(outcome[decided], run.outcome[decided])
        assert kernel.fallback or decided.all()
        right = group.right(kernel.domain) if kernel.domain else group.inside(kernel)
        wrong = (outcome == HIT) != right
        differ += wrong.sum()
        assert not (wrong & ~run.in_band).any(), (what, np.flatnonzero(wrong & ~run.in_band))
        if "X1" in kernel.claims and np.isinf(group.tmax):  # which is compared with a rounded t
            assert all(is_tie(*(a[i] for a in pairs)) for i in np.flatnonzero(wrong))
        if what.startswith("random") and kernel.exact:
            assert run.in_band.mean() < 0.01  # else the above would say little
        check_outputs(kernel, group, (outcome == HIT) & decided, outputs, run)
    # Pairs so close to a border that rounding decides some are among them.
    assert differ > 0


def is_tie(triangle, origin, direction):
    """Tell whether a line meets an edge or vertex exactly: either answer is right."""
    det, u, v, t = exact.numerators(*triangle.tolist(), origin.tolist(), direction.tolist())
    return 0 in (u, v, det - u - v, t)


def check_outputs(kernel, group, hit, outputs, run):
    """t, u, v of the hits equal what the bounds are of, and the exact ones lie within those."""
    assert hit.sum() > (10 if kernel.fallback else 30)
    for name, values in outputs.items():
        computed, bound = run.outputs[name]
        assert np.array_equal(values[hit].astype(float), computed[hit], equal_nan=True)
        if kernel.domain is None:
            if name == "t":
                assert np.isnan(values).all()
                continue
            axes = group.axes(kernel)
            right = np.full(len(values), np.nan)
            for i in np.flatnonzero(hit):
                direction = None if axes is None else np.eye(3)[axes[i]]
                weights = truth.weights(group.triangles[i], group.origins[i], direction)
                right[i] = weights["uv".index(name)]
            error = np.abs(right) * 2.0**-52
        else:
            right = getattr(group.reference, name)
            error = getattr(group.reference, f"{name}_error")
        off = np.abs(values[hit].astype(float) - right[hit])
        finite = np.isfinite(right[hit])  # a hit beside a parallel triangle has nothing to compare
        assert finite.mean() > 0.9
        assert (off <= bound[hit] + error[hit])[finite].all()
