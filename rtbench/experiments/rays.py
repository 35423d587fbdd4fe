"""Cells in which each ray meets all triangles of a soup and keeps the nearest hit."""

from __future__ import annotations

import numpy as np

from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import bytes_per_triangle, fill
from rtbench.errors import WrongAnswers
from rtbench.experiments.bench import Bench
from rtbench.experiments.preparation import preparation_times
from rtbench.kernels.contract import Kernel
from rtbench.measure.sampler import stopwatch
from rtbench.measure.session import Timed
from rtbench.workloads.soup import Soup, soup

NEAREST = "nearest"


def draw(bench: Bench, ratio: float, triangles: int | None = None, rays: int | None = None) -> Soup:
    """Return a soup of a hit ratio, noted in the records."""
    config = bench.config
    t, r = triangles or config.triangles, rays or config.rays
    bench.say(f"drawing {r} rays and {t} triangles, hit ratio {ratio:g}")
    drawn = soup(ratio, t, r, config.seed)
    bench.workloads.append(
        {
            "density": ratio,
            "triangles": t * r,
            "scene": t,
            "rays": r,
            "digest": drawn.digest,
            "hits": drawn.pairs_hit,
            "hit_ratio": drawn.hit_ratio,
            "rays_that_hit": int(np.count_nonzero(drawn.nearest >= 0)),
            "distance_share": drawn.distance_share,
        }
    )
    return drawn


def add(
    bench: Bench,
    kernel: Kernel,
    precision: str,
    drawn: Soup,
    ratio: float,
    prepared: str = "own",
    repetitions: int | None = None,
    target: str = "native",
    flags: str = "strict",
    columns: dict | None = None,
) -> tuple[np.ndarray, ...]:
    """Add a cell: every ray of a soup against all its triangles, tmax shrinking.

    Parameters
    ----------
    bench : Bench
    kernel, precision, drawn
        What is timed, over what.
    ratio : float
        The soup's nominal hit ratio, the cell's density.
    prepared : str
        In which arithmetic what is stored was prepared: own or double.
    repetitions : int, optional
        Of the whole soup; the config's if not given.
    target, flags : str
        As for `rtbench.compiled.loops.loop`; what is not strict is not judged.
    columns : dict, optional
        What else identifies the cell.

    Returns
    -------
    tuple of (R,) arrays
        The nearest triangle of each ray as this form of the kernel finds it, and t, u, v.

    Raises
    ------
    WrongAnswers
        If a nearest triangle is wrong beyond what rounding explains.
    """
    instance = bench.instance(kernel, precision, None, NEAREST, target, flags)
    scene = f"{drawn.digest}|{precision}"
    records = fill(
        kernel,
        bench.config.layout,
        precision,
        (drawn.v0, drawn.v1, drawn.v2),
        drawn.orig,
        drawn.dir,
        tmax=np.inf,
        prepared=prepared,
    )
    outputs = run_once(instance, kernel, precision, *records)
    _, seconds = stopwatch(lambda: run_once(instance, kernel, precision, *records))
    if flags == "strict":
        _judge(bench, kernel, precision, prepared, drawn, ratio, outputs[0])
    note(bench, kernel, precision, drawn)
    three = len(kernel.outputs) == 3
    kept = outputs if three else (*outputs[:2], outputs[2][:0], outputs[3][:0])
    arrays = bench.arrays
    names = tuple(
        arrays.add(f"{scene}|{kernel.name}|{prepared}|{target}|{flags}|{i}", values)
        for i, values in enumerate(kept)
    )
    rays = np.arange(len(drawn.orig), dtype=np.uint64)
    tests = len(drawn.v0)
    bench.cells.append(
        Timed(
            key={"kernel": kernel.name, "precision": precision, "order": "sweep"}
            | {"density": ratio, "prepared": prepared}
            | (columns or {}),
            instance=instance,
            triangles=arrays.add(f"{scene}|{kernel.name}|{prepared}|triangles", records[0]),
            rays=arrays.add(f"{scene}|{records[1].dtype}|rays", records[1]),
            pairs=arrays.add(f"rays {len(rays)}", rays),
            expected=names,
            order="sweep",
            count=len(rays),
            repetitions=repetitions or bench.config.repetitions,
            nanoseconds=seconds * 1e9 / (len(rays) * tests),
            tests=tests,
            environment=instance.environment,
        )
    )
    return outputs


def _judge(
    bench: Bench,
    kernel: Kernel,
    precision: str,
    prepared: str,
    drawn: Soup,
    ratio: float,
    nearest: np.ndarray,
) -> None:
    """Count the rays whose nearest triangle is not the exact one; refuse what is wrong."""
    other = np.flatnonzero(nearest != drawn.nearest)
    unsafe = drawn.unsafe(other, nearest[other], precision)
    unsafe |= drawn.unsafe(other, drawn.nearest[other], precision)
    wrong = other[~unsafe]
    if len(wrong) and kernel.exact:
        ray = wrong[0]
        raise WrongAnswers(
            f"kernel {kernel.name} in {precision} is wrong about {len(wrong)} of {len(nearest)} "
            f"rays; the first is ray {ray}, for which it finds triangle {nearest[ray]}, and "
            f"{drawn.nearest[ray]} is right (-1: none)"
        )
    found = {"kernel": kernel.name, "precision": precision, "prepared": prepared}
    found |= {"density": ratio, "triangles": len(nearest) * len(drawn.v0)}
    bench.facts.setdefault("nearest", []).append(
        found | {"rays": len(nearest), "differ": len(other), "wrong": len(wrong)}
    )


def note(bench: Bench, kernel: Kernel, precision: str, drawn: Soup) -> None:
    """Keep what a kernel stores of a triangle, and how long preparing it takes."""
    facts = bench.compiled[kernel.name][precision]
    if "bytes_per_triangle" in facts:
        return
    facts["bytes_per_triangle"] = bytes_per_triangle(kernel, "own", precision)
    facts["bytes_per_triangle_padded"] = bytes_per_triangle(kernel, "padded", precision)
    if kernel.prepare is not None:
        corners = drawn.v0, drawn.v1, drawn.v2
        times = preparation_times(kernel, precision, corners, bench.config.prepared[0])
        facts["prepare_ns_per_triangle"] = float(np.median(times))
