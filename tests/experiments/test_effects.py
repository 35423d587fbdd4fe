"""The experiment of effects: which tracers, at which size, and what its records keep."""

import csv
import math
from types import SimpleNamespace

import numpy as np
import pytest

from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.experiments import effects, effects_tracers, effects_worker
from rtbench.experiments.config import Config, find
from rtbench.records import schema
from rtbench.records.store import load_run
from rtbench.scenes import reading
from rtbench.tracer.effects import EFFECTS, compiled
from rtbench.tracer.options import KINDS

GLASS_EFFECTS = ("shadows", "reflection", "refraction", "specular", "texture", "antialiasing")
TINY = Config(
    name="tiny",
    experiment="effects",
    kernels=("watertight_safe",),
    precisions=("float64",),
    scenes=("matte", "glass"),
    width=40,
    height=30,
    processes=2,
    samples=2,
)


@pytest.fixture
def told(monkeypatch):
    """Let workers be called in this process, and pictures be grey: the tracer is not asked.

    ``told.wrong``: the tracer and process whose picture is darker; ``told.asked``: all options.
    """
    told = SimpleNamespace(wrong=None, asked=[], process=-1, compiled=[])

    class Renderer:
        def __init__(self, scene, options):
            self.scene, self.options = scene, options
            self.inside = compiled(scene, options.without, options.force)
            self.seconds = {"compile": 1.0}
            self.instance = options
            told.asked.append((scene.name, options))

        def render(self):
            camera = self.scene.camera
            shade = 1.0 - sum(self.inside[name] for name in self.options.without) / 100
            if not self.options.without:
                shade = 0.5
            if told.wrong and told.wrong(self.options, told.process):
                shade = math.nextafter(0.5, 1)
            pixels = np.full((camera.height, camera.width, 3), shade)
            count = camera.width * camera.height
            return SimpleNamespace(pixels=pixels, rays={"primary": count, "shadow": 7})

    class Code(SimpleNamespace):
        pass

    class Asked:
        def __init__(self, cpu, kernels, module=None):
            told.process += 1
            self.place = effects_worker.Place()
            self.ask("start", cpu=cpu, kernels=list(kernels))

        def ask(self, do, **more):
            return getattr(self.place, do)(**more)

        def close(self):
            pass

    def code_of(instance):
        refracts = "refraction" not in instance.without and told.asked[-1][0] == "glass"
        functions = ("fresnel", "radiance") if refracts else ("radiance",)
        return Code(digest="abc", instructions=123, functions=functions)

    monkeypatch.setattr(effects, "Asked", Asked)
    monkeypatch.setattr(effects, "compile_all", lambda wanted, *more: told.compiled.extend(wanted))
    monkeypatch.setattr(effects_worker, "Renderer", Renderer)
    monkeypatch.setattr(effects_worker, "Deleted", Renderer)
    monkeypatch.setattr(effects_worker, "code_of", code_of)
    monkeypatch.setattr(effects, "SAMPLE_NS", 1)
    return told


def test_steps_are_in_the_order_of_the_effects_and_end_at_the_scene_s_own():
    scene = reading.read("glass")
    inside = effects_tracers.called(scene)
    assert inside == GLASS_EFFECTS
    steps = effects_tracers.steps(inside)
    assert steps == ["plain", *(f"+{name}" for name in GLASS_EFFECTS)]
    before = set()
    for step in steps:
        options = effects_tracers.options_of(step, inside, "moller1", "float32")
        flags = compiled(scene, options.without, options.force)
        now = {name for name, there in flags.items() if there}
        assert now == before | ({step[1:]} if step != "plain" else set())
        assert (options.kernel, options.precision, options.kinds) == ("moller1", "float32", ())
        before = now
    assert before == set(GLASS_EFFECTS)


@pytest.mark.parametrize("name", reading.names())
def test_every_step_of_every_scene_adds_one_effect(name):
    scene = reading.read(name)
    inside = effects_tracers.called(scene)
    sizes = []
    for step in effects_tracers.steps(inside):
        options = effects_tracers.options_of(step, inside, "moller1", "float64")
        sizes.append(sum(compiled(scene, options.without).values()))
    assert sizes == list(range(len(inside) + 1))


def test_what_is_compiled_in_beyond_the_scene():
    told = {
        tracer: effects_tracers.options_of(tracer, ("shadows",), "moller1", "float64")
        for tracer in ("specialised", "optical", "inner_loop", "everything", "deleted")
    }
    found = {tracer: (len(o.force), o.kinds, o.without) for tracer, o in told.items()}
    every = len(EFFECTS)
    assert found == {
        "specialised": (0, (), ()),
        "optical": (every, (), ()),
        "inner_loop": (0, KINDS, ()),
        "everything": (every, KINDS, ()),
        "deleted": (0, (), ()),
    }


def test_scenes_with_many_rays_a_pixel_have_fewer_pixels():
    matte = effects_tracers.scene_of("matte", 256, 192).camera
    assert (matte.width, matte.height) == (256, 192)  # 1 sample, 2 lights
    # 36 samples, each with one shadow ray: 72 rays a pixel, and 16 are allowed.
    motion = effects_tracers.scene_of("motion", 256, 192).camera
    assert (motion.width, motion.height) == (int(256 / 4.5**0.5), int(192 / 4.5**0.5))
    tiny = effects_tracers.scene_of("room", 20, 12).camera
    assert (tiny.width, tiny.height) == (16, 12)


def test_bad_input(told, go):
    for changes, words in (
        ({"parts": ("step",)}, "unknown part 'step'"),
        ({"scenes": ("glas",)}, "glass"),
        ({"precisions": ("mixed",)}, "unknown precision 'mixed'"),
    ):
        with pytest.raises(RtbenchError, match=words):
            go(TINY, **changes)


def test_the_shipped_config_and_its_quick_form():
    config = find("effects")
    assert config.experiment == "effects" and config.scenes == ()
    assert config.parts == ("tracers", "steps", "proof")
    quick = config.quick()
    assert (quick.processes, quick.parts) == (1, ("tracers",))


def test_everything_is_compiled_once_for_all_scenes(told, go):
    go(TINY)
    every = [each for each in told.compiled if each["tracer"] == "everything"]
    assert len(every) == 1
    again = [str(each) for each in told.compiled]
    assert len(again) == len(set(again)) == 5 + 1 + 5 + 6 - 1
    kept = {(each["scene"]["name"], each["tracer"]) for each in told.compiled if each["code"]}
    assert kept == {(s, t) for s in ("matte", "glass") for t in ("specialised", "deleted")}


def test_what_the_records_keep(told, go, table):
    done = go(TINY)
    assert done.info["cell"] == ["kernel", "precision", "scene", "tracer"]
    scenes = {fact["scene"]: fact for fact in done.info["scenes"]}
    assert list(scenes) == ["matte", "glass"]
    assert list(scenes["glass"]["effects"]) == list(GLASS_EFFECTS)
    assert "casts shadows" in scenes["matte"]["effects"]["shadows"]
    samples = table(done, schema.SAMPLES)
    tracers = {"specialised", "optical", "inner_loop", "everything", "deleted", "plain"}
    wanted = {("matte", tracer) for tracer in tracers}
    wanted |= {("glass", tracer) for tracer in tracers}
    wanted |= {("glass", f"+{name}") for name in GLASS_EFFECTS[:-1]}
    turns = {}
    for row in samples:
        turns.setdefault((row["scene"], row["tracer"]), []).append((row["process"], row["round"]))
        size = scenes[row["scene"]]
        pixels = size["width"] * size["height"]
        assert int(row["tests"]) == int(row["repetitions"]) * pixels
    assert set(turns) == wanted
    assert {tuple(sorted(each)) for each in turns.values()} == {
        (("0", "0"), ("0", "1"), ("1", "0"), ("1", "1"))
    }
    rows = {(row["scene"], row["tracer"]): row for row in table(done, schema.EFFECTS)}
    assert set(rows) == wanted
    assert rows["glass", "specialised"]["rays_shadow"] == "7"
    assert len({rows["glass", t]["picture"] for t in tracers - {"plain"}}) == 1
    assert rows["glass", "plain"]["picture"] != rows["glass", "specialised"]["picture"]
    assert rows["glass", "deleted"]["functions"] == "fresnel radiance"
    assert rows["matte", "specialised"]["functions"] == "radiance"
    assert rows["matte", "optical"]["code"] == ""
    again = load_run(done.path)
    assert len(again.effects) == len(wanted) and len(again.summary) == len(wanted)


@pytest.mark.parametrize("process", [0, 1])
@pytest.mark.parametrize("field", ["force", "kinds"])
def test_a_picture_that_differs_in_one_bit_ends_the_run(told, go, process, field):
    told.wrong = lambda options, now: now == process and getattr(options, field)
    with pytest.raises(WrongAnswers, match="the picture of matte by the tracer") as ended:
        go(TINY, parts=("tracers",))
    assert ended.value.exit_code == 4


@pytest.mark.full
def test_a_real_run(go, table):
    done = go(TINY, scenes=("lens",), processes=1, samples=1)
    rows = {row["tracer"]: row for row in table(done, schema.EFFECTS)}
    own = rows["specialised"]
    for tracer in ("optical", "inner_loop", "everything", "deleted"):
        assert rows[tracer]["picture"] == own["picture"]
    assert rows["deleted"]["code"] == own["code"] != ""
    assert not {"refracted", "fresnel"} & set(own["functions"].split())
    with open(done.path / schema.SAMPLES, encoding="utf-8") as file:
        assert all(int(row["cpu_ns"]) > 0 for row in csv.DictReader(file))
