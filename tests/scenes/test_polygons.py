"""Polygons: triangles cover them once, whatever their form; what is none is refused."""

from fractions import Fraction

import numpy as np
import pytest

from rtbench.scenes.model import SceneError
from rtbench.scenes.polygons import triangulated


def twice_area(points, order):
    """Twice the area within a closed way, exactly, above 0 if it turns left (Gauss's formula)."""
    way = [[Fraction(each) for each in points[i]] for i in order]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(way, way[1:] + way[:1], strict=True))


def check(flat, full=None):
    """Cut a polygon in the plane z = 0: every triangle turns left, and they fill it once."""
    points = np.column_stack([flat, np.zeros(len(flat))])
    found = triangulated(points)
    assert found.dtype == np.int64 and found.shape[1] == 3
    areas = [twice_area(flat, triangle) for triangle in found.tolist()]
    assert min(areas) > 0
    assert sum(areas) == twice_area(flat, range(len(flat)))
    if full is None:
        assert len(found) == len(flat) - 2
    # Points anywhere: in one triangle, or outside the polygon (crossings to the right are even).
    random = np.random.default_rng(5)
    low, high = np.min(flat, axis=0), np.max(flat, axis=0)
    where = low + (high - low) * random.random((400, 2))
    start, end = np.asarray(flat, float), np.roll(np.asarray(flat, float), -1, axis=0)
    above = start[:, 1] > where[:, 1, None], end[:, 1] > where[:, 1, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        part = (where[:, 1, None] - start[:, 1]) / (end[:, 1] - start[:, 1])
        right = start[:, 0] + part * (end[:, 0] - start[:, 0]) > where[:, 0, None]
    inside = ((above[0] != above[1]) & right).sum(axis=1) % 2
    corners = np.asarray(flat, float)[found]
    ways = np.roll(corners, -1, axis=1) - corners
    off = where[:, None, None] - corners
    sides = ways[..., 0] * off[..., 1] - ways[..., 1] * off[..., 0]
    np.testing.assert_array_equal((sides > 0).all(axis=2).sum(axis=1), inside)
    return found


def star(random, count, least=0.05):
    """A star-shaped polygon: seen whole from its middle."""
    angle = (
        np.sort(random.permutation(4 * count)[:count] + random.random(count)) * np.pi / 2 / count
    )
    return random.uniform(least, 1, count)[:, None] * np.stack(
        [np.cos(angle), np.sin(angle)], axis=1
    )


def comb(teeth, random):
    """A spine with teeth of many lengths."""
    x = np.arange(2 * teeth + 1)
    y = np.where(x % 2, random.uniform(0.1, 5, len(x)), 0.0)
    return [(0, -1.0), (2 * teeth, -1.0), *zip(x[::-1].tolist(), y[::-1].tolist(), strict=True)]


def test_a_convex_polygon_is_a_fan():
    angle = np.arange(7) * 2 * np.pi / 7
    found = check(np.stack([np.cos(angle), np.sin(angle)], axis=1))
    np.testing.assert_array_equal(found, [(0, i, i + 1) for i in range(1, 6)])


@pytest.mark.parametrize("count", [3, 4, 5, 8, 20, 144])
def test_stars_are_filled_once(count):
    random = np.random.default_rng(count)
    for _ in range(1000 // count // 5 + 3):
        flat = star(random, count)
        if twice_area(flat, range(count)) > 0 and _middle_inside(flat):
            check(flat)


def _middle_inside(flat):
    nxt = np.roll(flat, -1, axis=0)
    return (flat[:, 0] * nxt[:, 1] - flat[:, 1] * nxt[:, 0] > 0).all()


@pytest.mark.parametrize("teeth", [2, 3, 10, 40])
def test_combs_are_filled_once(teeth):
    check(comb(teeth, np.random.default_rng(teeth)))


def test_a_spiral_is_filled_once():
    angle = np.linspace(0.5, 6 * np.pi, 60)
    out = np.stack([angle * np.cos(angle), angle * np.sin(angle)], axis=1)
    check(np.concatenate([out * 1.1, out[::-1]]))


@pytest.mark.parametrize("turned", range(6))
def test_vertices_on_an_edge_all_stay(turned):
    """They are corners of triangles: a neighbour that has them leaves no crack."""
    flat = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 3), (0, 3)]
    found = check(flat[turned:] + flat[:turned])
    assert set(found.ravel().tolist()) == set(range(6))
    check([(0, 0), (4, 0), (4, 4), (2, 4), (2, 3), (2, 2), (2, 1), (1, 1), (0, 1)])


def test_equal_vertices_are_left_out():
    flat = [(0, 0), (0, 0), (4, 0), (4, 4), (4, 4), (4, 4), (2, 1), (0, 4), (0, 0)]
    found = check(flat, full=False)
    assert len(found) == 3


def test_a_hole_is_reached_over_a_bridge():
    outer = [(0, 0), (9, 0), (9, 9), (0, 9)]
    hole = [(3, 3), (3, 6), (6, 6), (6, 3)]
    check([*outer, outer[0], *hole, hole[0]])
    random = np.random.default_rng(3)
    for _ in range(20):
        way = np.sort(random.random(9)) * 2 * np.pi
        inner = np.stack([np.cos(way), np.sin(way)], axis=1)[::-1] * random.uniform(0.5, 2, (9, 1))
        first = int(np.argmin(inner.sum(axis=1)))
        inner = np.roll(inner, -first, axis=0) + 4.5
        check(np.array([*outer, outer[0], *inner, inner[0]], float))


def test_a_spike_has_no_triangle():
    check([(0, 0), (4, 0), (4, 4), (4, 7), (4, 4), (0, 4)], full=False)


@pytest.mark.parametrize("seed", range(12))
def test_the_way_round_is_kept_wherever_it_lies(seed):
    random = np.random.default_rng(seed)
    axes = np.linalg.qr(random.normal(size=(3, 3)))[0]
    flat = np.array(comb(5, random))
    points = flat @ axes[:2] * 10.0 ** random.integers(-6, 7) + random.normal(size=3) * 3
    for given in (points, points[::-1]):
        found = given[triangulated(given)]
        assert len(found) == len(points) - 2
        normals = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
        moved = given - given[0]
        whole = np.cross(moved, np.roll(moved, -1, axis=0)).sum(axis=0)
        assert (normals @ whole > 0).all()
        np.testing.assert_allclose(normals.sum(axis=0), whole, rtol=0, atol=1e-9 * abs(whole).max())


def test_coordinates_rounded_to_six_digits_are_flat_enough():
    random = np.random.default_rng(1)
    axes = np.linalg.qr(random.normal(size=(3, 3)))[0]
    points = np.array(comb(9, random)) @ axes[:2] * 1e-3 + (1.5, -2.5, 0.5)
    rounded = [[float(f"{each:g}") for each in point] for point in points]
    assert len(triangulated(rounded)) == len(points) - 2


BAD = {
    r"a polygon of 2 vertices \(allowed: 3 or more\)": [(0, 0, 0), (1, 0, 0)],
    r"a polygon of 0 vertices \(allowed: 3 or more\)": np.zeros((0, 3)),
    "no area": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (5, 0, 0)],
    "no area$": [(1, 2, 3)] * 4,
    "no area .or crosses": [(0, 0, 0), (1, 1, 1), (2, 2, 2)],
    "not all finite": [(0, 0, 0), (1, 0, 0), (np.nan, 1, 0)],
    "up to 1.15292e": [(0, 0, 0), (1, 0, 0), (1e30, 1, 0)],
    "not flat: vertices lie 0.02": [(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)],
}


@pytest.mark.parametrize("told", BAD)
def test_what_is_no_polygon_is_refused_in_a_line(told):
    with pytest.raises(SceneError, match=told) as found:
        triangulated(BAD[told])
    assert found.value.key == "vertices" and "\n" not in str(found.value)


CROSSING = {
    "bow tie": [(0, 0), (4, 0), (1, 3), (3, 3)],
    "pentagram": [(np.cos(0.8 * np.pi * i), np.sin(0.8 * np.pi * i)) for i in range(5)],
    "twice round": [(0, 0), (4, 0), (4, 4), (0, 4), (1, 1), (5, 1), (5, 5), (1, 5)],
    "loop at a corner": [(0, 0), (4, 0), (4, 4), (5, 3), (3, 2), (0, 4)],
}


@pytest.mark.parametrize("name", CROSSING)
def test_a_polygon_that_crosses_itself_is_refused(name):
    points = [(*point, 0.0) for point in CROSSING[name]]
    for turned in range(len(points)):
        with pytest.raises(SceneError, match="crosses itself"):
            triangulated(points[turned:] + points[:turned])
