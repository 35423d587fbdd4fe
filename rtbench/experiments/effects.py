"""What a tracer saves that simulates only the effects a scene calls for.

Each scene is traced by a tracer of its own, by ones compiled with all optical effects, with all
that the inner loop can ask (kinds of primitives, motion), and with everything; by one from sources
without the blocks of absent effects; and step by step, from primary rays and Lambert's law alone to
all its effects. All but the steps must give the same picture, bit for bit. In several fresh
processes, for code placement differs between them, in interleaved rounds.
"""

from __future__ import annotations

from types import SimpleNamespace

from rtbench.errors import WrongAnswers
from rtbench.experiments import effects_tracers
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.effects_tracers import DELETED, PROOF, SPECIALISED
from rtbench.experiments.tree_session import Asked, Share, compile_all
from rtbench.measure.schedule import order
from rtbench.records import schema, tabular
from rtbench.records.writer import RunWriter
from rtbench.scenes import reading
from rtbench.tracer import effects

CELL = ("kernel", "precision", "scene", "tracer")
MODULE = "rtbench.experiments.effects_worker"
PROCESSES, ROUNDS = 3, 3
SAMPLE_NS = 60_000_000  # a picture that is traced faster is traced several times
MOST_REPETITIONS = 32
PICTURE = 0.25  # s, before any is measured


def plan(config: Config) -> tuple[int, int]:
    """Return how many processes and rounds there are."""
    return config.processes or PROCESSES, config.samples or ROUNDS


def build(bench: Bench) -> None:
    """Read the scenes, and compile all tracers of each."""
    config = bench.config
    parts = tuple(config.parts)
    effects_tracers.check(parts)
    facts = bench.facts["scenes"] = []
    bench.scenes = []
    wanted: dict[str, dict] = {}
    for name in config.scenes or reading.names():
        bench.say(f"reading scene {name}")
        scene = effects_tracers.scene_of(name, config.width, config.height)
        camera, why = scene.camera, effects.called_for(scene)
        inside = effects_tracers.called(scene)
        told = {"name": name, "width": camera.width, "height": camera.height}
        facts.append(
            {"scene": name, "width": camera.width, "height": camera.height}
            | {"samples": scene.settings.samples, "objects": len(scene.objects)}
            | {"effects": {key: why[key] for key in inside}, "steps": effects_tracers.steps(inside)}
        )
        bench.remarks += [f"{name}: {each}" for each in scene.remarks]
        tracers = effects_tracers.tracers(scene, parts)
        bench.scenes.append(SimpleNamespace(name=name, told=told, tracers=tracers))
        for kernel in bench.kernels:
            for precision in config.precisions:
                for tracer in tracers:
                    how = effects_tracers.options_of(tracer, inside, kernel.name, precision)
                    each = {"do": "compile", "scene": told, "tracer": tracer, "code": False}
                    each |= {"kernel": kernel.name, "precision": precision}
                    key = effects_tracers.code_key(scene, tracer, how)
                    known = wanted.setdefault(key, each)
                    known["code"] |= PROOF in parts and tracer in (SPECIALISED, DELETED)
    compile_all(list(wanted.values()), tuple(config.kernels), bench.say, MODULE)
    bench.tables[schema.EFFECTS] = []


def describe(bench: Bench, processes: int, rounds: int) -> str:
    """Return a line that says what is going to be measured."""
    cells = sum(len(_cells(bench, scene)) for scene in bench.scenes)
    seconds = processes * sum(_expected(bench, rounds).values())
    return (
        f"{cells} tracers of {len(bench.scenes)} scenes in {processes} processes x {rounds} "
        f"rounds, about {seconds:.0f} s"
    )


def _cells(bench: Bench, scene: SimpleNamespace) -> list[dict]:
    return [
        {"tracer": tracer, "kernel": kernel.name, "precision": precision}
        for kernel in bench.kernels
        for precision in bench.config.precisions
        for tracer in scene.tracers
    ]


def _expected(bench: Bench, rounds: int) -> dict[tuple[str, object], float]:
    """Return how many seconds each part of a process is expected to take."""
    found: dict[tuple[str, object], float] = {}
    for scene in bench.scenes:
        seconds = len(_cells(bench, scene)) * PICTURE
        found[scene.name, "check"] = 2 * seconds
        for turn in range(rounds):
            found[scene.name, turn] = seconds
    return found


def measure(bench: Bench, writer: RunWriter, watcher) -> None:
    """Trace, compare and time everything; rows and tables are written as they come."""
    told = writer.info["plan"]
    processes, rounds = told["processes"], told["rounds"]
    watcher.plan("\n".join([describe(bench, processes, rounds), *writer.info["remarks"]]))
    share = Share(_expected(bench, rounds), processes, watcher.progress)
    known: dict[tuple, str] = {}
    for process in range(processes):
        worker = Asked(told["cpu"], tuple(bench.config.kernels), MODULE)
        try:
            for scene in bench.scenes:
                cells = _cells(bench, scene)
                found = _check(bench, scene, cells, worker, process, known, share)
                share.done((scene.name, "check"))
                worker.ask("ready")
                for turn in range(rounds):
                    places = order(bench.config.seed, process, turn, len(cells))
                    rows = []
                    for position, i in enumerate(places):
                        row = _timed(scene, cells[i], i, found[i], worker, known)
                        place = {"process": process, "launch": 0, "round": turn}
                        rows.append(row | place | {"position": position})
                        share.still()
                    writer.append(rows)
                    share.done((scene.name, turn))
                for name, table in bench.tables.items():
                    tabular.write(writer.path / name, tabular.frame(table, schema.TABLES[name]))
        finally:
            worker.close()


def _check(bench, scene, cells, worker, process, known, share) -> list[dict]:
    """Trace each picture, compare it, and in the first process note what it is."""
    worker.ask("scene", **scene.told)
    answers = []
    for i, cell in enumerate(cells):
        found = worker.ask("tracer", **cell)
        _must_agree(scene, cell, found["digest"], known)
        if process == 0:
            more = {}
            if PROOF in bench.config.parts and cell["tracer"] in (SPECIALISED, DELETED):
                more = worker.ask("code", number=i)
            rays = {f"rays_{kind}": count for kind, count in found["rays"].items()}
            seen = {"width": scene.told["width"], "height": scene.told["height"]}
            row = cell | {"scene": scene.name, "picture": found["digest"]} | seen | rays | more
            bench.tables[schema.EFFECTS].append(row)
        answers.append(found)
        share.still()
    return answers


def _must_agree(scene, cell, digest: str, known: dict[tuple, str]) -> None:
    """Raise WrongAnswers for a picture that differs from that of the scene's own tracer."""
    tracer = cell["tracer"]
    own = tracer if effects_tracers.is_step(tracer) else SPECIALISED
    key = scene.name, cell["kernel"], cell["precision"], own
    if known.setdefault(key, digest) != digest:
        raise WrongAnswers(
            f"the picture of {scene.name} by the tracer {tracer} ({cell['kernel']} in "
            f"{cell['precision']}) is not, bit for bit, that of the tracer {own}"
        )


def _timed(scene, cell, number, found, worker, known) -> dict:
    repetitions = min(MOST_REPETITIONS, max(1, SAMPLE_NS // max(1, found["ns"])))
    told = worker.ask("time", number=number, repetitions=repetitions)
    _must_agree(scene, cell, told["digest"], known)
    pixels = scene.told["width"] * scene.told["height"]
    return cell | {
        "scene": scene.name,
        "triangles": pixels,
        "repetitions": repetitions,
        "tests": pixels * repetitions,
        "ns": told["ns"],
        "cpu_ns": told["cpu_ns"],
    }
