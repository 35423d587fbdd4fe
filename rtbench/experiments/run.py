"""A run from its config to its records: prepare, plan, measure, derive."""

from __future__ import annotations

import importlib
import os
from contextlib import closing
from pathlib import Path
from types import ModuleType
from typing import Protocol

from rtbench.errors import NotComparable, RtbenchError
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.resumption import codes, must_be_the_same, samples_taken
from rtbench.measure import float_control, machine, noise
from rtbench.measure.schedule import samples_for
from rtbench.measure.session import Plan, Worker, WorkerDied, measure
from rtbench.records import schema
from rtbench.records.run import Run, read_info
from rtbench.records.store import load_run
from rtbench.records.writer import RunWriter


class Stopped(RtbenchError):
    """Somebody stopped the run (Ctrl-C, SIGTERM); what was measured is kept."""

    exit_code = 130


class Watcher(Protocol):
    """Who is told how a run goes."""

    def say(self, text: str) -> None:
        """What begins now."""

    def plan(self, text: str) -> None:
        """What is going to be measured."""

    def progress(self, fraction: float) -> None:
        """How much of the measuring is done."""


def start(
    config: Config,
    watcher: Watcher,
    out: Path = Path("results"),
    label: str | None = None,
    cpu: int | None = None,
    command: list[str] | None = None,
) -> Run:
    """Do what a config says and keep the records.

    Parameters
    ----------
    config : Config
    watcher : Watcher
    out : Path
        The output folder.
    label : str, optional
        Part of the run folder's name; the machine's short name if not given.
    cpu : int, optional
        Pin the measuring processes to this CPU.
    command : list of str, optional
        The command line, for the records.

    Returns
    -------
    Run

    Raises
    ------
    RtbenchError
        For bad input, an unwritable folder, a kernel that is wrong (exit code 4).
    """
    _must_be_writable(out)
    if cpu is not None:
        machine.check_cpu(cpu)
    experiment = _module(config.experiment)
    before = machine.load()
    with closing(Bench(_absolute(config), watcher.say, watcher.progress)) as bench:
        return _first_launch(bench, experiment, watcher, before, out, label, cpu, command)


def _first_launch(
    bench: Bench,
    experiment: ModuleType,
    watcher: Watcher,
    before: dict,
    out: Path,
    label: str | None,
    cpu: int | None,
    command: list[str] | None,
) -> Run:
    config = bench.config
    # It imports what it needs while we prepare.
    own = hasattr(experiment, "measure")  # it has workers of its own
    worker = Worker() if config.experiment not in schema.UNTIMED and not own else None
    try:
        experiment.build(bench)
        processes, rounds = (
            experiment.plan(config)
            if own
            else samples_for(
                config.repetitions, _fewest(bench, config), config.processes, config.samples
            )
        )
        writer = RunWriter.create(
            out,
            label or machine.label(),
            config.name,
            _info(bench, experiment, before, processes, rounds, cpu, command),
            schema.sample_columns(list(experiment.CELL)),
        )
        with writer:
            return _measure(bench, experiment, writer, watcher, 0, set(), worker)
    finally:
        if worker:
            worker.close()


def resume(ref: str, watcher: Watcher, out: Path = Path("results")) -> Run:
    """End a run that was cut off, with what its run.json says.

    Parameters
    ----------
    ref : str
        A path, or a folder name under ``out``.

    Raises
    ------
    RtbenchError
        If it is finished already, or if the machine, the versions, a kernel's code or what is to
        be measured are not those it was begun with.
    """
    found = load_run(ref, out)
    with RunWriter.reopen(found.path) as writer:
        run = Run(writer.path, writer.info)  # read again, now that nobody else writes it
        told = run.info.get("config")
        if not isinstance(told, dict) or not isinstance(run.info.get("plan"), dict):
            raise NotComparable(f"{run.path} does not say what it was to measure (config, plan)")
        config = Config.from_dict(told)
        if run.info["plan"].get("cpu") is not None:
            machine.check_cpu(run.info["plan"]["cpu"])
        experiment = _module(config.experiment)
        if hasattr(experiment, "measure"):
            raise RtbenchError(f"{run.name} cannot be resumed: its trees are gone; run it again")
        must_be_the_same(
            run.info, {"machine": machine.fingerprint(), "software": machine.software()}
        )
        with closing(Bench(config, watcher.say, watcher.progress)) as bench:
            experiment.build(bench)
            now = {"workloads": bench.workloads, "outcomes": bench.outcomes}
            must_be_the_same(run.info, now | {"kernels": codes(bench.compiled)})
            must_be_the_same(run.info, {"plan": run.info["plan"] | _work(bench)})
            done, launches = samples_taken(run, bench.cells)
            return _measure(bench, experiment, writer, watcher, launches, done, None)


def _measure(
    bench: Bench,
    experiment: ModuleType,
    writer: RunWriter,
    watcher: Watcher,
    launch: int,
    done: set[tuple[int, int, int]],
    worker: Worker | None,
) -> Run:
    try:
        _measure_the_rest(bench, experiment, writer, watcher, launch, done, worker)
    except KeyboardInterrupt:
        raise Stopped(f"stopped; {_cure(experiment, writer)}") from None
    except WorkerDied as problem:
        raise RtbenchError(f"{problem}; {_cure(experiment, writer)}") from None
    return load_run(writer.path)


def _cure(experiment: ModuleType, writer: RunWriter) -> str:
    resumable = not hasattr(experiment, "measure")
    return writer.cure() if resumable else f"what was measured is kept in {writer.path}"


def _measure_the_rest(
    bench: Bench,
    experiment: ModuleType,
    writer: RunWriter,
    watcher: Watcher,
    launch: int,
    done: set[tuple[int, int, int]],
    worker: Worker | None,
) -> None:
    told = writer.info["plan"]
    plan = Plan(told["processes"], told["rounds"], writer.info["seed"], told["cpu"])
    if hasattr(experiment, "measure"):
        experiment.measure(bench, writer, watcher)
    if bench.cells:
        remarks = writer.info.get("remarks") or []
        watcher.plan("\n".join([_description(bench, plan), *remarks]))
        measure(
            bench.cells, bench.arrays, plan, writer.append, watcher.progress, done, launch, worker
        )
    if bench.tables:
        from rtbench.records import tabular

        for name, rows in bench.tables.items():
            tabular.write(writer.path / name, tabular.frame(rows, schema.TABLES[name]))
    watcher.say("summing up")
    more = {"load": {"after": machine.load()}}
    if hasattr(experiment, "conclude"):
        more |= experiment.conclude(Run(writer.path, read_info(writer.path)))
    from rtbench.records.run import write_derived

    # Finished only when all of it stands: a run killed here is resumed, and derives it again.
    writer.update(**more)
    write_derived(writer.path)
    writer.finish()


def _info(
    bench: Bench,
    experiment: ModuleType,
    before: dict,
    processes: int,
    rounds: int,
    cpu: int | None,
    command: list[str] | None,
) -> dict:
    config = bench.config
    fingerprint = machine.fingerprint()
    floats, compiled = float_control.state(), float_control.compiled_state()
    return {
        "experiment": config.experiment,
        "title": config.title,
        "cell": list(experiment.CELL),
        "config": config.as_dict(),
        "seed": config.seed,
        "command": command or [],
        "plan": {"processes": processes, "rounds": rounds, "cpu": cpu} | _work(bench),
        "machine": fingerprint,
        "software": machine.software(),
        "float_state": floats | {"compiled": compiled},
        "load": {"before": before},
        "remarks": bench.remarks + _remarks(fingerprint, before, [floats, compiled]),
        "workloads": bench.workloads,
        "kernels": bench.compiled,
        "outcomes": bench.outcomes,
        **bench.facts,
    }


def _remarks(fingerprint: dict, load: dict, floats: list[dict]) -> list[str]:
    """Return what disturbs measuring right now, each with its cure.

    The load average is left out: it remembers the run before this one.
    """
    found = noise.complaints(fingerprint, load | {"loadavg": machine.UNKNOWN})
    found += float_control.complaints(*floats)
    return [f"disturbed: {each.what}; cure: {each.cure}" for each in found if each.serious]


def _work(bench: Bench) -> dict:
    tests = sum(cell.count * cell.repetitions * cell.tests for cell in bench.cells)
    return {"cells": len(bench.cells), "tests": tests}


def _module(experiment: str) -> ModuleType:
    return importlib.import_module(f"rtbench.experiments.{experiment}")


def _absolute(config: Config) -> Config:
    """Return the config with kernel files named so that a resumption finds them from anywhere."""
    kernels = tuple(
        f"{Path(name.rpartition(':')[0]).resolve()}:{name.rpartition(':')[2]}"
        if ".py:" in name
        else name
        for name in config.kernels
    )
    return config.changed(kernels=kernels)


def _must_be_writable(out: Path) -> None:
    """Say at once, not after minutes of preparing, that nothing can be written."""
    place = out
    while not place.exists() and place != place.parent:
        place = place.parent
    if not place.is_dir() or not os.access(place, os.W_OK | os.X_OK):
        raise RtbenchError(f"output folder {str(out)!r} cannot be written")


def _fewest(bench: Bench, config: Config) -> int:
    """Return the number of pairs of the smallest workload that all kernels share."""
    return min((w["triangles"] for w in bench.workloads), default=config.triangles)


def _description(bench: Bench, plan: Plan) -> str:
    tests = sum(c.count * c.repetitions * c.tests for c in bench.cells)
    each = [(c.count * c.repetitions * c.tests, c.nanoseconds) for c in bench.cells]
    seconds = sum(n * nanoseconds for n, nanoseconds in each) / 1e9
    return (
        f"{len(bench.cells)} cells, {tests:.3g} tests in {plan.processes} processes x "
        f"{plan.rounds} rounds, about {_duration(seconds + plan.processes)}"
    )


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
