"""Tables and charts of effects: what stands in them is what numpy makes of the samples."""

import csv
import io
import json

import numpy as np
import pytest

from rtbench.records.store import load_run
from rtbench.report import plots
from rtbench.report.layouts.effects import effects_tables
from rtbench.report.run_tables import render_all, tables_of

CELL = ["kernel", "precision", "scene", "tracer"]
STEPS = {"matte": ["plain", "+shadows"], "glass": ["plain", "+shadows", "+refraction"]}
NS = {
    "matte": {"specialised": 100, "optical": 105, "inner_loop": 130, "everything": 140}
    | {"deleted": 100, "plain": 60},
    "glass": {"specialised": 900, "optical": 950, "inner_loop": 1100, "everything": 1300}
    | {"deleted": 900, "plain": 80, "+shadows": 300},
}
COLUMNS = ["kernel", "precision", "scene", "tracer", "width", "height", "picture"]
COLUMNS += ["rays_primary", "rays_shadow", "rays_reflection", "rays_refraction", "rays_indirect"]
COLUMNS += ["code", "instructions", "functions"]


@pytest.fixture
def effects_run(sample_runs, tmp_path):
    """Return a function that writes a run and loads it."""

    def write(scenes=("matte", "glass"), without=(), precisions=("float64",), **more):
        folder = tmp_path / "an-effects"
        cells, rows = [], []
        for precision in precisions:
            for scene in scenes:
                for tracer, ns in NS[scene].items():
                    if tracer in without:
                        continue
                    key = {"kernel": "moller1", "precision": precision}
                    key |= {"scene": scene, "tracer": tracer}
                    cells.append(key | {"ns": ns, "tests": 1200, "triangles": 1200})
                    step = tracer == "plain" or tracer.startswith("+")
                    row = key | {"width": 40, "height": 30}
                    row |= {"picture": tracer if step else "same", "rays_primary": 1200}
                    row |= {"rays_shadow": 0 if tracer == "plain" else 2400}
                    if tracer in ("specialised", "deleted"):
                        code = "c0de" if (scene, tracer) != ("glass", "deleted") else "0ther"
                        functions = "radiance" + " refracted" * (scene == "glass")
                        row |= {"code": code, "instructions": 3000, "functions": functions}
                    rows.append(row)
        facts = [
            {"scene": scene, "width": 40, "height": 30, "samples": 1, "objects": 3}
            | {"effects": {name[1:]: "why" for name in STEPS[scene][1:]}, "steps": STEPS[scene]}
            for scene in scenes
        ]
        given = {"processes": 3, "rounds": 3} | more
        sample_runs.write_run(folder, "effects", cells, CELL, scenes=facts, **given)
        with (folder / "effects.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        return load_run(folder)

    return write


def raw(table):
    return list(csv.DictReader(io.StringIO(table.render("csv"))))


def taken(run, scene, tracer):
    """Return the processor's ns a pixel by process and round, as the file has them."""
    with (run.path / "samples.csv").open(encoding="utf-8") as file:
        return {
            (row["process"], row["round"]): int(row["cpu_ns"]) / int(row["tests"])
            for row in csv.DictReader(file)
            if (row["scene"], row["tracer"]) == (scene, tracer)
        }


def paired(run, scene, tracer, other="specialised"):
    """Return the median ratio of the same rounds."""
    one, two = taken(run, scene, tracer), taken(run, scene, other)
    return np.exp(np.median([np.log(one[turn] / two[turn]) for turn in one]))


def test_ratios_are_medians_of_paired_rounds(effects_run):
    run = effects_run()
    tables = effects_tables(run)
    assert [table.name for table in tables] == ["effects", "effects-steps", "effects-proof"]
    rows = {row["scene"]: row for row in raw(tables[0])}
    assert list(rows) == ["matte", "glass", "geometric mean"]
    for tracer in ("optical", "inner_loop", "everything"):
        ratios = [paired(run, scene, tracer) for scene in NS]
        for scene, want in zip(NS, ratios, strict=True):
            assert float(rows[scene][tracer]) == pytest.approx(want)
            low, high = (float(rows[scene][f"{tracer}_{end}"]) for end in ("low", "high"))
            assert low <= want <= high
        mean = float(rows["geometric mean"][tracer])
        assert mean == pytest.approx(np.sqrt(np.prod(ratios)))
        low, high = (float(rows["geometric mean"][f"{tracer}_{end}"]) for end in ("low", "high"))
        assert low < mean < high
    assert rows["matte"]["equal"] == "True"
    own = np.median(list(taken(run, "glass", "specialised").values()))
    assert float(rows["glass"]["ms"]) == pytest.approx(own * 1200 / 1e6)


def test_a_picture_that_differs_is_told(effects_run):
    run = effects_run()
    path = run.path / "effects.csv"
    text = path.read_text()
    path.write_text(text.replace("matte,everything,40,30,same", "matte,everything,40,30,other"))
    rows = {row["scene"]: row["equal"] for row in raw(effects_tables(load_run(run.path))[0])}
    assert (rows["matte"], rows["glass"]) == ("False", "True")


def test_steps_end_at_the_scene_s_own_tracer(effects_run):
    run = effects_run()
    rows = [row for row in raw(effects_tables(run)[1]) if row["scene"] == "glass"]
    assert [row["step"] for row in rows] == ["plain", "+ shadows", "+ refraction"]
    assert rows[0]["times"] == ""
    assert float(rows[1]["times"]) == pytest.approx(paired(run, "glass", "+shadows", "plain"))
    last = paired(run, "glass", "specialised", "+shadows")
    assert float(rows[2]["times"]) == pytest.approx(last)
    assert [row["rays"] for row in rows] == ["1200", "3600", "3600"]


def test_the_proof_tells_equal_code_and_what_was_compiled(effects_run):
    rows = {row["scene"]: row for row in raw(effects_tables(effects_run())[2])}
    assert (rows["matte"]["equal"], rows["glass"]["equal"]) == ("True", "False")
    assert (rows["matte"]["refraction"], rows["matte"]["called"]) == ("False", "False")
    assert (rows["glass"]["refraction"], rows["glass"]["called"]) == ("True", "True")
    assert rows["matte"]["instructions"] == "3000"
    assert 0.9 < float(rows["matte"]["times_low"]) < 1 < float(rows["matte"]["times_high"]) < 1.1


def test_parts_that_were_not_measured_have_no_table(effects_run):
    run = effects_run(without=("plain", "+shadows", "deleted"))
    assert [table.name for table in tables_of(run)] == ["effects"]
    assert [name for name in plots.figures(run) if name.startswith("effects")] == ["effects"]


def test_one_process_has_no_interval_and_one_scene_no_mean(effects_run):
    run = effects_run(scenes=("matte",), processes=1, rounds=2)
    table = effects_tables(run)[0]
    assert [row["scene"] for row in raw(table)] == ["matte"]
    assert "95 %" not in table.render()
    assert raw(table)[0]["optical_low"] == ""
    plots.write(run)


def test_an_unfinished_run_can_be_read(effects_run):
    run = effects_run()
    (run.path / "effects.csv").unlink()
    lines = (run.path / "samples.csv").read_text().splitlines(keepends=True)
    (run.path / "samples.csv").write_text("".join(lines[:5]))
    render_all(tables_of(load_run(run.path)))
    (run.path / "samples.csv").write_text(lines[0])
    assert tables_of(load_run(run.path)) == []


def test_kernels_and_precisions_have_tables_of_their_own(effects_run):
    run = effects_run(precisions=("float32", "float64"))
    names = [table.name for table in tables_of(run)]
    assert names == [f"effects{part}-{k}" for k in (1, 2) for part in ("", "-steps", "-proof")]
    told = json.loads(render_all(tables_of(run), "json"))
    assert list(told) == names


def test_charts_show_every_tracer_step_and_scene(effects_run):
    run = effects_run()
    figures = plots.figures(run)
    assert list(figures) == ["effects", "effects-steps", "drift"]
    (axes,) = figures["effects"].axes
    assert [label.get_text() for label in axes.get_yticklabels()] == [*NS, "geometric mean"]
    bars = [one for one in axes.containers if hasattr(one, "has_xerr") and one.has_xerr]
    assert len(bars) == 3 * 3
    middles = sorted(bar.lines[0].get_xdata()[0] for bar in bars)
    assert middles[-1] == pytest.approx(max(paired(run, s, "everything") for s in NS))
    (axes,) = figures["effects-steps"].axes
    ends = {}
    for patch in axes.patches:
        line = round(patch.get_y() + patch.get_height() / 2)
        ends.setdefault(line, []).append(patch.get_x() + patch.get_width())
    assert {line: len(each) for line, each in ends.items()} == {0: 2, 1: 3}
    assert all(each[-1] == pytest.approx(1) for each in ends.values())
