"""The pieces of every method, as rationals, against Cramer's rule; and the misprints of the thesis.

For O + t D = A + b AB + c AC the determinants of the three equations are written out here; a
method's pieces must be these up to one factor, whatever it stores and however it goes about it.
"""

import dataclasses
import importlib.util
from fractions import Fraction

import numpy as np
import pytest

from rtbench.compiled.exact import exact_form, exact_records
from rtbench.kernels.contract import HIT
from rtbench.kernels.pieces import POINT_PARAMETERS
from rtbench.kernels.pluecker import coordinates
from rtbench.kernels.projection import dominant
from rtbench.kernels.registry import all_kernels, find
from rtbench.kernels.vectors import corners, cross, difference, dot
from rtbench.workloads.pairs import random_pairs

METHODS = {k.function.__name__: k for k in all_kernels().values() if k.ending is not None}


def determinant(rows):
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def rational(vector):
    return [Fraction(float(x)) for x in vector]


def minus(p, q):
    return [x - y for x, y in zip(p, q, strict=True)]


def cramer(triangle, origin, direction):
    """Return the determinants of the system and of t, b, c."""
    (a, b, c), o, d = map(rational, triangle), rational(origin), rational(direction)
    columns = [[-x for x in d], minus(b, a), minus(c, a)]
    right = minus(o, a)
    found = [determinant(columns)]
    for place in range(3):
        found.append(determinant([*columns[:place], right, *columns[place + 1 :]]))
    return found


def drawn(n=250):
    """Return random pairs, and small integers with lines through edges and vertices."""
    pairs = random_pairs(n, "pcg64", seed=12)
    random = np.random.default_rng(11)
    triangles = random.integers(0, 4, (n, 3, 3)).astype(float)
    origins = random.integers(-1, 5, (n, 3)).astype(float)
    ends = triangles[np.arange(n), random.integers(0, 3, n)]
    middle = (ends + triangles[np.arange(n), random.integers(0, 3, n)]) / 2
    found = (
        (np.stack([pairs.v0, pairs.v1, pairs.v2], axis=1), pairs.orig, pairs.dir),
        (triangles, origins, middle - origins),
    )
    return tuple(np.concatenate(each).astype(float) for each in zip(*found, strict=True))


PAIRS = drawn()
EXPECTED = [cramer(*pair) for pair in zip(*PAIRS, strict=True)]
RIGHT = [  # what a ray hits, t > 0, by the determinants
    det != 0 and t / det > 0 and b / det >= 0 and c / det >= 0 and (b + c) / det <= 1
    for det, t, b, c in EXPECTED
]


def records(kernel):
    triangles, origins, directions = PAIRS
    return exact_records(kernel, tuple(triangles[:, i] for i in range(3)), origins, directions)


def hits(kernel):
    form = exact_form(kernel)
    return [form(tri, ray)[0] == HIT for tri, ray in zip(*records(kernel), strict=True)]


def test_the_pairs_hit_inside_and_on_edges_and_vertices():
    least = [sorted((b / det, c / det, 1 - (b + c) / det)) for det, _, b, c in EXPECTED if det != 0]
    assert sum(first > 0 for first, *_ in least) > 20
    assert sum(first == 0 < second for first, second, _ in least) > 20
    assert sum(first == second == 0 for first, second, _ in least) > 20
    assert sum(det == 0 for det, *_ in EXPECTED) > 20


@pytest.mark.parametrize("name", METHODS)
def test_pieces_are_cramer_s_determinants_up_to_one_factor(name):
    kernel = METHODS[name]
    for tri, ray, triangle, (det, t, b, c) in zip(
        *records(kernel), PAIRS[0], EXPECTED, strict=True
    ):
        if det == 0:
            continue
        for found, scale in ways(kernel.function, tri, ray):
            denominator, own_t, own_b, own_c, own_a, area, normal = found
            assert denominator != 0
            assert own_t * det == t * denominator
            below = (denominator if scale is None else scale) * (1 if area is None else area)
            assert below != 0
            assert (own_b * det, own_c * det) == (b * below, c * below)
            assert own_a is None or own_a * det == (det - b - c) * below
            if normal is not None:
                corner, *others = map(rational, triangle)
                for edge in (minus(other, corner) for other in others):
                    assert sum(x * y for x, y in zip(normal, edge, strict=True)) == 0
                assert any(normal)


def ways(function, tri, ray):
    """Return the pieces, and by what beside the area b and c are divided (None: denominator).

    Of a method that meets the plane first those at the point, and those at the point times the
    denominator, which it has when the division is moved.
    """
    if list(function.__code__.co_varnames[: function.__code__.co_argcount]) != POINT_PARAMETERS:
        return [(function(tri, ray), None)]
    denominator, t, *_ = function(tri, ray, Fraction(0), Fraction(1))
    return [
        (function(tri, ray, t / denominator, Fraction(1)), Fraction(1)),
        (function(tri, ray, t, denominator), denominator),
    ]


# The forms with u and v decide as those without do; `inside` tests a point.
WITH_UV = [
    n
    for n, k in all_kernels().items()
    if k.ending and k.ending.name not in ("text9", "inside") and len(k.outputs) == 3
]


@pytest.mark.parametrize("name", WITH_UV)
def test_every_ending_in_rationals_is_the_exact_answer_on_edges_and_flat_triangles_too(name):
    kernel = all_kernels()[name]
    form = exact_form(kernel)
    for tri, ray, right, (det, t, b, c) in zip(*records(kernel), RIGHT, EXPECTED, strict=True):
        outcome, *outputs = form(tri, ray)
        assert (outcome == HIT) == right
        if right:
            assert tuple(outputs) == (t / det, b / det, c / det)


def printed_coordinates(tri):
    """The six coordinates as 3.2.4 prints them; the ray's own last one, -D_y, meets column 1."""
    a, b, c = corners(tri)
    normal = cross(difference(b, a), difference(c, a))
    return {
        "bc": printed_line(b, c),
        "ca": printed_line(c, a),
        "ab": printed_line(a, b),
        "n": normal,
        "nd": dot(normal, a),
    }


def printed_line(p, q):
    return (
        p[0] * q[1] - q[0] * p[1],
        -(p[0] * q[2] - q[0] * p[2]),
        p[0] - q[0],
        p[1] * q[2] - q[1] * p[2],
        p[2] - q[2],
        p[1] - q[1],
    )


def test_pluecker_s_last_coordinate_as_printed_loses_nearly_all_hits():
    right = find("pluecker_stored_uv")
    assert right.prepare is coordinates and hits(right) == RIGHT
    printed = hits(dataclasses.replace(right, prepare=printed_coordinates))
    inside = slice(0, 250)  # on integers, edges that lie along axes are right by chance
    lost = sum(r and not p for r, p in zip(RIGHT[inside], printed[inside], strict=True))
    assert lost > 0.9 * sum(RIGHT[inside]) > 10


SHEVTSOV = """
from rtbench.kernels.projection import along, dominant
from rtbench.kernels.vectors import corners, cross, difference

def made(tri):
    a, b, c = corners(tri)
    ab, ac = difference(b, a), difference(c, a)
    normal = cross(ab, ac)
    w = dominant(normal)
    u = {u}
    v = {v}
    nw = along(normal, w)
    signed = {sign} * nw if w == 1 else nw
    nu, nv = along(normal, u) / nw, along(normal, v) / nw
    return {{
        "nu": nu,
        "nv": nv,
        "nd": nu * along(a, u) + nv * along(a, v) + along(a, w),
        "au": along(a, u),
        "av": along(a, v),
        "eou": along(ab, u) / signed,
        "eov": along(ab, v) / signed,
        "eiu": along(ac, u) / signed,
        "eiv": along(ac, v) / signed,
        "w": w,
        "u": u,
        "v": v,
    }}
"""
ASCENDING = {"u": "1 if w == 0 else 0", "v": "1 if w == 2 else 2"}
CYCLIC = {"u": "(w + 1) % 3", "v": "(w + 2) % 3"}


def shevtsov_with(folder, order, sign):
    """Return Shevtsov's method with the axes in an order, and with (-1)^w (sign -1) or without."""
    path = folder / f"{len(list(folder.iterdir()))}.py"
    path.write_text(SHEVTSOV.format(**order, sign=sign), encoding="utf-8")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return dataclasses.replace(find("shevtsov_uv"), prepare=module.made)


def test_shevtsov_s_sign_belongs_to_ascending_axes(tmp_path):
    """(-1)^w with u < v is the cyclic order without it; each with the other's sign is wrong for
    triangles projected along y."""
    assert hits(find("shevtsov_uv")) == RIGHT
    assert hits(shevtsov_with(tmp_path, CYCLIC, 1)) == RIGHT
    assert hits(shevtsov_with(tmp_path, ASCENDING, -1)) == RIGHT
    along_y = [
        dominant(np.cross(b - a, c - a)) == 1 and right
        for (a, b, c), right in zip(PAIRS[0], RIGHT, strict=True)
    ]
    for wrong in ((CYCLIC, -1), (ASCENDING, 1)):
        found = hits(shevtsov_with(tmp_path, *wrong))
        lost = [right and not hit for right, hit in zip(RIGHT, found, strict=True)]
        assert sum(lost) > 0.7 * sum(along_y) > 5
        assert all(y for y, gone in zip(along_y, lost, strict=True) if gone)
