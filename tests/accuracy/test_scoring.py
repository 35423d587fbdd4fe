"""Scores of answers to cases that a person can check: one triangle, whole numbers."""

import numpy as np
import pytest

from rtbench.accuracy import scoring
from rtbench.accuracy.cases import CLASS_NAMES, EITHER, MUST_HIT, MUST_MISS, Cases
from rtbench.accuracy.scoring import Scored, by_family, clipped, curve, first_knee, seen_in, tally

EPS = 2.0**-53
FAMILIES = ("near_edge", "shared", "closed", "orders", "subnormal", "inf_nan")
RULES = (0, 1, 2, 3, 0, 0)


def made(rows):
    """Return cases of rows: family, difficulty, expect, and any other column."""
    n = len(rows)
    columns = {
        "v0": [[0, 0, 0]] * n,
        "v1": [[1, 0, 0]] * n,
        "v2": [[0, 1, 0]] * n,
        "org": [[0.25, 0.25, 1]] * n,
        "dir": [[0, 0, -1]] * n,
    }
    columns = {name: np.array(values, float) for name, values in columns.items()}
    defaults = {"sos_hit": -1, "group": -1, "f32_ok": True, "cls": 0, "eta": np.nan}
    defaults |= {"t": 1.0, "u": 0.25, "v": 0.25, "cond_t": 3.0, "cond_u": 1.0, "cond_v": 1.0}
    for name, value in defaults.items():
        columns[name] = np.array([row.get(name, value) for row in rows])
    columns["family"] = np.array([FAMILIES.index(row["family"]) for row in rows])
    columns["difficulty"] = np.array([row.get("difficulty", 0) for row in rows], float)
    columns["expect"] = np.array([row.get("expect", MUST_HIT) for row in rows])
    return Cases(
        **columns, family_names=FAMILIES, class_names=CLASS_NAMES, group_rule=np.array(RULES)
    )


def scored(rows, hit, t=None, u=None, v=None, precision="float64"):
    cases = made(rows)
    said = np.array(hit, bool)
    values = [None if x is None else np.broadcast_to(np.array(x, float), len(rows)) for x in (t, u)]
    last = None if v is None else np.broadcast_to(np.array(v, float), len(rows))
    return Scored(cases, clipped(said, *values, last), precision)


BOTH = [
    {"family": "near_edge", "expect": MUST_HIT, "eta": 8 * EPS},
    {"family": "near_edge", "expect": MUST_MISS, "eta": 16 * EPS},
    {"family": "near_edge", "expect": EITHER, "eta": 0.0},
    {"family": "near_edge", "expect": MUST_HIT, "eta": 17 * EPS},
]


@pytest.mark.parametrize(
    ("hit", "wrong", "unstable", "c_star"),
    [
        ([1, 0, 1, 1], 0, 0, None),  # by the book
        ([1, 0, 0, 1], 0, 0, None),  # a tie is either
        ([0, 0, 0, 0], 2, 1, 17),  # always misses
        ([1, 1, 1, 1], 1, 0, 16),  # always hits: 16 roundoffs are allowed
        ([1, 0, 0, 0], 1, 1, 17),
        ([0, 1, 0, 0], 3, 1, 17),
    ],
)
def test_wrong_answers(hit, wrong, unstable, c_star):
    found = tally(scored(BOTH, hit))
    assert (found["wrong"], found["unstable"], found["c_star"]) == (wrong, unstable, c_star)
    assert (found["cases"], found["decided"]) == (4, 3)


def test_float32_has_its_own_roundoff():
    found = tally(scored(BOTH, [0, 0, 0, 0], precision="float32"))
    assert found["unstable"] == 0 and found["c_star"] == 17 * 2.0**-29
    assert scoring.roundoff("mixed") == scoring.roundoff("float64") == 2.0**-53


def test_range_and_invalid_families_are_not_of_the_core():
    rows = [
        {"family": "subnormal", "eta": 1.0},
        {"family": "inf_nan", "expect": MUST_MISS},
        {"family": "near_edge", "expect": MUST_HIT, "eta": 1.0},
    ]
    one = scored(rows, [0, 1, 1], t=[1, 1, 1])
    assert (tally(one)["wrong"], tally(one)["accepted"]) == (0, 0)
    everything = tally(one, np.ones(3, bool))
    assert [everything[key] for key in ("wrong", "unstable", "accepted")] == [2, 1, 1]


def test_a_hit_of_the_line_behind_the_origin_is_none():
    one = clipped(np.ones(6, bool), np.array([1, -1, 0, np.nan, np.inf, -np.inf]))
    assert one.hit.tolist() == [True, False, False, False, False, False]
    assert one.strange.tolist() == [False, False, False, True, True, False]
    two = clipped(np.array([True, True, False]), np.ones(3), np.array([np.nan, 0.5, np.nan]))
    assert two.hit.tolist() == [True, True, False]
    assert two.strange.tolist() == [True, False, False]


def test_nan_for_t_accepts_an_invalid_input():
    rows = [{"family": "inf_nan", "expect": MUST_MISS}] * 3
    one = scored(rows, [1, 1, 0], t=[np.nan, -1.0, np.nan])
    found = tally(one, np.ones(3, bool))
    assert [found[key] for key in ("accepted", "wrong", "strange")] == [1, 1, 1]


def group(family, number, sos=(-1, -1), **more):
    return [{"family": family, "group": number, "expect": EITHER, "sos_hit": s} | more for s in sos]


@pytest.mark.parametrize(
    ("hits", "leaks", "doubles"),
    [([0, 0], 1, 0), ([1, 0], 0, 0), ([0, 1], 0, 0), ([1, 1], 0, 1)],
)
def test_a_shared_edge_is_hit_once_at_least(hits, leaks, doubles):
    found = tally(scored(group("shared", 7, (1, 0)), hits))
    assert [found[key] for key in ("groups", "leaks", "doubles")] == [1, leaks, doubles]


@pytest.mark.parametrize(
    ("hits", "leaks", "doubles"),
    [([1, 1, 1, 0], 0, 0), ([1, 1, 0, 0], 1, 0), ([1, 1, 1, 1], 0, 1), ([0, 0, 0, 0], 1, 0)],
)
def test_a_mesh_is_left_as_often_as_its_owner_says(hits, leaks, doubles):
    found = tally(scored(group("closed", 2, (1, 1, 1, 0)), hits))
    assert [found[key] for key in ("groups", "leaks", "doubles")] == [1, leaks, doubles]


def test_orders_of_vertices_are_one_case():
    rows = group("orders", 1, (-1,) * 3) + group("orders", 2, (-1,) * 3)
    rows += group("orders", 5, (-1,) * 3)
    found = tally(scored(rows, [1, 1, 1, 0, 1, 0, 0, 0, 0]))
    assert (found["permutation"], found["groups"], found["leaks"]) == (1, 0, 0)


def test_float32_sees_what_it_can_hold():
    rows = group("shared", 3) + group("shared", 4) + BOTH[:1]
    rows[3] = rows[3] | {"f32_ok": False}
    cases = made(rows)
    kept = seen_in(cases, "float32")
    assert kept.group.tolist() == [3, 3, -1, -1]  # a group that has lost one is none
    assert cases.group.tolist() == [3, 3, 4, 4, -1]
    assert seen_in(cases, "mixed").group.tolist() == [3, 3, -1, -1]
    assert len(seen_in(cases, "float64")) == 5


def test_errors_over_condition_relative_and_in_ulps():
    rows = [{"family": "near_edge"}]
    found = tally(scored(rows, [1], t=1 + 8 * EPS, u=0.25, v=0.25 - 5 * EPS))
    assert found["p99_t"] == pytest.approx(2.0)  # 8 eps / (eps (3 + 1))
    assert found["p99_u"] == 0
    assert found["p99_v"] == pytest.approx(5 / 1.25)
    assert found["relative_t"] == pytest.approx(8 * EPS)
    assert found["ulps_t"] == pytest.approx(4)  # at 1 an ulp is 2 eps
    assert found["ulps_v"] == pytest.approx(10)  # at 0.25 it is eps / 2


@pytest.mark.parametrize(
    "change",
    [
        {"expect": MUST_MISS},
        {"cond_t": 0.02 / EPS},  # 2 % of t
        {"cond_u": 0.02 / EPS},
        {"cond_v": np.inf},
        {"t": np.nan},
        {"t": 1e-20, "cond_t": 3.0},  # a start on the triangle, as good as
    ],
)
def test_errors_count_only_where_the_condition_bounds_them(change):
    rows = [{"family": "near_edge"}, {"family": "near_edge"} | change]
    found = tally(scored(rows, [1, 1], t=[1.0, 77.0], u=[0.25, 77.0], v=[0.25, 77.0]))
    assert [found[f"max_{x}"] for x in "tuv"] == [0, 0, 0]


def test_units_of_t_do_not_matter():
    rows = [{"family": "near_edge", "t": s, "cond_t": 3.0 * s} for s in (1e-15, 1.0, 1e15)]
    one = scored(rows, [1, 1, 1], t=[s * (1 + 8 * EPS) for s in (1e-15, 1.0, 1e15)])
    assert one.errors["over_t"] == pytest.approx(2.0, rel=0.2)


def test_without_t_there_is_no_error():
    found = tally(scored(BOTH, [1, 0, 1, 1]))
    assert [found[f"p99_{x}"] for x in "tuv"] == [None, None, None]


def ladder(shares):
    rows, hit = [], []
    for level, share in shares.items():
        rows += [{"family": "near_edge", "difficulty": level}] * 200
        hit += [i >= share * 200 for i in range(200)]
    return scored(rows, hit)


def test_the_knee_is_the_first_difficulty_with_more_than_one_per_cent_wrong():
    one = ladder({1: 0.0, 3: 0.01, 2: 0.005, 4: 0.015, 5: 0.0, 6: 0.5})
    points = curve(one, np.ones(1200, bool))
    assert [(p["difficulty"], p["wrong"], p["decided"]) for p in points] == [
        (1, 0, 200),
        (2, 1, 200),
        (3, 2, 200),
        (4, 3, 200),
        (5, 0, 200),
        (6, 100, 200),
    ]
    assert first_knee(points) == 4
    assert [row["knee"] for row in by_family(one)] == [4]


def test_where_both_ends_are_hard_the_knee_is_the_nearer_one():
    points = curve(ladder({-9: 1.0, -4: 0.5, 0: 0.0, 6: 0.3}), np.ones(800, bool))
    assert first_knee(points, both_ends=True) == -4
    assert first_knee(points[2:3]) is None


def test_many_difficulties_are_taken_together():
    rows = [{"family": "near_edge", "difficulty": i / 10} for i in range(40)]
    assert [p["difficulty"] for p in curve(scored(rows, [1] * 40), np.ones(40, bool))] == [
        *range(5)
    ]


def test_as_many_answers_as_cases():
    with pytest.raises(ValueError, match="3 answers to 4 cases"):
        Scored(made(BOTH), clipped(np.ones(3, bool)), "float64")
