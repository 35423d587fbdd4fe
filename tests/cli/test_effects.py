"""``rtbench effects``: what it asks of the experiment, and what it prints."""

import json

import pytest

from rtbench.errors import RtbenchError
from rtbench.experiments import run
from rtbench.records.store import load_run

CELL = ["kernel", "precision", "scene", "tracer"]


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """Instead of measuring: a run of two scenes, and the configs that were asked for."""
    asked = []

    def start(config, watcher, out, label=None, cpu=None, command=None):
        asked.append((config, out, label))
        folder = tmp_path / f"run-{len(asked)}"
        folder.mkdir()
        scenes = [{"scene": s, "width": 4, "height": 3} for s in ("matte", "glass")]
        for fact in scenes:
            fact |= {"effects": {"shadows": "why"}, "steps": ["plain", "+shadows"]}
        info = {"schema": 1, "name": folder.name, "experiment": "effects", "cell": CELL}
        info |= {"scenes": scenes, "seed": 1, "finished": "2026-01-02T03:05:05+00:00"}
        (folder / "run.json").write_text(json.dumps(info))
        timing = "outcome,process,launch,round,position,triangles,repetitions,tests,ns,cpu_ns"
        lines = [",".join([*CELL, timing])]
        for process in range(3):
            for scene in ("matte", "glass"):
                for tracer, ns in (("specialised", 1000), ("everything", 1500), ("plain", 500)):
                    key = f"moller1,float64,{scene},{tracer},,{process},0,0,0,12,1,12"
                    lines.append(f"{key},{ns + process},{ns + process}")
        (folder / "samples.csv").write_text("\n".join(lines) + "\n")
        return load_run(folder)

    monkeypatch.setattr(run, "start", start)
    return asked


def test_tables_charts_and_where_they_are(rtbench, asked):
    told = rtbench("effects")
    assert told.code == 0, told.err
    assert "What is compiled in and not called for; moller1, float64" in told.out
    assert "geometric mean" in told.out and "1.500" in told.out
    assert "Effects, one by one" in told.out
    folder = told.out.splitlines()[-1].removeprefix("Records, tables and plots: ")
    written = load_run(folder).path
    assert (written / "tables" / "effects.csv").is_file()
    assert (written / "plots" / "effects.png").is_file()
    ((config, out, label),) = asked
    assert (config.experiment, config.scenes, str(out), label) == ("effects", (), "results", None)
    assert config.parts == ("tracers", "steps", "proof")


def test_json_is_one_object_and_csv_one_table(rtbench, asked):
    told = json.loads(rtbench("effects", "--format", "json").out)
    assert list(told) == ["run", "path", "tables"]
    rows = told["tables"]["effects"]
    assert [row["scene"] for row in rows] == ["matte", "glass", "geometric mean"]
    assert rows[0]["everything"] == pytest.approx(1501 / 1001)
    lines = rtbench("effects", "--format", "csv").out.splitlines()
    assert lines[0].startswith("scene,size,ms,everything,")


def test_what_is_asked_for(rtbench, asked):
    rtbench(
        *("effects", "matte", "a.nff", "--size", "64x48", "--kernel", "moller1"),
        *("--precision", "float32", "--processes", "2", "--samples", "4", "--out", "there"),
        *("--label", "mine", "--part", "proof"),
    )
    ((config, out, label),) = asked
    assert config.scenes == ("matte", "a.nff")
    assert (config.width, config.height, config.kernels) == (64, 48, ("moller1",))
    assert (config.precisions, config.processes, config.samples) == (("float32",), 2, 4)
    assert (config.parts, str(out), label) == (("proof",), "there", "mine")


def test_quick_stays_quick_but_for_what_is_asked(rtbench, asked):
    rtbench("effects", "--quick")
    rtbench("effects", "--quick", "--part", "steps", "--processes", "4")
    (first, *_), (second, *_) = asked
    assert (first.processes, first.parts) == (1, ("tracers",))
    assert (second.processes, second.samples, second.parts) == (4, 2, ("steps",))


def test_bad_input_is_one_line(rtbench, asked, monkeypatch):
    told = rtbench("effects", "--size", "0x3")
    assert (told.code, told.out) == (2, "") and "size '0x3'" in told.err
    assert told.err.count("\n") == 1 and not asked

    def refuse(*arguments, **more):
        raise RtbenchError("unknown part 'all'")

    monkeypatch.setattr(run, "start", refuse)
    told = rtbench("effects", "--part", "all")
    assert (told.code, told.out, told.err) == (2, "", "rtbench: unknown part 'all'\n")
