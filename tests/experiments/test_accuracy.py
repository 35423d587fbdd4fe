"""A run of accuracy: every form beside the others, its answers judged by an oracle of its own."""

import dataclasses
from contextlib import closing
from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy.cases import EITHER
from rtbench.compiled import packets
from rtbench.compiled.filters import undecided
from rtbench.compiled.layout import fill
from rtbench.compiled.packing import Packing
from rtbench.errors import WrongAnswers
from rtbench.experiments import accuracy, config, judged, nearest_mesh, typical_cells
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.epsilons import KERNELS
from rtbench.experiments.judged import Form, Records, Truth
from rtbench.kernels import registry
from rtbench.records import schema
from rtbench.workloads import typical
from rtbench.workloads.solids import cube

SMALL = Config(
    name="small",
    experiment="accuracy",
    kernels=("moller_trumbore_uv", "wald_uv", "adaptive_exact_uv"),
    precisions=("float32",),
    flags=("strict",),
    triangles=512,
    sizes=(3000,),
    rays=16,
    repetitions=10,
    processes=1,
    samples=1,
    layout="own",
)


@pytest.fixture(scope="module")
def bench():
    with closing(Bench(SMALL, lambda text: None)) as made:
        accuracy.build(made)
        yield made


def rows(bench, **wanted):
    return [
        row
        for row in bench.tables[schema.ACCURACY]
        if all(row.get(name) == value for name, value in wanted.items())
    ]


def test_no_two_cells_share_their_key_and_all_have_the_same_columns(bench):
    keys = [tuple(cell.key[name] for name in accuracy.CELL) for cell in bench.cells]
    assert len(set(keys)) == len(keys)
    assert {frozenset(cell.key) for cell in bench.cells} == {frozenset(accuracy.CELL)}


def test_every_form_is_timed_and_judged(bench):
    told = {
        tuple(cell.key[name] for name in ("kernel", "precision", "flags")) for cell in bench.cells
    }
    judged_ones = {(r["kernel"], r["precision"], r["flags"]) for r in rows(bench)}
    assert told == judged_ones
    assert {"epsilon_absolute_uv", "epsilon_relative_uv", "epsilon_none_uv"} <= {
        k for k, *_ in told
    }
    forms = {(c.key["form"], c.key["precision"]) for c in bench.cells}
    assert forms == {
        *(("scalar", "float32"), ("pairs", "float32"), ("rays", "float32")),
    }
    workloads = {row["workload"] for row in rows(bench)}
    assert workloads == {"random", "leaf", "far", "corpus"}


def test_a_cell_stands_for_as_many_tests_as_it_makes(bench):
    for cell in bench.cells:
        pairs = np.load(bench.arrays.paths[cell.pairs])
        assert cell.count == len(pairs)
        places = len(np.load(bench.arrays.paths[cell.expected[0]]))
        assert set(pairs.tolist()) == set(range(places))  # all of them, none beyond
        width = cell.key["width"]
        assert cell.tests == (width * 320 if cell.key["workload"] == "mesh" else width)


def test_the_exact_kernel_is_never_wrong_and_others_are(bench):
    for row in rows(bench, kernel="adaptive_exact_uv", flags="strict"):
        assert row["wrong"] == 0 and row["undecided"] >= 0
        if row["workload"] == "corpus":
            assert (row["leaks"], row["doubles"], row["X1"], row["X2"]) == (0, 0, 1, 1)
    (hard,) = rows(
        bench, kernel="moller_trumbore_uv", precision="float32", flags="strict", workload="corpus"
    )
    assert hard["wrong"] > 0 and hard["leaks"] > 0 and not hard["S1"]
    absolute, none = (
        rows(bench, kernel=f"epsilon_{each}_uv", precision="float32", workload="corpus")[0]
        for each in ("absolute", "none")
    )
    assert absolute["wrong"] > none["wrong"]


def test_a_run_keeps_what_it_found(go):
    kernels, flags = ("moller_trumbore_uv", "wald_uv"), ("strict", "contract")
    changes = {"kernels": kernels, "flags": flags, "precisions": ("float32", "mixed")}
    done = go(dataclasses.replace(SMALL, **changes))
    # Two kernels and three of epsilon in two precisions, and one with leave to contract.
    assert done.finished and len(done.accuracy) == 4 * (5 * 2 + 1)
    loose = done.accuracy[done.accuracy["flags"] == "contract"]
    assert set(loose["kernel"]) == {"moller_trumbore_uv"} and len(loose) == 4
    lanes = done.summary[done.summary["form"] != "scalar"]
    assert set(lanes["precision"]) == {"float32"}
    assert set(done.accuracy.columns) == set(schema.ACCURACY_COLUMNS)
    assert (done.summary["ns_per_test"] > 0).all()
    assert {row["wrong"] for row in done.info["mesh"]} == {0}
    assert set(done.info["apart"]) == {name for name in KERNELS if name.endswith("_uv")}


def exact_hit(corners, orig, dir):
    """Cramer's rule in rationals: whether the ray t > 0 meets the inside, None on a border."""
    v0, v1, v2, o, d = ([Fraction(float(x)) for x in p] for p in (*corners, orig, dir))
    columns = [
        [-x for x in d],
        [a - b for a, b in zip(v1, v0, strict=True)],
        [a - b for a, b in zip(v2, v0, strict=True)],
    ]
    right = [a - b for a, b in zip(o, v0, strict=True)]

    def det(m):
        (a, b, c), (e, f, g), (h, i, j) = m
        return a * (f * j - g * i) - b * (e * j - g * h) + c * (e * i - f * h)

    whole = det(columns)
    t, u, v = (
        det([right if k == each else column for k, column in enumerate(columns)]) / whole
        for each in range(3)
    )
    parts = (t, u, v, 1 - u - v)
    return None if 0 in parts else all(part > 0 for part in parts)


def test_wrong_answers_are_those_that_differ_from_rationals():
    tests = typical.far(300)
    truth, right = (
        Truth.of(tests),
        np.array([exact_hit(*one) for one in zip(*tests[1:], strict=True)]),
    )
    for name in ("moller_trumbore_uv", "wald_uv"):
        form = Form(registry.find(name), "float32")
        hit = judged.ask(form, Records(*tests[1:]), "own").hit
        row = judged.judge_typical(form, truth, Records(*tests[1:]), "own")
        assert row["wrong"] == np.count_nonzero(hit != right)
        assert row["hits"] == np.count_nonzero(hit)
        assert row["p99_t"] > 0 and row["relative_t"] > 0


@pytest.mark.parametrize(("draw", "share"), [("random", 0.5), ("leaf", 0.047), ("far", 0.5)])
def test_typical_tests_hit_as_often_as_they_say(draw, share):
    tests = typical.WORKLOADS[draw](20_000)
    expect = Truth.of(tests.take(np.arange(20_000))).expect
    hits = np.count_nonzero(expect == 1)
    assert abs(hits / 20_000 - share) < 4 * np.sqrt(share * (1 - share) / 20_000)
    again = typical.WORKLOADS[draw](20_000)
    assert again.digest == tests.digest != typical.WORKLOADS[draw](20_000, seed=2).digest


def test_the_filter_alone_leaves_what_rounding_could_change():
    kernel = registry.find("adaptive_exact_uv")
    corners = [np.array([p], np.float32) for p in ((0, 0, 0), (1, 0, 0), (0, 1, 0))]
    origins = np.array([[0.25, 0.25, 1], [0.5, 0, 1], [3, 3, 1]], np.float32)
    directions = np.tile(np.array([[0, 0, -1]], np.float32), (3, 1))
    corners = [np.repeat(corner, 3, axis=0) for corner in corners]
    records = fill(kernel, "own", "float32", corners, origins, directions)
    assert undecided(kernel, "float32", *records).tolist() == [False, True, False]


def test_packets_that_say_something_else_stop_the_run(bench):
    tests = typical.half_hits(64)
    workload = typical_cells.in_whole_blocks(tests, 0.5)
    kernel = registry.find("moller_trumbore_uv")
    typical_cells.add(bench, kernel, "float32", workload)
    outcome, t, *_ = workload.given[kernel.name, "float32"]
    t[np.flatnonzero(outcome == 0)[3]] += 1
    with pytest.raises(WrongAnswers, match="differ in t of 1 rays"):
        typical_cells.add_packets(bench, kernel, "float32", workload)


def test_rays_at_a_mesh_hit_what_the_oracle_says(bench):
    workload, expect = nearest_mesh.scene(64, 3, cube())
    assert 0.2 < np.mean(expect == 1) < 0.9 and workload.tests == 12
    exact = registry.find("adaptive_exact_uv")
    found = nearest_mesh.add_forms(bench, exact, "float32", workload, expect, 5)
    assert [row["form"] for row in found] == ["scalar", "rays"]
    assert all(row["wrong"] == 0 and row["decided"] > 50 for row in found)
    turned = np.where(expect == EITHER, EITHER, 1 - expect).astype(np.int8)
    other = dataclasses.replace(workload, name="other")
    found = nearest_mesh.add_forms(bench, exact, "float32", other, turned, 5)
    assert all(row["wrong"] == row["decided"] for row in found)


@pytest.mark.parametrize("kernel", [k for k in KERNELS.values() if k.name.endswith("_uv")])
def test_kernels_that_differ_in_their_epsilon_differ_in_nothing_else(kernel):
    tests = typical.half_hits(2000)
    plain = judged.ask(
        Form(registry.find("moller_trumbore_uv"), "float32"), Records(*tests[1:]), "own"
    )
    found = judged.ask(Form(kernel, "float32"), Records(*tests[1:]), "own")
    both = plain.hit & found.hit
    assert np.count_nonzero(plain.hit != found.hit) <= 1 and both.sum() > 900
    assert np.array_equal(plain.t[both], found.t[both])
    packets.loop(kernel, "float32", Packing("pairs", 16))
    small = tests.triangles * np.float32(1e-4), tests.origins * np.float32(1e-4), tests.directions
    hits = judged.ask(Form(kernel, "float32"), Records(*small), "own").hit.sum()
    assert (hits < 10) == (kernel.name == "epsilon_absolute_uv")


def test_quick_judges_a_tenth_too():
    asked = config.find("accuracy")
    assert asked.sizes == (1_000_000,) and asked.quick().sizes == (100_000,)
    assert asked.quick().repetitions == asked.repetitions // 10
