"""Where shapes are hit: against exact arithmetic, with rays of all kinds and at all scales."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import shape_draws as draws
from exact_shapes import judged, roots
from shape_loops import ALL, compiled, hit_all, hit_all_by_tuples, hits, rays_of

from rtbench.errors import RtbenchError
from rtbench.shapes import any_shape, records
from rtbench.shapes.sphere import sphere

REALS = (np.float32, np.float64)
# How far an answer may be off, as a shift of the ray: so many halves of an eps of the distance from
# where it starts to the shape, plus the shape's size. Roundings of that size add up: the vector
# between the two (1), its product with the direction (2), the quotient (2), and what moves along
# the ray by it (2); then those of the shape's size.
ROUNDINGS = 8
RAYS, SELDOM = 700, 3000

CASES = [
    (kind, way)
    for kind, ways in {
        "spheres": (draws.rays_from_outside, draws.rays_from_inside, draws.rays_that_graze),
        "cones": (
            *(draws.rays_from_outside, draws.rays_from_inside, draws.rays_that_graze),
            *(draws.rays_along, draws.rays_near_a_tip, draws.rays_at_the_rim),
        ),
        "discs": (
            *(draws.rays_from_outside, draws.rays_from_inside, draws.rays_that_graze),
            draws.rays_at_the_rim,
        ),
        "planes": (draws.rays_from_outside, draws.rays_that_graze),
    }.items()
    for way in ways
] + [(kind, draws.rays_on_the_surface) for kind in ("spheres", "cones")]


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
@pytest.mark.parametrize(
    "kind, way", CASES, ids=lambda each: getattr(each, "__name__", each).removeprefix("rays_")
)
def test_hits_are_those_of_exact_arithmetic(kind, way, real):
    draw = np.random.default_rng(len(kind))
    count = SELDOM if way in (draws.rays_along, draws.rays_near_a_tip) else RAYS
    shapes = draws.shapes(draw, kind, count, real)
    itself = way is draws.rays_on_the_surface
    rays = rays_of(*way(draw, shapes), itself, real)
    t = hits(shapes, rays)
    wrong = [
        f"{k}: {told}"
        for k in range(count)
        if (told := judged(shapes[k], rays[k], t[k], ROUNDINGS))
    ]
    assert not wrong, wrong[:5]
    # The bounds leave few rays undecided but those that are meant to graze.
    if way in (draws.rays_from_inside, draws.rays_from_outside):
        known = [roots(shapes[k], rays[k], ROUNDINGS)[0] for k in range(count)]
        assert sum(any(each.sure for each in found) for found in known) > count // 4
        assert sum(bool(found) and not any(e.sure for e in found) for found in known) < count // 20


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
def test_hits_of_simple_numbers(real):
    """By hand; each number is one that is computed without rounding."""
    ball = records.sphere((0, 0, 0), 5, real)
    tube = records.cone((0, 0, 0), (0, 0, 8), 5, 5, real)
    tip = records.cone((0, 0, 0), (0, 0, 4), 4, 0, real)
    dish = records.disc((0, 0, 1), (0, 0, 2), 5, real)
    floor = records.plane((0, 0, 1), (0, 0, -3), real)
    cases = [
        (ball, (3, 0, -10), (0, 0, 1), 0, 6.0),
        (ball, (3, 0, -10), (0, 0, 2), 0, 3.0),
        (ball, (3, 0, 0), (0, 0, 1), 0, 4.0),
        (ball, (3, 0, 10), (0, 0, 1), 0, -1.0),
        (ball, (6, 0, -10), (0, 0, 1), 0, -1.0),
        (ball, (5, 0, -10), (0, 0, 1), 0, 10.0),  # touches
        (ball, (3, 0, -4), (0, 0, 1), 1, 8.0),
        (ball, (3, 0, -4), (0, 0, -1), 1, -1.0),
        (tube, (-10, 3, 1), (1, 0, 0), 0, 6.0),
        (tube, (0, 3, 1), (1, 0, 0), 0, 4.0),
        (tube, (-10, 3, -1), (1, 0, 0), 0, -1.0),  # beyond the end
        (tube, (-10, 3, -1), (4, 0, 1), 0, 1.5),
        (tube, (-10, 0, -6), (2, 0, 1), 0, 7.5),  # before the end in front, then the back
        (tube, (-10, 6, 1), (1, 0, 0), 0, -1.0),
        (tube, (3, 0, -1), (0, 0, 1), 0, -1.0),  # inside, along the axis
        (tube, (6, 0, -1), (0, 0, 1), 0, -1.0),
        (tube, (-3, 4, 1), (1, 0, 0), 1, 6.0),
        (tube, (-3, 4, 1), (-1, 0, 0), 1, -1.0),
        (tube, (-3, 4, 1), (0, 0, 1), 1, -1.0),  # along a side
        (tip, (-10, 0, 2), (1, 0, 0), 0, 8.0),
        (tip, (0, 0, 2), (1, 0, 0), 0, 2.0),
        (tip, (0, 0, -2), (0, 0, 1), 0, 6.0),  # the tip itself
        (tip, (-10, 0, 5), (1, 0, 0), 0, -1.0),  # there is no other nappe
        (tip, (-8, 0, 0), (1, 0, 1), 0, -1.0),  # in a plane with the axis, along the other side
        (tip, (0, 0, 0), (1, 0, 1), 0, 2.0),  # along one side, to the other
        (tip, (2, 0, 2), (-1, 0, 1), 1, -1.0),  # along its own side
        (tip, (2, 0, 2), (-1, 0, 0), 1, 4.0),
        (dish, (3, 4, 9), (0, 0, -2), 0, 4.0),
        (dish, (3, 5, 9), (0, 0, -2), 0, -1.0),
        (dish, (0, 0, 9), (0, 0, 1), 0, -1.0),
        (dish, (-9, 0, 1), (1, 0, 0), 0, -1.0),
        (dish, (0, 0, 1), (0, 0, 1), 1, -1.0),
        (floor, (1e3, 0, 9), (0, 0, -2), 0, 4.0),
        (floor, (0, 0, 9), (1, 0, 0), 0, -1.0),
        (floor, (0, 0, 1), (1, 0, 0), 0, -1.0),
        (floor, (0, 0, 1), (0, 1, 1), 1, -1.0),
    ]
    shapes = records.joined([case[0] for case in cases], real)
    rays = rays_of(*([case[k] for case in cases] for k in (1, 2, 3)), real)
    t = hits(shapes, rays)
    for case, got in zip(cases, t, strict=True):
        assert got == case[4], (case, got)


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
@pytest.mark.parametrize("kind", ALL)
def test_scale_changes_no_digit(kind, real):
    """A power of two rounds nothing: neither the scene's size counts nor the direction's."""
    draw = np.random.default_rng(2)
    shapes = draws.shapes(draw, kind, 2000, real, (-1, 1))
    rays = rays_of(*draws.rays_from_outside(draw, shapes), 0, real)
    t = hits(shapes, rays)
    for length, speed in ((2.0**12, 1.0), (2.0**-12, 1.0), (1.0, 2.0**10), (1.0, 2.0**-10)):
        scaled, other = shapes.copy(), rays.copy()
        for name in ("point", "radius", "height"):
            scaled[name] *= real(length)
        other["orig"] *= real(length)
        other["dir"] *= real(speed)
        expected = np.where(t > 0, t * real(length / speed), t)
        assert hits(scaled, other).tobytes() == expected.astype(real).tobytes()


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
def test_rays_along_their_own_side_hit_nothing(real):
    """All of it lies on the surface, up to rounding: any t would be one, and none is a hit."""
    draw = np.random.default_rng(2)
    shapes = draws.shapes(draw, "cones", 5000, real, (0, 0.3))
    rays = rays_of(*draws.rays_along_their_own_side(draw, shapes), 1, real)
    t = hits(shapes, rays)
    assert (t == -1).all(), (t != -1).mean()


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
def test_rays_that_are_none_hit_nothing(real):
    draw = np.random.default_rng(3)
    for kind in ALL:
        shapes = draws.shapes(draw, kind, 96, real)
        orig, dir = draws.rays_from_outside(draw, shapes)
        for itself in (0, 1):
            for value in (math.nan, math.inf, -math.inf):
                for k in range(6):
                    part, axis = (orig, dir)[k // 3], k % 3
                    kept = part[k::6, axis].copy()
                    part[k::6, axis] = value
                    t = hits(shapes, rays_of(orig, dir, itself, real))
                    part[k::6, axis] = kept
                    assert (t[k::6] == -1).all(), (kind, value, k)
            assert (hits(shapes, rays_of(orig, 0 * dir, itself, real)) == -1).all()


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
@pytest.mark.parametrize("kind", ALL)
def test_what_is_left_out_changes_no_bit(kind, real):
    draw = np.random.default_rng(4)
    shapes = draws.shapes(draw, kind, 20000, real)
    rays = rays_of(*draws.rays_from_outside(draw, shapes), draw.random(20000) < 0.3, real)
    full = hits(shapes, rays)
    assert 0.05 < (full > 0).mean() < 0.999
    assert hits(shapes, rays, (kind,)).tobytes() == full.tobytes()
    assert hits(shapes, rays, entry=hit_all_by_tuples).tobytes() == full.tobytes()
    others = tuple(each for each in ALL if each != kind)
    if kind == "spheres":
        assert (hits(shapes, rays, others) == -1).all()


def test_kinds_left_out_are_not_compiled():
    only = compiled(hit_all, np.float64, ("spheres",)).call.py_func.__globals__
    assert [only[each].signatures for each in ("cone", "disc", "plane")] == [[], [], []]
    assembly = compiled(hit_all, np.float64, ("spheres",)).assembly
    assert len(assembly) < len(compiled(hit_all, np.float64).assembly)


def test_plain_python_runs_the_same_function():
    ball = SimpleNamespace(point=(0.0, 0.0, 2.0), radius=1.0)
    assert sphere(ball, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), False) == 1.0


def test_unknown_kinds_are_told():
    with pytest.raises(RtbenchError, match="spheres"):
        any_shape.constants(("sphere",))


@pytest.mark.parametrize("real", REALS, ids=lambda real: real.__name__)
def test_a_ball_that_is_all_but_lost(real):
    """A far small sphere hit through its middle: t is the distance minus the radius.

    What b^2 - a c keeps of the radius is nothing here: 1 of 10^10, 1 of 10^20.
    """
    far = {np.float32: 2.0**16, np.float64: 2.0**34}[real]
    shapes = records.joined([records.sphere((0, 0, far), 1.0, real)] * 2, real)
    rays = rays_of([(0.5, 0, 0), (1.5, 0, 0)], [(0, 0, 1)] * 2, 0, real)
    t = hits(shapes, rays)
    assert abs(t[0] - (far - math.sqrt(0.75))) <= 2 * far * np.finfo(real).eps
    assert t[1] == -1
