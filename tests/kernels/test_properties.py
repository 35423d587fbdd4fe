"""What every correct kernel does, tested over the whole registry: a new one meets this by being.

A kernel is held to what it claims (`Kernel.claims`, and what endings but Text 9 promise). One that
does not claim a property may break it only where a rounding can have decided, by the running error
bounds of its own formula, or where its formula breaks it without rounding too. `point in triangle`
forms have no ray and are left out.
"""

import functools
import itertools

import fans
import numpy as np
import pytest
import running_error
import workload

from rtbench.compiled import syntax
from rtbench.compiled.exact import exact_form, exact_records
from rtbench.kernels.contract import HIT
from rtbench.kernels.registry import all_kernels
from rtbench.workloads.pairs import random_pairs

KERNELS = {
    name: kernel
    for name, kernel in all_kernels().items()
    if kernel.domain is not None
    # What returns u and v decides as what returns t alone does: one tree, cut off later.
    and (kernel.outputs == ("t", "u", "v") or f"{name}_uv" not in all_kernels())
}
EACH = pytest.mark.parametrize("name", KERNELS)
BOTH = pytest.mark.parametrize("precision", workload.DATA)
READS_EPSILON = [
    name for name, kernel in KERNELS.items() if "EPSILON" in syntax.outside_names(kernel)
]
pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


def claims(kernel, what):
    return what in kernel.claims


def fails_on_nan(kernel):
    """Tell whether all comparisons that decide fail on NaN: every ending but Text 9."""
    return kernel.ending is not None and kernel.ending.name != "text9"


def answers(kernel, precision, triangles, origins, directions, tmax=np.inf):
    """Return the outcome and t, u, v of hits; NaN and 0 elsewhere."""
    data = workload.DATA[precision]
    pairs = (np.asarray(a, data) for a in (triangles, origins, directions))
    with np.errstate(all="ignore"):
        outcome, outputs = workload.Group(*pairs, tmax).answers(kernel, precision)
    return outcome, {
        name: np.where(outcome == HIT, values, 0).astype(float) for name, values in outputs.items()
    }


def in_band(kernel, precision, triangles, origins, directions):
    """Return where a rounding may have decided."""
    with np.errstate(all="ignore"):
        return running_error.run(kernel, precision, triangles, origins, directions).in_band


def exactly_hit(kernel, group, at):
    """Return which of some pairs the kernel hits in rational arithmetic."""
    given = [a[at] for a in (group.triangles, group.origins, group.directions)]
    vertices = tuple(given[0][:, i] for i in range(3))
    records = exact_records(kernel, vertices, *given[1:])
    return [exact_form(kernel)(tri, ray)[0] == HIT for tri, ray in zip(*records, strict=True)]


@BOTH
@EACH
def test_watertight(name, precision):
    """A closed fan is hit, whichever vertex or inner edge the ray meets."""
    kernel = KERNELS[name]
    for case in (fans.exact(precision), fans.near(precision)):
        group = case.group
        hit = answers(kernel, precision, group.triangles, group.origins, group.directions)[0] == HIT
        hits = case.hits(hit)
        leaks = np.flatnonzero(hits == 0)
        if claims(kernel, "X2"):
            assert set(hits) == {1}
        if claims(kernel, "S2"):
            assert not len(leaks)
        assert hits.any()
        at = np.isin(case.fan, leaks)
        if at.any():
            pairs = group.triangles[at], group.origins[at], group.directions[at]
            unsure = np.bincount(case.fan[at], in_band(kernel, precision, *pairs), len(hits)) > 0
            for leak in leaks[~unsure[leaks]]:
                assert not any(exactly_hit(kernel, group, case.fan == leak))


@functools.cache
def near_edges(precision):
    """Return pairs of which lines pass close to a vertex or an edge, and t is about 1."""
    group, some = workload.groups(precision)["edges"], slice(60, 200)
    return group.triangles[some], group.origins[some], group.directions[some]


@BOTH
@EACH
def test_permutation(name, precision):
    """The order of the vertices does not decide."""
    kernel = KERNELS[name]
    triangles, *rays = near_edges(precision)
    orders = [list(order) for order in itertools.permutations(range(3))]
    six = np.concatenate([triangles[:, order] for order in orders])
    rays = [np.tile(each, (6, 1)) for each in rays]
    hit = (answers(kernel, precision, six, *rays)[0] == HIT).reshape(6, -1)
    differ = np.flatnonzero((hit != hit[0]).any(axis=0))
    assert 20 < hit[0].sum() < len(triangles) - 20
    if claims(kernel, "S6"):
        assert not len(differ)
    if len(differ):
        unsure = in_band(kernel, precision, six, *rays).reshape(6, -1).any(axis=0)
        assert unsure[differ].all()


def scaled(name, precision, size, length):
    """Return answers of random pairs, all coordinates times one number, directions times two."""
    drawn = random_pairs(150, "pcg64", seed=9)
    triangles = np.stack([drawn.v0, drawn.v1, drawn.v2], axis=1)
    pairs = triangles * size, drawn.orig * size, drawn.dir * size * length
    return answers(KERNELS[name], precision, *pairs, tmax=1 / length)


@BOTH
@EACH
def test_power_of_two_scaling(name, precision):
    """A power of two rounds nothing: answers stay bit for bit, t in units of the direction."""
    outcome, outputs = scaled(name, precision, 1.0, 1.0)
    assert (outcome == HIT).sum() > 5
    ways = [(2.0**7, 1.0), (2.0**-7, 1.0)]
    if "end" not in syntax.fields(KERNELS[name])[1]:  # a point that is rounded, and another one
        ways += [(1.0, 2.0**9), (1.0, 2.0**-9)]
    if name in READS_EPSILON:
        return
    for size, length in ways:
        same, others = scaled(name, precision, size, length)
        assert np.array_equal(same, outcome)
        for what, values in others.items():
            assert np.array_equal(values * length if what == "t" else values, outputs[what])


@BOTH
@pytest.mark.parametrize("name", READS_EPSILON)
def test_an_absolute_epsilon_is_not_invariant(name, precision):
    """Of small triangles, or with short directions, it takes every line for a parallel one."""
    large, small = (scaled(name, precision, 2.0**power, 1.0)[0] for power in (0, -20))
    assert not np.array_equal(large, small) or not np.array_equal(
        large, scaled(name, precision, 1.0, 2.0**-40)[0]
    )


@functools.cache
def degenerate(n=60):
    """Return rays at points and lines that are triangles, in small integers."""
    random = np.random.default_rng(3)
    corner, origin = random.integers(-3, 4, (2, n, 3)).astype(float)
    triangles = np.repeat(corner[:, None], 3, axis=1)
    way = random.integers(-2, 3, (n, 3))
    for vertex in (1, 2):  # the first third are points, the second lines, the third one edge twice
        triangles[n // 3 :, vertex] += (random.integers(-2, 3, (n, 1)) * way)[n // 3 :]
    triangles[2 * n // 3 :, 2] = triangles[2 * n // 3 :, 1]
    return triangles, origin, np.where(random.random((n, 1)) < 0.7, corner - origin, way)


def touched(triangles, origins, directions):
    """Return which lines lie in one plane with all three vertices, in whole numbers."""
    a, b, c = (triangles[:, i] - origins for i in range(3))
    sides = [np.einsum("ni,ni->n", directions, np.cross(p, q)) for p, q in ((a, b), (b, c), (c, a))]
    return (np.abs(sides) == 0).all(axis=0)


@BOTH
@EACH
def test_degenerate(name, precision):
    """A triangle without area is no hit with numbers that are none."""
    kernel = KERNELS[name]
    triangles, origins, directions = degenerate()
    outcome, outputs = answers(kernel, precision, triangles, origins, directions)
    assert ((outcome >= 0) & (outcome < len(kernel.outcomes))).all()
    hit = outcome == HIT
    if claims(kernel, "S4") or fails_on_nan(kernel):
        assert all(np.isfinite(values[hit]).all() for values in outputs.values())
        # Small integers: every area is exactly 0, and only what a ray touches may be called hit.
        assert not (hit & ~touched(triangles, origins, directions)).any()
        assert kernel.ending is None or not hit.any()
    elif kernel.ending is None and hit.any():
        data = workload.DATA[precision]
        pairs = (a[hit].astype(data) for a in (triangles, origins, directions))
        assert in_band(kernel, precision, *pairs).all()


@functools.cache
def invalid():
    """Return pairs that hit but for a number, or a vector, that is none; and zero directions."""
    random = np.random.default_rng(5)
    triangles = random.random((8, 3, 3))
    origins = random.random((8, 3)) - 2
    directions = np.einsum("ni,nij->nj", random.dirichlet((2, 2, 2), 8), triangles) - origins
    rows = np.concatenate([triangles, origins[:, None], directions[:, None]], axis=1)
    found = []
    for bad, vector, place in itertools.product(
        (np.nan, np.inf, -np.inf), range(5), (0, 1, 2, slice(None))
    ):
        broken = rows.copy()
        broken[:, vector, place] = bad
        found.append(broken)
    still = rows.copy()
    still[:, 4] = 0
    signed = still.copy()
    signed[:, 4, 1] = -0.0
    made = np.concatenate([*found, still, signed])
    return made[:, :3], made[:, 3], made[:, 4]


@BOTH
@EACH
def test_invalid(name, precision):
    """NaN, infinity and a direction of no length miss; what does not say so has a code at least."""
    kernel = KERNELS[name]
    for tmax in (np.inf, 1e3) if kernel.takes_tmax else (np.inf,):
        outcome, outputs = answers(kernel, precision, *invalid(), tmax)
        assert ((outcome >= 0) & (outcome < len(kernel.outcomes))).all()
        if claims(kernel, "S3") or fails_on_nan(kernel):
            assert HIT not in outcome
        elif claims(kernel, "S4"):
            assert all(np.isfinite(values).all() for values in outputs.values())
