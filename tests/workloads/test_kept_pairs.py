"""No listing of the thesis, in float32, is wrong on a pair that is safe to keep.

The listings are transcribed here once more, so that a kernel's fault cannot hide a workload's.
"""

import numpy as np
import pytest
from numba import njit

from rtbench.accuracy.exact import HIT, MISS
from rtbench.compiled import preparation
from rtbench.kernels.stored_plane import stored_plane
from rtbench.workloads import draws, safety

EPSILON = np.float32(0.000001)
ZERO, ONE = np.float32(0), np.float32(1)
PORTION = 1 << 16


@njit(error_model="numpy")
def moller(v0, v1, v2, orig, dir):
    e1x, e1y, e1z = v1[0] - v0[0], v1[1] - v0[1], v1[2] - v0[2]
    e2x, e2y, e2z = v2[0] - v0[0], v2[1] - v0[1], v2[2] - v0[2]
    pvx = dir[1] * e2z - dir[2] * e2y
    pvy = dir[2] * e2x - dir[0] * e2z
    pvz = dir[0] * e2y - dir[1] * e2x
    det = e1x * pvx + e1y * pvy + e1z * pvz
    tvx, tvy, tvz = orig[0] - v0[0], orig[1] - v0[1], orig[2] - v0[2]
    u = tvx * pvx + tvy * pvy + tvz * pvz
    qvx = tvy * e1z - tvz * e1y
    qvy = tvz * e1x - tvx * e1z
    qvz = tvx * e1y - tvy * e1x
    v = dir[0] * qvx + dir[1] * qvy + dir[2] * qvz
    if det > EPSILON:
        return not (u < ZERO or u > det or v < ZERO or u + v > det)
    if det < -EPSILON:
        return not (u > ZERO or u < det or v > ZERO or u + v < det)
    return False


@njit(error_model="numpy")
def badouel(v0, v1, v2, normal, d, i1, i2, orig, dir):
    dot = dir[0] * normal[0] + dir[1] * normal[1] + dir[2] * normal[2]
    if dot > -EPSILON and dot < EPSILON:
        return False
    dot2 = orig[0] * normal[0] + orig[1] * normal[1] + orig[2] * normal[2]
    t = -(d + dot2) / dot
    pointa = orig[i1] + dir[i1] * t
    pointb = orig[i2] + dir[i2] * t
    uu0, uu1, uu2 = pointa - v0[i1], v1[i1] - v0[i1], v2[i1] - v0[i1]
    vv0, vv1, vv2 = pointb - v0[i2], v1[i2] - v0[i2], v2[i2] - v0[i2]
    if uu1 == ZERO:
        beta = uu0 / uu2
        if beta < ZERO or beta > ONE:
            return False
        alpha = (vv0 - beta * vv2) / vv1
    else:
        beta = (vv0 * uu1 - uu0 * vv1) / (vv2 * uu1 - uu2 * vv1)
        if beta < ZERO or beta > ONE:
            return False
        alpha = (uu0 - beta * uu2) / uu1
    return not (alpha < ZERO or alpha + beta > ONE)


@njit(error_model="numpy")
def chirkov(v0, v1, v2, normal, d, i1, i2, orig, end):
    source = normal[0] * orig[0] + normal[1] * orig[1] + normal[2] * orig[2] + d
    target = normal[0] * end[0] + normal[1] * end[1] + normal[2] * end[2] + d
    dd = source - target
    ay, az = v1[i1] - v0[i1], v1[i2] - v0[i2]
    by, bz = v2[i1] - v0[i1], v2[i2] - v0[i2]
    dely, delz = end[i1] - orig[i1], end[i2] - orig[i2]
    basey, basez = orig[i1] - v0[i1], orig[i2] - v0[i2]
    a = source * (ay * delz - az * dely) + dd * (ay * basez - az * basey)
    b = source * (dely * bz - delz * by) + dd * (basey * bz - basez * by)
    if a * b >= ZERO:
        cy, cz = v2[i1] - v1[i1], v2[i2] - v1[i2]
        basey, basez = orig[i1] - v1[i1], orig[i2] - v1[i2]
        c = source * (dely * cz - delz * cy) + dd * (basey * cz - basez * cy)
        return a * c < ZERO
    return False


@njit(error_model="numpy")
def count_wrong(items, dir, normal, d, i1, i2, classes, wrong):
    kept = 0
    for i in range(len(items)):
        if classes[i] != HIT and classes[i] != MISS:
            continue
        kept += 1
        hit = classes[i] == HIT
        orig, end = items[i, 0:3], items[i, 3:6]
        v0, v1, v2 = items[i, 6:9], items[i, 9:12], items[i, 12:15]
        plane = normal[i], d[i], i1[i], i2[i]
        wrong[0] += moller(v0, v1, v2, orig, dir[i]) != hit
        wrong[1] += badouel(v0, v1, v2, *plane, orig, dir[i]) != hit
        wrong[2] += chirkov(v0, v1, v2, *plane, orig, end) != hit
    return kept


def wrong_on_kept(portions):
    """Return how many items are kept, and on how many of these each listing is wrong."""
    wrong = np.zeros(3, np.int64)
    kept = 0
    for items in portions:
        triangles, _, dir = safety.lines(items)
        corners = tuple(triangles[:, k] for k in range(3))
        plane = preparation.prepared(stored_plane, corners, *[np.float32] * 3)
        stored = (plane[name] for name in ("normal", "d", "i1", "i2"))
        kept += count_wrong(items, dir, *stored, safety.classify(items), wrong)
    return kept, dict(zip(("moller", "badouel", "chirkov"), wrong.tolist(), strict=True))


def drawn(generator, seed, n):
    draw = draws.items(generator, seed)
    return (draw(PORTION) for _ in range(0, n, PORTION))


def aimed_at_edges(seed, n):
    """Yield items whose line passes the edge v0 v2 at a distance of about 1e-7."""
    rng = np.random.default_rng(seed)
    items = draws.draw("pcg64", seed, n)
    v0, v1, v2 = (items[:, part].astype(float) for part in (draws.V0, draws.V1, draws.V2))
    near = rng.normal(0, 1e-7, (n, 1))
    target = v0 + near * (v1 - v0) + rng.random((n, 1)) * (v2 - v0)
    items[:, draws.END] = 2 * target - items[:, draws.ORIG]
    yield items


@pytest.mark.parametrize("generator", draws.GENERATORS)
def test_listings_are_right_on_a_million_kept_pairs(generator):
    kept, wrong = wrong_on_kept(drawn(generator, 101, 1_100_000))
    assert kept > 1_000_000
    assert wrong == {"moller": 0, "badouel": 0, "chirkov": 0}


def test_without_the_margin_every_listing_is_wrong_at_edges(monkeypatch):
    kept, _ = wrong_on_kept(aimed_at_edges(1, 20_000))
    assert kept < 20
    monkeypatch.setattr(safety, "MARGIN", 0.0)
    kept, wrong = wrong_on_kept(aimed_at_edges(1, 20_000))
    assert kept > 19_000
    assert min(wrong.values()) > 100


@pytest.mark.full
@pytest.mark.parametrize("generator", draws.GENERATORS)
def test_listings_are_right_on_two_hundred_million_kept_pairs(generator):
    kept, wrong = wrong_on_kept(drawn(generator, 2024, 105_000_000))
    assert kept > 100_000_000
    assert wrong == {"moller": 0, "badouel": 0, "chirkov": 0}
