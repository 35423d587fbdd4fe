"""What a test costs when the next one waits for it, against independent tests.

The next pair's address depends on the t that came before (compared with a tmax that no t is
below), so the processor cannot overlap two tests that hit: what is timed is the kernel's latency.
A miss updates no tmax, and a predicted one lets nothing wait: hence the config's density of 1.
"""

from __future__ import annotations

from rtbench.compiled.loops import PAIR_BY_PAIR
from rtbench.experiments.bench import Bench

CELL = ("kernel", "precision", "order", "density", "chain")


def build(bench: Bench) -> None:
    """Add every kernel with independent and with dependent tests."""
    for density in bench.config.densities:
        workload = bench.at_density(density)
        for precision in bench.config.precisions:
            for order in bench.config.orders:
                for kernel in bench.kernels:
                    for kind in PAIR_BY_PAIR:
                        bench.add(kernel, precision, workload, order, kind=kind, chain=kind)
