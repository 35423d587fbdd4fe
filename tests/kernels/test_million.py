"""A million random pairs through every kernel: how many answers are not exact, and whether rounding
explains each. Long; `pytest -m full -s tests/kernels/test_million.py` prints the table.

The rounding band is that of `running_error`. Its share of the pairs is measured on the first
20,000 of them, to see that it explains no more than it must.
"""

import functools

import numpy as np
import pytest
import running_error
import workload

from rtbench.kernels.contract import HIT
from rtbench.kernels.registry import all_kernels

KERNELS = all_kernels()
METHODS = list(dict.fromkeys(kernel.function.__name__ for kernel in KERNELS.values()))
N = 1_000_000
FIRST = slice(0, 20_000)
TMAX = 0.5  # ends a third of the hits


@functools.cache
def million(precision):
    """Return the pairs, the same in both precisions: coordinates of float32."""
    drawn = workload.random_group(N, 2008, TMAX)
    data = workload.DATA[precision]
    return workload.Group(
        *(
            np.ascontiguousarray(a, data)
            for a in (drawn.triangles, drawn.origins, drawn.directions)
        ),
        TMAX,
    )


@pytest.fixture(scope="module", autouse=True)
def head():
    print(f"\n{'kernel':40}{'precision':10}{'hits':>8}{'differ':>8}{'outside':>8}{'band':>12}")


def part(group, chosen):
    arrays = (a[chosen] for a in (group.triangles, group.origins, group.directions))
    return *arrays, group.tmax


@pytest.mark.full
@pytest.mark.parametrize("precision", workload.DATA)
@pytest.mark.parametrize("method", METHODS)
def test_a_million_random_pairs(method, precision):
    group = million(precision)
    outside = {}
    for kernel in (k for k in KERNELS.values() if k.function.__name__ == method):
        outcome, _ = group.answers(kernel, precision)
        right = group.right(kernel.domain) if kernel.domain else group.inside(kernel)
        differ = np.flatnonzero((outcome == HIT) != right)
        run = running_error.run(kernel, precision, *part(group, differ))
        assert np.array_equal(run.outcome, outcome[differ])
        outside[kernel.name] = int((~run.in_band).sum())
        first = running_error.run(kernel, precision, *part(group, FIRST)).in_band.mean()
        hits = int((outcome == HIT).sum())
        print(
            f"{kernel.name:40}{precision:10}{hits:8}{len(differ):8}{outside[kernel.name]:8}"
            f"{100 * first:10.3f} %"
        )
    assert not any(outside.values()), outside
