"""Kernels and functions checked on hard cases: what is scored is what they answered."""

import csv

import numpy as np
import pytest

from rtbench.compiled.intersect import intersect
from rtbench.errors import RtbenchError
from rtbench.experiments import stability, user_function
from rtbench.experiments.checking import check_function, check_kernel
from rtbench.experiments.config import Config
from rtbench.kernels.registry import all_kernels, find
from rtbench.records import schema
from rtbench.workloads import hard_cases


@pytest.fixture(scope="module")
def corpus():
    return hard_cases.corpus(1)


@pytest.fixture(scope="module")
def lengths():
    return hard_cases.direction_lengths(1, pairs=20)


@pytest.fixture(scope="module")
def moller1(corpus, lengths):
    return check_kernel(find("moller1_uv"), "float32", corpus, lengths)


def test_scores_are_those_of_the_answers(corpus, moller1):
    seen = corpus.take(corpus.f32_ok)
    hits = intersect("moller1_uv", seen.triangles, seen.org, seen.dir, "float32")
    core = np.isin(seen.family, [seen.family_names.index(name) for name in hard_cases.CORE])
    wrong = ((seen.expect == 1) & ~hits.hit) | ((seen.expect == 0) & hits.hit)
    row = moller1.row()
    assert row["wrong"] == np.count_nonzero(wrong & core)
    unstable = wrong & core & (seen.eta > 16 * 2.0**-24)
    assert row["unstable"] == np.count_nonzero(unstable) > 100
    assert row["c_star"] == seen.eta[wrong & core].max() * 2.0**24
    leaks = doubles = groups = 0
    for number in np.unique(seen.group[core & (seen.group >= 0)]):
        members = seen.group == number
        whole = np.count_nonzero(corpus.group == number) == members.sum()
        if whole and seen.group_rule[seen.family[members][0]] in (1, 2):
            count, owned = hits.hit[members].sum(), (seen.sos_hit[members] == 1).sum()
            odd = seen.group_rule[seen.family[members][0]] == 2
            groups += 1
            leaks += count < (max(owned, 1) if odd else 1)
            doubles += count > (max(owned, 1) if odd else 1)
    assert (row["leaks"], row["groups"], row["doubles"]) == (leaks, groups, doubles)


def test_moller1_fails_and_its_epsilon_is_to_blame(moller1):
    assert not any(moller1.verdict.holds[name] for name in ("S1", "S2", "S5", "S6", "R1"))
    why = moller1.row()["why"]
    assert why.startswith("fails S1 S2") and why.endswith("its EPSILON is absolute")
    worst = {row["family"]: row["unstable"] for row in moller1.families}
    assert worst["tiny_triangle"] > 50 and worst["dir_scale"] > 20
    knees = {row["family"]: row["knee"] for row in moller1.families}
    assert knees["tiny_triangle"] == 3 and knees["far_triangle"] is None
    assert -12 <= knees["dir_scale"] < 0
    short = {point["difficulty"]: point["wrong_share"] for point in moller1.lengths}
    assert min(short) == -20 and max(short) == 20
    assert all((share > 0.2) == (power <= -7) for power, share in short.items())


def test_moller_trumbore_without_epsilon_keeps_s3_and_s4(corpus, lengths):
    found = check_kernel(find("moller_trumbore_uv"), "float64", corpus, lengths)
    holds = found.verdict.holds
    assert holds["S3"] and holds["S4"] and not any(holds[name] for name in ("S2", "S5", "S6", "X1"))
    assert {point["wrong"] for point in found.lengths} == {0}
    assert found.causes.method == 0 and found.causes.arithmetic == found.row()["wrong"]
    assert not found.reads_epsilon and found.edges.word == "closed"


def test_one_without_u_and_v_is_checked_as_it_is(corpus):
    row = check_kernel(find("wald"), "mixed", corpus).row()
    assert row["p99_t"] > 0 and row["p99_u"] is None and row["p99_v"] is None
    assert "wrong_by_stored_data" in row and row["precision"] == "mixed"


def test_own_forms_have_u_and_v():
    forms, points = stability.own_forms(all_kernels().values())
    names = [kernel.name for kernel in forms]
    assert {"moller1_uv", "wald_uv", "chirkov_uv", "angle_sum"} <= set(names)
    assert not {"moller1", "wald_last_uv"} & set(names)
    assert "wald_inside" in [kernel.name for kernel in points]


def by_cramer(triangles, origins, directions):
    """Möller-Trumbore in float64, whatever it is given."""
    v0, v1, v2 = (triangles[:, k].astype(float) for k in range(3))
    o, d = origins.astype(float), directions.astype(float)
    e, f, s = v1 - v0, v2 - v0, o - v0
    p, q = np.cross(d, f), np.cross(s, e)
    det = (e * p).sum(axis=1)
    with np.errstate(all="ignore"):
        t, u, v = (f * q).sum(1) / det, (s * p).sum(1) / det, (d * q).sum(1) / det
    return (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, u, v


def by_half(triangles, origins, directions):
    """Forget the third edge."""
    _, t, u, v = by_cramer(triangles, origins, directions)
    return (u >= 0) & (v >= 0) & (t > 0)


def test_a_user_s_function_in_float64_is_stable_on_float32_numbers(corpus, lengths):
    found = check_function(by_cramer, "mine:by_cramer", "float32", corpus, lengths)
    row = found.row()
    assert found.verdict.holds["S1"] and found.verdict.holds["S6"] and row["wrong"] <= 5
    assert row["leaks"] <= 2 and row["p99_u"] < 1
    assert found.causes is None and found.claims == ()


def test_a_user_s_wrong_function_is_found_out(corpus):
    found = check_function(by_half, "mine:by_half", "float64", corpus)
    row = found.row()
    assert row["wrong"] > 500 and row["p99_t"] is None and not found.verdict.holds["S1"]
    families = {one["family"]: one for one in found.families}
    assert families["control_random"]["unstable"] > 20


def test_a_function_is_called_once_with_arrays_of_its_dtype(corpus):
    calls = []

    def mine(triangles, origins, directions):
        calls.append([(a.dtype, a.shape[1:]) for a in (triangles, origins, directions)])
        triangles[:] = origins[:] = 0  # it may do with them what it likes
        return np.zeros(len(origins), dtype=bool)

    before = corpus.org.copy()
    for precision in ("float32", "float64"):
        check_function(mine, "mine", precision, corpus)
    assert calls == [[(np.dtype(p), s) for s in ((3, 3), (3,), (3,))] for p in ("f4", "f8")]
    assert np.array_equal(before, corpus.org, equal_nan=True)


PAIRS = np.zeros((2, 3, 3)), np.zeros((2, 3)), np.ones((2, 3))


@pytest.mark.parametrize(
    ("returned", "said"),
    [
        (np.zeros(3, bool), r"returns hit of shape \(3,\): \(2,\) is wanted"),
        (True, r"returns hit of shape \(\)"),
        (np.zeros(2), "returns hit of dtype float64: bool is wanted"),
        ((np.zeros(2, bool), np.zeros((2, 1))), r"returns t of shape \(2, 1\)"),
        ((np.zeros(2, bool), np.zeros(2, "U1")), "returns t of dtype <U1: float is wanted"),
        ((np.zeros(2, bool),) * 3, "returns 3 values: hit, "),
        (None, r"returns hit of shape \(\)"),
    ],
)
def test_what_a_function_returns_is_looked_at(returned, said):
    with pytest.raises(RtbenchError, match=said):
        user_function.ask(lambda *_: returned, "mine", "float64", *PAIRS)


def test_a_function_that_raises_is_told_in_one_line():
    def mine(triangles, origins, directions):
        raise ValueError("two\nlines")

    with pytest.raises(RtbenchError, match=r"^mine fails in float32: ValueError: two lines$"):
        user_function.ask(mine, "mine", "float32", *PAIRS)
    with pytest.raises(RtbenchError, match="mine cannot be asked in mixed"):
        user_function.ask(mine, "mine", "mixed", *PAIRS)


def test_the_experiment_keeps_what_was_found(go, moller1):
    done = go(Config(experiment="stability", kernels=("moller1_uv",), precisions=("float32",)))
    assert done.finished

    def read(name):
        with (done.path / name).open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    (row,) = read(schema.STABILITY)
    for key in ("wrong", "unstable", "leaks", "groups", "doubles", "permutation"):
        assert int(row[key]) == moller1.row()[key]
    assert [row[name] for name in schema.CRITERIA] == [
        str(int(moller1.verdict.holds[name])) for name in schema.CRITERIA
    ]
    families = read(schema.FAMILIES)
    assert [one["family"] for one in families] == [one["family"] for one in moller1.families]
    points = read(schema.CURVES)
    told = {one["family"] for one in points}
    assert told == {*moller1.scored.cases.family_names, schema.LENGTHS}
    for one in families:
        own = [p for p in points if p["family"] == one["family"]]
        assert sum(int(p["wrong"]) for p in own) == int(one["wrong"])
    assert done.info["families"]["needle"].startswith("k: ")
    assert [len(done.stability), len(done.families)] == [1, len(families)]
