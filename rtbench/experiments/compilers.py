"""What the compiler makes of a kernel: the axis that Havel 2008 had in GCC 3, GCC 4 and MSVC.

Here it is LLVM's: what it compiles for, and what it may do with floats. Each target is compiled
and timed in processes of its own, whose environment is set before numba starts. What gives other
hits, or another t, than strict arithmetic for the first target is counted.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled import elsewhere, targets
from rtbench.experiments import rays
from rtbench.experiments.bench import Bench

CELL = ("kernel", "precision", "order", "density", "prepared", "target", "flags")


def build(bench: Bench) -> None:
    """Add every kernel for every target that this processor runs, or native, with all flags."""
    config = bench.config
    runnable = [target for target in config.targets if not targets.missing(target)]
    runnable = runnable or ["native"]  # which every processor is
    for target in config.targets:
        if target not in runnable:
            lacking = ", ".join(targets.missing(target))
            bench.remarks.append(f"target {target} is left out: this processor lacks {lacking}")
    bench.facts["variants"] = []
    for ratio in config.densities:
        drawn = rays.draw(bench, ratio)
        for precision in config.precisions:
            for kernel in bench.kernels:
                strict = None
                for target in runnable:
                    for flags in ("strict", *(f for f in config.flags if f != "strict")):
                        found = rays.add(
                            bench,
                            kernel,
                            precision,
                            drawn,
                            ratio,
                            config.prepared[0],
                            target=target,
                            flags=flags,
                            columns={"target": target, "flags": flags},
                        )
                        strict = found if strict is None else strict
                        bench.facts["variants"].append(
                            {
                                "kernel": kernel.name,
                                "precision": precision,
                                "density": ratio,
                                "target": target,
                                "flags": flags,
                                "rays": len(found[0]),
                                "other_hits": int(np.count_nonzero(found[0] != strict[0])),
                                "other_t": int(np.count_nonzero(found[1] != strict[1])),
                            }
                        )
    elsewhere.close()  # they would wait beside what is measured
