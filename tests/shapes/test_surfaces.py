"""Normals of shapes, and points moved back onto them."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
import shape_draws as draws
from exact_shapes import Shape, numbers
from shape_loops import ALL, surface

from rtbench.shapes import records

REALS = (np.float32, np.float64)
SHAPES = 2000


def _places(kind, real, spread=(-3, 5)):
    draw = np.random.default_rng(9)
    shapes = draws.shapes(draw, kind, SHAPES, real, spread)
    points, normals = draws.surface_points(draw, shapes)
    return draw, shapes, points, normals


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
@pytest.mark.parametrize("kind", ALL)
def test_normals(kind, real):
    """Against those of a parametrisation, as exact as the rounded points are."""
    _, shapes, points, expected = _places(kind, real)
    normals, _ = surface(shapes, points.astype(real))
    eps = np.finfo(real).eps
    assert (np.abs(np.linalg.norm(normals.astype(float), axis=1) - 1) <= 4 * eps).all()
    # How far from a sphere's centre, or a cone's axis: a point that is off turns the normal by so
    # much.
    reach = shapes["radius"].astype(float)
    if kind == "cones":
        w = points - shapes["point"]
        reach = np.linalg.norm(np.cross(w, shapes["axis"].astype(float)), axis=1)
    flat = kind in ("discs", "planes")
    off = np.abs(points).max(axis=1) + draws.extents(shapes)
    turned = 4 * eps * (1 + (0 if flat else off / np.maximum(reach, 1e-300)))
    near = np.linalg.norm(normals - expected, axis=1) <= np.minimum(turned, 2.0)
    assert near.all(), np.flatnonzero(~near)[:5]


@pytest.mark.parametrize("kind", ALL)
def test_normals_are_across_the_surface(kind):
    """By finite differences of the surface: neighbours, moved onto it, lie across the normal."""
    _, shapes, points, _ = _places(kind, np.float64, (-1, 1))
    normals, _ = surface(shapes, points)
    step = 1e-5 * np.maximum(draws.extents(shapes), 1e-3)
    if kind == "cones":  # a tip has no tangent plane
        across = np.linalg.norm(np.cross(points - shapes["point"], shapes["axis"]), axis=1)
        chosen = across > 0.05 * draws.extents(shapes)
    else:
        chosen = np.ones(SHAPES, bool)
    assert chosen.sum() > SHAPES // 4
    sides = []
    for sign in (-1, 1):
        beside = np.cross(normals, draws.directions(np.random.default_rng(1), SHAPES))
        _, moved = surface(shapes, points + beside * (sign * step)[:, None])
        sides.append(moved)
    tangent = (sides[1] - sides[0]) / (2 * step)[:, None]
    assert (np.abs(np.sum(tangent * normals, axis=1))[chosen] < 1e-6).all()
    if kind in ("spheres", "cones"):  # outward
        w = points - shapes["point"]
        if kind == "cones":
            w = w - shapes["axis"] * np.sum(w * shapes["axis"], axis=1)[:, None]
        assert (np.sum(w * normals, axis=1)[chosen] > 0).all()


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
@pytest.mark.parametrize("kind", ALL)
def test_points_are_moved_onto_the_surface(kind, real):
    """What was off by a thousandth of the size is off by a few roundings, nor has it gone far."""
    draw, shapes, points, normals = _places(kind, real)
    size = draws.extents(shapes)
    if kind == "cones":
        lean = 1 / np.sqrt(1 + shapes["slope"].astype(float) ** 2)
        size = np.minimum(size, shapes["height"] / lean)
    away = 1e-3 * size * draw.uniform(-1, 1, SHAPES)
    if kind == "cones":  # not through the axis to the other side
        w = points - shapes["point"]
        reach = np.linalg.norm(np.cross(w, shapes["axis"].astype(float)), axis=1)
        away = np.clip(away, -0.5 * reach, None)
    given = (points + normals * away[:, None]).astype(real)
    _, moved = surface(shapes, given)
    eps = float(np.finfo(real).eps)
    moves = np.linalg.norm(moved.astype(float) - given, axis=1)
    reach = np.abs(points).max(axis=1) + np.abs(shapes["point"]).max(axis=1) + draws.extents(shapes)
    assert (moves <= 1.1 * np.abs(away) + 8 * eps * reach).all()
    with localcontext() as context:
        context.prec = 60
        for k in range(0, SHAPES, 4):
            off = Shape(shapes[k]).distance(numbers(moved[k]))
            assert off <= Decimal(4 * eps * float(reach[k])), k


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
def test_the_tip_of_a_cone_has_a_normal(real):
    shapes = records.joined(
        [
            records.cone((0, 0, 0), (0, 0, 2), 1, 0, real),
            records.cone((0, 0, 2), (0, 0, 0), 0, 1, real),
        ],
        real,
    )
    normals, moved = surface(shapes, np.array([(0, 0, 2), (0, 0, 2)], real))
    assert (normals == [(0, 0, 1), (0, 0, 1)]).all()
    assert (moved == [(0, 0, 2), (0, 0, 2)]).all()
