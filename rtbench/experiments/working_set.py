"""What a test costs over the number of distinct pairs: predictor and caches giving out."""

from __future__ import annotations

from rtbench.errors import RtbenchError
from rtbench.experiments.bench import EMPTY, Bench

CELL = ("kernel", "precision", "order", "density", "triangles")


def build(bench: Bench) -> None:
    """Add every kernel over growing sets of pairs, each with the same number of tests.

    The tests are those of the config's triangles x repetitions; a size that does not divide
    them gets the next whole number of repetitions.
    """
    config = bench.config
    if not config.sizes:
        raise RtbenchError("sizes is empty: experiment working_set needs at least one")
    for density in config.densities:
        workload = bench.at_density(density, max(config.sizes))
        for precision in config.precisions:
            for order in config.orders:
                for size in config.sizes:
                    repetitions = -(-config.triangles * config.repetitions // size)
                    for kernel in (EMPTY, *bench.kernels):
                        bench.add(kernel, precision, workload, order, repetitions, first=size)
