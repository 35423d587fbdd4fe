"""Lanes say what single rays are told, bit for bit; layouts, axes and exits change nothing."""

import platform
import re

import numpy as np
import pytest

from rtbench.compiled import packets, packing
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import fill
from rtbench.compiled.loops import loop
from rtbench.compiled.machine_code import instructions
from rtbench.compiled.packing import Packing
from rtbench.errors import RtbenchError
from rtbench.kernels.registry import all_kernels, find

REFUSED = ("_text9", "_inside")
METHODS = sorted(
    name
    for name, kernel in all_kernels().items()
    if kernel.ending is not None and name == kernel.function.__name__
)
ENDINGS = ("", "_whole", "_last_whole")
FILTERS = sorted(name for name, kernel in all_kernels().items() if kernel.fallback)
EVERY = [
    name
    for name, kernel in all_kernels().items()
    if (kernel.ending is not None or kernel.fallback) and not any(each in name for each in REFUSED)
]
PROJECTING = "wald_uv"
X86 = platform.machine() in ("x86_64", "AMD64")


def scene(triangles=75, rays=64, seed=1, dtype=np.float64):
    """Return triangles that overlap much, and rays through them."""
    draw = np.random.default_rng(seed)
    corners = draw.normal(size=(triangles, 3, 3)).astype(np.float32)
    aim = draw.normal(size=(rays, 3)) * 0.5
    origins = (draw.normal(size=(rays, 3)) * 2).astype(np.float32)
    return corners.astype(dtype), origins.astype(dtype), (aim - origins).astype(np.float32)


def hostile(count):
    """Return pairs of which some are degenerate, infinite, huge, tiny or no numbers at all."""
    draw = np.random.default_rng(5)
    numbers = np.array([0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e30, -1e-30, np.inf, -np.inf, np.nan])
    chance = [0.2, 0.05, 0.2, 0.15, 0.15, 0.15, 0.02, 0.02, 0.02, 0.02, 0.02]
    values = draw.choice(numbers, size=(count, 5, 3), p=chance)
    return values[:, :3], values[:, 3], values[:, 4]


def whole_blocks(kernel, precision, corners, width):
    """Return the order of pairs in which blocks share the kernel's axis."""
    records = packing.fill_triangles(kernel, precision, Packing(width=width), corners)
    axis = packing.axis_of(kernel, records)
    parts = [np.flatnonzero(axis == each) for each in range(3)]
    return np.concatenate([part[: len(part) // width * width] for part in parts])


@np.errstate(all="ignore")
def in_lanes(kernel, precision, chosen, corners, origins, directions, tmax=np.inf):
    triangles = packing.fill_triangles(kernel, precision, chosen, corners)
    rays = packing.fill_rays(kernel, precision, chosen, origins, directions, tmax)
    made = packets.loop(kernel, precision, chosen, packing.held(chosen, triangles, rays))
    found = packets.run_once(made, kernel, precision, chosen, (triangles, rays), len(origins))
    return [values.reshape(-1) for values in found[: 1 + len(kernel.outputs)]]


@np.errstate(all="ignore")
def one_by_one(kernel, precision, kind, corners, origins, directions, tmax=np.inf):
    vertices = [corners[:, i] for i in range(3)]
    records = fill(kernel, "own", precision, vertices, origins, directions, tmax=tmax)
    found = run_once(loop(kernel, precision, "own", kind=kind), kernel, precision, *records)
    return list(found[: 1 + len(kernel.outputs)])


def assert_same(lanes, scalar):
    """Bit for bit; of NaN not the bits, since either of two may come out of a product."""
    for got, wanted in zip(lanes, scalar, strict=True):
        both = np.isnan(got) & np.isnan(wanted)
        assert np.where(both, 0, got).tobytes() == np.where(both, 0, wanted).tobytes()


def check_pairs(name, width, precision):
    kernel = find(name)
    random = scene(400, 400, dtype=np.float32)
    corners, origins, directions = (
        np.concatenate([a, b]) for a, b in zip(random, hostile(1200), strict=True)
    )
    order = whole_blocks(kernel, precision, corners, width)
    given = corners[order], origins[order], directions[order]
    lanes = in_lanes(kernel, precision, Packing("pairs", width), *given, tmax=2.0)
    scalar = one_by_one(kernel, precision, "independent", *given, tmax=2.0)
    hits = np.count_nonzero(scalar[0] == 0)
    assert 20 < hits < len(order) - 100
    scalar[0] = (scalar[0] != 0).astype(np.int32)
    assert_same(lanes, scalar)


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("method", METHODS)
def test_every_lane_says_what_the_single_test_says_of_hostile_pairs_too(method, ending):
    number = METHODS.index(method) + ENDINGS.index(ending)
    check_pairs(
        f"{method}{ending}_uv",
        packing.WIDTHS[number % 3],
        packing.PRECISIONS[number % 2],
    )


@pytest.mark.parametrize("precision", packing.PRECISIONS)
@pytest.mark.parametrize("name", [name for name in FILTERS if name.endswith("_uv")])
def test_lanes_that_a_filter_leaves_undecided_are_told_what_single_tests_are(name, precision):
    check_pairs(name, 16, precision)
    given = touching()
    for form, exit in (("rays", "none"), ("rays", "any"), ("triangles", "none")):
        kernel, chosen = find(name), Packing(form, 8, exit=exit)
        scalar = one_by_one(kernel, precision, "nearest", *given)
        assert (scalar[0] >= 0).sum() > 20
        assert_same(in_lanes(kernel, precision, chosen, *given), scalar)


def touching():
    """Return triangles of whole numbers, and rays straight at their corners and edges."""
    draw = np.random.default_rng(2)
    corners = draw.integers(-4, 5, (60, 3, 3)).astype(np.float32)
    aim = corners[:, 0].copy()
    aim[::2] = (corners[::2, 0] + corners[::2, 1]) / 2
    origins = draw.integers(-9, 10, (60, 3)).astype(np.float32)
    return corners, origins[:56], (aim - origins)[:56]


@pytest.mark.full
@pytest.mark.parametrize("precision", packing.PRECISIONS)
@pytest.mark.parametrize("width", packing.WIDTHS)
@pytest.mark.parametrize("name", EVERY)
def test_every_kernel_in_every_width(name, width, precision):
    check_pairs(name, width, precision)


def nearest_by_numpy(corners, origins, directions):
    """Return each ray's nearest triangle by solving O + t D = A + u AB + v AC in double."""
    found = []
    for origin, direction in zip(origins.astype(float), directions.astype(float), strict=True):
        a, b, c = (corners[:, i].astype(float) for i in range(3))
        columns = np.stack([np.broadcast_to(-direction, a.shape), b - a, c - a], axis=-1)
        t, u, v = np.linalg.solve(columns, (origin - a)[..., None])[..., 0].T
        t = np.where((t > 0) & (u >= 0) & (v >= 0) & (u + v <= 1), t, np.inf)
        found.append(int(t.argmin()) if np.isfinite(t.min()) else -1)
    return np.array(found)


@pytest.mark.parametrize("form", ["rays", "triangles"])
@pytest.mark.parametrize("name", ["wald_last_whole_uv", "moller_trumbore"])
def test_the_nearest_triangle_is_that_of_linear_algebra(name, form):
    given = scene(seed=3)
    found = in_lanes(find(name), "float64", Packing(form), *given)[0]
    right = nearest_by_numpy(*given)
    assert (right >= 0).sum() > 20
    assert found.tolist() == right.tolist()


ROUNDS = [
    Packing("rays", 4),
    Packing("rays", 8),
    Packing("rays", 16),
    Packing("rays", exit="any"),
    Packing("rays", 8, exit="any", axes="fixed"),
    Packing("rays", layout="soa"),
    Packing("rays", layout="aos"),
    Packing("rays", axes="table"),
    Packing("rays", axes="fixed"),
    Packing("triangles", 4),
    Packing("triangles", 8, exit="any"),
    Packing("triangles", 16),
    Packing("triangles", layout="soa", axes="table"),
    Packing("triangles", 8, layout="soa", axes="fixed"),
    Packing("triangles", 4, layout="aos"),
    Packing("triangles", axes="table"),
    Packing("triangles", axes="fixed"),
]


@pytest.mark.parametrize("precision", packing.PRECISIONS)
@pytest.mark.parametrize("chosen", ROUNDS, ids=str)
def test_no_packing_changes_the_nearest_hit(chosen, precision):
    kernel, given = find(PROJECTING), scene()
    scalar = one_by_one(kernel, precision, "nearest", *given, tmax=3.0)
    assert 20 < np.count_nonzero(scalar[0] >= 0) < 64
    assert_same(in_lanes(kernel, precision, chosen, *given, tmax=3.0), scalar)


@pytest.mark.parametrize("packet", ["common", "parallel"])
@pytest.mark.parametrize("name", ["kensler_shirley_uv", "wald_last_whole", "shevtsov_last"])
def test_what_a_packet_shares_may_be_computed_once(name, packet):
    kernel = find(name)
    corners, origins, directions = scene()
    shared = origins if packet == "common" else directions
    shared[:] = shared[np.arange(len(shared)) // 16 * 16]
    given = corners, origins, directions
    scalar = one_by_one(kernel, "float32", "nearest", *given)
    assert_same(in_lanes(kernel, "float32", Packing(packet=packet), *given), scalar)


TIED = [
    Packing("rays"),
    Packing("rays", axes="fixed"),
    Packing("triangles", 4),
    Packing("triangles", 16, axes="fixed"),
]


@pytest.mark.parametrize("chosen", TIED, ids=str)
@pytest.mark.parametrize("turn", [0, 1, 2])
def test_a_tie_goes_to_the_lower_index_whatever_the_order_of_axes(chosen, turn):
    # Three triangles, twice, through (0, 0, 2), met by a ray along z at t = 2 exactly, their
    # normals greatest along x, y and z.
    tilted = np.array(
        [
            [[-1, 0, 1], [1, -4, 3], [1, 4, 3]],
            [[-4, 1, 3], [0, -1, 1], [4, 1, 3]],
            [[-1, -1, 2], [3, -1, 2], [-1, 3, 2]],
        ],
        float,
    )
    tilted[0] *= [0.25, 1, 1]
    tilted[1] *= [1, 0.25, 1]
    corners = np.roll(tilted, turn, axis=0)[[0, 1, 2, 0, 1, 2]]
    rays = np.zeros((16, 3)), np.tile([0.0, 0.0, 1.0], (16, 1))
    kernel = find("wald")
    found = in_lanes(kernel, "float64", chosen, corners, *rays)
    records = packing.fill_triangles(kernel, "float64", Packing(), corners)
    assert sorted(packing.axis_of(kernel, records).tolist()) == [0, 0, 1, 1, 2, 2]
    assert found[1].tolist() == [2.0] * 16
    assert found[0].tolist() == [0] * 16


@pytest.mark.parametrize("form", ["rays", "triangles"])
def test_nothing_in_reach_leaves_tmax(form):
    corners, origins, directions = scene()
    found = in_lanes(
        find("shevtsov_uv"), "float32", Packing(form), corners, origins + 100, directions, 7.0
    )
    assert found[0].tolist() == [-1] * 64
    assert found[1].tolist() == [7.0] * 64
    assert not found[2].any() and not found[3].any()


@pytest.mark.skipif(not X86, reason="the estimates are x86's")
@pytest.mark.parametrize("width", packing.WIDTHS)
def test_the_estimated_reciprocal_is_near_and_a_zero_denominator_misses(width):
    kernel = find("wald_whole")
    corners, origins, directions = scene()
    directions[:16] = corners[0, 1] - corners[0, 0]
    chosen = [Packing(width=width, reciprocal=each) for each in packing.RECIPROCALS]
    exact, near = (
        in_lanes(kernel, "float32", each, corners, origins, directions) for each in chosen
    )
    same = exact[0] == near[0]
    assert same.sum() >= 62
    hit = same & (exact[0] >= 0)
    error = np.abs(near[1][hit] - exact[1][hit]) / exact[1][hit]
    assert 0 < error.max() < 2.0**-21
    flat = np.array([[[0, 0, 1], [1, 0, 1], [0, 1, 1]]], float)
    inside, along = np.tile([0.25, 0.25, 1.0], (16, 1)), np.tile([1.0, 0.0, 0.0], (16, 1))
    found = in_lanes(kernel, "float32", chosen[1], flat, inside, along)
    assert found[0].tolist() == [-1] * 16


@pytest.mark.skipif(not X86, reason="looks for x86's registers")
@pytest.mark.parametrize("form", ["pairs", "rays", "triangles"])
@pytest.mark.parametrize("width", packing.WIDTHS)
def test_the_machine_code_is_vector_code_without_gathers(form, width):
    made = packets.loop(find("shevtsov_whole"), "float32", Packing(form, width))
    code = instructions(made.assembly)
    text = "\n".join(code)
    products = re.findall(r"v?mulps\b", text)
    assert len(products) >= 10
    assert not re.search(r"v?mulss\b", text) or form == "triangles"  # what a group shares
    assert "gather" not in text


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("moller1", "takes no tmax"),
        ("wald_text9", "math.copysign"),
        ("wald_inside", "takes no tmax"),
        ("angle_sum", "cannot be taken in packets"),
    ],
)
def test_what_cannot_be_taken_in_lanes_is_refused(name, told):
    with pytest.raises(RtbenchError, match=told):
        packets.loop(find(name), "float32", Packing())


def test_a_kernel_without_an_exit_cannot_be_left_early():
    with pytest.raises(RtbenchError, match="no exit"):
        packets.loop(find("wald_whole"), "float32", Packing(exit="any"))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"form": "ray"}, "rays"),
        ({"width": 5}, "4, 8, 16"),
        ({"packet": "common", "form": "pairs"}, "common"),
        ({"packet": "parallel", "layout": "soa"}, "parallel"),
        ({"layout": "arrays"}, "aos"),
        ({"axes": "sorted"}, "stored"),
    ],
)
def test_a_packing_that_is_not_allowed_is_refused(options, told):
    with pytest.raises(RtbenchError, match=told):
        Packing(**options)


def test_lanes_are_made_in_two_precisions_and_estimates_in_one():
    with pytest.raises(RtbenchError, match="mixed"):
        packets.loop(find("wald"), "mixed", Packing())
    with pytest.raises(RtbenchError, match="float64"):
        packets.loop(find("wald"), "float64", Packing(reciprocal="estimate"))


def test_pairs_that_make_no_whole_blocks_are_refused():
    corners, origins, _ = scene(20, 20)
    with pytest.raises(RtbenchError, match="whole blocks of 16"):
        packing.fill_triangles(find("wald"), "float32", Packing("pairs"), corners)
    with pytest.raises(RtbenchError, match="20 rays"):
        packing.fill_rays(find("wald"), "float32", Packing(), origins, origins)
