"""What a test costs over the density of hits (Blecha 2007, tables 4.1, 4.2, 4.3, 4.10)."""

from __future__ import annotations

from rtbench.experiments.bench import EMPTY, Bench

CELL = ("kernel", "precision", "order", "density")


def build(bench: Bench) -> None:
    """Add every kernel at every density in every order, the loop alone, and each outcome."""
    for density in bench.config.densities:
        workload = bench.at_density(density)
        for precision in bench.config.precisions:
            for order in bench.config.orders:
                for kernel in (EMPTY, *bench.kernels):
                    bench.add(kernel, precision, workload, order)
            for kernel in bench.kernels:
                bench.add_groups(kernel, precision, workload)
