"""The loop of kind nearest against a plain Python loop over exact answers."""

from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy.exact import line_hit
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import REAL_TYPE, fill
from rtbench.compiled.loops import loop
from rtbench.errors import RtbenchError
from rtbench.kernels.registry import all_kernels, find

NAMES = ("wald_uv", "moller_trumbore_last_uv", "kensler_shirley_whole_uv", "moller1_uv", "chirkov")


def run(name, triangles, origins, directions, tmax, precision="float64", layout="own"):
    """Return index, t, u, v of each ray."""
    kernel = all_kernels()[name]
    vertices = tuple(np.ascontiguousarray(triangles[:, i]) for i in range(3))
    records = fill(kernel, layout, precision, vertices, origins, directions, tmax=tmax)
    return run_once(loop(kernel, precision, layout, kind="nearest"), kernel, precision, *records)


def soup(n_triangles, n_rays, seed):
    """Return triangles, each there twice and in a plane z of its own, and rays along z."""
    random = np.random.default_rng(seed)
    triangles = random.random((n_triangles, 3, 3))
    triangles[:, :, 2] = (1 + random.permutation(n_triangles) / 16)[:, None]
    triangles = random.permutation(np.concatenate([triangles, triangles])).astype(np.float32)
    origins = random.random((n_rays, 3)).astype(np.float32)
    origins[:, 2] = 0
    return triangles, origins, np.tile(np.float32([0, 0, 1]), (n_rays, 1))


def nearest(triangles, origins, directions, tmax):
    """Return index and t of the nearest hit of each ray, of equal ones the first."""
    found = []
    for origin, direction in zip(origins, directions, strict=True):
        index, best = -1, Fraction(tmax) if np.isfinite(tmax) else None
        for i, triangle in enumerate(triangles):
            hit, t, _, _ = line_hit(*triangle, origin, direction)
            if hit and t > 0 and (best is None or t < best):
                index, best = i, t
        found.append((index, tmax if best is None else float(best)))
    return found


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", NAMES)
def test_the_nearest_hit_of_each_ray_and_of_equal_ones_the_first(name, precision):
    triangles, origins, directions = soup(40, 200, 3)
    for tmax in (np.inf, 2.03, 1.5):
        expected = nearest(triangles, origins, directions, tmax)
        index, t, *_ = run(name, triangles, origins, directions, tmax, precision)
        assert index.tolist() == [i for i, _ in expected]
        assert np.allclose(t, [far for _, far in expected], rtol=1e-5)
        assert -1 in index and len(set(index.tolist())) > 5


@pytest.mark.parametrize("name", NAMES)
def test_a_tie_goes_to_the_lower_index(name):
    triangle = np.array([[0.0, 0, 2], [4, 0, 2], [0, 4, 2]])
    far, near = (triangle + np.array([0, 0, z]) for z in (1, -1))
    order = np.array([far, triangle, triangle, near, near, triangle])
    rays = np.array([[1.0, 1, 0]]), np.array([[0.0, 0, 1]])
    assert run(name, order, *rays, np.inf)[0].tolist() == [3]
    assert run(name, order[[0, 1, 2]], *rays, np.inf)[0].tolist() == [1]
    assert run(name, order[[3, 4, 0]], *rays, np.inf)[0].tolist() == [0]
    index, t, *_ = run(name, order, *rays, 1.0)  # t == tmax is no hit
    assert (index.tolist(), t.tolist()) == ([-1], [1.0])


@pytest.mark.parametrize("name", NAMES)
def test_what_lies_behind_a_line_kernel_s_origin_is_no_hit(name):
    triangle = np.array([[[0.0, 0, -1], [4, 0, -1], [0, 4, -1]]])
    index, t, *_ = run(name, triangle, np.array([[1.0, 1, 0]]), np.array([[0.0, 0, 1]]), 9.0)
    assert (index.tolist(), t.tolist()) == ([-1], [9.0])


@pytest.mark.parametrize("precision", REAL_TYPE)
def test_u_and_v_are_those_of_the_triangle_that_is_hit(precision):
    near = np.array([[0.0, 0, 1], [4, 0, 1], [0, 4, 1]])
    triangles = np.array([near + np.array([0, 0, 2]), near, near[[0, 2, 1]]])
    index, t, u, v = run(
        "wald_uv", triangles, np.array([[1.0, 2, -1]]), np.array([[0.0, 0, 2]]), np.inf, precision
    )
    assert (index[0], t[0], u[0], v[0]) == (1, 1.0, 0.25, 0.5)


def test_a_kernel_without_t_has_no_nearest_hit():
    for name in ("wald_hit", "keidy_point"):
        with pytest.raises(RtbenchError, match="returns no t: nearest tests need one"):
            loop(find(name), kind="nearest")
