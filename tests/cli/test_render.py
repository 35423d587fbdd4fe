"""rtbench render: what it prints and writes of a picture that is known, what it refuses, and one
real picture."""

import dataclasses
import json
import os
import shlex
import textwrap
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from rtbench.cli import render, render_options
from rtbench.errors import RtbenchError
from rtbench.tracer import effects, orbit

# As others read it: written down here, not taken from the code.
KINDS = ["primary", "shadow", "reflection", "refraction", "indirect"]
EFFECTS = ["shadows", "reflection", "refraction", "dispersion", "specular", "texture"]
EFFECTS += ["smooth_normals", "soft_shadows", "glossy", "depth_of_field", "motion_blur"]
EFFECTS += ["antialiasing", "indirect"]
SECONDS = {"compile": 0.0, "build": 0.25, "trace": 0.5}


@pytest.fixture
def traced(monkeypatch):
    """Instead of the tracer: grey pictures, known figures, and what was asked for."""
    from rtbench.scenes import reading
    from rtbench.tracer import render as tracer

    asked = []

    class Renderer:
        def __init__(self, scene, options, progress=None, later=False):
            self.scene, self.options = scene, options
            self.effects = effects.compiled(scene, options.without, options.force)

        def render(self, camera=None, threads=1, progress=None):
            asked.append((self.scene, self.options, threads))
            camera = self.scene.camera
            shape = camera.height, camera.width
            rays = {"primary": 1_000_000, "shadow": 500_000, "reflection": 0}
            return SimpleNamespace(
                pixels=np.full((*shape, 3), 0.5),
                rays=rays,
                saved={"light_behind": 1234, "depth": 0},
                seconds=SECONDS,
                effects=self.effects,
                heat={"steps": np.ones(shape, int), "tests": np.ones(shape, int)},
            )

    def read(name, models=None):
        if name == "nowhere":
            raise RtbenchError("unknown scene 'nowhere'")
        return dataclasses.replace(orbit.crowd(6, 40, 30), name=name, remarks=("a remark",))

    monkeypatch.setattr(tracer, "Renderer", Renderer)
    monkeypatch.setattr(tracer, "compile_all", lambda renderers, progress: progress(1.0))
    monkeypatch.setattr(reading, "read", read)
    return asked


def refused(told):
    assert (told.code, told.out) == (2, ""), told
    assert told.err.startswith("rtbench: ") and told.err.count("\n") == 1, told.err
    return told.err


def test_a_picture_its_figures_and_what_is_said(rtbench, traced, tmp_path):
    told = rtbench("render", "my scene", "--stats", "all.json", "--heat", "heat.png")
    assert told.code == 0, told.err
    assert "rtbench: a remark\n" in told.err
    here = tmp_path / "here"
    files = ["all.json", "heat-steps.png", "heat-tests.png", "my-scene.png"]
    assert sorted(path.name for path in here.iterdir()) == files
    with Image.open(here / "my-scene.png") as picture:
        assert (picture.size, picture.mode) == ((40, 30), "RGB")
    stats = json.loads((here / "all.json").read_text())
    assert list(stats) == ["seconds", "rays", "effects"]
    assert stats["seconds"] == SECONDS
    assert list(stats["rays"]) == KINDS and list(stats["effects"]) == EFFECTS
    assert stats["rays"] == dict(zip(KINDS, [1_000_000, 500_000, 0, 0, 0], strict=True))
    assert {type(value) for value in stats["effects"].values()} == {bool}
    assert stats["effects"]["shadows"] and not stats["effects"]["refraction"]
    lines = told.out.splitlines()
    assert lines[0] == "my scene: 40 x 30, float64, bvh, watertight_safe"
    assert "compile 0, build 0.2500, trace 0.5000" in told.out
    assert "simulated: shadows, reflection, specular\n" in told.out
    assert "not called for: refraction, dispersion, texture," in told.out
    # 1.5 million rays in half a second.
    assert [line.split() for line in lines if line.startswith("all")] == [
        ["all", "1,500,000", "100.0", "3.000"]
    ]
    assert "light behind 1,234" in told.out and "depth 0" not in told.out
    assert lines[-1] == "written: my-scene.png, heat-steps.png, heat-tests.png, all.json"


def test_json_is_what_stats_writes(rtbench, traced, tmp_path):
    told = rtbench("render", "small", "--stats", "s.json", "--format", "json", "--quiet")
    assert json.loads(told.out) == json.loads((tmp_path / "here" / "s.json").read_text())


def test_what_is_asked_for_reaches_the_tracer(rtbench, traced, tmp_path):
    told = rtbench(
        *("render", "small", "--size", "32x24", "--threads", 3, "--precision", "float32"),
        *("--kernel", "moller1", "--structure", "kd", "--rule", "object_median", "--depth", 2),
        *("--samples", 9, "--threshold", 0.5, "--without", "shadows", "--force", "refraction"),
        *("--subsampling", "8,4", "--tolerance", 0.2, "--interpolation", "nearest"),
        *("--no-shadow-cache", "--first-hit", "--builder", "binned", "--out", "x.npy"),
    )
    assert told.code == 0, told.err
    ((scene, options, threads),) = traced
    assert (scene.camera.width, scene.camera.height, threads) == (32, 24, 3)
    settings = scene.settings
    assert (settings.depth, settings.samples, settings.threshold) == (2, 9, 0.5)
    assert (options.precision, options.kernel, options.structure) == ("float32", "moller1", "kd")
    assert (options.rule, options.builder) == ("object_median", "binned")
    assert (options.without, options.force) == (("shadows",), ("refraction",))
    finer = options.subsampling
    assert (finer.grid, finer.tolerance, finer.interpolation) == ((8, 4), 0.2, "nearest")
    assert (options.shadow_cache, options.first_hit, options.counted) == (False, True, False)
    assert "left out though called for: shadows" in told.out
    assert "refraction (forced)" in told.out
    assert np.load(tmp_path / "here" / "x.npy").shape == (24, 32, 3)


def test_every_core_is_used_unless_told_otherwise(rtbench, traced):
    rtbench("render", "small")
    assert traced[0][2] == len(os.sched_getaffinity(0))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--size", "0x100"), "size '0x100' is not allowed (allowed: WxH, 1 to 16384 pixels"),
        (("--size", "100x0"), "size '100x0' is not allowed"),
        (("--size", "-3x5"), "size '-3x5' is not allowed"),
        (("--size", "16385x5"), "size '16385x5' is not allowed"),
        (("--size", "640"), "size '640' is not allowed"),
        (("--size", ""), "size '' is not allowed"),
        (("--threads", "0"), "threads 0 is not allowed"),
        (("--precision", "float16"), "unknown precision 'float16'; did you mean"),
        (("--kernel", "moler1"), "unknown kernel 'moler1'; did you mean 'moller1'?"),
        (("--kernel", "wald_inside"), "returns no t along a ray"),
        (("--kernel", "wald", "--kernel", "moller1"), "one --kernel; --orbit takes several"),
        (("--structure", "octree"), "unknown structure 'octree'"),
        (("--rule", "sha"), "unknown rule 'sha'; did you mean 'sah'?"),
        (("--builder", "nlog"), "unknown builder 'nlog'; did you mean 'nlogn'?"),
        (("--rule", "object_median", "--structure", "bvh"), "no --rule object_median"),
        (("--builder", "n2", "--structure", "bvh"), "a BVH has one builder, by the SAH: no"),
        (("--depth", "-1"), "depth -1 is not allowed"),
        (("--samples", "5"), "samples 5 is no square number (the nearest is 4)"),
        (("--samples", "0"), "samples 0 is not allowed"),
        (("--threshold", "nan"), "threshold nan is not allowed"),
        (("--without", "shadow"), "unknown effect 'shadow'; did you mean 'shadows'?"),
        (("--force", "glass"), "unknown effect 'glass'"),
        (("--force", "shadows", "--without", "shadows"), "shadows is named by --without and by"),
        (("--subsampling", "4;4"), "subsampling '4;4' is not allowed"),
        (("--subsampling", "0"), "grid 0 is not allowed"),
        (("--subsampling", "4", "--tolerance", "2"), "tolerance 2.0 is not allowed"),
        (("--subsampling", "4", "--tolerance", "nan"), "tolerance nan is not allowed"),
        (("--subsampling", "4", "--interpolation", "linear"), "did you mean 'bilinear'?"),
        (("--tolerance", "0.1"), "without --subsampling there is no --tolerance"),
        (("--interpolation", "nearest"), "without --subsampling there is no --interpolation"),
        (("--out", "x.jpg"), "--out 'x.jpg': unknown suffix '.jpg'"),
        (("--out", "x"), "--out 'x': unknown suffix '' (allowed: .npy, .pfm, .png)"),
        (("--out", "nowhere/x.png"), "cannot write --out 'nowhere/x.png': no such file"),
        (("--stats", "x.toml"), "--stats 'x.toml': unknown suffix '.toml'"),
        (("--heat", "x.npy"), "--heat 'x-steps.npy': unknown suffix '.npy'"),
        (("--out", "x-steps.png", "--heat", "./x.png"), "--out and --heat name the same file"),
        (("--frames", "5"), "only --orbit takes --frames"),
        (("--objects", "5"), "only --orbit takes --objects"),
        (("--orbit", "--out", "x.png"), "--orbit writes no picture: no --out"),
        (("--orbit", "--ledger"), "--orbit writes no picture: no --ledger"),
        (("--orbit", "--frames", "0"), "frames 0 is not allowed"),
        (("--orbit", "--objects", "10,"), "objects '10,' is not allowed"),
        (("--orbit", "--objects", "0"), "objects 0 is not allowed"),
        (("--orbit", "--kernel", "moler1"), "unknown kernel 'moler1'"),
        (("--format", "xml"), "'xml' is not one of"),
    ],
)
def test_bad_input_is_told_in_a_line_before_anything_is_traced(
    rtbench, traced, tmp_path, arguments, said
):
    # The scene's remark is no part of what is refused.
    told = rtbench("render", "small", "--quiet", *arguments)
    told = told._replace(err=told.err.replace("rtbench: a remark\n", ""))
    assert said in refused(told)
    assert traced == [] and list((tmp_path / "here").iterdir()) == []


def test_the_format_of_scenes_is_printed_and_its_example_is_one(rtbench, tmp_path):
    from rtbench.scenes import reading

    # Eager: a scene is not needed, and what is wrong beside it is not looked at.
    told = rtbench("render", "--size", "nothing", "--help-scene")
    assert (told.code, told.err) == (0, "")
    assert max(map(len, told.out.splitlines())) <= 100
    for table in ("[camera]", "[settings]", "[materials.NAME]", "[[lights]]", "[[objects]]"):
        assert f"\n{table}" in told.out
    _, example = told.out.split("A whole scene:\n")
    (tmp_path / "ball.toml").write_text(textwrap.dedent(example), encoding="utf-8")
    scene = reading.read(str(tmp_path / "ball.toml"))
    assert (scene.name, len(scene.objects), len(scene.lights)) == ("ball", 2, 1)
    assert "--help-scene" in rtbench("render", "--help").out


def test_no_scene(rtbench, traced):
    assert "unknown scene 'nowhere'" in refused(rtbench("render", "nowhere"))
    assert "Missing argument 'SCENE'" in refused(rtbench("render"))


def test_what_is_no_file_is_not_replaced(rtbench, traced, tmp_path):
    pipe = tmp_path / "here" / "x.png"
    os.mkfifo(pipe)
    told = rtbench("render", "small", "--out", "x.png")
    assert "is there already and is no file" in told.err and told.code == 2
    assert pipe.is_fifo() and traced == []


def test_the_old_picture_stays_if_anything_fails(rtbench, traced, tmp_path, monkeypatch):
    from rtbench.tracer import render as tracer

    here = tmp_path / "here"
    (here / "small.png").write_bytes(b"old")

    def stopped(self, camera=None, threads=1, progress=None):
        progress(0.5)
        raise KeyboardInterrupt

    monkeypatch.setattr(tracer.Renderer, "render", stopped)
    assert rtbench("render", "small").code == 130
    assert [path.name for path in here.iterdir()] == ["small.png"]
    assert (here / "small.png").read_bytes() == b"old"


def test_the_ledger_has_every_effect(rtbench, traced, tmp_path):
    told = rtbench("render", "small", "--ledger", "--quiet", "--threads", 2)
    assert told.code == 0, told.err
    assert "3 of 13 effects called for" in told.out
    assert told.out.splitlines()[-1] == "written: small.png"
    assert {threads for _, _, threads in traced} == {2}
    found = json.loads(rtbench("render", "small", "--ledger", "--format", "json").out)
    assert [row["key"] for row in found["ledger"]] == EFFECTS
    assert list(found) == ["seconds", "rays", "effects", "ledger"]


def test_orbit_prints_a_row_a_variant(rtbench, traced, tmp_path):
    told = rtbench("render", "small", "--orbit", "--frames", 3, "--objects", "4,1", "--format=json")
    assert told.code == 0, told.err
    rows = json.loads(told.out)
    # Four kernels for scenes with triangles, one for a lone sphere; times four.
    assert len(rows) == 16 + 16 + 4
    assert {(row["scene"], row["objects"]) for row in rows} == {
        ("small", 6),
        ("crowd of 4", 4),
        ("crowd of 1", 1),
    }
    assert {row["frames"] for row in rows} == {3}
    for row in rows:
        assert row["fps_least"] <= row["fps_low"] <= row["fps"] <= row["fps_high"]
    table = rtbench("render", "small", "--orbit", "--frames", 3, "-k", "moller1", "-k", "wald")
    assert "3 frames of 40 x 30" in table.out and "frames/s" in table.out
    assert len([line for line in table.out.splitlines() if line.startswith("small ")]) == 8
    assert list((tmp_path / "here").iterdir()) == []


def test_progress_is_of_the_frames(rtbench, traced, monkeypatch):
    from rtbench.cli import progress

    monkeypatch.setattr(progress, "PAUSE_LINES", 0.0)
    told = rtbench("render", "small", "--orbit", "--frames", 2, "--kernel", "moller1")
    assert "going round" in told.err and "left" in told.err
    assert "measuring" not in told.out


def test_examples_ask_for_what_there_is(rtbench, traced):
    lines = [line.strip() for line in render.EXAMPLES.splitlines() if "rtbench" in line]
    for line in lines:
        told = rtbench(*shlex.split(line)[1:])
        assert told.code == 0, told.err


@pytest.mark.parametrize(
    ("asked", "structure"),
    [
        ((), "bvh"),
        (("--rule", "sah"), "bvh"),
        (("--rule", "spatial_median"), "kd"),
        (("--builder", "binned"), "kd"),
        (("--structure", "kd"), "kd"),
    ],
)
def test_what_only_a_kd_tree_has_asks_for_one(rtbench, traced, asked, structure):
    assert rtbench("render", "small", *asked).code == 0
    assert traced[0][1].structure == structure


@pytest.mark.parametrize(
    ("text", "grid"), [("4", (4, 4)), ("8,2", (8, 2)), (" 1 ", (1, 1)), ("16,1", (16, 1))]
)
def test_a_grid_in_words(text, grid):
    assert render_options.grid_of(text) == grid


def test_a_real_picture(rtbench, process, tmp_path):
    """Of a scene that ships: as many primary rays as pixels, whatever the number of threads."""
    small = ("render", "matte", "--size", "40x36", "--samples", 1, "--quiet")
    here = tmp_path / "here"
    first = rtbench(*small, "--threads", 1, "--out", "one.npy", "--stats", "one.json")
    assert first.code == 0, first.err
    # A start of its own, which finds the code compiled.
    second = process(*small, "--threads", 2, "--out", "two.npy", "--stats", "two.json", cwd=here)
    out, err = second.communicate(timeout=300)
    assert (second.returncode, err) == (0, "")
    assert out.startswith("matte: 40 x 36, float64, bvh, watertight_safe\n")
    one, two = np.load(here / "one.npy"), np.load(here / "two.npy")
    assert one.shape == (36, 40, 3) and np.isfinite(one).all() and np.ptp(one) > 0.1
    assert one.tobytes() == two.tobytes()
    cold, warm = (json.loads((here / name).read_text()) for name in ("one.json", "two.json"))
    assert cold["rays"] == warm["rays"] and cold["rays"]["primary"] == 40 * 36
    assert cold["effects"]["shadows"] == (cold["rays"]["shadow"] > 0)
    assert not cold["effects"]["refraction"] and cold["rays"]["refraction"] == 0
    assert warm["seconds"]["compile"] == 0 < cold["seconds"]["trace"]
