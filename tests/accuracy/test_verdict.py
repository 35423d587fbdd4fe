"""Which criterion falls by which fault, one fault at a time; edges in exact arithmetic; causes."""

import dataclasses

import numpy as np
import pytest

from rtbench.accuracy import edges, verdict
from rtbench.accuracy.cases import CLASS_NAMES, EITHER, MUST_HIT, MUST_MISS, Cases
from rtbench.accuracy.causes import causes, exact_hits, stored_hits
from rtbench.accuracy.scoring import Answered, Scored, by_family
from rtbench.compiled.intersect import intersect
from rtbench.kernels.contract import CLAIMS
from rtbench.kernels.registry import find
from rtbench.records import schema

FAMILIES = ("control_random", "shared_edge_exact", "permutation", "subnormal", "inf_nan")


@pytest.fixture
def cases():
    """Two plain cases, a shared edge, two orders of vertices, a tiny and an invalid case."""
    n = 8
    one = np.ones(n)
    return Cases(
        v0=np.zeros((n, 3)),
        v1=np.tile([1.0, 0, 0], (n, 1)),
        v2=np.tile([0, 1.0, 0], (n, 1)),
        org=np.tile([0.25, 0.25, 1.0], (n, 1)),
        dir=np.tile([0, 0, -1.0], (n, 1)),
        family=np.array([0, 0, 1, 1, 2, 2, 3, 4]),
        family_names=FAMILIES,
        difficulty=np.zeros(n),
        f32_ok=np.ones(n, bool),
        cls=np.array([1, 0, 2, 2, 1, 1, 1, 11]),
        expect=np.array([MUST_HIT, MUST_MISS, EITHER, EITHER, 1, 1, MUST_HIT, MUST_MISS]),
        sos_hit=np.array([1, 0, 1, 0, 1, 1, 1, 0]),
        class_names=CLASS_NAMES,
        t=one,
        u=0.25 * one,
        v=0.25 * one,
        eta=0.1 * one,
        cond_t=3 * one,
        cond_u=one,
        cond_v=one,
        group=np.array([-1, -1, 0, 0, 1, 1, -1, -1]),
        group_rule=np.array([0, 1, 3, 0, 0]),
    )


RIGHT = np.array([1, 0, 1, 0, 1, 1, 1, 0], bool)


def judge(cases, hit=RIGHT, strange=(), eta=None, **errors):
    values = {x: getattr(cases, x) + errors.get(x, 0.0) for x in "tuv"}
    odd = np.isin(np.arange(len(cases)), strange)
    if eta is not None:
        cases = dataclasses.replace(cases, eta=np.full(len(cases), eta))
    scored = Scored(cases, Answered(np.array(hit, bool), **values, strange=odd), "float64")
    return verdict.verdict(scored, by_family(scored))


def flipped(*rows):
    hit = RIGHT.copy()
    hit[list(rows)] ^= True
    return hit


def test_right_answers_hold_everything(cases):
    found = judge(cases)
    assert found.holds == dict.fromkeys(CLAIMS, True) and found.reasons == {}


@pytest.mark.parametrize(
    ("change", "fallen"),
    [
        ({"hit": flipped(0)}, "S1 X1"),
        ({"hit": flipped(1)}, "S1 X1"),
        ({"hit": flipped(0), "eta": 2.0**-53}, "X1"),  # one rounding explains it
        ({"hit": flipped(2)}, "S2 X2"),
        ({"hit": flipped(3)}, "X2"),
        ({"hit": flipped(2, 3)}, ""),  # the other one owns the edge
        ({"hit": flipped(4)}, "S1 S6 X1"),
        ({"hit": flipped(6)}, "R1 X1"),
        ({"hit": flipped(6), "eta": 2.0**-53}, "X1"),
        ({"hit": flipped(7)}, "S3 X1"),
        ({"strange": [7]}, "S3 S4 X1"),  # a NaN for t is accepted, but is no hit
        ({"strange": [0]}, "S4"),
        ({"t": 300 * 2.0**-53}, "S5"),
        ({"u": 100 * 2.0**-53}, "S5"),
        ({"v": 70 * 2.0**-53}, ""),  # 70 / 1.25
    ],
)
def test_one_fault_at_a_time(cases, change, fallen):
    found = judge(cases, **change)
    assert [name for name, holds in found.holds.items() if not holds] == fallen.split()
    assert list(found.reasons) == fallen.split()


def test_reasons_name_the_family_and_the_number(cases):
    found = judge(cases, hit=flipped(0, 2), t=300 * 2.0**-53)
    assert found.reasons["S1"] == "1 unstable answer, worst in control_random (C* 9e+14)"
    assert found.reasons["S2"] == "1 leak, in shared_edge_exact"
    assert found.reasons["S5"] == "99 % errors in roundoffs: t 75 in permutation"
    assert verdict.broken(("S1", "S3", "S5"), found) == ("S1", "S5")


def test_nothing_shows_the_errors_of_a_test_without_t(cases):
    scored = Scored(cases, Answered(RIGHT, None, None, None, np.zeros(8, bool)), "float64")
    found = verdict.verdict(scored, by_family(scored))
    assert found.reasons == {"S5": "it returns no t, u or v"}


def test_the_records_know_the_same_criteria():
    assert schema.CRITERIA == verdict.CRITERIA == tuple(CLAIMS)


def test_edges_are_met_inside_and_from_both_sides():
    triangles, origins, directions = edges.configurations()
    point = origins + directions / 2
    for both, o, d, p in zip(triangles[:, :, 0], origins, directions, point, strict=True):
        (a, b, one), (a2, b2, other) = both
        assert (a == a2).all() and (b == b2).all()
        part = (p - a) @ (b - a) / ((b - a) @ (b - a))
        assert 0 < part < 1 and not np.cross(p - a, b - a).any()
        sides = [np.linalg.det([third - p, b - a, d]) for third in (one, other)]
        assert sides[0] * sides[1] < -0.5
        assert {tuple(np.sign(x)) for x in (o - p, -d)} == {tuple(np.sign(-d))}


def rule(kernel):
    return edges.edge_rule(find(kernel), np.zeros(0, bool))


def test_chirkov_loses_a_shared_edge_in_16_of_36_vertex_orders():
    found = rule("chirkov")
    assert found.word == "loses 16 of 36 vertex orders"
    assert found.hits == {0: 24 * 16, 1: 24 * 16, 2: 24 * 4}


@pytest.mark.parametrize(
    ("kernel", "word"),
    [
        ("moller1", "closed"),
        ("wald_uv", "closed"),
        ("watertight", "closed"),
        ("adaptive_exact", "half-open"),
    ],
)
def test_edges_of_other_methods(kernel, word):
    assert rule(kernel).word == word


@pytest.mark.parametrize("kernel", ["moller1", "pluecker", "adaptive_exact_uv"])
def test_small_whole_numbers_give_the_same_edges_in_floating_point(kernel):
    triangles, origins, directions = edges.pairs()
    computed = intersect(kernel, triangles, origins, directions, "float64").hit
    assert (exact_hits(find(kernel), triangles, origins, directions) == computed).all()
    assert edges.edge_rule(None, computed) == rule(kernel)


def test_words_for_edges():
    def word(first, second):
        hit = np.zeros((1, 2, 6), bool)
        hit[0, 0, :first], hit[0, 1, :second] = True, True
        return edges.rule_of(hit).word

    assert [word(6, 6), word(6, 0), word(0, 0), word(6, 3)] == [
        "closed",
        "half-open",
        "open",
        "once or twice",
    ]
    assert word(4, 2) == "loses 8 of 36 vertex orders"


SQUARE = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1.0, 0, 0], [1, 1, 0], [0, 1, 0]]


def leaking(cases, orders):
    """Return one shared edge in the places 2 and 3, the triangles in some vertex orders."""
    corners = [np.array(SQUARE[k])[list(orders[k])] for k in (0, 1)]
    new = {f"v{i}": getattr(cases, f"v{i}").copy() for i in range(3)}
    for i in range(3):
        for k in (0, 1):
            new[f"v{i}"][2 + k] = corners[k][i]
    org = cases.org.copy()
    org[2:4] = [0.5, 0.5, 1]
    return dataclasses.replace(cases, **new, org=org)


def test_a_leak_of_the_method_is_told_from_one_of_the_arithmetic(cases):
    kernel, lost = find("chirkov"), None
    for orders in [(a, b) for a in edges.ORDERS for b in edges.ORDERS]:
        case = leaking(cases, orders)
        if not exact_hits(kernel, case.triangles[2:4], case.org[2:4], case.dir[2:4]).any():
            lost = case
            break
    assert lost is not None
    hit = RIGHT.copy()
    hit[2:4] = False
    nothing = Answered(hit, cases.t, cases.u, cases.v, np.zeros(8, bool))
    assert causes(kernel, Scored(lost, nothing, "float64")).leaks_of_method == 1
    assert causes(find("moller1"), Scored(lost, nothing, "float64")).leaks_of_method == 0


def test_what_was_stored_is_told_from_what_is_computed():
    # A ray so near an edge that the float32 normal, rounded, puts it on the other side.
    random = np.random.default_rng(3)
    triangles = random.normal(size=(2000, 3, 3)).astype(np.float32).astype(float)
    weight = 1e-7 * random.choice([-1, 1], 2000)
    along = random.uniform(0.2, 0.8, 2000)
    placed = np.stack([weight, along, 1 - along - weight], axis=1)
    origins = random.normal(size=(2000, 3)).astype(np.float32).astype(float) * 2
    target = np.einsum("ij,ijk->ik", placed, triangles)
    directions = (target - origins).astype(np.float32).astype(float)
    pairs = triangles, origins, directions
    kernel = find("shevtsov")
    own, stored = exact_hits(kernel, *pairs), stored_hits(kernel, "float32", *pairs)
    assert (own == exact_hits(find("moller1"), *pairs)).all()
    assert 20 < np.count_nonzero(own != stored) < 750
    # In float64 the same numbers are stored a thousand million times better.
    assert np.count_nonzero(own != stored_hits(kernel, "float64", *pairs)) == 0


def test_causes_add_up(cases):
    hit = flipped(0, 4)
    found = Scored(cases, Answered(hit, cases.t, cases.u, cases.v, np.zeros(8, bool)), "float32")
    whose = causes(find("wald"), found)
    assert (whose.method, whose.stored, whose.arithmetic) == (0, 0, 2)
    assert causes(find("angle_sum"), found) is None
