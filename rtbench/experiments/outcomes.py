"""How often a kernel returns by which way, and what each way costs (tables 4.5 and 4.7)."""

from __future__ import annotations

from rtbench.experiments.bench import Bench

CELL = ("kernel", "precision", "order", "density")


def build(bench: Bench) -> None:
    """Add each outcome of each kernel, over random pairs of which nothing was redrawn."""
    workload = bench.as_drawn()
    for precision in bench.config.precisions:
        for kernel in bench.kernels:
            bench.add_groups(kernel, precision, workload)
