"""What a mispredicted branch costs here, and whether it explains the sweeps.

cost = sum of f_i t_i + m x penalty: f_i and t_i are frequency and time of outcome i (timed apart
in repeat order, where nothing is mispredicted), m is the expected number of mispredictions a test:
the sum over a kernel's branches of min(p, 1 - p), p how often it is taken, for outcomes that are
independent from test to test. One penalty serves all kernels and densities; no hardware counter.

What is explained is the shuffled order: every repetition of every pair in one random sequence.
Few enough pairs that the first-level cache holds them keep memory out of it; and a sequence that
never comes again keeps the predictor from learning it, which it does of a sweep over 25,000 pairs.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.branches import branches
from rtbench.compiled.layout import fill
from rtbench.experiments.bench import EMPTY, Bench
from rtbench.kernels.contract import Kernel
from rtbench.records import derive, resampling
from rtbench.records.run import Run
from rtbench.workloads.pairs import Pairs

CELL = ("kernel", "precision", "order", "density")
COUNTED_PAIRS = 4000  # p is known to 0.8 % then, and no kernel needs a second for it


def build(bench: Bench) -> None:
    """Add every kernel in every order, and each outcome; count the branches."""
    for density in bench.config.densities:
        workload = bench.at_density(density)
        for precision in bench.config.precisions:
            for order in bench.config.orders:
                for kernel in (EMPTY, *bench.kernels):
                    bench.add(kernel, precision, workload, order)
            for kernel in bench.kernels:
                bench.add_groups(kernel, precision, workload)
                bench.facts.setdefault("branches", []).append(
                    {
                        "kernel": kernel.name,
                        "precision": precision,
                        "density": density,
                        "mispredictions": mispredictions(kernel, workload.pairs),
                    }
                )


def mispredictions(kernel: Kernel, pairs: Pairs) -> float:
    """Return the expected mispredictions a test: sum of min(p, 1 - p) over the branches."""
    n = min(len(pairs), COUNTED_PAIRS)
    vertices = pairs.v0[:n], pairs.v1[:n], pairs.v2[:n]
    records = fill(kernel, "own", "float64", vertices, pairs.orig[:n], pairs.dir[:n], pairs.end[:n])
    return sum(min(ways) for ways in branches(kernel, *records)) / n


def conclude(run: Run) -> dict:
    """Return the fit: one penalty for all kernels, and every shuffled run beside what it explains.

    Returns
    -------
    dict
        ``fit``: ``penalty_ns``, its interval ``ci``, ``kernels`` with the penalty that each alone
        would give, and ``points`` with ``kernel, precision,
        density, measured, ci_low, ci_high, mixture, branches_m, predicted`` (ns a test).
    """
    seed = resampling.seed_of(run.name)
    cells = derive.cells(run, [*CELL, "outcome"])
    times = {key: resampling.median(derive.times(rows), seed) for key, rows in cells.items()}
    counts = {
        (o["kernel"], o["precision"], o["density"], o["outcome"]): o["count"]
        for o in run.info["outcomes"]
    }
    points = []
    for branch in run.info["branches"]:
        kernel, precision, density = (branch[k] for k in ("kernel", "precision", "density"))
        shuffled = times.get(_key(kernel, precision, "shuffled", density, None))
        groups = {
            code: count
            for (*who, code), count in counts.items()
            if who == [kernel, precision, density] and count
        }
        parts = {c: times.get(_key(kernel, precision, "repeat", density, c)) for c in groups}
        if shuffled is None or None in parts.values():
            continue
        n = sum(groups.values())
        mixture = sum(groups[code] / n * parts[code].value for code in groups)
        draws = None
        if shuffled.draws is not None and all(p.draws is not None for p in parts.values()):
            draws = shuffled.draws - sum(groups[code] / n * parts[code].draws for code in groups)
        points.append((branch, shuffled, mixture, draws))
    if not points:
        return {}
    m = np.array([branch["mispredictions"] for branch, *_ in points])
    excess = np.array([shuffled.value - mixture for _, shuffled, mixture, _ in points])
    penalty = float(m @ excess / (m @ m)) if m.any() else 0.0
    interval = None
    if all(draws is not None for *_, draws in points) and m.any():
        drawn = m @ np.array([draws for *_, draws in points]) / (m @ m)
        interval = resampling.joined(penalty, drawn, [p[1] for p in points]).interval()
    kernels = [branch["kernel"] for branch, *_ in points]
    own = {name: np.array([k == name for k in kernels]) for name in dict.fromkeys(kernels)}
    return {
        "fit": {
            "penalty_ns": penalty,
            "ci": list(interval) if interval else None,
            "kernels": {
                name: float(m[at] @ excess[at] / (m[at] @ m[at]))
                for name, at in own.items()
                if m[at].any()
            },
            "points": [
                {
                    "kernel": branch["kernel"],
                    "precision": branch["precision"],
                    "density": branch["density"],
                    "measured": shuffled.value,
                    "ci_low": (shuffled.interval() or (None, None))[0],
                    "ci_high": (shuffled.interval() or (None, None))[1],
                    "mixture": mixture,
                    "branches_m": branch["mispredictions"],
                    "predicted": mixture + branch["mispredictions"] * penalty,
                }
                for branch, shuffled, mixture, _ in points
            ],
        }
    }


def _key(kernel: str, precision: str, order: str, density: float, outcome: int | None) -> tuple:
    return kernel, precision, order, density, outcome
