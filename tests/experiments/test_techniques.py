"""Subsampling and the techniques of tracing: what is planned, compared, kept and stated."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.experiments import (
    run,
    subsampling,
    techniques,
    techniques_rounds,
    techniques_scenes,
    techniques_statements,
    techniques_worker,
)
from rtbench.experiments.config import Config, find
from rtbench.experiments.verdicts import rows
from rtbench.records.resampling import RESAMPLES, Estimate
from rtbench.scenes import reading

WAYS = Config(
    name="ways",
    experiment="subsampling",
    kernels=("watertight_safe",),
    precisions=("float64",),
    scenes=("matte",),
    grids=("4x4", "8x4"),
    tolerances=(0.0, 0.1, 1.0),
    interpolations=("bilinear", "nearest"),
    width=32,
    height=24,
    processes=2,
    samples=2,
)
TECHNIQUES = WAYS.changed(name="techniques", experiment="techniques", threads=(1, 2))
CORNERS = {4: (9, 7), 8: (5, 7)}  # of a picture of 32 x 24 pixels: from rim to rim


def table(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def faked(monkeypatch):
    """Let workers be called in this process, and pictures be made up: no tracer is compiled.

    A subsampled picture differs from the full one by a tenth of the tolerance, in its first row.
    ``faked.wrong(options, process)``: whose picture is darker; ``faked.cores``.
    """
    faked = SimpleNamespace(wrong=lambda options, process: False, process=-1, built=[], jobs=[])

    class Renderer:
        def __init__(self, scene, options):
            self.scene, self.options, self.seconds = scene, options, {"compile": 1.0}
            faked.built.append(options)

        def render(self, camera=None, threads=1):
            camera = camera or self.scene.camera
            pixels = np.full((camera.height, camera.width, 3), 0.5)
            chosen, count = self.options.subsampling, camera.width * camera.height
            left = 0
            if chosen is not None:
                pixels[0] += chosen.tolerance / 10
                left = int(chosen.tolerance * count / 2)
            if faked.wrong(self.options, faked.process):
                pixels *= 0.99
            rays = {"primary": count - left, "shadow": 2 * (count - left)}
            return SimpleNamespace(pixels=pixels, rays=rays, saved={"interpolated": left})

    class Resettled(Renderer):
        def __init__(self, built, options):
            self.scene, self.options, self.seconds = built.scene, options, built.seconds

    class Asked:
        def __init__(self, cpu, kernels, module=None):
            faked.process += 1
            self.place = techniques_worker.Place()
            self.ask("start", cpu=cpu, kernels=list(kernels))

        def ask(self, do, **more):
            return getattr(self.place, do)(**more)

        def close(self):
            pass

    monkeypatch.setattr(techniques_worker, "Renderer", Renderer)
    monkeypatch.setattr(techniques_worker, "Resettled", Resettled)
    monkeypatch.setattr(techniques_rounds, "Asked", Asked)
    monkeypatch.setattr(techniques_rounds, "compile_all", lambda jobs, *_: faked.jobs.extend(jobs))
    monkeypatch.setattr(techniques_rounds, "SAMPLE_NS", 1)
    monkeypatch.setattr(techniques.os, "sched_getaffinity", lambda _: range(2))
    monkeypatch.delenv(techniques_scenes.FOLDER, raising=False)
    return faked


def test_what_comes_with_rtbench():
    ways, found = find("subsampling"), find("tracer-techniques")
    assert ways.tolerances == (0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
    assert {"2x2", "4x4", "8x8", "16x16", "8x4"} == set(ways.grids)
    assert len(subsampling.settings(ways)) == 5 * 2 * 7
    assert sum(timed for _, timed in subsampling.settings(ways)) == 6 * 7
    techniques.check(found)
    assert found.quick().processes == ways.quick().processes == 1
    assert len(ways.quick().scenes) == 2


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"grids": ("4by4",)}, r"grid '4by4' is not allowed"),
        ({"grids": ("4x3",)}, r"grid 3 is not allowed \(allowed: 1, 2, 4, 8, 16 pixels\)"),
        ({"grids": ("4x4", "4x4")}, "grids names a value twice: 4x4, 4x4"),
        ({"tolerances": (1.5,)}, "tolerance 1.5 is not allowed"),
        ({"interpolations": ("bilinea",)}, "interpolation 'bilinea'; did you mean 'bilinear'"),
        ({"scenes": ("mate",)}, "scene 'mate'; did you mean 'matte'"),
        ({"experiment": "techniques", "techniques": ("cache",)}, "technique 'cache'"),
    ],
)
def test_what_is_not_allowed_is_said(go, faked, changes, words):
    with pytest.raises(RtbenchError, match=words):
        go(WAYS, **changes)


def test_errors_are_those_of_the_pictures(go, faked):
    done = go(WAYS)
    kept = table(done.path / "subsampling.csv")
    assert len(kept) == 1 + 2 * 2 * 3
    full, *others = kept
    assert full["grid"] == "full" and not full["mean_square"] and int(full["rays"]) == 3 * 768
    dark = 1.055 * 0.5 ** (1 / 2.4) - 0.055  # the sRGB curve
    for row in others:
        tolerance = float(row["tolerance"])
        light = 1.055 * (0.5 + tolerance / 10) ** (1 / 2.4) - 0.055
        assert float(row["greatest"]) == pytest.approx(light - dark)
        assert float(row["mean_square"]) == pytest.approx((light - dark) ** 2 / 24)
        assert float(row["differing"]) == pytest.approx((tolerance > 0) / 24)
        assert int(row["interpolated"]) == int(tolerance * 384)
        assert int(row["rays"]) == 3 * (768 - int(row["interpolated"]))
        assert int(row["rays_full"]) == 3 * 768


def test_cells_are_timed_in_every_round(go, faked):
    done = go(WAYS)
    samples = table(done.path / "samples.csv")
    told = {(row["grid"], row["interpolation"]) for row in samples}
    # Only with the first grid is filling timed that is not the first.
    assert told == {
        *(("full", "none"), ("4x4", "bilinear"), ("4x4", "nearest"), ("8x4", "bilinear"))
    }
    keys = {tuple(row[name] for name in subsampling.CELL) for row in samples}
    assert len(keys) == 1 + 3 * 3 and len(samples) == len(keys) * 2 * 2
    # A process builds each scene twice, whatever the number of ways: in full, and subsampling.
    assert len(faked.built) == 2 * 2 and len(faked.jobs) == 2
    assert done.finished


def test_a_picture_that_changes_is_noticed(go, faked):
    faked.wrong = lambda options, process: process == 1 and options.subsampling is None
    with pytest.raises(WrongAnswers, match=r"matte \(.*grid full.*\) is not, bit for bit"):
        go(WAYS)


def test_a_technique_that_changes_a_picture_is_noticed(go, faked):
    faked.wrong = lambda options, process: options.first_hit
    with pytest.raises(WrongAnswers, match=r"matte by first_hit in 1 threads .* ordinary tracing"):
        go(TECHNIQUES)


def test_techniques_stand_alone(go, faked):
    done = go(TECHNIQUES)
    kept = table(done.path / "techniques.csv")
    assert [(row["technique"], row["threads"]) for row in kept] == [
        *(("none", "1"), ("shadow_cache", "1"), ("shadow_cache", "2"), ("first_hit", "1"))
    ]
    assert len({row["picture"] for row in kept}) == 1
    chosen = {(each.shadow_cache, each.first_hit) for each in faked.built}
    assert chosen == {(False, False), (True, False), (False, True)}
    assert all(each.samples == 1 for each in faked.built)
    assert {each["section"] for each in done.info["statements"]} == {"2.3.1"}


def test_one_core_runs_one_thread(go, faked, monkeypatch):
    monkeypatch.setattr(techniques.os, "sched_getaffinity", lambda _: range(1))
    assert {row["threads"] for row in table(go(TECHNIQUES).path / "techniques.csv")} == {"1"}


def test_rays_from_a_lens_have_no_first_hits_by_rasterising():
    form = "watertight_safe", "float64"
    kinds = {
        name: {c.key["technique"] for c in techniques.cells(TECHNIQUES, reading.read(name), *form)}
        for name in ("matte", "lens")
    }
    assert "first_hit" in kinds["matte"] and "first_hit" not in kinds["lens"]


def test_pictures_with_many_shadow_rays_are_smaller():
    matte, penumbra = (reading.read(name) for name in ("matte", "penumbra"))
    assert techniques_scenes.size_of(matte, 256, 192, 1) == (256, 192)
    assert techniques_scenes.size_of(penumbra, 256, 192, 1) == (128, 96)
    assert techniques_scenes.size_of(penumbra, 128, 96, 1) == (128, 96)


def test_scenes_of_a_folder_follow(monkeypatch, tmp_path):
    for name in ("tetra", "gears", "other"):
        (tmp_path / f"{name}.nff").write_text("")
    monkeypatch.setenv(techniques_scenes.FOLDER, str(tmp_path))
    named = techniques_scenes.names(("matte",), spd=True)
    assert [techniques_scenes.spoken(name) for name in named] == ["matte", "gears", "tetra"]
    assert techniques_scenes.names(("matte",)) == ("matte",)
    assert techniques_scenes.spoken("scanned:1000") == "scanned:1000"


def ratio(value):
    random = np.random.default_rng(1)
    return Estimate(value, value * np.exp(random.normal(0, 0.01, RESAMPLES)), 5, 4.0)


SCENES = {  # primitives, area lights, secondary rays
    **{"ball": (8, 0, 0), "hall": (9, 0, 900), "soft": (7, 1, 0)},
    **{"mesh:20000": (20_000, 0, 0), "mesh:200000": (200_000, 0, 0)},
}


class Made:
    """A run in words: the ratios that are wanted."""

    groups = (("moller1", "float64"),)
    seed = 1

    def __init__(self, cache, first, primary=100, free_cores=True):
        self.free_cores = free_cores
        self.ratios = {"shadow_cache": cache, "first_hit": first}
        self.primary = primary
        self.facts = {
            name: {"primitives": primitives, "area_lights": area}
            for name, (primitives, area, _) in SCENES.items()
        }

    def scenes(self, group):
        return list(SCENES)

    def rays(self, group, scene):
        secondary = SCENES[scene][2]
        rest = {"shadow": 0, "refraction": 0, "indirect": 0}
        return {"primary": self.primary, "reflection": secondary, **rest}

    def faster(self, group, scene, technique, cpu=False):
        value = self.ratios[technique].get(scene)
        # Waiting for a core hides what a technique does.
        told = value if cpu or self.free_cores else 1.0
        return None if value is None else ratio(told)


def verdict(made, words):
    found = rows(techniques_statements.STATEMENTS, {techniques_statements.KEY: made})
    (row,) = (row for row in found if words in row["statement"])
    return row["verdict"]


@pytest.mark.parametrize(
    ("words", "cache", "first", "expected"),
    [
        ("very simple", {"ball": 1.5, "hall": 1.4}, {}, "confirmed"),
        ("very simple", {"ball": 0.7, "hall": 0.6, "soft": 3}, {}, "refuted"),
        ("very simple", {"ball": 1.0, "hall": 1.0}, {}, "not resolved"),
        ("area lights", {"soft": 0.8, "ball": 2}, {}, "confirmed"),
        ("area lights", {"soft": 1.3}, {}, "refuted"),
        ("area lights", {"ball": 1.3}, {}, "not resolved"),
        ("many and small", {"mesh:20000": 0.8, "mesh:200000": 0.8}, {}, "confirmed"),
        ("many and small", {"mesh:20000": 1.2, "mesh:200000": 1.2}, {}, "refuted"),
        ("saves little", {}, {"hall": 1.02}, "confirmed"),
        ("saves little", {}, {"hall": 1.5, "ball": 0.5}, "refuted"),
        ("ordinary tracing", {}, {"mesh:20000": 0.5, "mesh:200000": 0.5}, "confirmed"),
        ("ordinary tracing", {}, {"mesh:20000": 1.5, "mesh:200000": 1.5}, "refuted"),
    ],
)
def test_statements(words, cache, first, expected):
    assert verdict(Made(cache, first), words) == expected


def test_processor_time_decides_where_no_core_was_free():
    made = Made({"ball": 1.5, "hall": 1.4}, {}, free_cores=False)
    assert verdict(made, "very simple") == "confirmed"
    found = rows(techniques_statements.STATEMENTS, {techniques_statements.KEY: made})
    assert found[0]["number"].startswith("processor time without/with it 1.4")


def test_how_many_rays_are_primary():
    assert verdict(Made({}, {}, primary=100), "small part") == "confirmed"  # of 1000
    assert verdict(Made({}, {}, primary=900), "small part") == "refuted"  # of 1800


@pytest.mark.full
def test_corners_are_traced_and_no_more(nobody, tmp_path):
    """With tolerance 1 all cells are filled: rays go through corners alone."""
    done = run.start(WAYS, nobody(), tmp_path, "test")
    kept = table(done.path / "subsampling.csv")
    assert int(kept[0]["primary"]) == 32 * 24
    for row in kept[1:]:
        if float(row["tolerance"]) == 1:
            across, down = CORNERS[int(row["grid"].split("x")[0])]
            # Those on the right and lower rim are outside of the picture.
            assert int(row["primary"]) == across * down
            assert int(row["interpolated"]) == 32 * 24 - (across - 1) * (down - 1)
    for grid in ("4x4", "8x4"):
        same = [r for r in kept if (r["grid"], r["interpolation"]) == (grid, "nearest")]
        rays = [int(row["rays"]) for row in same]
        assert rays == sorted(rays, reverse=True)


@pytest.mark.full
def test_techniques_change_no_bit(nobody, tmp_path):
    scenes = ("mirrors", "scanned:1000")
    done = run.start(TECHNIQUES.changed(scenes=scenes), nobody(), tmp_path, "test")
    kept = table(done.path / "techniques.csv")
    assert {row["technique"] for row in kept} == {"none", "shadow_cache", "first_hit"}
    assert len({(row["scene"], row["picture"]) for row in kept}) == 2
