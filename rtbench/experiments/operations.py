"""How many operations a kernel needs at most (Blecha 2007, tables 4.4, 4.6, 4.8, 4.9)."""

from __future__ import annotations

from rtbench.compiled.operations import operations
from rtbench.experiments.bench import Bench
from rtbench.records import schema

CELL = ("kernel",)


def build(bench: Bench) -> None:
    """Time nothing: the counts are read off the kernels' syntax."""
    bench.tables[schema.OPERATIONS] = [
        {"kernel": kernel.name} | (operations(kernel) or {}) for kernel in bench.kernels
    ]
