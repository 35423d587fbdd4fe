"""Hard cases are what their families promise, by the oracle and by what was measured of them."""

import collections
import dataclasses
import hashlib
import struct
from fractions import Fraction

import numpy as np
import pytest

import rtbench
from rtbench.accuracy.cases import CLASS_NAMES
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import HIT
from rtbench.workloads import hard_cases
from rtbench.workloads.hard_cases import CORE, FAMILIES, describe, direction_lengths, drawn
from rtbench.workloads.hard_cases.assembling import answered

NAMES = [family.name for family in FAMILIES]
ALONE, ONE, ODD, SAME = range(4)

PROMISED = {
    "control_random": "miss hit_interior",
    "near_edge": "miss hit_interior",
    "near_vertex": "miss hit_interior",
    "exact_edge": "hit_edge",
    "exact_vertex": "hit_vertex",
    "shared_edge_exact": "hit_edge",
    "vertex_fan_exact": "hit_vertex",
    "parallel_offplane": "parallel",
    "coplanar": "coplanar_touch coplanar_miss",
    "degenerate_collinear": "degenerate_touch degenerate_miss",
    "degenerate_coincident": "degenerate_touch degenerate_miss",
    "origin_on": "origin_on",
    "self_intersection": "hit_interior behind",
    "near_origin": "hit_interior behind",
    "behind": "behind",
    "inf_nan": "invalid",
    "zero_dir": "invalid",
    "far_triangle": "miss hit_interior",
    "far_origin": "miss hit_interior",
    "tiny_triangle": "miss hit_interior",
    "dir_scale": "miss hit_interior",
    "permutation": "miss hit_interior",
}
MIXED = [
    "near_edge",
    "near_vertex",
    "grazing",
    "needle",
    "cap",
    "near_degenerate",
    "far_triangle",
    "far_origin",
    "tiny_triangle",
    "huge_triangle",
    "log_uniform",
    "subnormal",
    "overflow",
    "dir_scale",
]
# As robustness of intersection tests is measured elsewhere; numbers are part of the format.
ORDER = [
    "control_random",
    "near_edge",
    "near_vertex",
    "exact_edge",
    "exact_vertex",
    "shared_edge_exact",
    "shared_edge_near",
    "vertex_fan_exact",
    "vertex_fan_near",
    "closed_mesh_far",
    "parallel_offplane",
    "grazing",
    "coplanar",
    "needle",
    "cap",
    "near_degenerate",
    "far_triangle",
    "far_origin",
    "tiny_triangle",
    "huge_triangle",
    "log_uniform",
    "degenerate_collinear",
    "degenerate_coincident",
    "origin_on",
    "self_intersection",
    "near_origin",
    "behind",
    "subnormal",
    "overflow",
    "inf_nan",
    "zero_dir",
    "signed_zero_axis",
    "dir_scale",
    "permutation",
    "axis_tie",
    "field",
    "text9",
]


@pytest.fixture(scope="module")
def cases():
    return hard_cases.corpus()


def of(cases, name):
    return cases.take(cases.family == cases.family_names.index(name))


def groups(cases):
    return [
        cases.take(cases.group == number) for number in np.unique(cases.group[cases.group >= 0])
    ]


def names_of(cases):
    return [cases.class_names[number] for number in cases.cls]


def test_families_stand_in_order_and_have_cases_enough(cases):
    assert cases.family_names[: len(ORDER)] == tuple(ORDER)
    assert cases.family_names == tuple(NAMES)
    counts = np.bincount(cases.family)
    assert all(
        300 <= n <= 1400 for n, name in zip(counts, NAMES, strict=True) if "range" not in name
    )
    assert 18_000 <= len(cases) <= 25_000
    assert 0.6 < cases.f32_ok.mean() < 0.7
    for name in ORDER:
        assert 150 < of(cases, name).f32_ok.sum() < len(of(cases, name)) - 150
    assert set(NAMES) - set(CORE) == {"subnormal", "overflow", "inf_nan", "zero_dir", "field_range"}


@pytest.mark.parametrize("name", PROMISED)
def test_cases_have_the_classes_that_a_family_promises(cases, name):
    found = collections.Counter(names_of(of(cases, name)))
    assert set(found) == set(PROMISED[name].split())
    assert min(found.values()) > len(of(cases, name)) / 4


@pytest.mark.parametrize("name", MIXED)
def test_hits_and_misses_are_mixed_at_every_difficulty(cases, name):
    own = of(cases, name)
    own = own.take(own.f32_ok)
    for level in np.unique(own.difficulty):
        expected = own.expect[own.difficulty == level]
        assert 0.1 < (expected == 1).mean() < 0.9, level


def test_float32_cases_are_those_that_float32_holds(cases):
    rows = np.concatenate([cases.triangles.reshape(-1, 9), cases.org, cases.dir], axis=1)

    def holds(number):
        try:
            return number != number or struct.unpack("f", struct.pack("f", number))[0] == number
        except OverflowError:
            return False

    assert cases.f32_ok.tolist() == [all(map(holds, row)) for row in rows.tolist()]


def digests(seed):
    return [
        hashlib.sha256(b"".join(map(np.ascontiguousarray, drawn(name, seed)[:4]))).hexdigest()
        for name in NAMES
    ]


def test_a_seed_always_draws_the_same_and_another_seed_other_cases(cases):
    first = digests(1)
    assert first == digests(1)
    for name, a, b in zip(NAMES, first, digests(2), strict=True):
        assert (a == b) == (name == "field_range"), name  # the only one without a drawn number
    for name in ("needle", "field", "text9"):
        found, own = drawn(name), of(cases, name)
        np.testing.assert_array_equal(found.triangles, own.triangles)
        np.testing.assert_array_equal(found.directions, own.dir)


def test_bad_names_and_seeds_are_told():
    with pytest.raises(RtbenchError, match="did you mean 'needle'"):
        drawn("nedle")
    for ask in (lambda: drawn("needle", -1), lambda: hard_cases.corpus(-1)):
        with pytest.raises(RtbenchError, match="seed -1 is not allowed"):
            ask()


def test_groups_are_one_ray_in_one_family_and_in_both_precisions_or_one(cases):
    grouped = cases.take(cases.group >= 0)
    rules = grouped.group_rule[grouped.family]
    assert (rules > 0).all()
    assert not (cases.group_rule[cases.family[cases.group < 0]] > 0).any()
    order = np.argsort(grouped.group, kind="stable")
    same = np.diff(grouped.group[order]) == 0
    rows = np.column_stack([grouped.org, grouped.dir, grouped.family, grouped.f32_ok])[order]
    assert (rows[1:] == rows[:-1])[same].all()
    _, sizes = np.unique(grouped.group, return_counts=True)
    assert sizes.min() == 2 and sizes.max() == 20
    assert len(sizes) > 1000


def test_exactly_one_triangle_of_a_group_owns_the_ray(cases):
    chosen = np.isin(cases.group_rule[cases.family], (ONE, ODD)) & (cases.group >= 0)
    owners = np.bincount(cases.group[chosen], cases.sos_hit[chosen])
    assert (owners[np.unique(cases.group[chosen])] == 1).all()
    closed = np.isin(cases.cls, (1, 2, 3))  # closed triangles: at least one, without any rule
    assert (
        np.bincount(cases.group[chosen], closed[chosen])[np.unique(cases.group[chosen])] > 0
    ).all()


def corners(triangle):
    return [tuple(corner) for corner in triangle.tolist()]


@pytest.mark.parametrize("name", ["vertex_fan_exact", "vertex_fan_near"])
def test_fans_are_closed_and_go_once_around_their_corner(cases, name):
    windings, sizes = collections.Counter(), set()
    for group in groups(of(cases, name)):
        triangles = [corners(triangle) for triangle in group.triangles]
        sizes.add(len(triangles))
        (centre,) = set.intersection(*map(set, triangles))
        rim = collections.Counter(c for triangle in triangles for c in triangle if c != centre)
        assert set(rim.values()) == {2} and len(rim) == len(triangles)
        way = np.cross(
            group.triangles[:, 1] - group.triangles[:, 0],
            group.triangles[:, 2] - group.triangles[:, 0],
        )
        windings.update(np.sign(way @ group.dir[0]))
    assert sizes == set(range(3, 9))
    assert min(windings.values()) > 200 and set(windings) == {-1, 1}


def test_shared_edges_have_a_triangle_on_each_side(cases):
    for name in ("shared_edge_exact", "shared_edge_near"):
        for group in groups(of(cases, name)):
            one, other = (set(corners(triangle)) for triangle in group.triangles)
            assert len(one & other) == 2
            first, last = (np.array(corner) for corner in one & other)
            sides = [
                np.linalg.det([last - first, group.dir[0], np.array(third) - first])
                for (third,) in (one - other, other - one)
            ]
            assert sides[0] * sides[1] < 0


def test_closed_meshes_are_closed(cases):
    for group in groups(of(cases, "closed_mesh_far")):
        edges = collections.Counter(
            frozenset((triangle[i], triangle[i - 1]))
            for triangle in map(corners, group.triangles)
            for i in range(3)
        )
        assert len(group) == 20 and len(edges) == 30 and set(edges.values()) == {2}
    own = of(cases, "closed_mesh_far")
    far = np.array([148376.0, 1234, -223423])
    embree = own.take(np.abs(own.difficulty - np.log10(np.linalg.norm(far))) < 1e-9)
    assert len(embree) and np.abs(embree.org - far).max() < 0.5


def test_permutations_are_all_six_orders_of_one_triangle_with_one_answer(cases):
    for group in groups(of(cases, "permutation")):
        orders = {tuple(corners(triangle)) for triangle in group.triangles}
        assert len(orders) == len(group) == 6
        assert len({frozenset(order) for order in orders}) == 1
        assert len(set(group.cls)) == len(set(group.sos_hit)) == len(set(group.eta)) == 1


def test_controls_have_a_margin(cases):
    assert of(cases, "control_random").eta.min() > 0.005


def edges(cases):
    lengths = np.linalg.norm(cases.triangles - np.roll(cases.triangles, 1, axis=1), axis=2)
    return np.sort(lengths, axis=1)


def area(cases):
    v0, v1, v2 = cases.v0, cases.v1, cases.v2
    with np.errstate(over="ignore"):
        return np.linalg.norm(np.cross(v1 - v0, v2 - v0), axis=1) / 2


def angle(cases):
    normal = np.cross(cases.v1 - cases.v0, cases.v2 - cases.v0)
    across = (normal * cases.dir).sum(axis=1)
    return np.abs(across) / (np.linalg.norm(normal, axis=1) * np.linalg.norm(cases.dir, axis=1))


def least_weight(cases):
    return np.min(np.abs([cases.u, cases.v, 1 - cases.u - cases.v]), axis=0)


def away(cases):
    return np.abs(cases.t) * np.linalg.norm(cases.dir, axis=1)


# What is 10 to the difficulty, or minus it; up to which difficulty in float32; within which factor.
MEANINGS = {
    "near_edge": (least_weight, -1, 5, 1.5),
    "near_vertex": (least_weight, -1, 5, 4),
    "grazing": (angle, -1, 5, 1.5),
    "needle": (lambda c: edges(c)[:, 0] / edges(c)[:, 2], -1, 5, 2),
    "cap": (lambda c: 2 * area(c) / edges(c)[:, 2] ** 2, -1, 5, 2.5),
    "far_triangle": (lambda c: np.linalg.norm(c.v0, axis=1), 1, 6, 5),
    "far_origin": (lambda c: np.linalg.norm(c.org, axis=1), 1, 7, 4),
    "tiny_triangle": (lambda c: edges(c)[:, 1], -1, 10, 3),
    "huge_triangle": (lambda c: edges(c)[:, 1], 1, 10, 3),
    "self_intersection": (lambda c: np.linalg.norm(c.org, axis=1), 1, 6, 5),
    "near_origin": (away, -1, 5, 2),
    "behind": (away, 1, 5, 2),
    "dir_scale": (lambda c: np.linalg.norm(c.dir, axis=1), 1, 12, 1.1),
}


@pytest.mark.parametrize("name", MEANINGS)
def test_difficulty_is_what_it_is_said_to_be(cases, name):
    measure, sign, greatest, factor = MEANINGS[name]
    own = of(cases, name)
    own = own.take(own.f32_ok & (own.difficulty <= greatest) & (own.difficulty != 0))
    assert len(own) > 150
    ratio = measure(own) / 10.0 ** (sign * own.difficulty)
    assert ratio.max() < factor and ratio.min() > 1 / factor


def test_whole_numbers_have_as_many_bits_as_their_difficulty(cases):
    for name in [
        "exact_edge",
        "exact_vertex",
        "shared_edge_exact",
        "vertex_fan_exact",
        "origin_on",
    ]:
        own = of(cases, name)
        rows = np.concatenate([own.triangles.reshape(-1, 9), own.org, own.dir], axis=1)
        assert (rows == np.rint(rows)).all()
        bits = np.log2(np.abs(rows).max(axis=1))
        assert (bits <= own.difficulty + 1).all() and (bits > own.difficulty - 4).all()


def test_parallel_rays_lie_at_the_height_of_their_difficulty(cases):
    own = of(cases, "parallel_offplane")
    for i in range(0, len(own), 7):
        v0, v1, v2, org, way = (
            [Fraction(x) for x in each[i]] for each in (own.v0, own.v1, own.v2, own.org, own.dir)
        )
        e, f, s = (([a - b for a, b in zip(p, v0, strict=True)]) for p in (v1, v2, org))
        normal = [e[j - 2] * f[j - 1] - e[j - 1] * f[j - 2] for j in range(3)]
        assert sum(a * b for a, b in zip(normal, way, strict=True)) == 0
        volume = abs(sum(a * b for a, b in zip(normal, s, strict=True)))
        height = float(volume) / float(sum(a * a for a in normal)) ** 0.5
        size = edges(own)[i, 2]
        assert 2.0 ** -(own.difficulty[i] + 8) < height / size < 2.0 ** (3 - own.difficulty[i])


def plain_test(cases, dtype):
    """Möller and Trumbore's test in numpy, in a precision."""
    v0, v1, v2, o, d = (
        a.astype(dtype) for a in (cases.v0, cases.v1, cases.v2, cases.org, cases.dir)
    )
    e, f, s = v1 - v0, v2 - v0, o - v0
    p, q = np.cross(d, f), np.cross(s, e)
    with np.errstate(all="ignore"):
        det = (e * p).sum(axis=1)
        u, v, t = ((a * b).sum(axis=1) / det for a, b in ((s, p), (d, q), (f, q)))
        return (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)


@pytest.mark.parametrize("name", ["near_edge", "near_vertex", "grazing", "needle", "cap"])
def test_difficulty_goes_from_easy_to_hopeless_for_float32(cases, name):
    own = of(cases, name)
    own = own.take(own.f32_ok)
    wrong = plain_test(own, np.float32) != (own.expect == 1)
    assert not wrong[own.difficulty <= 4].any()
    assert wrong[own.difficulty == own.difficulty.max()].mean() > 0.1
    assert (plain_test(own, np.float64) == (own.expect == 1)).all()


def test_broken_numbers_and_directions_of_zeros(cases):
    own = of(cases, "inf_nan")
    rows = np.stack([own.v0, own.v1, own.v2, own.org, own.dir], axis=1)
    count = (~np.isfinite(rows)).sum(axis=2)
    assert (count.max(axis=1) == count.sum(axis=1)).all()  # one vector of each is broken
    for kind in (np.isnan(rows), rows == np.inf, rows == -np.inf):
        counts = kind.sum(axis=2)
        assert ((counts == 1).sum(axis=0) > 10).all() and ((counts == 3).sum(axis=0) > 10).all()
    own = of(cases, "zero_dir")
    assert (own.dir == 0).all()
    minus = np.signbit(own.dir).sum(axis=1)
    assert set(minus) == {0, 1, 2, 3}


def test_signed_zeros_are_of_both_signs_and_rays_along_axes(cases):
    own = of(cases, "signed_zero_axis")
    assert ((own.dir != 0).sum(axis=1) == 1).all()
    assert {"hit_edge", "hit_vertex", "hit_interior", "miss", "behind"} == set(names_of(own))
    for rows in (own.dir, own.org, own.triangles):
        zeros = np.signbit(rows[rows == 0])
        assert 0.3 < zeros.mean() < 0.7


def test_text_9_is_wrong_about_its_borders_where_the_same_method_is_not(cases):
    own = of(cases, "text9")
    assert set(own.source) == {"Havel 2008, Text 9"} and len(set(own.name)) == 7

    def answers(kernel):
        # The kernel's own outcome: t is NaN there. Finite: else the sign of another NaN decides.
        found = rtbench.intersect(kernel, own.triangles, own.org, own.dir, "float64", tmax=1e6)
        hit = found.outcome == HIT
        return hit, (hit & (own.expect == 0)) | (~hit & (own.expect == 1))

    assert not answers("moller_trumbore")[1].any()
    hit, wrong = answers("moller_trumbore_text9")
    assert set(own.name[wrong]) == {
        "all zero: the triangle is a line",
        "all zero: the triangle is a point",
    }
    # An edge met exactly is either: here the sign of a zero decides it.
    edge = np.isin(own.cls, (CLASS_NAMES.index("hit_edge"), CLASS_NAMES.index("hit_vertex")))
    assert {True, False} == set(hit[edge])


FIELD = {
    "quad diagonal": "hit_edge",
    "square diagonal": "hit_edge",
    "segment beside the corner": "miss",
    "three corners of a line": "degenerate_miss",
    "skinny triangle at 0.52 degrees": "miss",
    "long thin triangle below a fixed epsilon": "hit_interior",
    "triangle of 0.2 mm": "hit_interior",
    "direction with a -0": "hit_interior",
    "direction changed by 1e-16": "hit_interior",
    "start on the plane": "origin_on",
    "start on the plane, beside": "miss",
    "ray in the plane": "coplanar_touch",
    "ray in the plane, past": "coplanar_miss",
    "plane just ahead of the start": "hit_interior",
    "plane just behind the start": "behind",
    "denormal t": "hit_interior",
    "no number in the ray": "invalid",
    "plane from 1e6 away, at the middles of its triangles": "hit_interior",
}


@pytest.mark.parametrize("name", FIELD)
def test_field_cases_have_the_answer_of_exact_arithmetic(cases, name):
    own = cases.take(cases.name == name)
    assert len(own) and set(names_of(own)) == {FIELD[name]}


def test_field_cases_have_names_and_sources(cases):
    field = np.isin(cases.family, [NAMES.index(n) for n in NAMES if n.startswith("field")])
    assert (cases.name[field] != "").all() and (cases.source[field] != "").all()
    for source in [
        "Oblikovati #2146",
        "trimesh #1766",
        "trimesh test_on_vertex",
        "trimesh #1496",
        "Mitsuba test10",
        "FCPW",
        "VK-CTS ray tracing watertightness",
        "YAR",
        "pbrt-v4 Triangle.Watertight",
        "embree #181",
        "embree watertight tests",
        "embree",
        "trimesh test_embree_duplicate_hits",
        "trimesh #48",
        "mitsuba2 #171",
        "embree #416",
        "pbrt #249",
        "Cycles T43865",
        "pbrt-v4 Triangle.Reintersect",
        "AMReX #5870",
        "OptiX forum 69745",
        "mitsuba #1871",
        "pbrt-v4 Triangle.BadCases",
        "embree #387",
        "Cycles T45778",
        "madmann #28",
        "three-mesh-bvh #684",
        "nanort #30",
        "embree tests",
        "Cycles 32b341774",
    ]:
        assert (cases.source == source).any(), source


def test_direction_lengths_are_the_same_pairs_with_other_lengths():
    found = direction_lengths(pairs=20)
    levels = np.unique(found.difficulty)
    assert levels.tolist() == list(range(-20, 21)) and found.f32_ok.all()
    np.testing.assert_allclose(np.linalg.norm(found.dir, axis=1), 10.0**found.difficulty, rtol=1e-6)
    by_level = [found.take(found.difficulty == level) for level in levels]
    assert 4 < (by_level[0].expect == 1).sum() < 16
    for level in by_level:
        np.testing.assert_array_equal(level.triangles, by_level[0].triangles)
        np.testing.assert_array_equal(level.org, by_level[0].org)
        np.testing.assert_array_equal(level.cls, by_level[0].cls)
        assert level.eta.min() > 0.005
    assert set(found.expect) == {0, 1}


def test_a_corpus_of_somebody_else_is_described_too(cases):
    own = of(cases, "needle")
    theirs = tuple("theirs" if name == "needle" else name for name in cases.family_names)
    rows = {row["family"]: row for row in describe(dataclasses.replace(own, family_names=theirs))}
    row = rows["theirs"]
    assert row["difficulty"] is None
    assert (row["cases"], row["float32"], row["groups"]) == (len(own), own.f32_ok.sum(), 0)
    assert sum(row[name] for name in CLASS_NAMES) == len(own)
    assert rows["cap"]["cases"] == 0 and rows["cap"]["easiest"] is None


def test_progress_ends_at_one():
    told = []
    answered({FAMILIES[NAMES.index("needle")]: drawn("needle")}, told.append)
    assert told and told == sorted(told) and told[-1] == 1
