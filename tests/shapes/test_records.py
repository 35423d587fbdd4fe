"""Records of shapes and their boxes."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
import shape_draws as draws
from exact_shapes import Shape
from shape_loops import ALL

from rtbench.shapes import records

REALS = (np.float32, np.float64)


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
def test_records(real):
    cone = records.cone((1, 2, 3), (1, 2, 7), 2, 1, real)
    assert cone.dtype == records.shape_type(real) and cone.dtype.isalignedstruct
    assert cone["point"].tolist() == [1, 2, 3] and cone["axis"].tolist() == [0, 0, 1]
    assert [float(cone[each]) for each in ("radius", "height", "slope")] == [2, 4, -0.25]
    both = records.joined([cone, records.sphere([(0, 0, 0), (1, 1, 1)], [1, 2], real)], real)
    assert both.dtype == records.shape_type(real) and both.shape == (3,)
    assert both["kind"].tolist() == [records.CONE, records.SPHERE, records.SPHERE]
    assert both["radius"].tolist() == [2, 1, 2]
    assert records.disc((0, 0, 0), (0, -3, 0), 1, real)["axis"].tolist() == [0, -1, 0]
    assert records.plane((0, 0, 0), (0, 0, 1e-30), real)["axis"].tolist() == [0, 0, 1]


def test_boxes_by_hand():
    found = records.boxes(
        records.joined(
            [
                records.sphere((1, 2, 3), 2),
                records.cone((0, 0, 0), (0, 0, 4), 2, 1),
                records.disc((0, 5, 0), (0, 1, 0), 3),
                records.disc((0, 0, 0), (0, 1, 1), 1),
                records.plane((0, 0, 0), (0, 1, 0)),
            ]
        )
    )
    half = np.sqrt(0.5)
    expected = [
        [-1, 0, 1, 3, 4, 5],
        [-2, -2, 0, 2, 2, 4],
        [-3, 5, -3, 3, 5, 3],
        [-1, -half, -half, 1, half, half],
        [-np.inf] * 3 + [np.inf] * 3,
    ]
    assert np.allclose(found, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
@pytest.mark.parametrize("kind", ALL[:3])
def test_boxes_hold_their_shapes_and_touch_them(kind, real):
    draw = np.random.default_rng(6)
    shapes = draws.shapes(draw, kind, 40, real)
    boxes = records.boxes(shapes)
    assert boxes.dtype == np.float64
    assert (boxes.astype(real) == boxes).all()
    for shape, box in zip(shapes, boxes, strict=True):
        many = np.broadcast_to(shape, 10000).copy()
        points, _ = draws.surface_points(draw, many)
        size = float(draws.extents(many[:1])[0])
        # What the points themselves, in float64, may be off.
        off = 4 * np.finfo(np.float64).eps * (np.abs(shape["point"]).max() + size)
        assert (points.min(axis=0) >= box[:3] - off).all()
        assert (points.max(axis=0) <= box[3:] + off).all()
        near = 0.05 * size + 8 * np.finfo(real).eps * np.abs(shape["point"]).max()
        assert (points.min(axis=0) <= box[:3] + near).all()
        assert (points.max(axis=0) >= box[3:] - near).all()


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
@pytest.mark.parametrize("kind", ALL[:3])
def test_boxes_are_as_tight_as_rounding_lets_them_be(kind, real):
    """Against the radius times the sine of the angle to the axis, with 60 digits."""
    draw = np.random.default_rng(7)
    shapes = draws.shapes(draw, kind, 300, real)
    for record, box in zip(shapes, records.boxes(shapes), strict=True):
        with localcontext() as context:
            context.prec = 60
            shape = Shape(record)
            other_radius = max(shape.radius + shape.slope * shape.height, Decimal(0))
            for k in range(3):
                cosine = 0 if kind == "spheres" else min(abs(shape.axis[k]), Decimal(1))
                sine = (1 - cosine * cosine if cosine else Decimal(1)).sqrt()
                first = shape.point[k]
                second = first + shape.axis[k] * shape.height
                low = min(first - shape.radius * sine, second - other_radius * sine)
                high = max(first + shape.radius * sine, second + other_radius * sine)
                near = shape.radius + other_radius + shape.height
                near = Decimal(float(np.finfo(real).eps)) * (6 * near + 2 * abs(first))
                assert low - near <= Decimal(box[k]) < low
                assert high < Decimal(box[3 + k]) <= high + near
