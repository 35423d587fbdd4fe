"""What of the naive way's time the tests take: each ray against every triangle, and untested.

Primary rays of an image meet all triangles of a generated surface, by each kernel and, beside it,
in a loop that reads each triangle of the first kernel's and tests none.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import REAL_TYPE, fill, record_types
from rtbench.compiled.sources import dtype_source
from rtbench.errors import RtbenchError
from rtbench.experiments.bench import EMPTY, Bench
from rtbench.kernels.contract import TMAX, Kernel
from rtbench.measure.sampler import stopwatch
from rtbench.measure.session import Timed
from rtbench.workloads.cameras import primary_rays, recommended
from rtbench.workloads.generated_models import scanned
from rtbench.workloads.meshes import Mesh

CELL = ("kernel", "precision", "order", "density", "triangles")
NEAREST = "nearest"


def untested(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            hit = np.int32(-1)
            tmax = rays[k].tmax
            for i in range(triangles.shape[0]):
                # Never, rays being without an end; but without it nothing of the loop would be
                # left. Nothing is kept but the index: to carry a least t along without a branch,
                # as a compiler then does, takes as long as a test.
                if triangles[i].v0[0] > tmax:
                    hit = np.int32(i)
            outcome[k] = hit
            t[k] = tmax


def build(bench: Bench) -> None:
    """Add every kernel, and none, over surfaces of growing size, with about as many tests each.

    The config's width x height rays meet its largest surface as often as ``repetitions`` says.
    """
    config = bench.config
    if not config.sizes:
        raise RtbenchError("sizes is empty: experiment naive needs at least one")
    scenes = bench.facts["scenes"] = []
    for size in config.sizes:
        bench.say(f"making a surface of about {size} triangles")
        mesh = scanned(size).rounded(np.float32)
        camera = recommended(mesh)
        origins, directions, _ = primary_rays(camera, config.width, config.height)
        fact = {"rays": len(origins), "triangles": len(mesh.faces)}
        scenes.append(fact | {"pairs": fact["rays"] * fact["triangles"]})
        repetitions = max(1, config.repetitions * max(config.sizes) // size)
        for precision in config.precisions:
            for chosen in (EMPTY, *bench.kernels):
                _add(bench, chosen, precision, mesh, origins, directions, repetitions)


def _add(
    bench: Bench,
    chosen: Kernel,
    precision: str,
    mesh: Mesh,
    origins: np.ndarray,
    directions: np.ndarray,
    repetitions: int,
) -> None:
    read = bench.kernels[0] if chosen is EMPTY else chosen
    instance = (
        _alone(read, precision, bench.config.layout)
        if chosen is EMPTY
        else bench.instance(chosen, precision, None, NEAREST)
    )
    corners = tuple(mesh.triangles[:, k] for k in range(3))
    records = fill(read, bench.config.layout, precision, corners, origins, directions, tmax=np.inf)
    outputs = run_once(instance, chosen, precision, *records)
    _, seconds = stopwatch(lambda: run_once(instance, chosen, precision, *records))
    kept = outputs if len(chosen.outputs) == 3 else (*outputs[:2], outputs[2][:0], outputs[3][:0])
    arrays, what = bench.arrays, f"{len(mesh.faces)}|{chosen.name}|{precision}"
    tests = len(mesh.faces)
    bench.cells.append(
        Timed(
            # Over which scene is told by its pairs, in the samples' column triangles.
            key={"kernel": chosen.name, "precision": precision, "order": "sweep", "density": None},
            instance=instance,
            triangles=arrays.add(f"{what}|triangles", records[0]),
            rays=arrays.add(f"{what}|rays", records[1]),
            pairs=arrays.add(f"{what}|places", np.arange(len(origins), dtype=np.uint64)),
            expected=tuple(arrays.add(f"{what}|{i}", values) for i, values in enumerate(kept)),
            order="sweep",
            count=len(origins),
            repetitions=repetitions,
            nanoseconds=seconds * 1e9 / (len(origins) * tests),
            tests=tests,
        )
    )


def _alone(read: Kernel, precision: str, layout: str) -> Instance:
    """Return the loop without a kernel, over the records of one."""
    triangle, ray = record_types(read, layout, precision, (TMAX,))
    real = REAL_TYPE[precision].__name__
    return instantiate(
        untested,
        signature=(
            "void(TRIANGLE[::1], RAY[::1], uint64[::1], uint64[::1], int32[::1], "
            f"{real}[::1], {real}[::1], {real}[::1])"
        ),
        constants={"TRIANGLE": dtype_source(triangle), "RAY": dtype_source(ray)},
        title=f"The naive loop without a test, over records of {read.name} in {precision}",
    )
