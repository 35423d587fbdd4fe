"""Field cases of one triangle and one ray: scales, places, flat triangles, special values."""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.field_edges import HALVES, SQUARE, box
from rtbench.workloads.hard_cases.field_list import FieldList
from rtbench.workloads.hard_cases.geometry import (
    Format,
    Geometry,
    Random,
    rotations,
    unit,
    ways,
)

CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def field(random: Random, form: Format, n: int) -> Geometry:
    """Field cases of single triangles; see `field_list`."""
    cases = FieldList(form)
    _special(cases)
    _boxes(cases)
    _places(cases, random, form)
    _flat(cases)
    return cases.geometry()


def _special(cases: FieldList) -> None:
    twice = SQUARE[HALVES[[0, 0]]]
    name, source = "two equal triangles: a tie", "OptiX forum 110450"
    cases.each(name, source, twice, [-0.25, 0.25, 1], [0, 0, -1])
    for sign in (1.0, -1.0):
        cases.case(
            "direction with a -0" if sign < 0 else "direction with a +0",
            "madmann #20",
            [[1, -1, 1], [1, 1, 1], [-1, 1, 1]],
            [0.25, 0.25, 0],
            [0, sign * 0.0, 1],
        )
    side = 2e-4
    name, source = "triangle of 0.2 mm", "tinybvh #283"
    cases.case(name, source, CORNER * side, [side / 3, side / 3, -1], [0, 0, 1])
    for nudge in (0, 1e-16, -1e-16):
        cases.case(
            f"direction changed by {nudge:g}",
            "nanort #30",
            [[-1, -1, 0], [2, -1, 0], [0, 2, 0]],
            [0.3, 0.2, 5],
            [nudge, 0, -1],
        )
    for scale in (1e-6, 1e-3, 1.0, 1e3):
        _segment(cases, scale)


def _segment(cases: FieldList, scale: float) -> None:
    origin, direction = np.array([[0.75, 0.75, -1e9], [0, 0, 2e9]]) * scale
    name, source = "segment beside the corner", "AMReX #5870"
    cases.case(name, source, CORNER * scale, origin, direction)


def _wide_box(cases: FieldList, width: float) -> None:
    name, source = "wide flat box from above", "embree #416"
    sizes = (width, width, 120000)
    cases.each(name, source, box(sizes), [1000, 2000, 240000], [0, 0, -1])


def _boxes(cases: FieldList) -> None:
    for size in (1e-4, 0.1, 1, 10, 1e4, 1e8):
        start = np.array([0.1, 0.2, 0.5]) * size
        name, source = "ray from a face of a box", "trimesh test_embree_duplicate_hits"
        cases.each(name, source, box(size), start, [0, 0, -1])
    _wide_box(cases, 5.89e8)


def _places(cases: FieldList, random: Random, form: Format) -> None:
    # A plane of 100 x 100, turned; every triangle has a ray of its own.
    turn = rotations(random, 1)[0]
    for _ in range(40):
        place = np.append(random.integers(-50, 50, 2), 0)
        half = random.integers(2)
        triangle = form.round((SQUARE[HALVES[half]] / 2 + place) @ turn)
        middle = triangle.mean(axis=0)
        origin = form.round(middle + 1e6 * turn[2])
        name = "plane from 1e6 away, at the middles of its triangles"
        cases.case(name, "embree", triangle, origin, unit(middle - origin))
    for scale in 10.0 ** np.arange(6):
        for above in 10.0 ** np.arange(0, -10, -1):
            for away in (1, -1):
                triangle = CORNER * scale + np.array([0, 0, scale])
                origin = np.array([0.25, 0.25, 1]) * scale + [0, 0, above]
                name = "start just above a triangle, up" if away > 0 else "the same, down"
                cases.case(name, "trimesh #48", triangle, origin, [0, 0, away])
    for size in 10.0 ** np.arange(8):
        triangle = form.round(size * (SQUARE[HALVES[0]] @ turn))
        origin = form.round(size * np.array([0.3, 0.2, 2]))
        ray = form.round(unit(triangle.mean(axis=0) - origin))
        cases.case("plane of a scene of any size", "mitsuba2 #171", triangle, origin, ray)
    name, source = "corners at 1e9", "pbrt #249"
    wide = 1e9 * np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
    for height in (1.0, 1e3, 1e6):
        cases.case(name, source, wide, [height / 3, height / 7, height], [0.1, 0.2, -1])
    turned = form.round(1e5 * SQUARE[HALVES[0]] @ turn)
    for height in (1e-3, 0.1, 10.0):
        origin = form.round(turned.mean(axis=0) / 1e3 + height * turn[2])
        name, source = "huge triangle next to the start", "Cycles T43865"
        cases.case(name, source, turned, origin, -turn[2])
    for _ in range(60):
        power = random.uniform(-8, 8, (3, 3))
        triangle = form.round(random.choice([-1, 1], (3, 3)) * 10**power)
        origin = form.round(random.dirichlet((1, 1, 1)) @ triangle)
        name, source = "spawned ray, coordinates of any size", "pbrt-v4 Triangle.Reintersect"
        cases.case(name, source, triangle, origin, ways(random))
    earth = unit(np.array([0.6, 0.1, 0.78])) * 6.4e6
    for _ in range(20):
        triangle = form.round(earth + 10 * (SQUARE[HALVES[0]] @ rotations(random, 1)[0]))
        origin = form.round(earth * (1 + 1e-3) + random.uniform(-9, 9, 3))
        name, source = "triangle of 10 m on the Earth", "OptiX forum 69745"
        cases.case(name, source, triangle, origin, unit(triangle.mean(axis=0) - origin))
    for radius, start in ((1, 0.0), (1 + 4e-5, 0.0), (1, 1.0), (1 + 4e-5, 1.0)):
        patch = np.array([[radius, -0.01, -0.01], [radius, 0.01, -0.01], [radius, 0, 0.01]])
        triangle = patch / np.linalg.norm(patch, axis=1, keepdims=True) * radius
        name, source = "concentric spheres of radius 1 and 1 + 4e-5", "mitsuba #1871"
        cases.case(name, source, triangle, [start, 1e-4, 2e-4], [1, 0, 0])


def _flat(cases: FieldList) -> None:
    cases.case(
        "three corners of a line",
        "pbrt-v4 Triangle.BadCases",
        [
            [-1113.45459, -79.049614, -56.2431908],
            [-1113.45459, -87.0922699, -56.2431908],
            [-1113.45459, -79.2090149, -56.2431908],
        ],
        [-1081.47925, 99.9999542, 87.7701111],
        [-32.1072998, -183.355865, -144.607635],
    )
    # Edges of about 11.2, 9.8 and 1.4: the third corner is 0.06 above the first edge.
    skinny = np.array([[300.0, 200, 100], [311.2, 200, 100], [309.8, 200.06, 100.02]])
    slope = np.tan(np.radians(0.52))
    plane = unit(np.cross(skinny[1] - skinny[0], skinny[2] - skinny[0]))
    along = unit(skinny[2] - skinny[0])
    across = np.cross(plane, along)
    for aim in (-20, -2, 2, 20):
        # Past the triangle, within its plane's neighbourhood, as reported: no hit.
        target = skinny[0] + aim * across
        origin = target - 500 * (across + slope * plane)
        name, source = "skinny triangle at 0.52 degrees", "embree #387"
        cases.case(name, source, skinny, origin, across + slope * plane)
    point = [[1.0, 2, 3]] * 3
    name, source = "object without area", "Cycles T45778"
    cases.case(name, source, point, [0, 0, 0], [1, 2, 3])
    cases.case(name, source, point, [0, 0, 0], [1, 2, 2])
    for bits in (18, 20, 22, 24):
        thin = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 2.0**-bits, 0]])
        name, source = "long thin triangle below a fixed epsilon", "madmann #28"
        cases.case(name, source, thin, [0.5, 2.0 ** -(bits + 1), 1], [0, 0, -1])
    source = "embree changelog 3.x"
    cases.case("ray in the plane", source, CORNER, [-1, 0.25, 0], [1, 0, 0])
    cases.case("ray in the plane, past", source, CORNER, [-1, 2, 0], [1, 0, 0])
    cases.case("start on the plane", source, CORNER, [0.25, 0.25, 0], [0, 0, 1])
    cases.case("start on the plane, beside", source, CORNER, [0.75, 0.75, 0], [0, 0, 1])
    for ulp in (2.0**-24, -(2.0**-24)):
        name = "plane just ahead of the start" if ulp > 0 else "plane just behind the start"
        cases.case(name, source, CORNER + np.array([0, 0, 0.5 + ulp]), [0.25, 0.25, 0.5], [0, 0, 1])
    leaning = [[-1.3836679, -4.4803119, 10], [3.9273109, 5.8979445, 8], [-1.3836679, -4.4803119, 8]]
    for move in range(-5, 6):
        for axis in (0, 1):
            origin = np.array([-0.0282217, -2.5058889, 8])
            origin[axis] += move * 1e-3
            name, source = "ray in the plane of an edge, moved by 1e-3", "three-mesh-bvh #684"
            cases.case(name, source, leaning, origin, [-0.16852837, 0.98569680, 0])


def field_range(random: Random, form: Format, n: int) -> Geometry:
    """Field cases of NaN, infinities, a denormal t, and products that overflow float32."""
    cases = FieldList(form)
    for width in (5.89e9, 5.89e10, 5.89e11):
        _wide_box(cases, width)
    _segment(cases, 1e6)
    origin, direction = [0.25, 0.25, 1.0], [0.0, 0, -1]
    odd = 1 if form.bits == 24 else 1 + 2.0**-30
    for bad in (np.nan, np.inf, -np.inf):
        for axis in range(3):
            broken = list(origin)
            broken[axis] = bad
            cases.case("no number in the origin", "embree tests", CORNER * odd, broken, direction)
            broken = list(direction)
            broken[axis] = bad
            cases.case("no number in the direction", "embree tests", CORNER * odd, origin, broken)
        cases.case("no number in the ray", "embree tests", CORNER * odd, [bad] * 3, [bad] * 3)
    for tiny in (1e-37, 1e-39, 1e-41, 1e-44, 1e-300, 1e-310, 1e-320):
        if form.round(tiny) > 0:
            name, source = "denormal t", "Cycles 32b341774"
            cases.case(name, source, CORNER, [0.25, 0.25, tiny], direction)
    return cases.geometry()
