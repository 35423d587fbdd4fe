"""What a test costs where every ray meets all triangles (Havel 2008, chapter 5).

The density of a cell is the soup's hit ratio; the tests of all kernels come in the same order.
There is no empty loop beside them: of a loop that tests nothing the compiler leaves nothing.
"""

from __future__ import annotations

from rtbench.experiments import rays
from rtbench.experiments.bench import Bench

CELL = ("kernel", "precision", "order", "density", "prepared")


def build(bench: Bench) -> None:
    """Add every kernel over every soup."""
    for ratio in bench.config.densities:
        drawn = rays.draw(bench, ratio)
        for precision in bench.config.precisions:
            for kernel in bench.kernels:
                for prepared in _ways(kernel, bench.config.prepared):
                    rays.add(bench, kernel, precision, drawn, ratio, prepared)


def _ways(kernel, prepared: tuple[str, ...]) -> tuple[str, ...]:
    """Return the ways to prepare that differ for this kernel."""
    return prepared if kernel.prepare is not None else prepared[:1]
