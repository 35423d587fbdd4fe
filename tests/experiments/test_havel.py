"""Havel's statements, judged on runs whose times are made up so that the right verdict is known."""

import numpy as np
import pytest

from rtbench.experiments.havel import judged
from rtbench.records.schema import sample_columns
from rtbench.records.store import load_run
from rtbench.records.writer import RunWriter

CELL = ["kernel", "precision", "order", "density", "prepared"]
RATIOS = (0.1, 0.5)


@pytest.fixture
def make(tmp_path):
    def write(name, costs, methods=None, spread=0.002, **more):
        """Return a run in which a kernel's test takes so many ns at either hit ratio."""
        random = np.random.default_rng(3)
        info = {"experiment": "soup", "cell": CELL, "methods": methods or {}}
        info |= {"config": {"densities": list(RATIOS), "precisions": ["float32"]}} | more
        with RunWriter.create(tmp_path, "x", name, info, sample_columns(CELL)) as writer:
            for process in range(5):
                for turn in range(5):
                    rows = [
                        {"kernel": kernel, "precision": "float32", "order": "sweep"}
                        | {"density": ratio, "prepared": "own", "process": process, "launch": 0}
                        | {"round": turn, "position": 0, "triangles": 1000, "repetitions": 1000}
                        | {"tests": 10**6, "cpu_ns": 1}
                        | {"ns": round(cost * 1e6 * random.normal(1, spread))}
                        for kernel, cost in costs.items()
                        for ratio in RATIOS
                    ]
                    writer.append(rows)
            writer.finish()
        return load_run(writer.path)

    return write


def verdict(runs, words):
    (row,) = (row for row in judged(runs) if words in row["statement"])
    return row["verdict"], row["number"]


def order(uvt, tuv):
    """Return the order chart's cells: Möller-Trumbore's two orders, then Kensler-Shirley's."""
    return {
        "moller_trumbore_last_uv": uvt[0],
        "moller_trumbore_last_tuv_uv": tuv[0],
        "kensler_shirley_last_uvt_uv": uvt[1],
        "kensler_shirley_last_uv": tuv[1],
    }


@pytest.mark.parametrize(
    ("costs", "expected"),
    [
        (order((9.0, 9.0), (5.0, 5.0)), "confirmed"),
        (order((9.0, 9.0), (6.0, 5.0)), "refuted"),  # not level where both test t first
        (order((5.0, 5.0), (5.0, 5.0)), "refuted"),  # no lead at all
    ],
)
def test_who_leads_by_the_order_of_the_tests(make, costs, expected):
    assert verdict({"order": make("order", costs)}, "only because it tests t first")[0] == expected


@pytest.mark.parametrize(
    ("other", "spread", "expected"),
    [(5.0, 0.002, "confirmed"), (6.0, 0.002, "refuted"), (5.3, 0.1, "not resolved")],
)
def test_level_in_the_worst_case(make, other, spread, expected):
    costs = {
        "moller_trumbore_last_whole_uv": other,
        "kensler_shirley_last_whole_uv": 5.0,
    }
    run = make("5.3", costs, spread=spread)
    assert verdict({"5.3": run}, "are level")[0] == expected


@pytest.mark.parametrize(("more", "expected"), [((5, 6), "confirmed"), ((5, 7), "refuted")])
def test_multiplications_are_those_of_the_trees(make, more, expected):
    """Two of a hit's u and v are not of the moved test."""
    methods = {}
    for base, count in zip(("wald", "perpendicular_planes"), more, strict=True):
        methods[f"{base}_uv"] = {"operations": {"mul": 11}}
        methods[f"{base}_last_uv"] = {"operations": {"mul": 11 + 2 + count}}
    endings = ("_uv", "_last_uv", "_whole_uv", "_last_whole_uv")
    bases = ("moller_trumbore", "kensler_shirley", "keidy", "badouel_cramer", "wald")
    bases += ("perpendicular_planes", "shevtsov")
    costs = {base + ending: 5.0 for base in bases for ending in endings}
    run = make("5.2", costs, methods)
    assert verdict({"5.2": run}, "5 multiplications")[0] == expected


@pytest.mark.parametrize(("cost", "expected"), [(1.03, "confirmed"), (1.2, "refuted")])
def test_moving_the_division_hurts_by_what_it_costs(make, cost, expected):
    bases = ("moller_trumbore", "kensler_shirley", "keidy", "badouel_cramer", "wald")
    bases += ("perpendicular_planes", "shevtsov")
    costs = {f"{base}{ending}_uv": 5.0 for base in bases for ending in ("", "_last", "_whole")}
    costs |= {f"{base}_last_whole_uv": 5.0 * cost for base in bases}
    methods = {name: {"operations": {"mul": 1}} for name in costs}
    assert verdict({"5.2": make("5.2", costs, methods)}, "hardly hurts")[0] == expected


def test_triangles_that_differ_are_counted(make):
    methods = {"wald_last_uv": {"operations": {"mul": 1}}}
    methods["angle_sum"] = {"operations": {"mul": 1}}
    bases = ("shevtsov", "badouel_cramer", "perpendicular_planes")
    costs = dict.fromkeys((*methods, *(f"{base}_last_uv" for base in bases)), 5.0)
    own = {"kernel": "wald_last_uv", "rays": 100, "differ": 0}
    loose = own | {"kernel": "angle_sum", "differ": 3}  # which has no right tolerance
    for differ, expected in ((0, "confirmed"), (2, "refuted")):
        run = make("5.1.2", costs, methods, nearest=[own | {"differ": differ}, loose])
        found = verdict({"5.1.1": run, "5.1.2": run}, "different triangles")
        assert found[0] == expected and found[1].startswith(f"{2 * differ} of 200")
