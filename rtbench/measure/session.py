"""The parent of the workers: gives them turns, one at a time, and hands on each finished round.

Workers are fresh interpreters, never forks: a forked child would inherit its parent's code
placement, and placement is what differs from process to process. Each is started just before its
first turn, while nobody measures.
"""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass

from rtbench.compiled.instantiate import Instance
from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.measure.arrays import Arrays
from rtbench.measure.schedule import order, shares


@dataclass(frozen=True)
class Timed:
    """A cell to be timed.

    Attributes
    ----------
    key : dict
        What identifies the cell in the records.
    instance : Instance
        The compiled loop.
    triangles, rays : str
        Names of the arrays of records.
    pairs : str
        Name of the array of pairs (uint64) to be tested, in this order.
    expected : tuple of str
        Names of the outputs (outcome, t, u, v) that every run must give, bit for bit.
    order : str
        repeat: each pair many times in a row; sweep, sorted: the list of pairs again and again;
        shuffled: all repetitions of all pairs in one random sequence.
    count : int
        How many pairs.
    repetitions : int
        Of each pair, over all samples.
    nanoseconds : float
        Expected time of a test, for the estimate of what is left.
    tests : int
        How many tests a pair stands for: 1, or as many as there are triangles where each index
        of ``pairs`` is a ray that is tested against all of them.
    environment : tuple of (str, str)
        What must be set before a process that runs this cell starts: cells of the same process
        number that differ in it are served by different processes.
    """

    key: dict
    instance: Instance
    triangles: str
    rays: str
    pairs: str
    expected: tuple[str, str, str, str]
    order: str
    count: int
    repetitions: int
    nanoseconds: float
    tests: int = 1
    environment: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Plan:
    """How the samples are laid out: processes, rounds, the seed of the orders, a CPU to pin to."""

    processes: int
    rounds: int
    seed: int
    cpu: int | None = None


class WorkerDied(RtbenchError):
    """A measuring process ended before its time."""


class Worker:
    """One worker process.

    Parameters
    ----------
    environment : tuple of (str, str)
        Variables that are set for it beside those of this process.
    module : str
        What it runs: it reads lines of JSON and answers with lines of JSON.
    """

    def __init__(
        self,
        environment: tuple[tuple[str, str], ...] = (),
        module: str = "rtbench.measure.worker",
    ) -> None:
        self._words = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._words,
            text=True,
            env=os.environ | dict(environment),
        )

    def tell(self, message: dict) -> None:
        try:
            self._process.stdin.write(json.dumps(message) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self._gone()

    def hear(self) -> dict | list:
        line = self._process.stdout.readline()
        if not line.endswith("\n"):
            self._gone()
        return json.loads(line)

    def _gone(self) -> None:
        code = self._process.wait()
        self._words.seek(0)
        words = self._words.read().decode(errors="replace").strip().splitlines()
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        raise WorkerDied(
            f"a measuring process ended by {how}" + (f": {words[-1]}" if words else "")
        )

    def close(self) -> None:
        with suppress(OSError):
            self._process.stdin.close()
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()
        self._words.close()


def measure(
    cells: list[Timed],
    arrays: Arrays,
    plan: Plan,
    sink: Callable[[list[dict]], None],
    progress: Callable[[float], None] = lambda fraction: None,
    done: Iterable[tuple[int, int, int]] = (),
    launch: int = 0,
    first_worker: Worker | None = None,
) -> None:
    """Time every cell in every round of every process that is not done yet.

    Parameters
    ----------
    cells : list of Timed
    arrays : Arrays
        What the cells name.
    plan : Plan
    sink : callable
        Is given the rows of each round of a process as it ends.
    progress : callable
        Is given the fraction that is done, by expected time.
    done : iterable of (process, round, cell)
        What earlier launches have measured.
    launch : int
        0, one more at each resumption.
    first_worker : Worker, optional
        One already started, for cells that need no environment of their own.

    Raises
    ------
    WrongAnswers
        If a timed loop gives any answer but the expected one.
    WorkerDied
        If a worker process ends, whatever ended it.
    """
    done = set(done)
    layout = [shares(cell.repetitions, plan.processes * plan.rounds) for cell in cells]
    left = [
        (turn, process, todo)
        for turn in range(plan.rounds)
        for process in range(plan.processes)
        if (
            todo := [
                (position, i, layout[i][process * plan.rounds + turn])
                for position, i in enumerate(order(plan.seed, process, turn, len(cells)))
                if (process, turn, i) not in done and layout[i][process * plan.rounds + turn]
            ]
        )
    ]
    cost = [cell.count * cell.tests * cell.nanoseconds for cell in cells]
    total = sum(cost[i] * m for *_, todo in left for _, i, m in todo) or 1.0
    spent = 0.0
    spare = [first_worker] if first_worker else []
    workers: dict[tuple[int, tuple], Worker] = {}
    try:
        for turn, process, todo in left:
            for environment in dict.fromkeys(cells[i].environment for _, i, _ in todo):
                if (process, environment) not in workers:
                    reused = spare and not environment
                    worker = spare.pop() if reused else Worker(environment)
                    workers[process, environment] = worker
                    _prepare(worker, environment, cells, arrays, plan, process)
            rows = []
            # The order stays that of the round: each worker is told of its cells until another's.
            for environment, run in itertools.groupby(todo, lambda t: cells[t[1]].environment):
                run = list(run)
                worker = workers[process, environment]
                worker.tell({"round": [[i, m] for _, i, m in run]})
                for position, i, repetitions in run:
                    answer = worker.hear()
                    if isinstance(answer, dict):
                        raise WrongAnswers(_wrong(cells[answer["wrong"]]))
                    rows.append(
                        cells[i].key
                        | {
                            "process": process,
                            "launch": launch,
                            "round": turn,
                            "position": position,
                            "triangles": cells[i].count * cells[i].tests,
                            "repetitions": repetitions,
                            "tests": cells[i].count * repetitions * cells[i].tests,
                            "ns": answer[1],
                            "cpu_ns": answer[2],
                        }
                    )
                    spent += cost[i] * repetitions
                    progress(spent / total)
            sink(rows)
    finally:
        for worker in [*workers.values(), *spare]:
            worker.close()


def _prepare(
    worker: Worker,
    environment: tuple[tuple[str, str], ...],
    cells: list[Timed],
    arrays: Arrays,
    plan: Plan,
    process: int,
) -> None:
    """Let a worker load those cells that its environment is for, and check their answers."""
    own = [cell if cell.environment == environment else None for cell in cells]
    named = {
        name
        for cell in filter(None, own)
        for name in (cell.triangles, cell.rays, cell.pairs, *cell.expected)
    }
    worker.tell(
        {
            "cpu": plan.cpu,
            "arrays": {name: path for name, path in arrays.paths.items() if name in named},
            "cells": [
                cell
                and {
                    "module": str(cell.instance.path),
                    "entry": cell.instance.entry,
                    "triangles": cell.triangles,
                    "rays": cell.rays,
                    "pairs": cell.pairs,
                    "expected": cell.expected,
                    "order": cell.order,
                    "seed": [plan.seed, process],
                }
                for cell in own
            ],
        }
    )
    answer = worker.hear()
    if "wrong" in answer:
        raise WrongAnswers(_wrong(cells[answer["wrong"]]))


def _wrong(cell: Timed) -> str:
    what = ", ".join(
        f"{name} {value}" for name, value in cell.key.items() if value not in ("", None)
    )
    return f"the timed loop of {what} gave an answer that differs from the one checked before"
