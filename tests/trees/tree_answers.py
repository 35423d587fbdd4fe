"""What walks through trees answer, and what all pairs of rays and triangles do."""

import numpy as np

import rtbench
from rtbench.compiled.layout import REAL_TYPE
from rtbench.kernels import registry
from rtbench.trees import leaves
from rtbench.trees.nodes import one_leaf
from rtbench.trees.traversal.walks import walk

KERNELS = ("moller_trumbore_uv", "watertight_safe", "adaptive_exact_uv")
EXACT = "adaptive_exact_uv"  # each t is the right one, rounded
# Options of every builder that is there.
BUILDERS = {
    "nlogn": {},
    "nlog2n": {"builder": "nlog2n", "overlap": "three_stage", "traversal_cost": 0.7},
    "n2": {"builder": "n2", "ending": "automatic", "empty_bonus": 1.0},
    "binned": {"builder": "binned", "overlap": "plane_clipped", "block": 8, "max_leaf": 8},
    "as_printed": {"builder": "as_printed", "overlap": "box", "axes": "longest"},
    "object_median": {"rule": "object_median", "overlap": "separating_axes"},
    "spatial_median": {"rule": "spatial_median", "axes": "round_robin"},
}


def walked(
    kernel,
    precision,
    geometry,
    tree,
    rays,
    way="stack",
    query="nearest",
    form=leaves.ONE_BY_ONE,
    counted=False,
):
    """Return outcome, t, u, v (N,) and counts (N, 3) of a walk over (origins, directions, tmax)."""
    chosen = registry.find(kernel)
    if way == "brute_force":
        tree = one_leaf(len(geometry), geometry.box, tree.options)
    made = leaves.one_by_one if form == leaves.ONE_BY_ONE else leaves.blocks
    read = made(chosen, precision, geometry, tree)
    records = leaves.rays(chosen, precision, *rays)
    n, real = len(records), REAL_TYPE[precision]
    scene = np.concatenate([geometry.base, geometry.box, [geometry.reach]]).astype(np.float64)
    outcome, counts = np.full(n, -7, np.int32), np.full((n, 3), -7, np.int32)
    t, u, v = (np.zeros(n, real) for _ in range(3))
    walk(chosen, precision, way, query, form, counted).call(
        *(read.nodes, read.refs, read.triangles, scene, records),
        *(np.zeros(1, np.uint64), np.arange(n, dtype=np.uint64), outcome, t, u, v, counts),
    )
    return outcome, t, u, v, counts


def by_pairs(kernel, precision, triangles, origins, directions, tmax):
    """Return triangle, t, u, v of the nearest hit by asking for every pair of few rays."""
    n, m = len(origins), len(triangles)
    tmax = np.asarray(tmax, REAL_TYPE[precision])
    if not m:
        zero = np.zeros(n, tmax.dtype)
        return np.full(n, -1), tmax, zero, zero
    found = rtbench.intersect(
        kernel,
        np.broadcast_to(triangles, (n, m, 3, 3)).reshape(-1, 3, 3),
        np.repeat(origins, m, axis=0),
        np.repeat(directions, m, axis=0),
        precision,
    )
    t = np.where(found.hit, found.t, np.inf).reshape(n, m)
    t[~(t < tmax[:, None])] = np.inf
    # The least t, then the lowest index: argmin takes the first of equal ones.
    index, rows = t.argmin(axis=1), np.arange(n)
    hit = t[rows, index] < np.inf
    of_hit = [
        np.where(hit, np.nan_to_num(each).reshape(n, m)[rows, index], 0).astype(tmax.dtype)
        for each in (found.u, found.v)  # 0 too where the kernel returns none
    ]
    return np.where(hit, index, -1), np.where(hit, t[rows, index], tmax), *of_hit


def pads(geometry, origins):
    """Return how far off a triangle a hit may be so that no walk loses it: see `entering`."""
    extent = 2.0 * np.abs(geometry.box.astype(np.float64)).max()
    away = np.abs(origins - geometry.base).max(axis=1) + extent
    rounding = 2.0**-20 if geometry.corners.dtype == np.float32 else 2.0**-49
    return 2.0**-20 * extent + rounding * away + 2.0**-50 * geometry.reach


def off_triangle(points, triangles):
    """Return how far points (N, 3) are from triangles (N, 3, 3)."""
    found = np.full(len(points), np.inf)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = (normal * normal).sum(axis=1)
    over = size > 0
    for k in range(3):
        start = triangles[:, k]
        edge, to = triangles[:, (k + 1) % 3] - start, points - start
        along = (to * edge).sum(axis=1) / np.maximum((edge * edge).sum(axis=1), 1e-300)
        away = to - np.clip(along, 0, 1)[:, None] * edge
        found = np.minimum(found, np.linalg.norm(away, axis=1))
        over &= (np.cross(edge, to) * normal).sum(axis=1) >= 0
    height = np.abs(((points - triangles[:, 0]) * normal).sum(axis=1))
    return np.where(over, height / np.sqrt(np.where(over, size, 1)), found)


def assert_equal(found, expected, geometry, rays, what, exact=False):
    """Compare triangle, t, u, v (N,) of a walk with brute force's: equal, bit for bit.

    Of a kernel that is not exact there may be answers that differ where the hit that brute force
    reports is further off its triangle than planes are widened: so are hits of rays that
    run in the plane of the triangle or nearly so, where t has no digit that is right. No tree
    finds such a triangle, and which does is chance. How many rays these were is returned.
    """
    differ = np.zeros(len(found[0]), bool)
    for one, other in zip(found, expected, strict=True):
        differ |= (one != other) & ~(np.isnan(one) & np.isnan(other))
    there = np.flatnonzero(differ)
    if not len(there):
        return 0
    first = there[0], [x[there[0]] for x in found], [x[there[0]] for x in expected]
    what = f"{what}: {len(there)} of {len(differ)} differ; ray, walk, brute force: {first}"
    assert not exact and (expected[0][there] >= 0).all(), what
    origins, directions = (np.asarray(each)[there] for each in rays[:2])
    points = origins + expected[1][there].astype(np.float64)[:, None] * directions
    triangles = geometry.corners[expected[0][there]].astype(np.float64)
    off = off_triangle(points, triangles) / pads(geometry, origins)
    near = off < 1
    assert not near.any(), f"{what}; ray {there[near][0]} by no more than {off[near][0]} of a pad"
    return len(there)
