"""Tables and charts of subsampling and techniques: what stands in them is what samples say."""

import csv
import io

import pytest

from rtbench.records.store import load_run
from rtbench.report import plots
from rtbench.report.charts import style
from rtbench.report.run_tables import render_all, tables_of
from rtbench.report.techniques import Ways, psnr, root_mean_square

TOLERANCES = (0.0, 0.05, 0.2)
GRIDS = {"4x4": 1.0, "8x4": 1.5}  # times as fast at the greatest tolerance, of a scene's number
SCENES = {"matte": 6.0, "glass": 2.0}
WAY = ["kernel", "precision", "scene", "grid", "tolerance", "interpolation"]
TECHNIQUE = ["kernel", "precision", "scene", "technique", "threads"]
FASTER = {  # shadow cache, first hits, two threads
    "matte": {"shadow_cache": 1.4, "first_hit": 1.2, "threads": 1.9},
    "mesh": {"shadow_cache": 0.8, "first_hit": 0.25, "threads": 1.6},
}
FORM = {"kernel": "moller1", "precision": "float64"}
PIXELS = {"width": 40, "height": 30}
STATED = {"section": "2.3.1", "statement": "it helps", "verdict": "refuted", "number": "0.5"}


def table(path, rows):
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[-1]))
        writer.writeheader()
        writer.writerows(rows)


def facts(scenes, primitives):
    more = {"samples": 1, "lights": 1, "area_lights": 0, "primitives": primitives}
    return [{"scene": scene} | PIXELS | more for scene in scenes]


@pytest.fixture
def subsampling(sample_runs, tmp_path):
    """Return a function that writes a run and loads it."""

    def write(**more):
        cells, rows = [], []
        timed = {"tests": 1200, "triangles": 1200}
        for scene, most in SCENES.items():
            full = {"grid": "full", "tolerance": 0.0, "interpolation": "none"}
            cells.append(FORM | {"scene": scene, "ns": 9000} | full | timed)
            for grid, better in GRIDS.items():
                for place, tolerance in enumerate(TOLERANCES):
                    for how in ("bilinear", "nearest"):
                        way = {"grid": grid, "tolerance": tolerance, "interpolation": how}
                        key = FORM | {"scene": scene} | way
                        faster = 1 if tolerance == 0 else most * better * tolerance / 0.2
                        if how == "bilinear" or grid == "4x4":
                            cells.append(key | {"ns": 9000 / faster} | timed)
                        worse = place * (2 if how == "nearest" else 1)
                        error = {"mean_square": (worse / 255) ** 2, "ssim": 1 - worse / 100}
                        error |= {"greatest": worse * 7 / 255, "differing": worse / 20}
                        error |= {"above_two_steps": worse / 40, "picture": "same"}
                        rays = {"interpolated": 300 * place, "primary": 1300 - 300 * place}
                        rays |= {"rays": 3900 - 900 * place, "rays_full": 3600}
                        rows.append(key | PIXELS | rays | error)
        folder = tmp_path / "some-subsampling"
        config = {"grids": [*GRIDS], "tolerances": [*TOLERANCES], "scenes": [*SCENES]}
        config |= {"interpolations": ["bilinear", "nearest"], "kernels": ["moller1"]}
        given = {"processes": 3, "rounds": 2, "config": config} | more
        scenes = facts(SCENES, 9)
        load = {"before": {"loadavg": [0.5, 1, 1]}, "after": {"loadavg": [7.25, 1, 1]}}
        given |= {"scenes": scenes, "load": load}
        sample_runs.write_run(folder, "subsampling", cells, WAY, **given)
        table(folder / "subsampling.csv", rows)
        return load_run(folder)

    return write


@pytest.fixture
def techniques(sample_runs, tmp_path):
    """Return a function that writes a run and loads it."""

    def write(other=(), **more):
        cells, rows = [], []
        for scene, faster in FASTER.items():
            ways = {("none", 1): 1.0, ("shadow_cache", 1): faster["shadow_cache"]}
            ways[("first_hit", 1)] = faster["first_hit"]
            ways[("shadow_cache", 2)] = faster["shadow_cache"] * faster["threads"]
            for (technique, threads), times in ways.items():
                key = FORM | {"scene": scene, "technique": technique, "threads": threads}
                cells.append(key | {"ns": 9000 / times, "tests": 1200, "triangles": 1200})
                picture = "other" if (scene, technique) in other else "same"
                rays = {"rays_primary": 1200, "rays_shadow": 3600, "rays_reflection": ""}
                rays |= {"rays_refraction": 0, "rays_indirect": 0}
                rows.append(key | PIXELS | {"picture": picture} | rays)
        folder = tmp_path / "some-techniques"
        given = {"processes": 3, "rounds": 2} | more
        scenes = facts(FASTER, 20_000)
        given |= {"scenes": scenes, "statements": [STATED]}
        sample_runs.write_run(folder, "techniques", cells, TECHNIQUE, **given)
        table(folder / "techniques.csv", rows)
        return load_run(folder)

    return write


def raw(found):
    return list(csv.DictReader(io.StringIO(found.render("csv"))))


def test_speed_and_error_stand_side_by_side(subsampling):
    by_scene, by_grid = tables_of(subsampling(spread=0.001))
    rows = {
        (r["scene"], r["grid"], r["interpolation"], float(r["tolerance"])): r for r in raw(by_scene)
    }
    assert len(rows) == 2 * 2 * 2 * 3
    row = rows["matte", "4x4", "bilinear", 0.2]
    assert float(row["faster"]) == pytest.approx(6, rel=0.02)
    assert float(row["faster_low"]) < 6 < float(row["faster_high"])
    assert float(row["rms"]) == pytest.approx(2) and float(row["greatest"]) == pytest.approx(14)
    assert float(row["psnr"]) == pytest.approx(42.11, abs=0.01)  # 20 log10(255 / 2)
    assert float(row["traced"]) == 0.5 and float(row["rays"]) == pytest.approx(2100 / 3600)
    assert not rows["matte", "4x4", "bilinear", 0.0]["psnr"]
    assert not rows["matte", "8x4", "nearest", 0.2]["faster"]  # was not timed
    assert rows["matte", "4x4", "nearest", 0.2]["faster"]
    # Printed is the first grid alone.
    assert len(by_scene.rows) == 2 * 3 and "8x4" not in by_scene.render("plain")
    text = render_all([by_scene, by_grid], "plain")
    assert "load of the machine before and after: 0.5, 7.2" in text and "equal" in text


def test_grids_are_means_over_scenes(subsampling):
    _, by_grid = tables_of(subsampling(spread=0.001))
    rows = {(r["grid"], float(r["tolerance"])): r for r in raw(by_grid)}
    row = rows["8x4", 0.2]
    assert float(row["faster"]) == pytest.approx(1.5 * 12**0.5, rel=0.02)
    assert float(row["rms_bilinear"]) == pytest.approx(2)
    assert float(row["rms_nearest"]) == pytest.approx(4)
    assert float(row["traced"]) == 0.5


def test_equal_pictures_have_no_noise():
    assert psnr(0.0) == float("inf") and psnr(0.01) == pytest.approx(20)
    assert root_mean_square(1.0) == 255


def test_ratios_are_beside_ordinary_tracing(techniques):
    found, stated = tables_of(techniques(spread=0.001))
    for row in raw(found):
        told = FASTER[row["scene"]]
        assert float(row["shadow_cache"]) == pytest.approx(told["shadow_cache"], rel=0.02)
        assert float(row["first_hit"]) == pytest.approx(told["first_hit"], rel=0.02)
        assert float(row["threads_2"]) == pytest.approx(told["threads"], rel=0.02)
        assert row["equal"] == "True" and row["rays_shadow"] == "3600"
    assert "25.0 %" in found.render("plain")  # of the rays are primary
    assert raw(stated) == [STATED]


def test_threads_are_left_out_where_no_core_was_free(techniques):
    run = techniques()
    text = (run.path / "samples.csv").read_text(encoding="utf-8")
    lines = list(csv.DictReader(io.StringIO(text)))
    table(run.path / "samples.csv", [row | {"cpu_ns": int(row["ns"]) // 2} for row in lines])
    run = load_run(run.path)
    found, _ = tables_of(run)
    assert "threads_2" not in raw(found)[0]
    assert "a lone thread had a core for 50% of the time" in found.render("plain")
    (axes,) = plots.figures(run)["techniques"].axes
    assert axes.get_xlabel().startswith("processor time")
    assert {text.get_text() for text in axes.get_legend().get_texts()} == {
        *("shadow cache", "first hits by rasterising")
    }


def test_a_picture_that_differs_shows(techniques):
    found, _ = tables_of(techniques(other=[("mesh", "first_hit")]))
    assert {row["scene"]: row["equal"] for row in raw(found)} == {"matte": "True", "mesh": "False"}


@pytest.mark.parametrize("processes", [1, 3])
def test_charts(subsampling, techniques, processes):
    shapes = {"processes": processes, "rounds": 2 if processes > 1 else 1}
    charts = plots.figures(subsampling(**shapes)) | plots.figures(techniques(**shapes))
    assert {"subsampling", "techniques"} <= charts.keys()
    left, right = charts["subsampling"].axes
    assert "1/255" in left.get_xlabel() and "ratio" in left.get_ylabel()
    assert left.get_yscale() == "log"
    named = [text.get_text() for artist in left.get_children() for text in legend_of(artist)]
    assert {"matte", "glass"} <= set(named)
    assert {t.get_text() for t in right.get_legend().get_texts()} == {"0", "0.05", "0.2"}
    for name in ("subsampling", "techniques"):
        figure = charts[name]
        style.settle(figure)
        renderer = figure.canvas.get_renderer()
        assert "AMD EPYC 9B14" in " ".join(text.get_text() for text in figure.texts)
        for axes in figure.axes:
            box = axes.get_tightbbox(renderer)
            assert box.x0 >= 0 and box.y0 >= 0
            assert box.x1 <= figure.bbox.width and box.y1 <= figure.bbox.height


def legend_of(artist):
    return artist.get_texts() if hasattr(artist, "get_texts") else []


def test_curves_are_drawn_where_the_numbers_are(subsampling):
    run = subsampling(spread=0.001)
    (left, _), ways = plots.figures(run)["subsampling"].axes, Ways(run)
    lines = [line for line in left.get_lines() if line.get_linestyle() != "None"]
    drawn = [line for line in lines if len(line.get_xdata()) == len(TOLERANCES)]
    assert len(drawn) == len(ways.scenes(("moller1", "float64"))) == 2
    for line, most in zip(drawn, SCENES.values(), strict=True):
        assert list(line.get_xdata()) == pytest.approx([0, 1, 2])
        assert list(line.get_ydata()) == pytest.approx([1, most / 4, most], rel=0.02)
