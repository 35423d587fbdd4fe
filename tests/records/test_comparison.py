"""Comparisons of runs whose truth is known, and of the published ones."""

import json

import numpy as np
import pytest

from rtbench.errors import NotComparable, RtbenchError
from rtbench.records import schema
from rtbench.records.comparison import compare, slowdowns
from rtbench.records.environments import differences
from rtbench.records.store import load_run
from rtbench.records.writer import RunWriter

CELL = ["kernel", "precision", "order", "density"]
FIVE = (0.0, 0.25, 0.5, 0.75, 1.0)


@pytest.fixture
def make(tmp_path):
    def build(name, ns, seed, densities=FIVE, cell=CELL, processes=5, noise=0.01, **info):
        """A run: kernel -> ns a test, with noise between and inside processes."""
        rng = np.random.default_rng(seed)
        info = {"experiment": "density", "cell": cell, "config": {"layout": "shared"}} | info
        writer = RunWriter.create(tmp_path, name, "t", info, schema.sample_columns(cell))
        for process in range(processes):
            effect = rng.normal(0, noise)
            for number in range(8):
                rows = []
                for kernel, one in ns.items():
                    for density in densities:
                        time = one * (1 + 0.2 * density) * np.exp(effect + rng.normal(0, noise))
                        row = {"kernel": kernel, "precision": "float32", "order": "repeat"}
                        row |= {"density": density, "process": process, "launch": 0}
                        row |= {"round": number, "position": 0, "triangles": 1000}
                        row |= {"repetitions": 100, "tests": 100_000, "ns": round(time * 100_000)}
                        rows.append({k: v for k, v in row.items() if k in writer.columns})
                writer.append(rows)
        writer.finish()
        return load_run(writer.path)

    return build


def published(name):
    return load_run(name)


def test_the_same_machine_twice_resolves_next_to_nothing(make):
    ns = {"moller1": 30, "badouel": 45, "chirkov": 28, "empty": 0.5}
    found = compare([make("a", ns, 1), make("b", ns, 2)])
    words = [row["verdict"] for row in found.cells]
    assert len(words) == 20
    assert words.count("no difference resolved") >= 19
    assert found.means[0]["low"] < 1 < found.means[0]["high"]
    assert found.means[0]["cells"] == 15
    assert found.missing == [] and found.rankings[0]["turnovers"] == []


def test_a_run_and_itself_are_equal(make):
    run = make("a", {"moller1": 30, "badouel": 45}, 1)
    found = compare([run, run])
    assert len(set(found.runs)) == 2
    assert {row["verdict"] for row in found.cells} == {"no difference resolved"}
    assert {(row["ratio"], row["low"], row["high"]) for row in found.cells} == {(1, 1, 1)}


def test_known_differences_are_resolved_and_a_threshold_is_kept(make):
    runs = [make("a", {"m": 30, "b": 45, "c": 20}, 1), make("b", {"m": 36, "b": 27, "c": 20}, 2)]
    found = compare(runs)
    words = {(row["kernel"], row["verdict"]) for row in found.cells}
    assert words == {("m", "slower"), ("b", "faster"), ("c", "no difference resolved")}
    for row in found.cells:
        true = {"m": 1.2, "b": 0.6, "c": 1}[row["kernel"]]
        assert row["low"] <= row["ratio"] <= row["high"]
        assert row["ratio"] == pytest.approx(true, rel=0.03)
    assert found.means[0]["ratio"] == pytest.approx((1.2 * 0.6) ** (1 / 3), rel=0.02)
    assert found.means[0]["least"] < 0.62 and found.means[0]["greatest"] > 1.17
    kept = {row["verdict"] for row in compare(runs, threshold=0.4).cells if row["kernel"] == "m"}
    assert kept == {"no difference resolved"}
    slower, unjudged = slowdowns(found, 0.05)
    assert ({row["kernel"] for row in slower}, len(slower), unjudged) == ({"m"}, 5, 0)
    assert slowdowns(found, 0.3)[0] == []


def test_comparisons_are_reproducible(make):
    runs = [make("a", {"m": 30}, 1), make("b", {"m": 31}, 2)]
    assert compare(runs) == compare([load_run(run.path) for run in runs])


def test_missing_and_new_cells_are_named(make):
    a = make("a", {"m": 30, "gone": 40}, 1, densities=(0.0, 0.5))
    b = make("b", {"m": 30, "new": 40}, 2, densities=(0.5, 1.0))
    found = compare([a, b])
    assert [(row["kernel"], row["density"]) for row in found.cells] == [("m", 0.5)]
    told = {(row["kernel"], row["density"], row["is"]) for row in found.missing}
    assert told == {
        ("m", 0.0, "missing"),
        ("gone", 0.0, "missing"),
        ("gone", 0.5, "missing"),
        ("m", 1.0, "new"),
        ("new", 0.5, "new"),
        ("new", 1.0, "new"),
    }


def test_the_mean_is_over_cells_that_all_runs_have(make):
    runs = [make("a", {"m": 30, "b": 30}, 1), make("b", {"m": 60, "b": 30}, 2)]
    runs.append(make("c", {"m": 30}, 3))
    found = compare(runs)
    assert [row["cells"] for row in found.means] == [5, 5]
    assert found.means[0]["ratio"] == pytest.approx(2, rel=0.03)
    assert len([row for row in found.cells if row["run"] == found.runs[1]]) == 10


def test_relative_to_a_kernel_the_machine_falls_out(make):
    runs = [make("a", {"m": 30, "b": 45}, 1), make("b", {"m": 15, "b": 45}, 2)]
    found = compare(runs, relative_to="m")
    for row in found.cells:
        if row["kernel"] == "m":
            assert (row["first_relative"], row["relative"]) == (1, 1)
            assert "relative_ratio" not in row
        else:
            assert row["relative_ratio"] == pytest.approx(2, rel=0.03)
            assert row["relative_verdict"] == "slower"
            assert row["relative_low"] < 2 < row["relative_high"]
    with pytest.raises(RtbenchError, match="did you mean 'm'"):
        compare(runs, relative_to="mm")


def test_resolved_turnovers_of_two_measured_runs(make):
    runs = [make("a", {"m": 30, "c": 25, "b": 50}, 1), make("b", {"m": 25, "c": 30, "b": 50}, 2)]
    (ranked,) = compare(runs).rankings
    assert list(ranked["kernels"].values()) == [["c", "m", "b"], ["m", "c", "b"]]
    (turn,) = ranked["turnovers"]
    assert (turn["faster"], turn["slower"], turn["resolved"]) == ("c", "m", "yes")
    assert turn["ratio"] == pytest.approx(1.2, rel=0.03)
    assert turn["other_ratio"] == pytest.approx(1 / 1.2, rel=0.03)
    assert ranked["densities"] == list(FIVE)


def test_a_mean_is_formed_from_five_densities_for_the_published_machines(make):
    own = make("own", {"moller1": 30, "badouel": 45, "chirkov": 28}, 1)
    found = compare([published("blecha-pc4"), own])
    assert {row["density"] for row in found.cells} == {"mean"}
    assert {row["verdict"] for row in found.cells} == {"no interval"}
    cell = next(row for row in found.cells if row["kernel"] == "moller1")
    assert cell["ns"] == pytest.approx(30 * 1.1, rel=0.02)
    assert cell["first_ns"] == pytest.approx(18.409 / 5e8 * 1e9)
    four = make("four", {"moller1": 30}, 1, densities=FIVE[:4])
    with pytest.raises(NotComparable, match="no cell in common"):
        compare([published("blecha-pc4"), four])


def test_moller_and_chirkov_change_places_between_the_vendors():
    found = compare([published(f"blecha-pc{number}") for number in (1, 2, 3, 4)])
    (ranked,) = found.rankings
    assert [ranked["kernels"][run][0] for run in found.runs] == ["chirkov"] * 2 + ["moller1"] * 2
    turns = {(turn["run"][-1], turn["other_run"][-1]) for turn in ranked["turnovers"]}
    assert turns == {("1", "3"), ("1", "4"), ("2", "3"), ("2", "4")}
    assert {(turn["faster"], turn["slower"]) for turn in ranked["turnovers"]} == {
        ("chirkov", "moller1")
    }
    assert {turn["resolved"] for turn in ranked["turnovers"]} == {"no interval"}


def test_the_mean_beside_its_densities_counts_for_nothing():
    run = published("blecha-pc1")
    found = compare([run, run])
    assert found.means[0]["cells"] == 33 + 15
    assert slowdowns(found, 0.0) == ([], 51)


def test_what_cannot_be_compared_ends_with_code_3(make):
    a = make("a", {"m": 30}, 1)
    with pytest.raises(NotComparable, match="different experiments") as error:
        compare([a, make("b", {"m": 30}, 2, experiment="working_set")])
    assert error.value.exit_code == 3 and "\n" not in str(error.value)
    with pytest.raises(NotComparable, match="no cell in common"):
        compare([a, make("c", {"other": 30}, 3)])
    empty = make("d", {}, 4)
    with pytest.raises(NotComparable, match="has no times"):
        compare([a, empty])
    operations = published("blecha-operations")
    with pytest.raises(NotComparable, match="has no times"):
        compare([operations, operations])
    with pytest.raises(RtbenchError, match="at least two"):
        compare([a])


def test_a_further_column_is_joined_over_if_it_tells_no_cells_apart(make):
    a = make("a", {"m": 30}, 1)
    wide = make("b", {"m": 30}, 2, cell=[*CELL, "triangles"])
    assert len(compare([a, wide]).cells) == 5
    path = wide.path / schema.SAMPLES
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines, lines[1].replace(",1000,", ",2000,")]) + "\n")
    with pytest.raises(NotComparable, match="also differ in triangles"):
        compare([a, load_run(wide.path)])


def test_other_pairs_and_settings_are_remarked_where_both_sides_know(make):
    work = [{"density": 0.5, "triangles": 10, "digest": "aa"}]
    a = make("a", {"m": 30}, 1, workloads=work)
    b = make("b", {"m": 30}, 2, workloads=[work[0] | {"digest": "bb"}], config={"layout": "own"})
    remarks = compare([a, b]).remarks
    assert any("other pairs were tested" in text and "density 0.5" in text for text in remarks)
    assert any(text.startswith("layout: shared in") for text in remarks)
    assert compare([a, b], allow=["workloads", "layout"]).remarks == []
    assert compare([a, a]).remarks == []
    moller = make("c", {"moller1": 30}, 3, densities=(0.0, 0.5), workloads=work, config={})
    assert compare([moller, published("blecha-pc1")]).remarks == []


def test_environments_that_differ_come_as_a_table(make):
    a = make("a", {"m": 30}, 1, machine={"cpu_model": "X", "cores": 2}, software={"numba": "1"})
    b = make("b", {"m": 30}, 2, machine={"cpu_model": "Y", "cores": 2}, software={"numba": "2"})
    rows = {row["key"]: (row[a.name], row[b.name]) for row in differences([a, b])}
    assert rows == {
        "processor": ("X", "Y"),
        "machine.cpu_model": ("X", "Y"),
        "software.numba": ("1", "2"),
    }
    c = make("c", {"m": 30}, 3, machine={"cpu_model": "X", "cores": 2})
    rows = {row["key"]: row[c.name] for row in differences([a, c])}
    assert rows["software.numba"] == "unknown"


def test_machine_code_is_compared_by_its_digest(make):
    def kernels(digest):
        code = {"source_digest": "s", "machine_code_digest": digest}
        return {"m": {"float32": code, "float64": {"source_digest": "s"}}}

    a = make("a", {"m": 30}, 1, kernels=kernels("1"))
    b = make("b", {"m": 30}, 2, kernels=kernels("2"))
    rows = compare([a, b]).machine_code
    told = {row["precision"]: (row["source"], row["machine_code"]) for row in rows}
    assert told == {"float32": ("same", "different"), "float64": ("same", "unknown")}


def test_times_of_outcomes_are_cells_of_outcome_runs_only(make, tmp_path):
    info = {"experiment": "outcomes", "cell": ["kernel", "precision"]}
    runs = []
    for name, ns in (("a", 100), ("b", 200)):
        columns = schema.sample_columns(info["cell"])
        with RunWriter.create(tmp_path, name, "o", info, columns) as writer:
            for process in range(5):
                row = dict.fromkeys(columns[3:], 1) | {"process": process, "tests": 10}
                row |= {"kernel": "m", "precision": "float32", "ns": ns + process}
                writer.append([row | {"outcome": 0}, row | {"outcome": 1}])
        runs.append(load_run(writer.path))
    found = compare(runs)
    assert [row["outcome"] for row in found.cells] == [0, 1]
    assert {row["verdict"] for row in found.cells} == {"slower"}
    assert json.dumps(found.cells)


def on_one_machine(**codes):
    """Return what run.json says of a processor and of each kernel's machine code."""
    kernels = {
        kernel: {"float32": {"source_digest": code, "machine_code_digest": code}}
        for kernel, code in codes.items()
    }
    return {"machine": {"cpu_model": "one processor"}, "kernels": kernels}


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_another_clock_is_no_other_kernel(make, factor):
    ns = {"moller1": 30, "badouel": 45, "empty": 0.5}
    codes = on_one_machine(moller1="a", badouel="b", empty="e")
    slow = {kernel: time * factor for kernel, time in ns.items()}
    found = compare([make("a", ns, 1, **codes), make("b", slow, 2, **codes)])
    words = [row["verdict"] for row in found.cells]
    assert words.count("no difference resolved") >= len(words) - 1
    assert found.means[0]["verdict"] == "no difference resolved"
    assert found.means[0]["ratio"] == pytest.approx(factor, rel=0.02)
    (remark,) = [text for text in found.remarks if "its clock or its load" in text]
    assert f"{factor:.1f}" in remark
    assert slowdowns(found, 0.05) == ([], 0)
    # Without one processor, or without the same code, nothing tells a clock from a kernel.
    elsewhere = codes | {"machine": {"cpu_model": "another"}}
    found = compare([make("c", ns, 1, **codes), make("d", slow, 2, **elsewhere)])
    assert "no difference resolved" not in {row["verdict"] for row in found.cells}


def test_a_changed_kernel_is_told_from_another_clock(make):
    ns = {"moller1": 30, "badouel": 45, "chirkov": 20, "empty": 0.5}
    changed = {"moller1": 33, "badouel": 49.5, "chirkov": 33, "empty": 0.55}
    before = on_one_machine(moller1="a", badouel="b", chirkov="c", empty="e")
    after = on_one_machine(moller1="a", badouel="b", chirkov="new", empty="e")
    found = compare([make("a", ns, 1, **before), make("b", changed, 2, **after)])
    words = {(row["kernel"], row["verdict"]) for row in found.cells}
    assert ("chirkov", "slower") in words
    assert ("moller1", "slower") not in words and ("badouel", "slower") not in words
    slower, _ = slowdowns(found, 0.2)
    assert {row["kernel"] for row in slower} == {"chirkov"}
    assert slower[0]["beside_shift"] == pytest.approx(1.5, rel=0.03)
