"""Trees over models: how long they take to build, what rays meet in them, how fast they are traced.

Model by model, in several fresh processes, each of which builds every tree itself. Every walk's
answers are compared: all trees and ways of a kernel in a precision give the same, bit for bit, and
brute force gives it too, over a sample. Then all cells of a model are timed in interleaved rounds;
other libraries are cells among them.
"""

from __future__ import annotations

from types import SimpleNamespace

from rtbench.experiments import tree_cells, tree_models
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.peers import absence, find
from rtbench.experiments.tree_cells import Walk
from rtbench.experiments.tree_config import MEASURED
from rtbench.experiments.tree_rounds import OverModel
from rtbench.experiments.tree_session import Asked, Share, compile_all
from rtbench.records import schema, tabular
from rtbench.records.writer import RunWriter

CELL = ("kernel", "precision", "model", "structure", "rule", "builder", "ending", "way", "rays")
PROCESSES, ROUNDS = 3, 3
# Before anything is measured; seconds a triangle of a build, and a ray and pass.
BUILD, RAY = 3e-6, 3e-7
COST_TRIANGLES = 20_000


def plan(config: Config) -> tuple[int, int]:
    """Return how many processes and rounds there are."""
    return config.processes or PROCESSES, config.samples or ROUNDS


def build(bench: Bench) -> None:
    """Load models, draw rays, and compile all that will be run."""
    config = bench.config
    facts = bench.facts["models"] = []
    scenes = bench.scenes = []
    names = tree_models.names(config)
    for name in names:
        bench.say(f"model {name}: rays")
        model = tree_models.load(name, config, bench.arrays)
        facts.append(model.facts)
        bench.remarks += [each for each in model.remarks if each not in bench.remarks]
        scenes.append(SimpleNamespace(model=model))
    bench.peers = _peers(bench)
    kernels = tuple(config.kernels)
    wanted: dict[str, dict] = {}
    costs = None
    if config.costs == MEASURED:
        costs = bench.facts["costs"] = _costs(bench)
    for scene in scenes:
        made, walks, remarks = tree_cells.plan(config, bench.kernels, scene.model.triangles, costs)
        scene.trees = made
        scene.walks = [walk for walk in walks if walk.rays in scene.model.ray_sets]
        bench.remarks += [each for each in remarks if each not in bench.remarks]
        if "shadow" in scene.model.ray_sets:
            first = scene.walks[0]
            scene.walks_for_shadow = Walk(
                first.kernel, first.precision, first.tree, first.way, "primary"
            )
        for each in tree_cells.to_compile(made, scene.walks, config.judged > 0):
            wanted.setdefault(str(each), {"do": "compile"} | each)
        for tree in made:
            told = tree.told | {"max_leaf": 1, "traversal_cost": 1.0, "intersection_cost": 1.0}
            told |= {"ending": "both", "block": 1, "max_depth": None}
            wanted.setdefault(str(told), {"do": "compile_builder", "options": told})
        if "shadow" in scene.model.ray_sets:
            one = scene.walks_for_shadow
            each = {"kernel": one.kernel, "precision": one.precision, "way": one.way}
            each |= {"query": tree_cells.NEAREST, "counted": False}
            wanted.setdefault(str(each), {"do": "compile"} | each)
    compile_all(list(wanted.values()), kernels, bench.say)
    bench.tables[schema.TREES] = []
    bench.tables[schema.VISITS] = []


def _costs(bench: Bench) -> dict:
    """Return K_T and K_I of the first kernel as measured here."""
    kernel, precision = bench.kernels[0], bench.config.precisions[0]
    bench.say(f"measuring what a step and a test of {kernel.name} cost")
    worker = Asked(None, tuple(bench.config.kernels))
    try:
        return worker.ask(
            "costs", kernel=kernel.name, precision=precision, triangles=COST_TRIANGLES
        )
    finally:
        worker.close()


def _peers(bench: Bench) -> list[str]:
    """Return the peers that are there; the records name the others too."""
    found, facts = [], bench.facts.setdefault("peers", [])
    for name in bench.config.peers:
        peer, why = find(name), absence(find(name))
        told = {"name": name, "title": peer.title, "absent": why}
        if why is None:
            told["version"] = peer.version
            found.append(name)
        facts.append(told)
    absent = [f"{told['name']} ({told['absent']})" for told in facts if told["absent"]]
    if absent:
        bench.remarks.append(f"peers not asked: {'; '.join(absent)}")
    return found


def describe(bench: Bench, processes: int, rounds: int) -> str:
    """Return a line that says what is going to be measured."""
    cells = sum(len(scene.walks) for scene in bench.scenes)
    seconds = processes * sum(_expected(bench, rounds).values())
    return (
        f"{cells} cells over {len(bench.scenes)} models in {processes} processes x {rounds} "
        f"rounds, about {seconds:.0f} s"
    )


def _expected(bench: Bench, rounds: int) -> dict[tuple[str, str], float]:
    """Return how many seconds each part of a process is expected to take."""
    config, found = bench.config, {}
    for scene in bench.scenes:
        name = scene.model.name
        rays = max(config.width * config.height, config.rays)
        found[name, "build"] = 1.0 + len(scene.trees) * scene.model.triangles * BUILD
        found[name, "check"] = (len(scene.walks) + len(scene.trees)) * rays * RAY
        for turn in range(rounds):
            found[name, turn] = len(scene.walks) * rays * RAY * 1.2
    return found


def measure(bench: Bench, writer: RunWriter, watcher) -> None:
    """Build, check and time everything; rows and tables are written as they come."""
    told = writer.info["plan"]
    processes, rounds = told["processes"], told["rounds"]
    watcher.plan("\n".join([describe(bench, processes, rounds), *writer.info["remarks"]]))
    share = Share(_expected(bench, rounds), processes, watcher.progress)
    for process in range(processes):
        worker = Asked(told["cpu"], tuple(bench.config.kernels))
        try:
            for scene in bench.scenes:
                OverModel(bench, scene, worker, process, writer, watcher, share).run(rounds)
                for name, rows in bench.tables.items():
                    tabular.write(writer.path / name, tabular.frame(rows, schema.TABLES[name]))
        finally:
            worker.close()
    told = {
        name: bench.facts[name] for name in ("peer_answers", "leaf_sizes") if name in bench.facts
    }
    writer.update(**told)
