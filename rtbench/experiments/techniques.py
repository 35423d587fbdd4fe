"""What the shadow cache and first hits by rasterising save, scene by scene, and a second thread.

Each technique is alone beside ordinary tracing, by one ray through the middle of each pixel, in
interleaved rounds. None may change a bit of the picture.

Source: Šilhavý 2010, section 2.3.1.
"""

from __future__ import annotations

import os

from rtbench.errors import RtbenchError, WrongAnswers, unknown
from rtbench.experiments import techniques_rounds, techniques_scenes, techniques_statements
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.techniques_rounds import Cell, Traced
from rtbench.records import schema
from rtbench.records.run import Run
from rtbench.records.writer import RunWriter
from rtbench.scenes.model import Scene
from rtbench.tracer import effects

CELL = ("kernel", "precision", "scene", "technique", "threads")
PROCESSES, ROUNDS = 5, 4
SAMPLES = 1  # rays a pixel: first hits are for the ray through the middle
NONE, CACHE, FIRST_HIT = "none", "shadow_cache", "first_hit"
OPTIONS = {
    NONE: {"shadow_cache": False},
    CACHE: {"shadow_cache": True},
    FIRST_HIT: {"shadow_cache": False, "first_hit": True},
}
# Rays that do not go through the middles of pixels, or meet what has moved.
ASIDE = ("depth_of_field", "motion_blur")


def plan(config: Config) -> tuple[int, int]:
    """Return how many processes and rounds there are."""
    return config.processes or PROCESSES, config.samples or ROUNDS


def check(config: Config) -> None:
    """Raise RtbenchError for an unknown technique."""
    for each in config.techniques:
        if each not in OPTIONS:
            raise RtbenchError(unknown("technique", each, OPTIONS))


def cells(config: Config, scene: Scene, kernel: str, precision: str) -> list[Cell]:
    """Return the cells of a scene: ordinary tracing, what it can use, and more threads."""
    called = effects.called_for(scene)
    form = {"kernel": kernel, "precision": precision}
    there = [NONE]
    if CACHE in config.techniques and called["shadows"]:
        there.append(CACHE)
    if FIRST_HIT in config.techniques and not any(called[each] for each in ASIDE):
        there.append(FIRST_HIT)
    # Two threads on one core say nothing.
    cores = len(os.sched_getaffinity(0))
    found = []
    for technique in there:
        last = technique == (CACHE if CACHE in there else NONE)
        for threads in config.threads if last else (1,):
            if threads <= cores:
                key = form | {"technique": technique, "threads": threads}
                options = form | OPTIONS[technique] | {"samples": SAMPLES}
                found.append(Cell(key, options, threads))
    return found


def build(bench: Bench) -> None:
    """Read the scenes, and compile each technique for each."""
    config = bench.config
    check(config)
    names = techniques_scenes.names(config.scenes, spd=True)
    techniques_rounds.prepare(
        bench,
        names,
        SAMPLES,
        lambda scene, kernel, precision: cells(config, scene, kernel, precision),
    )
    bench.tables[schema.TECHNIQUES] = []


def measure(bench: Bench, writer: RunWriter, watcher) -> None:
    """Trace, compare and time everything; rows and tables are written as they come."""
    ordinary: dict[tuple, str] = {}

    def keep(scene: Traced, cell: Cell, answer: dict) -> None:
        form = scene.name, cell.key["kernel"], cell.key["precision"]
        if ordinary.setdefault(form, answer["digest"]) != answer["digest"]:
            raise WrongAnswers(
                f"the picture of {scene.name} by {cell.key['technique']} in {cell.threads} "
                f"threads ({form[1]} in {form[2]}) is not, bit for bit, that of ordinary tracing"
            )
        row = cell.key | {"scene": scene.name, "picture": answer["digest"]}
        row |= {"width": scene.told["width"], "height": scene.told["height"]}
        row |= {f"rays_{kind}": count for kind, count in answer["rays"].items()}
        bench.tables[schema.TECHNIQUES].append(row)

    techniques_rounds.measure(bench, writer, watcher, keep)


def conclude(run: Run) -> dict:
    """Return what the thesis states of these techniques, and what became of it here."""
    return {"statements": techniques_statements.judged(run)}
