"""Every experiment from end to end with next to no work, and every config that is shipped."""

import ast
import inspect
from collections import Counter

import pytest

from rtbench.compiled.loops import loop
from rtbench.compiled.machine_code import instructions
from rtbench.errors import RtbenchError
from rtbench.experiments import config as configs
from rtbench.experiments.config import EXPERIMENTS, Config
from rtbench.kernels import moller
from rtbench.kernels.registry import find
from rtbench.records import schema
from rtbench.workloads.pairs import pairs_at_density

TINY = {"triangles": 64, "repetitions": 12, "processes": 2, "samples": 2}
KERNELS = ("moller1", "badouel")


def cells(rows, *names):
    return Counter(tuple(row[name] for name in names) for row in rows)


def test_density(go, table):
    done = go(Config(kernels=KERNELS, densities=(0.0, 0.25, 1.0), **TINY))
    summary = table(done, "summary.csv")
    hits = {"0.0": "0", "0.25": "16", "1.0": "64"}
    assert {(r["density"], r["hits"]) for r in summary if r["kernel"] != "empty"} == {*hits.items()}
    assert set(cells(summary, "kernel", "order", "density").values()) == {1}
    assert len(summary) == 3 * 2 * 3
    assert all(float(row["ns_per_test"]) > 0 for row in summary)


def test_outcomes(go, table):
    done = go(Config(experiment="outcomes", kernels=KERNELS, **TINY | {"triangles": 2000}))
    found = table(done, "outcomes.csv")
    assert table(done, "summary.csv") == []
    for kernel in KERNELS:
        own = [row for row in found if row["kernel"] == kernel]
        assert sum(int(row["count"]) for row in own) == 2000
        assert sum(float(row["fraction"]) for row in own) == pytest.approx(1)
        for row in own:
            assert (row["ns_per_test"] != "") == (row["count"] != "0")
            if row["count"] != "0":
                assert row["pairs_timed"] == row["count"]
                # What a group lacks in pairs it has in repetitions.
                assert int(row["tests"]) >= 2000 * 12
    # Nothing is redrawn: the two methods hit the same pairs, about 12 % of random ones.
    first = {row["kernel"]: int(row["count"]) for row in found if row["outcome"] == "0"}
    assert first["moller1"] == first["badouel"] == pytest.approx(0.12077 * 2000, abs=4 * 15)
    assert done.info["workloads"][0]["redrawn"] == {"edge": 0, "parallel": 0, "margin": 0}


def test_operations(go, table):
    done = go(Config(experiment="operations", kernels=("moller1", "badouel", "chirkov")))
    # Blecha 2007, tables 4.4, 4.6 and 4.8.
    published = {
        row["kernel"]: [int(row[name]) for name in ("add", "sub", "mul", "div", "cond")]
        for row in table(done, "operations.csv")
    }
    from rtbench.records.store import load_run

    printed = load_run("blecha-operations").operations
    for row in printed.to_dict("records"):
        if row["kernel"] in published:
            counted = published[row["kernel"]]
            assert counted == [row[name] for name in ("add", "sub", "mul", "div", "cond")]
    assert set(published) == {"moller1", "badouel", "chirkov"} <= set(printed["kernel"])
    assert table(done, "samples.csv") == [] and done.finished


def test_stages(go, table):
    done = go(
        Config(
            experiment="stages", kernels=("moller1",), densities=(1.0,), orders=("repeat",), **TINY
        )
    )
    marks = {
        node.lineno: node.value.value
        for node in ast.walk(ast.parse(inspect.getsource(moller.moller1)))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    stages = list(dict.fromkeys(marks[line] for line in sorted(marks)))
    rows = [row for row in table(done, "summary.csv") if row["kernel"] == "moller1"]
    rows.sort(key=lambda row: int(row["stage_index"]))
    assert len(stages) >= 4
    assert [row["stage"] for row in rows] == [*stages, "whole"]
    assert [int(row["stage_index"]) for row in rows] == list(range(len(stages) + 1))
    assert rows[-1]["hits"] == "64"


def test_working_set(go, table):
    sizes = (4, 16, 100, 1000)
    done = go(
        Config(
            experiment="working_set",
            kernels=("moller1",),
            densities=(0.5,),
            orders=("sweep", "repeat"),
            sizes=sizes,
            triangles=100,
            repetitions=15,
        )
    )
    rows = table(done, "summary.csv")
    assert set(cells(rows, "kernel", "order", "triangles").values()) == {1}
    assert sorted({int(row["triangles"]) for row in rows}) == list(sizes)
    # As many tests each, or the next multiple: 1500 over 4, 16, 100, 1000 pairs.
    for row in rows:
        wanted = {"4": 1500, "16": 1504, "100": 1500, "1000": 2000}
        assert int(row["tests"]) == wanted[row["triangles"]]
    # Half of all pairs hit; of the first of them as many as in the workload's own beginning.
    pairs = pairs_at_density(1000, 0.5, "pcg64", done.info["seed"])
    for row in rows:
        if row["kernel"] != "empty":
            assert int(row["hits"]) == pairs.hit[: int(row["triangles"])].sum()
    with pytest.raises(RtbenchError, match="sizes is empty"):
        go(Config(experiment="working_set"))


def test_latency(go, table):
    done = go(Config(experiment="latency", kernels=("moller1",), densities=(0.5,), **TINY))
    rows = table(done, "summary.csv")
    assert cells(rows, "kernel", "order", "chain") == {
        ("moller1", order, chain): 1
        for order in ("repeat", "sweep")
        for chain in ("independent", "dependent")
    }
    assert {row["hits"] for row in rows} == {"32"}


def test_the_chain_is_in_the_machine_code():
    """Dependent tests load the next pair from an address into which the last t has gone."""
    kernel = find("moller1")
    alone, chained = (
        Counter(line.split()[0] for line in instructions(loop(kernel, kind=kind).assembly))
        for kind in ("independent", "dependent")
    )
    compares = sum(n for name, n in chained.items() if "comis" in name or name.startswith("fcmp"))
    before = sum(n for name, n in alone.items() if "comis" in name or name.startswith("fcmp"))
    assert compares > before


def test_prediction(go, table):
    orders = ("repeat", "sorted", "sweep", "shuffled")
    done = go(
        Config(
            experiment="prediction",
            kernels=("moller1",),
            densities=(0.25, 0.5),
            orders=orders,
            **TINY,
        )
    )
    rows = table(done, "summary.csv")
    assert {row["order"] for row in rows} == set(orders)
    assert {row["tests"] for row in rows} == {str(64 * 12)}
    fit = done.info["fit"]
    assert [point["density"] for point in fit["points"]] == [0.25, 0.5]
    for point in fit["points"]:
        explained = point["mixture"] + point["branches_m"] * fit["penalty_ns"]
        assert point["predicted"] == pytest.approx(explained)


def test_both_precisions_see_one_workload(go):
    done = go(
        Config(kernels=("moller1",), densities=(0.5,), precisions=("float32", "float64"), **TINY)
    )
    assert len(done.info["workloads"]) == 1
    hits = {(o["precision"], o["count"]) for o in done.info["outcomes"] if o["outcome"] == 0}
    assert hits == {("float32", 32), ("float64", 32)}


def test_one_repetition_is_one_sample_without_interval(go, table):
    done = go(
        Config(
            kernels=("moller1",), densities=(0.5,), orders=("sweep",), triangles=64, repetitions=1
        )
    )
    samples = [row for row in table(done, "samples.csv") if not row["outcome"]]
    assert [row["repetitions"] for row in samples] == ["1", "1"]
    for row in table(done, "summary.csv"):
        assert (row["tests"], row["ci_low"], row["ci_high"]) == ("64", "", "")


@pytest.mark.parametrize("name", configs.shipped())
def test_shipped_configs_run(go, name):
    config = configs.find(name)
    small = {"triangles": 50, "repetitions": 4, "processes": 1, "samples": 1, "rays": 20}
    if config.sizes:
        small["sizes"] = tuple(min(size, 100 + i) for i, size in enumerate(config.sizes[:3]))
    if name.startswith("havel"):  # the same for every kernel, and each takes its time to compile
        small["kernels"] = tuple(n for n in config.kernels if "*" not in n)[:2]
    if config.experiment in ("stability", "watertightness"):
        small |= {"kernels": ("moller1_uv",), "precisions": ("float32",), "triangles": 80}
    if config.experiment in ("trees", "tree_builders"):  # whatever is beside, each kind once
        small |= {"models": ("scanned:1000",), "kernels": config.kernels[:1], "ways": ("stack",)}
        small |= {"precisions": ("float32",), "rules": ("sah",), "width": 8, "height": 8}
        small |= {"builders": ("nlog2n",), "overlaps": ("clipped",), "judged": 10, "sizes": (1000,)}
    if config.experiment in ("effects", "subsampling", "techniques"):  # each tracer is compiled
        small |= {"scenes": ("matte",), "kernels": ("moller_trumbore",), "width": 16, "height": 12}
        small |= {"parts": ("steps",)} if config.experiment == "effects" else {}
    done = go(config, **small)
    assert done.finished and done.info["experiment"] in EXPERIMENTS
    if config.experiment == "operations":
        assert len(done.operations) == len(config.kernels)
    elif config.experiment == "tree_builders":
        assert len(done.builds) == 4  # axes and candidates
    elif config.experiment in schema.UNTIMED:
        assert len(done.errors) or len(done.stability) or len(done.leaks)
    else:
        assert set(done.samples["kernel"]) >= set(small.get("kernels", config.kernels))
