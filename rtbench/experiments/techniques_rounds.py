"""Techniques timed: in fresh processes, in interleaved rounds, every picture compared.

A cell is a way to trace a scene: what samples.csv says of it, the tracer's options, and threads.
Code placement differs between processes, hence several; within a round the order is shuffled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from rtbench.errors import WrongAnswers
from rtbench.experiments import techniques_scenes
from rtbench.experiments.bench import Bench
from rtbench.experiments.tree_session import Asked, Share, compile_all
from rtbench.measure.schedule import order
from rtbench.records import schema, tabular
from rtbench.records.writer import RunWriter
from rtbench.scenes.model import Scene

MODULE = "rtbench.experiments.techniques_worker"
SAMPLE_NS = 25_000_000  # a picture that is traced faster is traced several times
MOST_REPETITIONS = 32
PICTURE = 0.1  # s, before any is measured


@dataclass
class Cell:
    """A way to trace a scene.

    Attributes
    ----------
    key : dict
        Its columns, all but the scene's.
    options : dict
        Of `rtbench.tracer.options.Options`.
    threads : int
    full : bool
        Whether the pictures of later cells are compared with this one.
    timed : bool
        Else only its picture is taken.
    """

    key: dict
    options: dict
    threads: int = 1
    full: bool = False
    timed: bool = True


@dataclass
class Traced:
    """A scene and its cells; ``told``: name, width and height, for the workers."""

    name: str
    told: dict
    cells: list[Cell]
    facts: dict
    # By the place of the cell: what its picture must be, and how long the first took.
    digests: dict[int, str] = field(default_factory=dict)
    ns: dict[int, int] = field(default_factory=dict)

    @property
    def pixels(self) -> int:
        """Of its picture."""
        return self.told["width"] * self.told["height"]


def prepare(
    bench: Bench,
    names: tuple[str, ...],
    samples: int,
    cells: Callable[[Scene, str, str], list[Cell]],
) -> None:
    """Read the scenes and compile what their cells need.

    Parameters
    ----------
    bench : Bench
    names : tuple of str
    samples : int
        Primary rays a pixel, in place of the scenes' own.
    cells : callable
        Returns the cells of a scene, by a kernel and in a precision.
    """
    config = bench.config
    bench.facts["scenes"] = []
    bench.traced = []
    wanted: dict[str, dict] = {}
    for name in names:
        bench.say(f"reading scene {techniques_scenes.spoken(name)}")
        scene = techniques_scenes.read(name, config.width, config.height)
        size = techniques_scenes.size_of(scene, config.width, config.height, samples)
        facts = techniques_scenes.facts(name, scene, *size, samples)
        bench.facts["scenes"].append(facts)
        bench.remarks += [f"{facts['scene']}: {each}" for each in scene.remarks]
        told = {"name": name, "width": size[0], "height": size[1]}
        of_scene = [
            cell
            for kernel in bench.kernels
            for precision in config.precisions
            for cell in cells(scene, kernel.name, precision)
        ]
        bench.traced.append(Traced(facts["scene"], told, of_scene, facts))
        # Meshes differ in nothing that is compiled, nor do the numbers of subsampling.
        alike = name.partition(":")[0]
        for cell in of_scene:
            options = {**cell.options, "subsampling": bool(cell.options.get("subsampling"))}
            job = {"do": "compile", "scene": told, "options": cell.options}
            wanted.setdefault(str((alike, options)), job)
    compile_all(list(wanted.values()), tuple(config.kernels), bench.say, MODULE)


def describe(bench: Bench, processes: int, rounds: int) -> str:
    """Return a line that says what is going to be measured."""
    cells = sum(cell.timed for scene in bench.traced for cell in scene.cells)
    seconds = processes * sum(_expected(bench, rounds).values())
    return (
        f"{cells} cells of {len(bench.traced)} scenes in {processes} processes x {rounds} "
        f"rounds, about {seconds:.0f} s"
    )


def _expected(bench: Bench, rounds: int) -> dict[tuple[str, object], float]:
    """Return how many seconds each part of a process is expected to take."""
    found: dict[tuple[str, object], float] = {}
    for scene in bench.traced:
        found[scene.name, "check"] = (2 + len(scene.cells)) * PICTURE
        for turn in range(rounds):
            found[scene.name, turn] = sum(cell.timed for cell in scene.cells) * PICTURE
    return found


def measure(
    bench: Bench,
    writer: RunWriter,
    watcher,
    keep: Callable[[Traced, Cell, dict], None],
) -> None:
    """Trace and time everything; rows and tables are written as they come.

    Parameters
    ----------
    bench, writer, watcher
    keep : callable
        Is given the answer about each cell's first picture; raises WrongAnswers where it must.
    """
    told = writer.info["plan"]
    processes, rounds = told["processes"], told["rounds"]
    watcher.plan("\n".join([describe(bench, processes, rounds), *writer.info["remarks"]]))
    share = Share(_expected(bench, rounds), processes, watcher.progress)
    for process in range(processes):
        worker = Asked(told["cpu"], tuple(bench.config.kernels), MODULE)
        try:
            for scene in bench.traced:
                numbers = _begin(scene, worker, process, keep, share)
                share.done((scene.name, "check"))
                worker.ask("ready")
                for turn in range(rounds):
                    rows, there = [], list(numbers)
                    places = order(bench.config.seed, process, turn, len(there))
                    for position, place in enumerate(places):
                        row = _timed(scene, there[place], numbers[there[place]], worker)
                        row |= {"process": process, "launch": 0, "round": turn}
                        rows.append(row | {"position": position})
                        share.still()
                    writer.append(rows)
                    share.done((scene.name, turn))
            for name, table in bench.tables.items():
                tabular.write(writer.path / name, tabular.frame(table, schema.TABLES[name]))
        finally:
            worker.close()


def _begin(scene, worker, process, keep, share) -> dict[int, int]:
    """Give a worker a scene; return which of its tracers each timed cell's is.

    The first process looks at every picture, the others add those that are timed.
    """
    worker.ask("scene", **scene.told)
    numbers = {}
    for i, cell in enumerate(scene.cells):
        told = {"options": cell.options, "threads": cell.threads}
        if process == 0:
            answer = worker.ask("tracer", full=cell.full, **told)
            _must_be_the_same(scene, i, answer["digest"])
            scene.ns[i] = answer["ns"]
            keep(scene, cell, answer)
        elif cell.timed:
            worker.ask("add", **told)
        if cell.timed:
            numbers[i] = i if process == 0 else len(numbers)
        share.still()
    return numbers


def _must_be_the_same(scene: Traced, i: int, digest: str) -> None:
    """Raise WrongAnswers for a picture that differs from the one before by the same cell."""
    if scene.digests.setdefault(i, digest) != digest:
        told = ", ".join(f"{name} {value}" for name, value in scene.cells[i].key.items())
        raise WrongAnswers(
            f"the picture of {scene.name} ({told}) is not, bit for bit, what it was before"
        )


def _timed(scene: Traced, i: int, number: int, worker: Asked) -> dict:
    repetitions = min(MOST_REPETITIONS, max(1, SAMPLE_NS // max(1, scene.ns[i])))
    told = worker.ask("time", number=number, repetitions=repetitions)
    _must_be_the_same(scene, i, told["digest"])
    return scene.cells[i].key | {
        "scene": scene.name,
        "triangles": scene.pixels,
        "repetitions": repetitions,
        "tests": scene.pixels * repetitions,
        "ns": told["ns"],
        "cpu_ns": told["cpu_ns"],
    }
