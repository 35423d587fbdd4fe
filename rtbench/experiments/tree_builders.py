"""How long trees take to build over the number of triangles, builder by builder.

Generated models are made in each size; of a file's triangles the first so many in Morton order are
taken, so that each size is a part of the surface. The builders of the exact SAH must give the same
tree. Memory at the peak is that of the process while it builds, less what it held before.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from rtbench.errors import WrongAnswers
from rtbench.experiments import tree_models
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.tree_cells import cost_options, variants
from rtbench.experiments.tree_config import BVH, MEDIANS
from rtbench.experiments.tree_session import Asked, Share, compile_all
from rtbench.records import schema, tabular
from rtbench.records.writer import RunWriter
from rtbench.trees import leaves, ways
from rtbench.trees.options import Options
from rtbench.workloads.generated_models import MODELS as GENERATED
from rtbench.workloads.generated_models import find_model
from rtbench.workloads.meshes import Mesh

CELL = ("builder", "rule", "axes", "candidates", "overlap", "model", "triangles")
EXACT = ("n2", "nlog2n", "nlogn")
MOST_N2 = 20_000  # triangles: 2 s
ONCE = 200_000  # triangles: above, one process builds them, and only the plain variant
SIZES = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
LEAST_FOR_MEMORY = 30_000  # triangles
SEVERAL = 30_000  # triangles: up to so many are built ROUNDS times
PROCESSES, ROUNDS = 2, 3
SECONDS = {"n2": 0.0, BVH: 1.2e-6, "object_median": 4e-6, "spatial_median": 3e-6, "binned": 3e-6}


@dataclass(frozen=True)
class Task:
    """A tree to be built again and again: its name in the records, its options."""

    builder: str
    options: Options

    @property
    def key(self) -> dict[str, str]:
        """What names it in the records."""
        told = self.options
        plain = {"axes": told.axes, "candidates": told.candidates, "overlap": told.overlap}
        if self.builder == BVH:
            plain = dict.fromkeys(plain, "")
        elif self.builder in MEDIANS:
            plain["candidates"] = ""
        return {"builder": self.builder, "rule": told.rule} | plain

    def seconds(self, triangles: int) -> float:
        """Return about how long it takes, before it is measured."""
        if self.builder == "n2":
            return 5e-9 * triangles**2
        return triangles * SECONDS.get(self.builder, 7e-6) + 0.05


def plan(config: Config) -> tuple[int, int]:
    """Return how many processes and rounds there are; rounds of the smaller sizes."""
    return config.processes or PROCESSES, config.samples or ROUNDS


def tasks(config: Config) -> list[Task]:
    """Return all builders and, of the first exact one, the variants."""
    told = cost_options(config, None) | {"ending": config.endings[0]}
    base = {"axes": config.axes[0], "candidates": config.candidates[0]}
    base |= {"overlap": config.overlaps[0]}
    varied = next((each for each in ("nlogn", "nlog2n") if each in config.builders), None)
    found = []
    for builder in config.builders:
        if builder == BVH:
            found.append(Task(BVH, ways.options(leaves.IN_BLOCKS, structure=BVH)))
        elif builder in MEDIANS:
            own = told | {"rule": builder, "axes": config.median_axes}
            own["overlap"] = config.overlaps[0]
            found.append(Task(builder, ways.options(leaves.ONE_BY_ONE, **own)))
        else:
            for axes, candidates, overlap in variants(config, builder == varied):
                own = base | {"axes": axes, "candidates": candidates, "overlap": overlap}
                own |= told | {"builder": builder}
                found.append(Task(builder, ways.options(leaves.ONE_BY_ONE, **own)))
    return found


def build(bench: Bench) -> None:
    """Compile every builder."""
    config = bench.config
    wanted: dict[str, dict] = {}
    for task in tasks(config):
        asked = {"do": "compile_builder", "options": task.options.__dict__}
        wanted.setdefault(str(task.key), asked)
    if "n2" in config.builders:
        bench.remarks.append(f"builder n2 is asked for up to {MOST_N2:,} triangles")
    tree_models.names(config)  # says at once what is not there
    compile_all(list(wanted.values()), (), bench.say)
    bench.facts["models"] = []
    bench.tables[schema.BUILDS] = []


def measure(bench: Bench, writer: RunWriter, watcher) -> None:
    """Build trees in every size, builders in an order that changes from round to round."""
    config, told = bench.config, writer.info["plan"]
    processes, rounds = told["processes"], told["rounds"]
    jobs = _jobs(config)
    whole = tasks(config)
    expected = {
        (name, size, process, turn): sum(t.seconds(size) for t in _fit(whole, size)) + 0.2
        for process in range(processes)
        for name, size in jobs
        for turn in range(_rounds(size, process, rounds))
    }
    remarks = writer.info["remarks"]
    text = f"{len(whole)} builders over {len(jobs)} models, about {sum(expected.values()):.0f} s"
    watcher.plan("\n".join([text, *remarks]))
    share = Share(expected, 1, watcher.progress)
    digests: dict[tuple, tuple[str, str]] = {}
    for process in range(processes):
        worker = Asked(told["cpu"], ())
        try:
            for name, size in jobs:
                if not _rounds(size, process, rounds):
                    continue
                watcher.say(f"{name}, {size:,} triangles")
                mesh, label = _cut(name, size, config)
                _give(bench, worker, mesh, f"{label}|{size}")
                fact = {"model": label, "triangles": len(mesh.faces)}
                if fact not in bench.facts["models"]:
                    bench.facts["models"].append(fact)
                for turn in range(_rounds(size, process, rounds)):
                    _round(bench, worker, share, watcher, whole, fact, (process, turn), digests)
                    share.done((name, size, process, turn))
                name_of = schema.BUILDS
                rows = bench.tables[name_of]
                table = tabular.frame(rows, schema.TABLES[name_of])
                tabular.write(writer.path / name_of, table)
        finally:
            worker.close()
    writer.update(models=bench.facts["models"])


def _jobs(config: Config) -> list[tuple[str, int]]:
    sizes = sorted(config.sizes or SIZES)
    found = []
    for name in tree_models.names(config):
        there = None if name.partition(":")[0] in GENERATED else len(_mesh(name, config).faces)
        fit = [size for size in sizes if there is None or size < there]
        if there is not None and there <= sizes[-1]:
            fit.append(there)
        found += [(name, size) for size in fit]
    return found


def _rounds(size: int, process: int, rounds: int) -> int:
    if size > ONCE and process > 0:
        return 0
    return rounds if size <= SEVERAL else 1


def _fit(whole: list[Task], size: int) -> list[Task]:
    """Return what is built in a size: of large ones no variants, n2 of small ones only."""
    found, seen = [], set()
    for task in whole:
        too_slow = task.builder == "n2" and size > MOST_N2
        variant = task.builder in seen
        if not (too_slow or (variant and size > ONCE)):
            found.append(task)
        seen.add(task.builder)
    return found


_MESHES: dict[str, Mesh] = {}


def _mesh(name: str, config: Config) -> Mesh:
    """Return a file's mesh, its triangles in Morton order, kept."""
    if name not in _MESHES:
        mesh = tree_models.mesh_of(name, config)
        order = morton_order(mesh.triangles.mean(axis=1))
        _MESHES[name] = Mesh(mesh.name, mesh.vertices, mesh.faces[order], mesh.centre)
    return _MESHES[name]


def _cut(name: str, size: int, config: Config) -> tuple[Mesh, str]:
    kind = name.partition(":")[0]
    if kind in GENERATED:
        return find_model(f"{kind}:{size}"), kind
    mesh = _mesh(name, config)
    part = Mesh(mesh.name, mesh.vertices, mesh.faces[:size], mesh.centre)
    return part, part.name


def _give(bench: Bench, worker: Asked, mesh: Mesh, label: str) -> None:
    """Let a worker have a mesh; its files are gone then."""
    parts = {"vertices": mesh.vertices.astype(np.float32), "faces": mesh.faces.astype(np.int32)}
    paths = {
        name: bench.arrays.paths[
            bench.arrays.add(f"{label}|{name}|{len(bench.arrays.paths)}", values)
        ]
        for name, values in parts.items()
    }
    worker.ask("model", **paths, rays={}, light=[0.0, 0.0, 0.0], width=1, height=1)
    for path in paths.values():
        os.truncate(path, 0)


def _round(bench, worker, share, watcher, whole, fact, turn, digests) -> None:
    rows, size = bench.tables[schema.BUILDS], fact["triangles"]
    fit = _fit(whole, size)
    random = np.random.default_rng([bench.config.seed, size, *turn])
    for place in random.permutation(len(fit)).tolist():
        task = fit[place]
        watcher.say(f"{fact['model']}, {size:,} triangles: {task.builder}")
        share.still()
        found = worker.ask("build_once", options=task.options.__dict__, judged=turn == (0, 0))
        key = task.key
        same = (fact["model"], size, *(key[name] for name in ("axes", "candidates", "overlap")))
        same += ("exact",) if task.builder in EXACT else (task.builder,)
        known = digests.setdefault(same, (found["digest"], task.builder))
        if known[0] != found["digest"]:
            raise WrongAnswers(
                f"builders {known[1]} and {task.builder} give different trees over {size} "
                f"triangles of {fact['model']}: {known[0]}, {found['digest']}"
            )
        if size < LEAST_FOR_MEMORY:  # what is left over from before is as much
            found["peak_bytes"] = None
        rows.append(key | fact | {"process": turn[0]} | found)


def morton_order(points: np.ndarray) -> np.ndarray:
    """Return the order of points (N, 3) along Morton's curve, with 21 bits an axis."""
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    cells = ((points - low) / np.where(size > 0, size, 1) * (2**21 - 1)).astype(np.uint64)
    code = np.zeros(len(points), np.uint64)
    for axis in range(3):
        code |= _spread(cells[:, axis]) << np.uint64(axis)
    return np.argsort(code, kind="stable")


def _spread(bits: np.ndarray) -> np.ndarray:
    """Return numbers of 21 bits with two zeros after each bit."""
    for shift, mask in (
        *((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F)),
        *((4, 0x10C30C30C30C30C3), (2, 0x1249249249249249)),
    ):
        bits = (bits | bits << np.uint64(shift)) & np.uint64(mask)
    return bits
