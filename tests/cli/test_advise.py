"""rtbench advise: which kernel to take, asked of runs of this machine."""

import csv
import importlib.util
import io
import json
import re
import shlex
from pathlib import Path

import pytest

from rtbench.measure.machine import fingerprint

KERNELS = {"plain": (10, 20, "none", 48, None), "kept": (8, 16, "precomputed", 64, 100.0)}


@pytest.fixture
def runs(tmp_path):
    """Write a run of this machine into the output folder; return its name."""
    place = Path(__file__).parents[1] / "report" / "sample_runs.py"
    spec = importlib.util.spec_from_file_location("sample_runs", place)
    sample_runs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sample_runs)

    def write(name="one", machine=None, **more):
        cells, methods, facts = [], {}, {}
        for kernel, (sparse, dense, stored, size, prepared) in KERNELS.items():
            methods[kernel] = {"stored": stored, "outputs": ["t", "u", "v"]}
            facts[kernel] = {"float32": {"bytes_per_triangle_padded": size}}
            if prepared:
                facts[kernel]["float32"]["prepare_ns_per_triangle"] = prepared
            for density, ns in ((0.1, sparse), (0.5, dense)):
                cell = {"kernel": kernel, "precision": "float32", "order": "sweep"}
                cells.append(cell | {"density": density, "prepared": "own", "ns": ns})
        sample_runs.write_run(
            tmp_path / "here" / "results" / name,
            "soup",
            cells,
            ["kernel", "precision", "order", "density", "prepared"],
            spread=0.002,
            machine=machine or fingerprint(),
            methods=methods,
            kernels=facts,
            config={"name": "soups", "layout": "padded", "kernels": list(KERNELS)},
            **more,
        )
        return name

    return write


def told(ended):
    assert (ended.code, ended.err) == (0, "")
    return ended.out


def refused(ended, code=2):
    assert (ended.code, ended.out) == (code, "")
    assert ended.err.startswith("rtbench: ") and ended.err.count("\n") == 1
    return ended.err


def test_the_examples_of_the_help_work(rtbench, runs):
    runs()
    _, _, below = rtbench("advise", "--help").out.rpartition("Examples")
    lines = [shlex.split(line) for line in below.splitlines() if line.strip().startswith("rtbench")]
    assert len(lines) == 4
    for line in lines:
        assert told(rtbench(*line[1:])).startswith("Take ")


@pytest.mark.parametrize(
    ("asked", "best", "out"),
    [
        ((), "kept", {"plain": "slower"}),
        (("--stored", "none"), "plain", {"kept": "stores more than none"}),
        # 8 + 100 / 20 = 13 beside 10
        (("--rays-per-triangle", 20), "plain", {"kept": "slower"}),
        (("--triangles", 1000, "--memory", "50 kB"), "plain", {"kept": "memory"}),
        # 64,000 bytes are 62.5 KiB
        (("--triangles", 1000, "--memory", "62.5KiB"), "kept", {"plain": "slower"}),
    ],
)
def test_questions_and_answers(rtbench, runs, asked, best, out):
    name = runs()
    found = json.loads(told(rtbench("advise", *asked, "--format", "json")))
    assert found["best"] == [best] and found["runs"] == [name]
    assert {row["kernel"]: row["reason"] for row in found["fell_out"]} == out
    assert found["ranking"][0]["kernel"] == best
    assert found["advice"].startswith(f"Take {best}: ")
    assert found["advice"] in told(rtbench("advise", *asked))


def test_formats(rtbench, runs):
    runs()
    ended = rtbench("advise", "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(ended.out)))
    assert [row["kernel"] for row in rows] == ["kept", "plain"] and "Take kept" in ended.err
    assert r"\begin{table}" in told(rtbench("advise", "--format", "latex"))
    assert "| rank" in re.sub(r"\|\s+rank", "| rank", told(rtbench("advise", "--format", "github")))


def test_nothing_fits(rtbench, runs):
    runs()
    out = told(rtbench("advise", "--precision", "mixed"))
    assert out.startswith("No measured kernel fits: not in mixed.")
    found = json.loads(told(rtbench("advise", "--precision", "mixed", "--format", "json")))
    assert (found["best"], found["ranking"]) == ([], [])
    assert len(found["fell_out"]) == 2


def test_runs_of_this_machine_are_the_default_and_others_are_asked_by_name(rtbench, runs):
    other = runs("other", machine={"cpu_model": "another", "caches": []})
    assert "reproduce havel --quick" in refused(rtbench("advise"))
    assert told(rtbench("advise", other)).startswith("Take kept")
    own = runs("own")
    assert json.loads(told(rtbench("advise", "--format", "json")))["runs"] == [own]
    assert "different machines" in refused(rtbench("advise", own, other), 3)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "no finished run of this machine in 'results'"),
        (("--packets",), "measured packets"),
        (("--out", "elsewhere"), "'elsewhere'"),
        (("nothing",), "unknown run 'nothing'"),
        (("blecha-pc1",), "was published"),
        (("--stored", "nomal"), "unknown stored 'nomal'; did you mean 'normal'?"),
        (("--outputs", "tu"), "unknown outputs 'tu'"),
        (("--precision", "float16"), "unknown precision 'float16'"),
        (("--hit-ratio", "2"), "hit ratio 2 is not allowed"),
        (("--hit-ratio", "often"), "'often' is not a valid float"),
        (("--rays-per-triangle", "-1"), "rays per triangle -1 is not allowed"),
        (("--triangles", "1.5"), "'1.5' is not a valid integer"),
        (("--memory", "5MB"), "--triangles"),
        (("--memory", "5 miles", "--triangles", "5"), "'5 miles' is not a number of bytes"),
        (("--memory", "5ib", "--triangles", "5"), "'5ib' is not a number of bytes"),
        (("--format", "xml"), "'xml' is not one of"),
    ],
)
def test_what_is_refused_is_told_in_one_line(rtbench, arguments, said):
    assert said in refused(rtbench("advise", *arguments))
