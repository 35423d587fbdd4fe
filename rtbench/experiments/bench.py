"""Where an experiment puts together what is to be timed: workloads, kernels, cells."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtbench.compiled import elsewhere
from rtbench.compiled.catalogue import facts
from rtbench.compiled.instantiate import Instance
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import REAL_TYPE, bytes_per_triangle, fill, record_types
from rtbench.compiled.loops import empty, loop
from rtbench.compiled.machine_code import widens
from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.experiments.answers import check
from rtbench.experiments.config import Config
from rtbench.experiments.preparation import preparation_times
from rtbench.kernels import registry
from rtbench.kernels.contract import HIT, Kernel
from rtbench.measure.sampler import stopwatch
from rtbench.measure.session import Arrays, Timed
from rtbench.workloads.pairs import Pairs, pairs_at_density, random_pairs

EMPTY = empty.kernels[0]
# A group of one outcome is timed over at most so many of its pairs: more would only measure
# memory, and the thesis's own groups had 25,000.
GROUP_PAIRS = 25_000
DESCRIBED = ("title", "method", "outputs", "operations", "exact")
GROUP_TESTS = 1_000_000  # and at least so many tests in all, however few its pairs


@dataclass(frozen=True)
class Workload:
    """Pairs under a name; ``judged`` where every kernel must be right about each."""

    name: str
    pairs: Pairs
    density: float | None
    judged: bool


@dataclass(frozen=True)
class Answers:
    """What a kernel says of a workload, and how long a test took by the way (ns)."""

    outcome: np.ndarray
    outputs: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    nanoseconds: float


class Bench:
    """Collects the cells of a run, and what the records say of them.

    Parameters
    ----------
    config : Config
    progress : callable
        Is given a text whenever something that may take long begins.
    part : callable, optional
        Is given how much of an untimed experiment is done, from 0 to 1.
    """

    def __init__(
        self,
        config: Config,
        progress: Callable[[str], None],
        part: Callable[[float], None] = lambda fraction: None,
    ) -> None:
        self.config = config
        self.kernels = registry.select(config.kernels)
        self.arrays = Arrays()
        self.cells: list[Timed] = []
        self.workloads: list[dict] = []
        self.outcomes: list[dict] = []
        self.facts: dict[str, object] = {}
        # Tables that stand beside the samples, by file name; columns: `schema.TABLES`.
        self.tables: dict[str, list[dict]] = {}
        self.remarks: list[str] = []
        self.compiled: dict[str, dict[str, dict]] = {}
        self.say = progress
        self.part = part
        self._answers: dict[tuple, Answers] = {}

    def close(self) -> None:
        """Remove the arrays that the workers read, and end what compiles for other targets."""
        self.arrays.close()
        elsewhere.close()

    def at_density(self, density: float, triangles: int | None = None) -> Workload:
        """Return a workload with exactly that density of hits."""
        config = self.config
        n = triangles or config.triangles
        self.say(f"drawing {n} pairs at density {density:g}")
        pairs = pairs_at_density(n, density, config.generator, config.seed)
        domains = {kernel.domain for kernel in self.kernels}
        if None in domains:
            if domains != {None}:
                raise RtbenchError(
                    "kernels that test a point (*_inside) and kernels that test a line cannot be "
                    "timed over the same pairs: run them apart"
                )
            pairs = pairs.on_planes()
        elif domains != {"line"}:
            pairs = pairs.ahead()  # who tests the line has as many hits as who tests the ray
        return self._register(Workload(f"density {density:g}", pairs, density, judged=True))

    def as_drawn(self) -> Workload:
        """Return a workload of which nothing was redrawn."""
        config = self.config
        self.say(f"drawing {config.triangles} random pairs")
        pairs = random_pairs(config.triangles, config.generator, config.seed)
        return self._register(Workload("as drawn", pairs, None, judged=False))

    def _register(self, workload: Workload) -> Workload:
        pairs = workload.pairs
        # Of the first kernel: its records, an index, and what it writes.
        kernel, precision = self.kernels[0], self.config.precisions[0]
        triangle, ray = record_types(kernel, self.config.layout, precision)
        written = 4 + len(kernel.outputs) * np.dtype(REAL_TYPE[precision]).itemsize
        self.workloads.append(
            {
                "density": workload.density,
                "triangles": len(pairs),
                "digest": pairs.digest,
                "hits": int(pairs.hit.sum()),
                "drawn": pairs.drawn,
                "redrawn": pairs.redrawn,
                "bytes_per_pair": triangle.itemsize + ray.itemsize + 8 + written,
            }
        )
        return workload

    def instance(
        self,
        kernel: Kernel,
        precision: str,
        stage: str | None = None,
        kind: str = "independent",
        target: str = "native",
        flags: str = "strict",
    ) -> Instance:
        """Return a kernel's compiled loop; the records say how long compiling took."""
        self.say(f"compiling {kernel.name} in {precision}")
        made, seconds = stopwatch(
            lambda: loop(kernel, precision, self.config.layout, stage, kind, target, flags)
        )
        if stage is None and kind != "dependent":
            self._describe(kernel)
            known = self.compiled.setdefault(kernel.name, {}).setdefault(precision, {})
            if not known:
                known.update(
                    source_digest=made.path.stem.rpartition("_")[2],
                    machine_code_digest=made.code_digest,
                    compile_seconds=seconds if made.fresh else 0.0,
                )
                if precision == "float32" and not kernel.fallback and widens(made.assembly):
                    self.remarks.append(
                        f"kernel {kernel.name} in float32 computes in float64 in places: a whole "
                        "number beside a float32 does that; write it as a float (2.0)"
                    )
        return made

    def _describe(self, kernel: Kernel) -> None:
        """Keep what tables and advice must know of a kernel without its source."""
        known = self.facts.setdefault("methods", {})
        if kernel is not EMPTY and kernel.name not in known:
            told = facts(kernel)
            known[kernel.name] = {name: told[name] for name in DESCRIBED} | {
                "base": kernel.function.__name__,
                "stored": kernel.stored,
                "ending": kernel.ending and kernel.ending.name,
                "division": kernel.ending and kernel.ending.division,
                "early": kernel.ending and kernel.ending.early,
            }

    def answers(
        self, kernel: Kernel, precision: str, workload: Workload, stage: str | None = None
    ) -> Answers:
        """Return what a kernel says of every pair; a judged workload's truth is checked.

        Raises
        ------
        WrongAnswers
            If the kernel is wrong about a judged pair.
        """
        key = kernel.name, precision, workload.name, stage
        if key not in self._answers:
            instance = self.instance(kernel, precision, stage)
            records = self._records(kernel, precision, workload)
            outputs = run_once(instance, kernel, precision, *records)
            _, seconds = stopwatch(lambda: run_once(instance, kernel, precision, *records))
            if workload.judged and stage is None and kernel is not EMPTY:
                self._judge(kernel, precision, workload, outputs)
            nanoseconds = seconds * 1e9 / len(workload.pairs)
            uv = len(kernel.outputs) == 3
            kept = outputs if uv else (*outputs[:2], outputs[2][:0], outputs[3][:0])
            self._answers[key] = Answers(outputs[0], kept, nanoseconds)
            if stage is None and kernel is not EMPTY:
                self._note_storage(kernel, precision, workload)
                _must_be_declared(kernel, outputs[0])
                self._count(kernel, precision, workload, outputs[0])
        return self._answers[key]

    def _judge(self, kernel: Kernel, precision: str, workload: Workload, outputs: tuple) -> None:
        """Check answers; of a method that no tolerance makes right it is only remarked."""
        try:
            check(kernel, precision, workload.pairs, outputs[0] == HIT, outputs[1:])
        except WrongAnswers as problem:
            if kernel.exact:
                raise
            self.remarks.append(f"{problem} ({workload.name})")

    def _note_storage(self, kernel: Kernel, precision: str, workload: Workload) -> None:
        """Keep what a kernel stores of a triangle, and how long preparing it takes."""
        facts = self.compiled[kernel.name][precision]
        if "bytes_per_triangle" in facts:
            return
        facts["bytes_per_triangle"] = bytes_per_triangle(kernel)
        if kernel.prepare is not None:
            corners = workload.pairs.v0, workload.pairs.v1, workload.pairs.v2
            times = preparation_times(kernel, precision, corners)
            facts["prepare_ns_per_triangle"] = float(np.median(times))

    def _count(self, kernel, precision, workload, outcome) -> None:
        counts = np.bincount(outcome, minlength=len(kernel.outcomes))
        for code, label in enumerate(kernel.outcomes):
            self.outcomes.append(
                {
                    "kernel": kernel.name,
                    "precision": precision,
                    "density": workload.density,
                    "triangles": len(workload.pairs),
                    "outcome": code,
                    "label": label,
                    "count": int(counts[code]),
                }
            )

    def _records(self, kernel, precision, workload) -> tuple[np.ndarray, np.ndarray]:
        pairs = workload.pairs
        vertices = pairs.v0, pairs.v1, pairs.v2
        return fill(
            kernel, self.config.layout, precision, vertices, pairs.orig, pairs.dir, pairs.end
        )

    def add(
        self,
        kernel: Kernel,
        precision: str,
        workload: Workload,
        order: str,
        repetitions: int | None = None,
        first: int | None = None,
        group: np.ndarray | None = None,
        cut: str | None = None,
        kind: str = "independent",
        **key: object,
    ) -> None:
        """Add a cell.

        Parameters
        ----------
        kernel, precision, workload, order, cut, kind
            What is timed, over what, how; ``cut`` is the stage after which the kernel ends.
        repetitions : int, optional
            The config's if not given.
        first : int, optional
            Only so many pairs of the workload, from its beginning.
        group : (P,) integer array, optional
            Only these pairs, moved next to each other in memory.
        **key
            Further columns that identify the cell.
        """
        answers = self.answers(kernel, precision, workload, cut)
        what = workload.name if group is None else f"{workload.name}, {hash(group.tobytes())}"
        names = [
            self._keep(f"{what}|{kernel.name}|{precision}|{cut}|{i}", values, group)
            for i, values in enumerate(answers.outputs)
        ]
        prepared = kernel.prepare and (kernel.prepare.__module__, kernel.prepare.__qualname__)
        records = f"{what}|{prepared}|{record_types(kernel, self.config.layout, precision)}"
        if f"{records}|rays" not in self.arrays.paths:
            triangles, rays = self._records(kernel, precision, workload)
            self._keep(f"{records}|triangles", triangles, group)
            self._keep(f"{records}|rays", rays, group)
        count = first or len(workload.pairs if group is None else group)
        pairs = np.arange(count)
        if order in ("sweep", "sorted"):
            pairs = np.random.default_rng([self.config.seed, count]).permutation(pairs)
        if order == "sorted":
            pairs = pairs[np.argsort(answers.outcome[pairs], kind="stable")]
        if first and kernel is not EMPTY and cut is None:
            hit = answers.outcome[:count] == HIT
            found = {"kernel": kernel.name, "precision": precision, "density": workload.density}
            found |= {"triangles": count, "hits": int(np.count_nonzero(hit))}
            hits = self.facts.setdefault("hits", [])
            if found not in hits:
                hits.append(found)
        self.cells.append(
            Timed(
                key={"kernel": kernel.name, "precision": precision, "order": order}
                | {"density": workload.density}
                | key,
                instance=self.instance(kernel, precision, cut, kind),
                triangles=f"{records}|triangles",
                rays=f"{records}|rays",
                pairs=self.arrays.add(f"{hash(pairs.tobytes())}", pairs.astype(np.uint64)),
                expected=tuple(names),
                order=order,
                count=count,
                repetitions=repetitions or self.config.repetitions,
                nanoseconds=answers.nanoseconds,
            )
        )

    def _keep(self, name: str, values: np.ndarray, group: np.ndarray | None) -> str:
        if name not in self.arrays.paths:
            self.arrays.add(name, values if group is None or not len(values) else values[group])
        return name

    def add_groups(self, kernel: Kernel, precision: str, workload: Workload) -> None:
        """Add a cell for each outcome of a kernel, over pairs that all return it.

        Each pair is repeated as the config says; a small group's more often, so that it too gets
        GROUP_TESTS tests (or as many as the whole workload, if that is fewer).
        """
        outcome = self.answers(kernel, precision, workload).outcome
        whole = self.config.repetitions * len(workload.pairs)
        for code in range(len(kernel.outcomes)):
            group = np.flatnonzero(outcome == code)[:GROUP_PAIRS]
            if len(group):
                enough = -(-min(whole, GROUP_TESTS) // len(group))
                repetitions = max(self.config.repetitions, enough)
                self.add(
                    kernel, precision, workload, "repeat", repetitions, group=group, outcome=code
                )


def _must_be_declared(kernel: Kernel, outcome: np.ndarray) -> None:
    strange = outcome[(outcome < 0) | (outcome >= len(kernel.outcomes))]
    if len(strange):
        raise RtbenchError(
            f"kernel {kernel.name} returns outcome {strange[0]} and declares only 0 to "
            f"{len(kernel.outcomes) - 1}"
        )
