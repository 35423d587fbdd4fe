"""Triangles that an absolute EPSILON makes invisible."""

from __future__ import annotations

import numpy as np
import pytest

import rtbench
from rtbench.kernels import registry
from rtbench.trees.never_hit import never_hit, remark


def small(edge: float) -> np.ndarray:
    """One right-angled triangle in z = 0."""
    return np.array([[[0, 0, 0], [edge, 0, 0], [0, edge, 0]]], float)


@pytest.mark.parametrize("name", ["moller0", "moller1", "moller2", "moller3"])
def test_a_triangle_said_to_be_never_hit_is_not(name):
    """Just below EPSILON the best of rays misses; just above, it hits."""
    kernel = registry.find(name)
    for edge, never in ((0.9e-3, True), (1.1e-3, False)):
        triangles = small(edge)
        assert never_hit(kernel, triangles).tolist() == [never]
        ray = [[edge / 4, edge / 4, -1]], [[0, 0, 1]]  # at right angles, of length 1
        assert rtbench.intersect(name, triangles, *ray, "float64").hit.tolist() == [not never]


def test_who_has_no_epsilon_hits_all():
    """Nothing is remarked of kernels that compare with no absolute number."""
    triangles = small(1e-6)
    for name in ("moller_trumbore", "watertight_safe", "adaptive_exact", "badouel"):
        assert remark(registry.find(name), triangles) is None
    told = remark(registry.find("moller1"), np.concatenate([triangles, small(1.0)]))
    assert "1 of 2 triangles (50 %)" in told and "moller1" in told
