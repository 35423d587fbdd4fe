"""From how many rays per triangle on preparing triangles pays (Havel 2008, sections 2 and 6.1).

Preparing a triangle costs p ns once, and saves the difference of two times at each test; where
every ray meets every triangle, a triangle is tested once a ray: rays = p / (t without - t with).
Measured over the hit ratio and over the number of triangles, from the first-level cache to memory,
where what is stored costs time of its own: its bytes.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.layout import bytes_per_triangle
from rtbench.errors import RtbenchError
from rtbench.experiments import rays
from rtbench.experiments.bench import Bench
from rtbench.experiments.preparation import preparation_times
from rtbench.records import derive, resampling
from rtbench.records.resampling import Estimate
from rtbench.records.run import Run

CELL = ("kernel", "precision", "order", "density", "prepared", "scene")
FEWEST_RAYS = 8


def build(bench: Bench) -> None:
    """Add every kernel over soups of growing size, each with about the same number of tests.

    The tests are those of the config's triangles x rays. What kernels store is prepared over each
    number of triangles, several times.

    Raises
    ------
    RtbenchError
        If the config has no sizes, or no kernel that stores nothing.
    """
    config = bench.config
    if not config.sizes:
        raise RtbenchError("sizes is empty: experiment break_even needs at least one")
    if all(kernel.prepare is not None for kernel in bench.kernels):
        raise RtbenchError("break_even needs a kernel that stores nothing, to compare with")
    bench.facts["preparation"] = []
    for scene in config.sizes:
        count = max(FEWEST_RAYS, config.triangles * config.rays // scene)
        for ratio in config.densities:
            drawn = rays.draw(bench, ratio, scene, count)
            # The largest need more tests than the others: a few rays would be no sample of them.
            tests = config.triangles * config.rays * config.repetitions
            repetitions = max(_samples(config), tests // (scene * count))
            for precision in config.precisions:
                for kernel in bench.kernels:
                    rays.add(
                        bench,
                        kernel,
                        precision,
                        drawn,
                        ratio,
                        config.prepared[0],
                        repetitions,
                        columns={"scene": scene},
                    )
                    if kernel.prepare is not None and ratio == config.densities[0]:
                        _prepare(bench, kernel, precision, drawn)


def _samples(config) -> int:
    return (config.processes or 1) * (config.samples or 1)


def _prepare(bench: Bench, kernel, precision: str, drawn) -> None:
    corners = drawn.v0, drawn.v1, drawn.v2
    bench.say(f"preparing {len(drawn.v0)} triangles for {kernel.name}")
    times = preparation_times(kernel, precision, corners, bench.config.prepared[0])
    low, high = np.quantile(_medians(times), [0.025, 0.975])
    bench.facts["preparation"].append(
        {
            "kernel": kernel.name,
            "precision": precision,
            "scene": len(drawn.v0),
            "ns_per_triangle": float(np.median(times)),
            "ci_low": float(low),
            "ci_high": float(high),
            "samples": times.tolist(),
            "bytes_per_triangle": bytes_per_triangle(kernel, bench.config.layout, precision),
        }
    )


def _medians(times: np.ndarray) -> np.ndarray:
    """Return medians of resamples, as many as there are of a cell's time."""
    random = np.random.default_rng(len(times))
    drawn = random.integers(0, len(times), (resampling.RESAMPLES, len(times)))
    return np.median(times[drawn], axis=1)


def conclude(run: Run) -> dict:
    """Return ``break_even``: from how many rays per triangle on each stored form pays.

    Returns
    -------
    dict
        ``break_even``: rows of ``kernel, precision, density, scene, against`` (the fastest kernel
        that stores nothing), ``ns_per_test, against_ns, preparation_ns, rays_per_triangle`` (None:
        never) and its 95 % interval ``ci_low, ci_high`` (None: no bound on that side).
    """
    seed = resampling.seed_of(run.name)
    times = {
        key[:4]: resampling.median(derive.times(samples), seed)
        for key, samples in derive.cells(
            run, ["kernel", "precision", "density", "scene", "outcome"]
        ).items()
    }
    methods = run.info["methods"]
    rows = []
    for prepared in run.info["preparation"]:
        for (kernel, precision, density, scene), time in times.items():
            if (kernel, precision, scene) != tuple(
                prepared[name] for name in ("kernel", "precision", "scene")
            ):
                continue
            plain = {
                other: found
                for (other, p, d, s), found in times.items()
                if (p, d, s) == (precision, density, scene) and methods[other]["stored"] == "none"
            }
            against = min(plain, key=lambda name: plain[name].value)
            row = {"kernel": kernel, "precision": precision, "density": density, "scene": scene}
            row |= {"against": against, "ns_per_test": time.value}
            row |= {"against_ns": plain[against].value}
            row |= {"preparation_ns": prepared["ns_per_triangle"]}
            rows.append(row | _pays(time, plain[against], np.array(prepared["samples"])))
    return {"break_even": rows}


def _pays(time: Estimate, plain: Estimate, preparation: np.ndarray) -> dict:
    """Return the number of rays per triangle, with its interval; infinity is told as None."""
    value = _rays(np.median(preparation), plain.value - time.value)
    low = high = np.inf
    if time.draws is not None and plain.draws is not None:
        drawn = _rays(_medians(preparation), plain.draws - time.draws)
        low, high = np.sort(drawn)[[int(0.025 * len(drawn)), int(0.975 * len(drawn))]]
    told = {"rays_per_triangle": value, "ci_low": low, "ci_high": high}
    return {name: float(each) if np.isfinite(each) else None for name, each in told.items()}


def _rays(preparation: np.ndarray, saved: np.ndarray) -> np.ndarray:
    """Return preparation / saved, infinity where nothing is saved."""
    preparation, saved = np.broadcast_arrays(preparation, saved)
    with np.errstate(divide="ignore"):
        return np.where(saved > 0, preparation / np.where(saved > 0, saved, 1), np.inf)
