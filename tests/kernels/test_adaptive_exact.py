"""Exact answers: against the oracle, which shares nothing with the kernel, in each of its stages.

The oracle breaks ties as the kernel does: the origin moved by (e, e^2, e^3).
"""

import dataclasses

import numpy as np
import pytest

from rtbench.accuracy.oracle import expectations, owned
from rtbench.compiled.intersect import intersect, run_once
from rtbench.compiled.layout import fill
from rtbench.compiled.loops import loop
from rtbench.kernels.contract import HIT, UNDECIDED
from rtbench.kernels.registry import find

DATA = {"float32": np.float32, "float64": np.float64, "mixed": np.float32}
KERNEL = find("adaptive_exact_uv")


def random_pairs(n, seed, dtype):
    draw = np.random.default_rng(seed)
    triangles = draw.uniform(-1, 1, (n, 3, 3)).astype(dtype)
    origins = draw.uniform(-1, 1, (n, 3)).astype(dtype)
    return triangles, origins, draw.uniform(-1, 1, (n, 3)).astype(dtype)


def aimed(n, seed, dtype):
    """Rays at points of edges, a quarter at vertices, as far as rounding allows."""
    draw = np.random.default_rng(seed)
    triangles = draw.uniform(-1, 1, (n, 3, 3)).astype(dtype)
    origins = draw.uniform(-1, 1, (n, 3)).astype(dtype)
    weight = draw.uniform(0, 1, (n, 1))
    weight[::4] = 0
    targets = triangles[:, 0] * (1 - weight) + triangles[:, 1] * weight
    directions = targets - origins
    # Half of them along an axis or of whole numbers: exact ties.
    half = n // 2
    small = draw.integers(-3, 4, (half, 4, 3)).astype(dtype)
    triangles[:half], origins[:half] = small[:, :3], small[:, 3]
    directions[:half] = small[:, 0] + small[:, 1] - 2 * small[:, 3]
    return triangles, origins, directions.astype(dtype)


def filtered(pairs, precision):
    """Return which pairs the filter alone leaves undecided."""
    kernel = dataclasses.replace(KERNEL, fallback=None)
    vertices = tuple(np.ascontiguousarray(pairs[0][:, i]) for i in range(3))
    records = fill(kernel, "own", precision, vertices, *pairs[1:], tmax=np.inf)
    return run_once(loop(kernel, precision, "own"), kernel, precision, *records)[0] == UNDECIDED


def check(pairs, precision):
    found = intersect(KERNEL, *pairs, precision=precision)
    assert np.array_equal(found.hit, owned(*pairs) == 1)
    expected = expectations(*pairs)
    assert not (found.hit & (expected == 0)).any()
    assert not (~found.hit & (expected == 1)).any()
    hit = found.hit
    for values in (found.t, found.u, found.v):
        assert np.isfinite(values[hit]).all()
    assert (found.t[hit] > 0).all()
    assert (found.u[hit] >= 0).all() and (found.v[hit] >= 0).all()
    return found


@pytest.mark.parametrize("precision", DATA)
def test_random_pairs_are_all_right(precision):
    pairs = random_pairs(20_000, 1, DATA[precision])
    assert check(pairs, precision).hit.sum() > 300
    assert filtered(pairs, precision).sum() < 200


@pytest.mark.parametrize("precision", DATA)
def test_rays_aimed_at_edges_and_vertices_are_all_right(precision):
    pairs = aimed(4_000, 2, DATA[precision])
    hit = check(pairs, precision).hit
    assert 0.1 < hit.mean() < 0.7
    # A filter that decided them all would prove nothing here.
    undecided = filtered(pairs, precision)
    ties, rounded = undecided[: len(hit) // 2], undecided[len(hit) // 2 :]
    assert ties.mean() > 0.3
    assert rounded.mean() > 0.5 or precision == "mixed"


@pytest.mark.parametrize("precision", DATA)
def test_numbers_of_any_size_are_all_right(precision):
    """Products of these underflow and overflow, and stage by stage the kernel must notice."""
    draw = np.random.default_rng(3)
    reach = (-44, 38) if DATA[precision] is np.float32 else (-320, 308)
    sizes = 10.0 ** draw.uniform(*reach, (1500, 5, 1)) * draw.uniform(0.3, 1, (1500, 5, 3))
    values = (sizes * draw.choice([-1.0, 1.0], sizes.shape)).astype(DATA[precision])
    # A third of one size, so that some hit.
    values[500:1000, 1:] = values[500:1000, :1, :1] * draw.uniform(-1, 1, (500, 4, 3))
    pairs = values[:, :3], values[:, 3], values[:, 4]
    with np.errstate(all="ignore"):
        assert check(pairs, precision).hit.sum() > 5


@pytest.mark.parametrize("precision", DATA)
def test_the_filter_alone_is_never_wrong_where_it_decides(precision):
    """Distances from the edge of 1e-8 to 1e-3: about where the bounds end."""
    draw = np.random.default_rng(4)
    n, dtype = 6_000, DATA[precision]
    triangles, origins, _ = random_pairs(n, 5, dtype)
    weights = draw.dirichlet((1, 1, 1), n)
    scale = 1.0 if dtype is np.float32 else 2.0**-29
    weights[:, 0] = 10.0 ** draw.uniform(-8, -3, n) * draw.choice([-1, 1], n) * scale
    weights[:, 1] = 1 - weights[:, 2] - weights[:, 0]
    points = np.einsum("ni,nij->nj", weights, triangles.astype(float))
    directions = (points - origins).astype(dtype)
    pairs = triangles, origins, directions
    undecided = filtered(pairs, precision)
    assert 0.05 < undecided.mean() < 0.95 or precision == "mixed"
    kernel = dataclasses.replace(KERNEL, fallback=None)
    vertices = tuple(np.ascontiguousarray(triangles[:, i]) for i in range(3))
    records = fill(kernel, "own", precision, vertices, origins, directions, tmax=np.inf)
    outcome = run_once(loop(kernel, precision, "own"), kernel, precision, *records)[0]
    right = owned(*pairs) == 1
    assert np.array_equal((outcome == HIT)[~undecided], right[~undecided])


@pytest.mark.full
def test_a_million_random_pairs_and_rays_at_edges_are_all_right():
    for precision, dtype in DATA.items():
        check(random_pairs(1_000_000, 6, dtype), precision)
        check(aimed(200_000, 7, dtype), precision)
