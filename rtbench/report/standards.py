"""Which kernels are stable, watertight or exact: by records of hard cases, else by claims."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rtbench.records import schema
from rtbench.records.tabular import plain
from rtbench.report.candidates import created, finished_runs

if TYPE_CHECKING:
    from rtbench.records.run import Run

REQUIRED = {
    "stable": ("S1", "S2", "S3", "S4", "S5", "S6"),
    "watertight": ("S2",),
    "exact": ("X1", "X2"),
}
JUDGING = ("accuracy", "stability")  # experiments that say what kernels hold
CORPUS = "corpus"
CLAIMED = ("float32", "float64")  # what a kernel claims it claims in these


@dataclass(frozen=True, eq=False)
class Standard:
    """What is asked of a kernel, and who says whether it holds.

    Attributes
    ----------
    word : str
        stable, watertight or exact.
    runs : sequence of Run
        Of the experiments accuracy and stability, newest first.
    claims : mapping of str to tuple of str
        What kernels claim, by name.
    """

    word: str
    runs: Sequence["Run"] = ()
    claims: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    _known: dict = field(default_factory=dict)

    def misfit(self, kernel: str, precision: str) -> str | None:
        """Return why a kernel does not meet it, None if it does.

        Parameters
        ----------
        kernel, precision : str
            A kernel that was not asked is taken for the same one that returns u and v too, or t
            alone: they decide alike.
        """
        names = (kernel, f"{kernel}_uv", kernel.removesuffix("_uv"))
        for run in self.runs:
            for name in names:
                holds = self._of(run).get((name, precision))
                if holds is not None:
                    failed = [each for each in REQUIRED[self.word] if not holds.get(each)]
                    return f"fails {' '.join(failed)} ({run.name})" if failed else None
        if precision not in CLAIMED:
            return f"no record, and nothing is claimed in {precision}"
        claimed = next((self.claims[name] for name in names if name in self.claims), ())
        absent = [each for each in REQUIRED[self.word] if each not in claimed]
        return f"no record, and it does not claim {' '.join(absent)}" if absent else None

    def source(self, kernel: str, precision: str) -> str:
        """Return who says it of a kernel: the name of a run, or its claims."""
        names = (kernel, f"{kernel}_uv", kernel.removesuffix("_uv"))
        for run in self.runs:
            if any((name, precision) in self._of(run) for name in names):
                return run.name
        return "what kernels claim, no record of hard cases"

    def _of(self, run: "Run") -> dict[tuple[str, str], dict]:
        if id(run) not in self._known:
            self._known[id(run)] = dict(_rows(run))
        return self._known[id(run)]


def judging_runs(out: Path, machine: dict) -> list["Run"]:
    """Return the newest finished runs that say what kernels hold, newest first."""
    found = [run for run in finished_runs(out, machine) if run.info.get("experiment") in JUDGING]
    return sorted(found, key=created, reverse=True)


def _rows(run: "Run"):
    """Yield kernel and precision with the criteria that a run found to hold."""
    rows = run.stability.to_dict("records")
    rows += [
        row
        for row in run.accuracy.to_dict("records")
        if (row["workload"], row["flags"], row["reciprocal"]) == (CORPUS, "strict", "division")
    ]
    for row in rows:
        holds = {name: plain(row.get(name)) for name in schema.CRITERIA}
        if any(value is not None for value in holds.values()):
            yield (row["kernel"], row["precision"]), holds
