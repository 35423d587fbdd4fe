"""The filter of rays never contradicts exact arithmetic, and leaves little open."""

import numpy as np
import pytest

from rtbench.accuracy import elimination, oracle
from rtbench.accuracy.bounds import UNDECIDED
from rtbench.accuracy.cases import EXPECT, HIT_INTERIOR
from rtbench.accuracy.exact import HIT, MISS
from rtbench.accuracy.ray_filter import filtered_rays
from rtbench.accuracy.ties import sos_hit

N = 400


def random_rays(rng):
    return rng.normal(size=(N, 5, 3))


def grid(rng):
    return rng.integers(-2, 3, (N, 5, 3)).astype(float)


def aimed_at_edges(rng):
    rays = rng.normal(size=(N, 5, 3))
    along = rng.random((N, 1))
    rays[:, 4] = rays[:, 0] * along + rays[:, 1] * (1 - along) - rays[:, 3]
    return rays


def aimed_at_vertices(rng):
    rays = rng.random((N, 5, 3))
    rays[:, 4] = rays[:, 2] - rays[:, 3]
    return rays


def from_the_plane(rng):
    """Origins on the triangle, but for rounding: t is nearly 0, of either sign."""
    rays = rng.normal(size=(N, 5, 3))
    rays[:, 3] = np.einsum("ij,ijk->ik", rng.dirichlet([1, 1, 1], N), rays[:, :3])
    return rays


def behind(rng):
    rays = from_the_plane(rng)
    rays[:, 4] *= np.sign(rng.normal(size=(N, 1)))
    rays[:, 3] += rays[:, 4] * 10.0 ** rng.uniform(-20, 0, (N, 1))
    return rays


def flat(rng):
    """In the plane or nearly so."""
    rays = rng.normal(size=(N, 5, 3))
    rays[:, :, 2] = rng.choice([0, 1e-17], (N, 5))
    return rays


def needles(rng):
    rays = aimed_at_edges(rng)
    rays[:, 2] = (rays[:, 0] + rays[:, 1]) / 2 + rng.normal(size=(N, 3)) * 1e-14
    return rays


def any_scale(rng):
    return random_rays(rng) * 10.0 ** rng.uniform(-300, 300, (N, 5, 3))


def middle_scale(rng):
    return random_rays(rng) * 10.0 ** rng.uniform(-12, 12, (N, 5, 3))


def tiny(rng):
    return aimed_at_edges(rng) * 1e-150


def invalid(rng):
    rays = rng.normal(size=(N, 5, 3))
    bad = rng.choice([np.nan, np.inf, -np.inf, 0.0], N)
    which, axis = rng.integers(0, 5, N), rng.integers(0, 3, N)
    rays[np.arange(N), which, axis] = bad
    rays[bad == 0.0, 4] = 0.0
    return rays


FAMILIES = [
    *(random_rays, grid, aimed_at_edges, aimed_at_vertices, from_the_plane, behind, flat),
    *(needles, any_scale, middle_scale, tiny, invalid),
]
CASES = [
    (f, t) for f in FAMILIES for t in ("f8", "f4") if not (f in (any_scale, tiny) and t < "f8")
]


@pytest.mark.parametrize(("family", "dtype"), CASES, ids=[f"{f.__name__}-{t}" for f, t in CASES])
def test_never_contradicts_rationals(family, dtype):
    rays = family(np.random.default_rng(1)).astype(dtype)
    arrays = [np.ascontiguousarray(a) for a in (rays[:, :3], rays[:, 3], rays[:, 4])]
    found = filtered_rays(*arrays)
    classes = np.array([elimination.decide(*ray).cls for ray in rays.tolist()])
    assert set(classes[found == HIT].tolist()) <= {HIT_INTERIOR}
    assert set(EXPECT[classes[found == MISS]].tolist()) <= {0}
    np.testing.assert_array_equal(oracle.expectations(*arrays), EXPECT[classes])
    ties = [sos_hit(*ray) for ray in rays.tolist()]
    np.testing.assert_array_equal(oracle.owned(*arrays), ties)


def test_random_pairs_are_nearly_all_decided():
    rng = np.random.default_rng(2)
    rays = rng.random((100_000, 5, 3), dtype=np.float32)
    rays[:, 4] -= 0.5
    arrays = [np.ascontiguousarray(a) for a in (rays[:, :3], rays[:, 3], rays[:, 4])]
    found = filtered_rays(*arrays)
    assert np.count_nonzero(found == UNDECIDED) < 5
    assert np.count_nonzero(found == HIT) > 1000
    flipped = filtered_rays(arrays[0], arrays[1], -arrays[2])
    # A line that hits does so either ahead of or behind its origin.
    assert not np.any((found == HIT) & (flipped == HIT)) and np.any(flipped == HIT)
