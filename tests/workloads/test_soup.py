"""Soups: what is nearest and how far a test gets, by rationals written once more."""

import hashlib
from fractions import Fraction

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads import nearest as nearest_module
from rtbench.workloads import rounding, scattered
from rtbench.workloads.nearest import nearest
from rtbench.workloads.soup import SETS, decided, soup

FLOAT32 = np.float32


def rationals(vectors):
    return [[Fraction(float(x)) for x in vector] for vector in vectors]


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def meet(corners, orig, dir):
    """Return t, u, v (Fractions) and whether the ray hits, by plane and areas; None: parallel."""
    a, b, c = corners
    normal = cross(minus(b, a), minus(c, a))
    below = dot(normal, dir)
    if below == 0:
        return None
    t = dot(normal, minus(a, orig)) / below
    point = [o + t * d for o, d in zip(orig, dir, strict=True)]
    whole = dot(normal, normal)
    weights = [
        dot(cross(minus(q, p), minus(point, p)), normal) / whole
        for p, q in ((b, c), (c, a), (a, b))
    ]
    return t, weights[1], weights[2], t > 0 and min(weights) >= 0


def brute_force(corners, origins, directions):
    """Return nearest, hits and tests within (0, tmax), one pair after the other."""
    triangles = [rationals(each) for each in corners]
    first, hits, within = [], 0, 0
    for orig, dir in zip(rationals(origins), rationals(directions), strict=True):
        best = -1, None, None, None
        for j, triangle in enumerate(triangles):
            found = meet(triangle, orig, dir)
            if found is None:
                continue
            t, u, v, hit = found
            hits += hit
            if t > 0 and (best[1] is None or t < best[1]):
                within += 1
                if hit:
                    best = j, t, u, v
        first.append(best)
    return first, hits, within


def corners_of(found):
    return np.stack([found.v0, found.v1, found.v2], axis=1)


@pytest.fixture(scope="module", params=sorted(SETS))
def known(request):
    return soup(request.param, seed=1)


class TestNearest:
    @pytest.mark.parametrize("name", ["sparse", "dense", 0.02, 0.9])
    def test_is_what_rationals_find(self, name):
        found = soup(name, triangles=20, rays=60, seed=8)
        first, hits, within = brute_force(corners_of(found), found.orig, found.dir)
        assert found.nearest.tolist() == [j for j, *_ in first]
        assert found.pairs_hit == hits
        assert found.hit_ratio == hits / 1200
        assert found.distance_share == pytest.approx(1 - within / 1200, abs=1e-15)
        _, *expected = zip(*first, strict=True)
        for array, values in zip((found.t, found.u, found.v), expected, strict=True):
            for x, value in zip(array, values, strict=True):
                assert np.isnan(x) if value is None else x == pytest.approx(float(value), abs=1e-12)

    def test_where_float64_cannot_tell(self):
        rng = np.random.default_rng(4)
        # Whole numbers: rays through vertices and edges, origins in planes, equal and opposite t.
        corners = rng.integers(-2, 3, (40, 3, 3)).astype(FLOAT32)
        corners[20:30] = corners[:10]
        corners[30:] = corners[:10, ::-1]
        origins = rng.integers(-2, 3, (60, 3)).astype(FLOAT32)
        directions = rng.integers(-2, 3, (60, 3)).astype(FLOAT32)
        directions[(directions == 0).all(axis=1)] = 1
        first, hits, within = brute_force(corners, origins, directions)
        found = nearest(corners, origins, directions)
        assert found.triangle.tolist() == [j for j, *_ in first]
        assert (found.hits, found.within) == (hits, within)
        assert 20 < sum(j >= 0 for j, *_ in first) < 60

    def test_one_float_decides(self):
        near = np.array([[-1, -1, 1], [1, -1, 1], [0, 1, 1]], FLOAT32)
        further = near.copy()
        further[:, 2] = np.nextafter(FLOAT32(1), FLOAT32(2))
        rays = np.zeros((1, 3), FLOAT32), np.array([[0, 0, 1]], FLOAT32)
        assert nearest(np.stack([further, near]), *rays).triangle == [1]
        assert nearest(np.stack([near, further]), *rays).triangle == [0]
        assert nearest(np.stack([near, near]), *rays).triangle == [0]
        assert nearest(-np.stack([near, near]), *rays).triangle == [-1]

    def test_a_hit_at_the_origin_is_none(self):
        flat = np.array([[[-1, -1, 0], [1, -1, 0], [0, 1, 0]]], FLOAT32)
        found = nearest(flat, np.zeros((1, 3), FLOAT32), np.array([[0, 0, 1]], FLOAT32))
        assert (found.triangle[0], found.hits, found.within) == (-1, 0, 0)
        assert np.isnan([found.t[0], found.u[0], found.v[0]]).all()

    def test_a_distance_test_sees_only_what_came_before(self):
        plane = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], FLOAT32)
        # At 3 hit, at 2 beside, at 4 hit, at 1 hit, at 2 hit: tests 3 and 5 end there.
        corners = np.stack([plane + FLOAT32([x, 0, z]) for x, z in ((0, 3), (9, 2), (0, 4))])
        corners = np.concatenate([corners, [plane + FLOAT32([0, 0, z]) for z in (1, 2)]])
        found = nearest(corners, np.zeros((1, 3), FLOAT32), FLOAT32([[0, 0, 1]]))
        assert (found.triangle[0], found.t[0], found.hits, found.within) == (3, 1, 4, 3)

    def test_portions_make_no_difference(self, monkeypatch):
        whole = soup("dense", 100, 50, seed=3)
        monkeypatch.setattr(nearest_module, "PORTION", 333)
        monkeypatch.setattr(scattered, "PORTION", 1100)
        parts = soup("dense", 100, 50, seed=3)
        assert parts.digest == whole.digest
        assert (parts.pairs_hit, parts.distance_share) == (whole.pairs_hit, whole.distance_share)


class TestDrawing:
    @pytest.mark.parametrize(("name", "off"), [("sparse", 0.012), ("dense", 0.035)])
    def test_hit_ratios(self, name, off):
        ratios = [soup(name, seed=seed).hit_ratio for seed in range(20, 30)]
        assert max(abs(ratio - SETS[name]) for ratio in ratios) < off
        assert abs(np.mean(ratios) - SETS[name]) < off / 3

    @pytest.mark.parametrize("ratio", [0.03, 0.25, 0.75, 0.93])
    def test_any_ratio_between(self, ratio):
        found = np.mean([soup(ratio, seed=seed).hit_ratio for seed in range(40, 46)])
        assert abs(found - ratio) < 0.06 * min(ratio, 1 - ratio) + 0.005

    def test_arrays(self, known):
        for array, n in (*((a, 512) for a in (known.v0, known.v1, known.v2)), (known.orig, 1024)):
            assert array.shape == (n, 3)
            assert array.dtype == FLOAT32
            assert array.flags.c_contiguous
        assert known.dir.shape == known.orig.shape
        np.testing.assert_allclose(np.linalg.norm(known.dir.astype(float), axis=1), 1, atol=1e-7)
        assert known.nearest.dtype == np.int64
        assert {known.t.dtype, known.u.dtype, known.v.dtype} == {np.dtype("f8")}
        assert known.triangles.shape == (512, 3, 3)

    def test_nothing_prefers_a_direction(self):
        big = soup("sparse", 8000, 1, seed=5)
        many = soup("sparse", 1, 8000, seed=5)
        normal = np.cross(big.v1 - big.v0, big.v2 - big.v0)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        for vectors in (normal, many.dir):
            # The moments of a uniform sphere: 0, and a third of the unit matrix.
            assert np.abs(vectors.mean(axis=0)).max() < 0.03
            assert np.abs(vectors.T @ vectors / 8000 - np.eye(3) / 3).max() < 0.02
        assert np.abs(big.triangles.mean(axis=(0, 1))).max() < 0.02
        assert np.abs(many.orig.mean(axis=0)).max() < 0.04

    def test_both_signs_of_denominator_and_distance(self, known):
        normal = np.cross(known.v1 - known.v0, known.v2 - known.v0).astype(float)
        denominator = known.dir.astype(float) @ normal.T
        assert abs((denominator > 0).mean() - 0.5) < 0.02
        t = ((known.v0 * normal).sum(axis=1) - known.orig.astype(float) @ normal.T) / denominator
        assert 0.05 < (t < 0).mean() < 0.4

    def test_no_triangle_is_degenerate(self, known):
        v0, v1, v2 = (array.astype(float) for array in (known.v0, known.v1, known.v2))
        edges = np.stack([v1 - v0, v2 - v0, v2 - v1])
        area = np.linalg.norm(np.cross(edges[0], edges[1]), axis=1)
        assert (area >= 0.1 * (edges**2).sum(axis=2).max(axis=0)).all()
        assert np.abs(edges).min() >= 1 / 64

    def test_more_begin_with_the_same(self):
        few, many = soup("dense", 10, 7, seed=2), soup("dense", 3000, 9, seed=2)
        np.testing.assert_array_equal(many.v2[:10], few.v2)
        np.testing.assert_array_equal(many.orig[:7], few.orig)
        np.testing.assert_array_equal(many.dir[:7], few.dir)

    def test_the_distance_test_ends_most_tests(self, known):
        assert 0.8 < known.distance_share < 0.97

    def test_progress_rises_to_one(self):
        seen = []
        soup("dense", 512, 300, progress=seen.append)
        assert seen == sorted(seen)
        assert len(seen) > 1
        assert seen[-1] == 1.0

    def test_what_is_not_allowed(self):
        with pytest.raises(RtbenchError, match="dense"):
            soup("dens")
        for ratio in (0.0, 0.99, float("nan")):
            with pytest.raises(RtbenchError, match=r"hit ratio \S+ is not allowed"):
                soup(ratio)
        for given in ({"triangles": 0}, {"rays": -1}, {"seed": -1}, {"seed": 1.5}):
            with pytest.raises(RtbenchError, match=r"is not allowed"):
                soup("dense", **given)


class TestDigest:
    # A change here changes every workload: raise it to the reader of old records.
    def test_is_stable(self):
        assert soup("sparse", seed=1).digest == SPARSE_DIGEST
        assert soup("dense", seed=1).digest == DENSE_DIGEST

    def test_is_of_the_bytes_in_the_stated_order(self, known):
        names = ("v0", "v1", "v2", "orig", "dir", "nearest")
        data = b"".join(getattr(known, name).tobytes() for name in names)
        assert known.digest == hashlib.sha256(data).hexdigest()

    def test_each_choice_changes_it(self):
        choices = (("dense", 9, 9, 1), ("dense", 9, 9, 2), ("dense", 9, 8, 1), ("dense", 8, 9, 1))
        digests = {soup(*choice).digest for choice in (*choices, ("sparse", 9, 9, 1))}
        assert len(digests) == 5


def moller(v0, v1, v2, orig, dir):
    e, f, s = v1 - v0, v2 - v0, orig - v0
    p, q = cross_rows(dir, f), cross_rows(s, e)
    det = dot_rows(e, p)
    return dot_rows(f, q) / det, dot_rows(s, p) / det, dot_rows(dir, q) / det


def pluecker(v0, v1, v2, orig, dir):
    moment = cross_rows(orig, dir)
    sides = [
        dot_rows(dir, cross_rows(p, q)) + dot_rows(q - p, moment)
        for p, q in ((v1, v2), (v2, v0), (v0, v1))
    ]
    whole = sides[0] + sides[1] + sides[2]
    normal = cross_rows(v1 - v0, v2 - v0)
    t = (dot_rows(normal, v0) - dot_rows(normal, orig)) / dot_rows(normal, dir)
    return t, sides[1] / whole, sides[2] / whole


def perpendicular(v0, v1, v2, orig, dir):
    e, f = v1 - v0, v2 - v0
    n = cross_rows(e, f)
    squared = dot_rows(n, n)[:, None]
    b, c = cross_rows(f, n) / squared, cross_rows(n, e) / squared
    t = (dot_rows(n, v0) - dot_rows(orig, n)) / dot_rows(dir, n)
    point = orig + t[:, None] * dir
    return t, dot_rows(point, b) - dot_rows(b, v0), dot_rows(point, c) - dot_rows(c, v0)


def projected(v0, v1, v2, orig, dir, by_edge):
    e, f = v1 - v0, v2 - v0
    n = cross_rows(e, f)
    w = np.argmax(np.abs(n), axis=1)

    def on(vectors):
        return [np.take_along_axis(vectors, (w + k)[:, None] % 3, 1)[:, 0] for k in range(3)]

    (nw, nu, nv), (aw, au, av), (ow, ou, ov), (dw, du, dv) = map(on, (n, v0, orig, dir))
    nu, nv = nu / nw, nv / nw
    t = (aw + nu * au + nv * av - ow - nu * ou - nv * ov) / (dw + nu * du + nv * dv)
    pu, pv = ou + t * du, ov + t * dv
    (_, eu, ev), (_, fu, fv) = on(e), on(f)
    det = eu * fv - ev * fu
    if not by_edge:
        b = pu * (fv / det) + pv * (-fu / det) + (fu * av - fv * au) / det
        return t, b, pu * (-ev / det) + pv * (eu / det) + (ev * au - eu * av) / det
    pu, pv = pu - au, pv - av
    c = (pv * eu - pu * ev) / det
    return t, (pu - c * fu) / eu, c


def wald(*pairs):
    return projected(*pairs, by_edge=False)


def badouel(*pairs):
    return projected(*pairs, by_edge=True)


def cross_rows(a, b):
    return np.stack([a[:, i] * b[:, j] - a[:, j] * b[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], 1)


def dot_rows(a, b):
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


METHODS = (moller, pluecker, perpendicular, wald, badouel)


def all_pairs(found):
    rays, triangles = len(found.orig), len(found.v0)
    ray, triangle = np.repeat(np.arange(rays), triangles), np.tile(np.arange(triangles), rays)
    pairs = (found.v0[triangle], found.v1[triangle], found.v2[triangle])
    return ray, triangle, (*pairs, found.orig[ray], found.dir[ray])


def nearest_by(method, found):
    """Return the nearest triangle of each ray as a float32 method finds it."""
    _, _, pairs = all_pairs(found)
    with np.errstate(all="ignore"):
        t, u, v = method(*pairs)
    assert t.dtype == u.dtype == v.dtype == FLOAT32
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    t = np.where(hit, t, np.inf).reshape(len(found.orig), -1)
    return np.where(np.isfinite(t).any(axis=1), t.argmin(axis=1), -1)


def aimed(corners, targets, name="dense"):
    """Return a soup of given triangles, and rays from a unit before given targets."""
    rng = np.random.default_rng(9)
    dir = rng.normal(size=targets.shape)
    dir = (dir / np.linalg.norm(dir, axis=1)[:, None]).astype(FLOAT32)
    return decided(corners, (targets - dir).astype(FLOAT32), dir, name, 0.0, 9)


@pytest.fixture(scope="module")
def stacked():
    half = np.array([[-1, -1.25, 0], [1.25, -1, 0], [0.25, 1, 0]], FLOAT32)
    heights = (2, 2.0000005, 2.1, -2)
    corners = np.stack([half + FLOAT32([0, 0, z]) for z in heights])
    edge = (half[0].astype(float) + half[1]) / 2
    inwards = np.array([-0.25, 2.25, 0]) / np.hypot(0.25, 2.25)
    origins = [[0, 0, 0], edge, edge + 1e-7 * inwards, edge + 0.01 * inwards]
    origins += [edge - 0.01 * inwards, [0, 0, 1.9999999], [0, 0, 1.99], [5, 5, 0]]
    dir = np.tile(FLOAT32([0, 0, 1]), (len(origins), 1))
    return decided(corners, np.array(origins).astype(FLOAT32), dir, "dense", 0.0, 1)


class TestUnsafe:
    @pytest.mark.parametrize("method", METHODS)
    def test_a_method_differs_only_where_it_says_so(self, method):
        differ = 0
        for seed in (1, 2):
            whole = soup("dense", 200, 1, seed)
            corners = whole.triangles.astype(float)
            # At edges the last bits decide; with few triangles no other one hides it.
            share = np.random.default_rng(seed).random((1500, 1))
            chosen = np.arange(1500) % 8
            targets = corners[chosen, 0] + share * (corners[chosen, 1] - corners[chosen, 0])
            found = aimed(whole.triangles[:8], targets)
            own = nearest_by(method, found)
            other = np.flatnonzero(own != found.nearest)
            differ += len(other)
            safe = ~found.unsafe(other, own[other]) & ~found.unsafe(other, found.nearest[other])
            assert not safe.any()
        assert differ > 100

    @pytest.mark.parametrize("method", METHODS)
    def test_bands_hold_the_errors(self, method):
        worst_t = worst_weight = 0
        for name in SETS:
            found = soup(name, 256, 200, seed=6)
            _, _, pairs = all_pairs(found)
            corners = np.stack(pairs[:3], axis=1)
            reference, t_band, weight_band = rounding.bands(corners, *pairs[3:])
            with np.errstate(all="ignore"):
                t, u, v = method(*pairs)
            inner = np.minimum(np.minimum(reference.u, reference.v), 1 - reference.u - reference.v)
            # Far from the triangle u and v are large, and so are their errors.
            near = (inner > -0.2) & (weight_band < 0.1)
            error = np.maximum(np.abs(u - reference.u), np.abs(v - reference.v))
            worst_t = max(worst_t, (np.abs(t - reference.t) / t_band)[near].max())
            worst_weight = max(worst_weight, (error / weight_band)[near].max())
        # Neither too narrow nor far wider than need be.
        assert 0.02 < worst_t < 0.5
        assert 0.02 < worst_weight < 0.5

    def test_few_pairs_are(self, known):
        ray, triangle, _ = all_pairs(known)
        assert 0 < known.unsafe(ray, triangle).mean() < 1e-3
        assert known.unsafe(ray, triangle, "float64").sum() == 0
        assert known.unsafe(np.arange(1024), known.nearest).mean() < 0.01

    def test_edges(self, stacked):
        # In the middle, on the edge, beside it by 1e-7, by 0.01 inside and outside, far away.
        ray = [0, 1, 2, 3, 4, 7]
        assert stacked.unsafe(ray, [0] * 6).tolist() == [False, True, True, False, False, False]
        assert stacked.unsafe([1, 2], [0, 0], "float64").tolist() == [True, False]

    def test_distances_near_zero(self, stacked):
        assert stacked.unsafe([5, 6], [0, 0]).tolist() == [True, False]
        assert stacked.unsafe([5], [0], "float64").tolist() == [False]

    def test_distances_near_that_of_the_nearest(self, stacked):
        # Of ray 0 triangle 0 is nearest; 1 is a rounding further, 2 clearly, 3 behind.
        assert stacked.nearest[0] == 0
        assert stacked.unsafe([0] * 4, [0, 1, 2, 3]).tolist() == [False, True, False, False]
        # Of a ray that misses all of them clearly, none may be chosen, however near they are.
        assert not stacked.unsafe([7] * 4, [0, 1, 2, 3]).any()

    def test_none_is_never(self, stacked):
        assert stacked.unsafe([0, 1], [-1, -1]).tolist() == [False, False]
        none = np.zeros(0, int)
        assert stacked.unsafe(none, none).shape == (0,)

    def test_any_shape(self, stacked):
        answers = stacked.unsafe([[0, 1], [5, 6]], [[0, -1], [0, 0]])
        assert answers.tolist() == [[False, False], [True, False]]

    def test_parallel_rays_are(self):
        flat = np.array([[[0, 0, 0], [1, 0.5, 0], [0.5, 1, 0]]], FLOAT32)
        dir = FLOAT32([[1, 0, 0], [0.5, 0, 0.5]])
        found = decided(flat, FLOAT32([[-1, 0.5, 0], [-1, 9, 0.5]]), dir, "dense", 0.0, 1)
        assert found.unsafe([0, 1], [0, 0]).tolist() == [True, False]

    def test_unknown_precision(self, known):
        with pytest.raises(RtbenchError, match="float64"):
            known.unsafe([0], [0], "float46")


SPARSE_DIGEST = "229625ab47c3641a17c6d8a77e082003b15a10aef3a3740a8dc24e58c3df5f4e"
DENSE_DIGEST = "95d0d31e56c556a7aa5d9af544cb04cb3980ac47c4c235ce311df065bb647550"
