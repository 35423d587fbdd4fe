"""Cells over typical tests and over a mesh: kernels one by one and in packets, on the same rays."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rtbench.compiled import packets, packing
from rtbench.compiled.instantiate import Instance
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import bytes_per_triangle, fill
from rtbench.compiled.packing import Packing
from rtbench.experiments.bench import Bench
from rtbench.experiments.packets import in_blocks, must_be_equal
from rtbench.experiments.preparation import preparation_times
from rtbench.kernels.contract import HIT, Kernel
from rtbench.measure.sampler import stopwatch
from rtbench.measure.session import Timed
from rtbench.workloads.typical import Tests

CELL = (
    *("kernel", "precision", "order", "density", "prepared"),
    *("workload", "form", "width", "flags", "reciprocal"),
)
SCALAR, WIDTH = "scalar", 16
ORDER = "sweep"  # in memory, one after the other, in the order in which they were drawn
# Packets wait for the third cache (0.96 ns instead of 0.6 were seen): so many of their tests, which
# the second cache holds, are taken so often in a row before the next. One by one nothing waits.
NEAR, IN_A_ROW = 4096, 16


@dataclass(frozen=True, eq=False)
class Workload:
    """What is timed: N tests, or R rays of which each meets all T triangles of a scene.

    Attributes
    ----------
    name : str
    density : float
        Nominal share of the tests, or of the rays, that hit.
    corners : (N, 3, 3) or (T, 3, 3) array
    origins, directions : (N, 3) or (R, 3) arrays
    scene : bool
        Whether every ray meets all triangles.
    given : dict
        What was said one by one, by kernel and precision: packets must say the same.
    """

    name: str
    density: float
    corners: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    scene: bool = False
    given: dict = field(default_factory=dict)

    @property
    def tests(self) -> int:
        """Tests for each ray."""
        return len(self.corners) if self.scene else 1

    @property
    def form(self) -> str:
        """How packets take it: `rtbench.compiled.packing.FORMS`."""
        return "rays" if self.scene else "pairs"


def in_whole_blocks(tests: Tests, density: float) -> Workload:
    """Return tests as a workload: blocks of 16 share an axis of projection, a few are left out."""
    blocks = in_blocks(tests, WIDTH).reshape(-1, WIDTH)
    # Shuffled: the blocks of an axis came one after the other.
    found = np.random.default_rng(len(blocks)).permutation(blocks).reshape(-1)
    return Workload(tests.name, density, *tests.take(found)[1:])


def add(
    bench: Bench,
    kernel: Kernel,
    precision: str,
    workload: Workload,
    flags: str = "strict",
    repetitions: int | None = None,
) -> tuple[np.ndarray, ...]:
    """Add a cell of a kernel with its early exits, ray by ray.

    Parameters
    ----------
    bench : Bench
    kernel, precision, workload
        What is timed, over what.
    flags : str
        What LLVM may do with floats.
    repetitions : int, optional
        The config's if not given.

    Returns
    -------
    tuple of (N,) arrays
        outcome (of a scene: the nearest triangle, -1 for none), t, u, v.
    """
    kind = "nearest" if workload.scene else "independent"
    instance = bench.instance(kernel, precision, kind=kind, flags=flags)
    corners = tuple(np.ascontiguousarray(workload.corners[:, k]) for k in range(3))
    limit = np.inf if workload.scene or kernel.takes_tmax else None
    records = fill(
        kernel,
        bench.config.layout,
        precision,
        corners,
        workload.origins,
        workload.directions,
        tmax=limit,
    )
    outputs = run_once(instance, kernel, precision, *records)
    _, seconds = stopwatch(lambda: run_once(instance, kernel, precision, *records))
    if flags == "strict":
        workload.given[kernel.name, precision] = outputs
    _note_storage(bench, kernel, precision, corners)
    kept = [outputs[0], *(o if k < len(kernel.outputs) else o[:0] for k, o in _numbered(outputs))]
    key = {"form": SCALAR, "width": 1, "flags": flags, "reciprocal": "division"}
    _append(bench, kernel, precision, workload, key, instance, records, kept, seconds, repetitions)
    return outputs


def add_packets(
    bench: Bench,
    kernel: Kernel,
    precision: str,
    workload: Workload,
    reciprocal: str = "division",
    repetitions: int | None = None,
) -> tuple[np.ndarray, ...]:
    """Add a cell of a kernel in packets of 16.

    Parameters
    ----------
    bench, kernel, precision, workload, repetitions
        As for `add`, which must have been asked first.
    reciprocal : str
        ``division``, or the processor's ``estimate`` and one Newton step.

    Returns
    -------
    tuple of (N,) arrays
        As `add` returns them; outcome is 0 or 1 where pairs are tested.

    Raises
    ------
    WrongAnswers
        If packets say anything else than the scalar loop; an estimate may.
    """
    chosen = Packing(workload.form, WIDTH, reciprocal=reciprocal)
    outputs, seconds, instance, records = ask_packets(
        kernel, precision, chosen, workload.corners, workload.origins, workload.directions
    )
    found = tuple(each.reshape(-1) for each in outputs)
    if reciprocal == "division":
        given = list(workload.given[kernel.name, precision])
        if not workload.scene:
            given[0] = (given[0] != HIT).astype(np.int32)
        told = {"kernel": kernel.name, "precision": precision, "workload": workload.name}
        must_be_equal(told, found[: 1 + len(kernel.outputs)], given)
    key = {"form": workload.form, "width": WIDTH, "flags": "strict", "reciprocal": reciprocal}
    _append(
        bench, kernel, precision, workload, key, instance, records, outputs, seconds, repetitions
    )
    return found


def ask_packets(
    kernel: Kernel,
    precision: str,
    chosen: Packing,
    corners: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
) -> tuple[tuple[np.ndarray, ...], float, Instance, tuple[np.ndarray, np.ndarray]]:
    """Return what packets say, (P, W) each; how long they took; their loop and records."""
    records = (
        packing.fill_triangles(kernel, precision, chosen, corners),
        packing.fill_rays(kernel, precision, chosen, origins, directions),
    )
    instance = packets.loop(kernel, precision, chosen, packing.held(chosen, *records))
    what = instance, kernel, precision, chosen, records, len(origins)
    outputs = packets.run_once(*what)
    _, seconds = stopwatch(lambda: packets.run_once(*what))
    return outputs, seconds, instance, records


def _append(
    bench, kernel, precision, workload, key, instance, records, outputs, seconds, repetitions
) -> None:
    label = f"{workload.name}|{kernel.name}|{precision}|{sorted(key.items())}"
    prepare = kernel.prepare and (kernel.prepare.__module__, kernel.prepare.__qualname__)
    kept = [f"{workload.name}|{prepare}|{len(part)} {part.dtype}" for part in records]
    arrays = bench.arrays
    places = np.arange(len(outputs[0]), dtype=np.uint64)
    if key["form"] == "pairs":
        parts = [places[k : k + NEAR // WIDTH] for k in range(0, len(places), NEAR // WIDTH)]
        places = np.concatenate([np.tile(part, IN_A_ROW) for part in parts])
    tests = workload.tests * key["width"]
    bench.cells.append(
        Timed(
            key={"kernel": kernel.name, "precision": precision, "order": ORDER}
            | {"density": workload.density, "prepared": "own", "workload": workload.name}
            | key,
            instance=instance,
            triangles=arrays.add(f"triangles|{kept[0]}", records[0]),
            rays=arrays.add(f"rays|{kept[1]}", records[1]),
            pairs=arrays.add(f"{key['form']} {len(places)}", places),
            expected=tuple(
                arrays.add(f"{label}|{place}", each) for place, each in enumerate(outputs)
            ),
            order=ORDER,
            count=len(places),
            repetitions=repetitions or bench.config.repetitions,
            nanoseconds=seconds * 1e9 / (len(outputs[0]) * tests),
            tests=tests,
        )
    )


def _numbered(outputs: tuple) -> list:
    return list(enumerate(outputs[1:]))


def _note_storage(bench: Bench, kernel: Kernel, precision: str, corners: tuple) -> None:
    """Keep what a kernel stores of a triangle, and how long preparing it takes."""
    facts = bench.compiled[kernel.name][precision]
    if "bytes_per_triangle" not in facts:
        facts["bytes_per_triangle"] = bytes_per_triangle(kernel, "own", precision)
        if kernel.prepare is not None:
            times = preparation_times(kernel, precision, corners)
            facts["prepare_ns_per_triangle"] = float(np.median(times))
