"""What accuracy costs in time: every form of a kernel, how long it takes and what it gets wrong.

Timed over random tests of which half hit, over such as a leaf of a tree meets, and over a mesh;
wrong answers are counted over a million tests of each kind, over as many far from the origin, and
over the hard cases. Each step of accuracy is one form beside another of the same run.
"""

from __future__ import annotations

from rtbench.compiled import packing
from rtbench.experiments import judged, nearest_mesh, typical_cells
from rtbench.experiments.bench import Bench
from rtbench.experiments.epsilons import KERNELS as EPSILONS
from rtbench.experiments.judged import Form, Records, Truth
from rtbench.experiments.typical_cells import CELL, IN_A_ROW, WIDTH, Workload
from rtbench.kernels.contract import Kernel
from rtbench.measure.schedule import PROCESSES, ROUNDS
from rtbench.records import schema
from rtbench.workloads import hard_cases, typical

__all__ = ["CELL", "build"]

DENSITIES = {"random": 0.5, "leaf": 0.047}  # of what is timed: nominal shares of hits
# Whom the compiler is given leave with; whose reciprocal is estimated in packets.
LOOSE = (
    *("moller_trumbore_uv", "moller_trumbore_stable_uv", "watertight_uv", "watertight_safe_uv"),
    "adaptive_exact_uv",
)
ESTIMATED = ("moller_trumbore_whole_uv", "moller_trumbore_stable_whole_uv", "kensler_shirley_uv")
OVER_MESH = (
    *("moller_trumbore_uv", "moller_trumbore_stable_uv", "half_open_uv", "watertight_uv"),
    *("watertight_safe_uv", "adaptive_exact_uv"),
)
OF_EPSILON = "moller_trumbore_uv"  # with it come the three that differ in their epsilon alone
PACKED = 8  # times as many tests in packets: they take a fraction of the time
ONE_RAY = 10  # as many pairs' tests go to a ray, about: fewer repetitions


def build(bench: Bench) -> None:
    """Add the cells, and count what every form gets wrong."""
    config = bench.config
    kernels = bench.kernels + [
        EPSILONS[name]
        for name in EPSILONS
        if name.endswith("_uv") and any(k.name == OF_EPSILON for k in bench.kernels)
    ]
    # They are no methods to be taken.
    bench.facts["apart"] = [kernel.name for kernel in kernels if kernel not in bench.kernels]
    for name, density in DENSITIES.items():
        bench.say(f"drawing {config.triangles} tests of each kind")
        drawn = typical.WORKLOADS[name](config.triangles, config.seed)
        workload = typical_cells.in_whole_blocks(drawn, density)
        bench.workloads.append(
            {
                "workload": name,
                "density": density,
                "triangles": len(workload.corners),
                "scene": config.triangles,
                "digest": drawn.digest,
            }
        )
        _add(bench, kernels, workload)
    _add_mesh(bench)
    bench.tables[schema.ACCURACY] = _judge(bench, forms(bench, kernels))


def forms(bench: Bench, kernels: list[Kernel]) -> list[Form]:
    """Return every form whose answers are its own; packets say what the scalar loop says."""
    config = bench.config
    found = [Form(kernel, each) for each in config.precisions for kernel in kernels]
    found += [
        Form(kernel, "float32", flags)
        for kernel in kernels
        for flags in config.flags
        if flags != "strict" and kernel.name in LOOSE and "float32" in config.precisions
    ]
    return found + [
        Form(kernel, "float32", reciprocal="estimate")
        for kernel in kernels
        if kernel.name in ESTIMATED and "float32" in config.precisions
    ]


def _add(bench: Bench, kernels: list[Kernel], workload: Workload) -> None:
    config = bench.config
    least = (config.processes or PROCESSES) * (config.samples or ROUNDS)
    more = max(config.repetitions * PACKED // IN_A_ROW, least)
    for form in forms(bench, kernels):
        kernel, precision, flags, reciprocal = form
        bench.say(f"compiling {kernel.name} in {precision}")
        if reciprocal == "estimate":
            typical_cells.add_packets(bench, kernel, precision, workload, reciprocal, more)
            continue
        outcome = typical_cells.add(bench, kernel, precision, workload, flags)[0]
        bench.facts.setdefault("hits", []).append(
            form.key | {"workload": workload.name, "hits": int((outcome == 0).sum())}
        )
        if flags == "strict" and nearest_mesh.in_packets(kernel, precision):
            typical_cells.add_packets(bench, kernel, precision, workload, repetitions=more)


def _add_mesh(bench: Bench) -> None:
    chosen = [kernel for kernel in bench.kernels if kernel.name in OVER_MESH]
    if not chosen:
        return
    config = bench.config
    rays = -(-config.rays // WIDTH) * WIDTH
    bench.say(f"drawing {rays} rays at a mesh")
    workload, expect = nearest_mesh.scene(rays, config.seed)
    bench.workloads.append(
        {
            "workload": workload.name,
            "density": workload.density,
            "triangles": len(workload.corners) * rays,
            "scene": len(workload.corners),
            "rays": rays,
            "rays_that_hit": int((expect == 1).sum()),
        }
    )
    least = (config.processes or PROCESSES) * (config.samples or ROUNDS)
    repetitions = max(config.repetitions // ONE_RAY, least)
    bench.facts["mesh"] = [
        row
        for precision in config.precisions
        for kernel in chosen
        for row in nearest_mesh.add_forms(bench, kernel, precision, workload, expect, repetitions)
    ]


def _judge(bench: Bench, asked: list[Form]) -> list[dict]:
    config, rows = bench.config, []
    count = config.sizes[0] if config.sizes else config.triangles
    for name, draw in typical.WORKLOADS.items():
        bench.say(f"exact answers to {count} tests ({name})")
        truth = Truth.of(draw(count, config.seed + 1))
        records = Records(*truth.tests[1:])
        for form in sorted(asked, key=lambda f: config.precisions.index(f.precision)):
            bench.say(f"{name}: what {form.kernel.name} in {form.precision} gets wrong")
            if form.reciprocal == "estimate" and packing.axis_fields(form.kernel):
                continue  # its pairs would have to be sorted by axis
            rows.append(judged.judge_typical(form, truth, records, config.layout))
    bench.say("making hard cases and their exact answers")
    cases = hard_cases.corpus(config.seed)
    for form in asked:
        bench.say(f"hard cases: what {form.kernel.name} in {form.precision} gets wrong")
        rows.append(judged.judge_corpus(form, cases, config.layout))
    return rows
