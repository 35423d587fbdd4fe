"""Which triangles belong to a cell, against exact rationals: clipping, and separating axes."""

from fractions import Fraction

import numpy as np
import pytest

from rtbench.compiled.instantiate import instantiate
from rtbench.errors import RtbenchError
from rtbench.trees.overlap import FITS, clipping, fit_sources, fitted, let_through, overlapping
from rtbench.trees.overlap.rounding import downward, upward

EXACT = ("separating_axes", "clipped")


def touching(triangles, cells):
    """Tell by separating axes, exactly, which triangles of whole numbers touch their cells."""
    t, c = (np.vectorize(int, otypes=[object])(each) for each in (triangles, cells))
    low, high = c[:, None, :3], c[:, None, 3:]
    apart = ((t.max(1) < c[:, :3]) | (t.min(1) > c[:, 3:])).any(1)
    unit = np.eye(3, dtype=int).astype(object)
    edges = [t[:, (k + 1) % 3] - t[:, k] for k in range(3)]
    axes = [np.cross(edges[0], edges[1])]
    axes += [np.cross(edge, np.broadcast_to(u, edge.shape)) for edge in edges for u in unit]
    for axis in axes:
        n = axis[:, None, :]
        along = (t * n).sum(2)
        least = np.where(n > 0, n * low, n * high).sum(2)[:, 0]
        most = np.where(n > 0, n * high, n * low).sum(2)[:, 0]
        apart |= (along.max(1) < least) | (along.min(1) > most)
    return ~apart.astype(bool)


def polygon(triangle, cell):
    """Return the exact polygon that a triangle and a cell share; of no corners if none."""
    corners = [[Fraction(float(x)) for x in corner] for corner in triangle]
    for axis in range(3):
        for sign, side in ((1, cell[axis]), (-1, cell[axis + 3])):
            found = []
            for a, b in zip(corners[-1:] + corners[:-1], corners, strict=True):
                da = sign * (a[axis] - Fraction(float(side)))
                db = sign * (b[axis] - Fraction(float(side)))
                if (da < 0) != (db < 0):
                    s = da / (da - db)
                    found.append([p + (q - p) * s for p, q in zip(a, b, strict=True)])
                if db >= 0:
                    found.append(b)
            corners = found
    return corners


def cells_of(rng, n, size):
    """Return cells of whole numbers, many of them flat."""
    ends = rng.integers(-size, size + 1, (n, 2, 3))
    flat = rng.random((n, 3)) < 0.15
    ends[:, 1] = np.where(flat, ends[:, 0], ends[:, 1])
    return np.concatenate([ends.min(1), ends.max(1)], axis=1)


def whole_numbers(n=40_000, seed=5):
    """Return pairs of small whole numbers: touching in all ways, points and segments among them."""
    rng = np.random.default_rng(seed)
    triangles = rng.integers(-7, 8, (n, 3, 3))
    cells = cells_of(rng, n, 4)
    kind = rng.integers(0, 10, n)
    triangles[kind == 0, 1] = triangles[kind == 0, 0]
    triangles[kind == 1, 1:] = triangles[kind == 1, :1]
    triangles[kind == 2, 2] = 2 * triangles[kind == 2, 1] - triangles[kind == 2, 0]
    some = np.flatnonzero(kind == 3)  # in the plane of a side
    axis = rng.integers(0, 3, len(some))
    triangles[some, :, axis] = cells[some, axis + 3 * rng.integers(0, 2, len(some))][:, None]
    return triangles, cells


def touching_once(n=3_000, seed=6):
    """Return triangles that touch cells in one point or segment, of numbers up to 2**53."""
    rng = np.random.default_rng(seed)
    cells = np.stack([cells_of(rng, 1, 2**bits)[0] for bits in rng.integers(2, 12, n)])
    side = rng.integers(0, 2, (n, 3))
    at = np.take_along_axis(cells, np.arange(3) + 3 * side, axis=1)
    # Outward normals of a plane through that corner of the cell, zeros among them.
    lengths = cells[:, 3:] - cells[:, :3]
    scaled = np.roll(lengths, 1, axis=1) * np.roll(lengths, 2, axis=1)
    normal = rng.integers(0, 1000, (n, 3))
    kind = rng.integers(0, 3, n)
    normal[kind == 1] = 1
    normal[kind == 2] = scaled[kind == 2]
    normal = normal * (rng.random((n, 3)) < 0.8) * np.where(side == 1, 1, -1)
    first = np.cross(normal, rng.integers(-500, 501, (n, 3)))
    second = np.cross(normal, rng.integers(-500, 501, (n, 3)))
    k = rng.integers(1, 2**10, (n, 2, 1))
    first, second = first * k[:, 0], second * k[:, 1]
    triangles = np.stack([at + first, at + second, at - first - second], axis=1)
    # Half of them touch with an edge alone, or a corner, and stand out.
    outward = normal * k[:, 0] + first
    with_edge = rng.random(n) < 0.3
    triangles[with_edge] = np.stack([at + second, at - 5 * second, at + outward], 1)[with_edge]
    with_corner = rng.random(n) < 0.2
    triangles[with_corner] = np.stack([at, at + outward, at + second + normal], 1)[with_corner]
    assert np.abs(triangles).max() < 2**53
    return triangles, cells


@pytest.fixture(scope="module")
def whole():
    triangles, cells = whole_numbers()
    return triangles, cells, touching(triangles, cells)


@pytest.mark.parametrize("test", FITS)
def test_no_triangle_that_touches_is_lost(whole, test):
    triangles, cells, exact = whole
    assert 0.2 < exact.mean() < 0.8
    for scale in (1.0, 2.0**-140, 2.0**90):
        assert overlapping(test, triangles * scale, cells * scale)[exact].all()
    triangles, cells = touching_once()
    assert touching(triangles, cells).all()
    for scale in (1.0, 2.0**-100):
        lost = ~overlapping(test, triangles * scale, cells * scale)
        assert not lost.any(), (triangles[lost][0], cells[lost][0])


@pytest.mark.parametrize("test", EXACT)
def test_exact_ones_let_nothing_else_through(whole, test):
    triangles, cells, exact = whole
    for scale in (1.0, 2.0**-140, 2.0**90):
        np.testing.assert_array_equal(overlapping(test, triangles * scale, cells * scale), exact)


def test_a_gap_of_one_part_in_a_million_is_seen():
    triangles, cells = touching_once()
    triangles = triangles * 2.0**20
    cells = cells * 2.0**20
    size = np.abs(triangles).max((1, 2)) + np.abs(cells).max(1)
    step = np.random.default_rng(10).choice((-1, 1), (len(cells), 3)) * size[:, None] * 2.0**-20
    apart = np.round(triangles + step[:, None])
    exact = touching(apart, cells)
    assert 0.1 < exact.mean() < 0.9
    for test in EXACT:
        np.testing.assert_array_equal(overlapping(test, apart, cells), exact)


def test_the_two_exact_answers_of_this_file_agree():
    triangles, cells = whole_numbers(400, seed=7)
    clipped = [bool(polygon(t, c)) for t, c in zip(triangles, cells, strict=True)]
    np.testing.assert_array_equal(touching(triangles, cells), clipped)


def test_the_cheap_ones_let_more_through(whole):
    triangles, cells, exact = whole
    needless = let_through(triangles, cells)
    assert needless["separating_axes"] == needless["clipped"] == 0
    for test in ("three_stage", "three_stage_world", "plane_clipped"):
        assert 0 < needless[test] < needless["box"]
    in_box = ((triangles.min(1) <= cells[:, 3:]) & (triangles.max(1) >= cells[:, :3])).all(1)
    assert needless["box"] == np.count_nonzero(in_box & ~exact)


def test_planes_at_45_degrees_stand_in_world_space_or_in_the_box_s():
    # Beyond the edge x = 4, y = 1: by its slope in the world's x and y, or in the box's own.
    cell = [-4, -1, -1, 4, 1, 1]
    in_world = [[4.9, 0.2, 0], [3.2, 1.9, 0], [3.2, 1.9, 0.5]]
    scaled = [[4.8, 0.9, 0], [2.2, 1.5, 0], [2.2, 1.5, 0.5]]
    triangles, cells = np.array([in_world, scaled]), np.array([cell, cell])
    assert list(overlapping("box", triangles, cells)) == [True, True]
    assert list(overlapping("three_stage_world", triangles, cells)) == [False, True]
    assert list(overlapping("three_stage", triangles, cells)) == [True, False]


def test_planes_at_the_corners():
    # Beyond the corner of a cube, though beyond none of its sides and edges.
    triangle = np.array([[2.3, 0.4, 0.4], [0.4, 2.3, 0.4], [0.4, 0.4, 2.3]])
    cube = np.array([-1, -1, -1, 1, 1, 1])
    stretch = np.array([1, 2, 4])
    triangles = np.array([triangle, triangle - 0.1, triangle * stretch])
    cells = np.array([cube, cube, cube * np.tile(stretch, 2)])
    assert list(overlapping("three_stage", triangles, cells)) == [False, True, False]
    assert list(overlapping("three_stage_world", triangles, cells)) == [False, True, True]


@pytest.fixture(scope="module")
def descents():
    """Triangles, the boxes of two cells one in the other, and what is shared exactly, in floats."""
    rng = np.random.default_rng(8)
    n = 500
    triangles = rng.normal(size=(n, 3, 3)) * 2.0 ** rng.integers(-8, 8, (n, 1, 1))
    triangles[::5] = np.round(triangles[::5])
    triangles[1::5, :, 1] = triangles[1::5, :1, 1].astype(np.float32)
    corners = triangles + rng.normal(size=(n, 1, 3)) * 0.3
    size = np.ptp(triangles, 1)[:, None]
    ends = corners.mean(1, keepdims=True) + rng.normal(size=(n, 2, 3)) * size
    parents = np.concatenate([ends.min(1), ends.max(1)], 1).astype(np.float32)
    cells = parents.copy()
    axis, side, row = rng.integers(0, 3, n), 3 * rng.integers(0, 2, n), np.arange(n)
    cells[row, axis + side] = parents[:, :3][row, axis] * np.float32(0.5) + (
        parents[:, 3:][row, axis] * np.float32(0.5)
    )
    return corners, parents, cells, [polygon(t, c) for t, c in zip(corners, cells, strict=True)]


@pytest.mark.parametrize("test", FITS)
def test_boxes_hold_what_is_shared(descents, test):
    corners, parents, cells, shared = descents
    kept, own = fitted(test, corners, parents)
    inside, boxes = fitted(test, corners, cells, own)
    exact = np.array([bool(each) for each in shared])
    assert 0.2 < exact.mean() < 0.9
    assert (kept & inside)[exact].all()
    assert (boxes == boxes.astype(np.float32))[inside].all()
    assert not np.signbit(boxes[boxes == 0]).any()
    for k in np.flatnonzero(exact):
        least = [min(point[a] for point in shared[k]) for a in range(3)]
        most = [max(point[a] for point in shared[k]) for a in range(3)]
        assert all(Fraction(boxes[k, a]) <= least[a] for a in range(3))
        assert all(Fraction(boxes[k, a + 3]) >= most[a] for a in range(3))
        if test == "clipped":
            bounds = np.array([float(x) for x in least + most])
            allowed = np.spacing(np.abs(bounds).astype(np.float32)) * 2.0
            allowed += np.abs(corners[k]).max() * 2.0**-46
            assert (np.abs(boxes[k] - bounds) <= allowed).all()
    both = kept & inside
    assert (boxes >= np.where(np.arange(6) < 3, np.maximum(own, cells), -np.inf))[both].all()
    assert (boxes <= np.where(np.arange(6) < 3, np.inf, np.minimum(own, cells)))[both].all()


@pytest.mark.parametrize("test", ("clipped", "plane_clipped"))
def test_a_corner_in_a_side_of_the_cell_is_a_bound_as_it_is(test):
    # What is left is bounded by the middle corner (4, 5, 1): not by the float beside it.
    corners = [[0, 3, 0], [4, 5, 1], [8, 9.1, 3]]
    right, left = [4, -20, -20, 20, 20, 20], [-20, -20, -20, 4, 20, 20]
    for order in ((0, 1, 2), (1, 2, 0), (2, 1, 0)):
        inside, boxes = fitted(test, np.array([corners, corners])[:, order], [right, left])
        assert inside.all()
        assert list(boxes[0, :3]) == [4, 5, 1]
        assert boxes[1, 3] == 4
    # And where the cell's other sides cut the edges at it.
    near = [[4, 4.9, -20, 20, 5.5, 20]]
    assert list(fitted("clipped", np.array([corners]), near)[1][0, :3]) == [4, 5, 1]


@pytest.mark.parametrize("test", ("clipped", "plane_clipped"))
def test_a_computed_point_does_not_cut_off_what_it_was_rounded_over(test):
    # The first edge meets x = 0 a little before its middle, where y is 5; in floats there.
    for half in (1, 2.0**-11):
        triangle = [[-1, 5 - half, 0], [1 + 2.0**-52, 5 + half, 0], [1, 9, 0]]
        inside, boxes = fitted(test, np.array([triangle]), [[0, -20, -20, 20, 20, 20]])
        assert inside[0]
        assert boxes[0, 1] == np.nextafter(np.float32(5), np.float32(0))


def test_plane_clipping_takes_off_what_the_split_cut():
    triangle = np.array([[[0, 0, 0], [8, 8, 0], [0, 0, 8]]])
    left, right = [[-1, -1, -1, 2, 9, 9]], [[2, -1, -1, 9, 9, 9]]
    for cell, exact in ((left, [0, 0, 0, 2, 2, 8]), (right, [2, 2, 0, 8, 8, 6])):
        inside, box = fitted("plane_clipped", triangle, np.array(cell))
        assert inside[0]
        np.testing.assert_allclose(box[0], exact, rtol=3e-7)


def test_a_polygon_that_wavers_about_a_plane_is_given_up_and_not_written_past_the_room():
    room = np.zeros((2, 12, 3))
    room[0, :10, 0] = [-1, 1] * 5
    assert clipping.clipped_to_slab(room, 0, 10, 0, 0, 0.0, 9.0, 0.0) == (-1, 0)
    room[0, :4, 0] = [-1, 1, -1, 1]
    count, cuts = clipping.clipped_to_slab(room, 0, 4, 0, 0, 0.0, 9.0, 0.0)
    assert count == 6
    assert bin(cuts).count("1") == 4


def test_rounding_goes_outward_to_the_next_float():
    rng = np.random.default_rng(9)
    numbers = rng.normal(size=3_000) * 2.0 ** rng.integers(-155, 120, 3_000)
    numbers[1_000:1_500] = rng.uniform(2.0**-127, 2.0**-124, 500)
    numbers[:1_000] = numbers[:1_000].astype(np.float32)
    some = (0.0, -0.0, 2.0**-149, -(2.0**-149), 2.0**-126, 1.0, -1.0, 1 + 2.0**-40)
    for x in np.concatenate([numbers, some]):
        nearest = np.float32(x)
        below = nearest if nearest <= x else np.nextafter(nearest, np.float32(-np.inf))
        above = nearest if nearest >= x else np.nextafter(nearest, np.float32(np.inf))
        assert downward(x) == below, x
        assert upward(x) == above, x
        assert not np.signbit(downward(x)) or x < 0
        assert not np.signbit(upward(x)) or above < 0


def asked(out):
    room = np.empty((2, 12, 3))
    triangle = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    result = fit(triangle, (0.0, 0.0, 0.0, 1.0, 1.0, 0.0), (0.0, 0.0, -1.0, 0.5, 2.0, 1.0), room)
    out[0] = result[4]


def fit(triangle, own, cell, room):  # a stand-in
    return False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


def test_a_test_goes_into_compiled_code_as_fit():
    out = np.zeros(1)
    instantiate(asked, signature="void(float64[::1])", callees=fit_sources("box")).call(out)
    assert out[0] == 0.5
    with pytest.raises(RtbenchError, match=r"overlap test.*'clip'.*clipped"):
        fit_sources("clip")


def test_shapes_that_do_not_belong_together_are_refused():
    with pytest.raises(ValueError, match="are wanted"):
        overlapping("box", np.zeros((2, 3, 3)), np.zeros((1, 6)))
