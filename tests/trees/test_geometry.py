"""What trees see of triangles: boxes that hold them, and numbers that stay what they are."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from rtbench.trees.geometry import Geometry


@pytest.mark.parametrize("offset", [0.0, 3.0, 1e6, -1e20])
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_boxes_hold_their_triangles(offset, precision):
    """Exactly, in rational numbers, wherever the scene lies; and by no more than a rounding."""
    rng = np.random.default_rng(1)
    triangles = rng.normal(size=(50, 3, 3)) * max(1.0, abs(offset) * 1e-3) + offset
    found = Geometry.of(triangles, precision)
    for k, corners in enumerate(found.corners):
        for axis in range(3):
            base = Fraction(float(found.base[axis]))
            exact = [Fraction(float(x)) - base for x in corners[:, axis]]
            low, high = (Fraction(float(found.boxes[k, axis + side])) for side in (0, 3))
            assert low <= min(exact) and max(exact) <= high
            grain = Fraction(float(np.spacing(np.float32(max(map(abs, exact))))))
            # Two roundings: of float64, and outward.
            assert min(exact) - low <= 2 * grain and high - max(exact) <= 2 * grain


@pytest.mark.parametrize("offset", [0.0, 3.0, 1e6])
def test_float32_corners_are_not_rounded(offset):
    """A corner that two triangles share stays one number: both sides of the boxes name it."""
    rng = np.random.default_rng(2)
    triangles = (rng.normal(size=(50, 3, 3)) + offset).astype(np.float32)
    found = Geometry.of(triangles)
    for axis in range(3):
        exact = triangles[:, :, axis].astype(float) - found.base[axis]
        np.testing.assert_array_equal(found.boxes[:, axis], exact.min(axis=1))
        np.testing.assert_array_equal(found.boxes[:, axis + 3], exact.max(axis=1))


def test_a_far_scene_is_seen_from_near():
    """In float64 a scene of size 1 at 1e12 keeps seven digits of its size."""
    rng = np.random.default_rng(3)
    triangles = rng.random((20, 3, 3)) + 1e12
    found = Geometry.of(triangles, "float64")
    assert np.abs(found.box).max() <= 2
    near = (triangles - found.base).min(axis=1)
    np.testing.assert_allclose(found.boxes[:, :3], near, atol=1e-6)


def test_flat_and_empty_scenes():
    """A flat scene has a flat box; of no triangles there is a box of zeros."""
    flat = np.zeros((3, 3, 3))
    flat[:, :, 2] = 5
    flat[:, 1, 0] = flat[:, 2, 1] = 1
    assert Geometry.of(flat).box.tolist() == [0, 0, 0, 1, 1, 0]
    assert Geometry.of(np.zeros((0, 3, 3))).box.tolist() == [0] * 6


def test_what_is_not_finite_in_the_precision_is_refused():
    """1e39 is a float64 but no float32."""
    triangles = np.ones((4, 3, 3))
    triangles[2, 1, 0] = 1e39
    with pytest.raises(ValueError, match=r"1 of 4 triangles are not finite in float32.* 2$"):
        Geometry.of(triangles, "float32")


def test_what_would_overflow_in_the_walk_is_refused():
    """A line that says how far is too far."""
    with pytest.raises(ValueError, match=r"reach 1e\+30.*scale the scene"):
        Geometry.of(np.full((1, 3, 3), 1e30))
