"""What part of a test goes to which of its operations (Blecha 2007, section 4.4).

The kernel is timed cut off after each stage, over pairs that reach them all (density 1); the
part of a stage is the difference to the one before. What is cut off returns the sum of the live
values: those additions are the method's error, and overlap in the processor makes parts of a
whole, not costs of their own.
"""

from __future__ import annotations

from rtbench.compiled.stages import stages as stages_of
from rtbench.experiments.bench import EMPTY, Bench

CELL = ("kernel", "precision", "order", "density", "stage", "stage_index")
WHOLE = "whole"


def build(bench: Bench) -> None:
    """Add every kernel cut off after each of its stages, and whole."""
    for density in bench.config.densities:
        workload = bench.at_density(density)
        for precision in bench.config.precisions:
            for order in bench.config.orders:
                bench.add(EMPTY, precision, workload, order, stage_index=0)
                for kernel in bench.kernels:
                    stages = stages_of(kernel)
                    for index, stage in enumerate(stages):
                        bench.add(
                            kernel,
                            precision,
                            workload,
                            order,
                            cut=stage,
                            stage=stage,
                            stage_index=index,
                        )
                    bench.add(
                        kernel, precision, workload, order, stage=WHOLE, stage_index=len(stages)
                    )
