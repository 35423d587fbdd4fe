"""Run folders of the experiments trees and tree_builders, by the words of their records.

`write` is `sample_runs.write_run`; times and trees are made up, in the order that the thesis says.
"""

import csv
import math
from pathlib import Path

import numpy as np

CELL = ["kernel", "precision", "model", "structure", "rule", "builder", "ending", "way", "rays"]
MODELS = {"scanned": 20_000, "even": 20_000}
# ns a ray of the stack through the tree of a rule, over 20,000 triangles; and what building takes.
RULES = {
    "sah": (400.0, 0.12),
    "object_median": (640.0, 0.05),
    "spatial_median": (980.0, 0.04),
}
RAYS = {"primary": 1.0, "shadow": 0.7, "random": 1.6}
WAYS = {"stack": (1.0, 1), "blocks": (0.7, 8), "packets": (0.3, 8), "wide": (0.6, 8)}
KERNELS = {"moller_trumbore": 1.0, "watertight_safe": 1.12, "adaptive_exact": 1.3}
ENDINGS = {"automatic": 1.0, "ad_hoc": 1.15}
NAIVE_NS = 2.0  # a ray and triangle
TREE_COLUMNS = [
    "model",
    "triangles",
    "structure",
    "rule",
    "builder",
    "ending",
    "axes",
    "candidates",
    "overlap",
    "traversal_cost",
    "intersection_cost",
    "max_leaf",
    "block",
    "process",
    "build_seconds",
    "build_cpu_seconds",
    "nodes",
    "leaves",
    "empty_leaves",
    "references",
    "depth",
    "bytes",
    "sah_cost",
    "expected_steps",
    "expected_leaves",
    "expected_tests",
    "digest",
]
VISIT_COLUMNS = [
    "model",
    "structure",
    "rule",
    "builder",
    "ending",
    "rays",
    "kernel",
    "precision",
    "block",
    "rays_counted",
    "hits",
    "steps",
    "leaves",
    "leaf_tests",
    "wrong",
    "rays_judged",
    "exact_wrong",
    "exact_judged",
    "never_hit",
]
BUILD_COLUMNS = [
    "builder",
    "rule",
    "axes",
    "candidates",
    "overlap",
    "model",
    "triangles",
    "process",
    "seconds",
    "cpu_seconds",
    "peak_bytes",
    "nodes",
    "references",
    "sah_cost",
    "digest",
]


def trees_run(
    folder: Path,
    write,
    models=None,
    rules=tuple(RULES),
    endings=tuple(ENDINGS),
    kernels=("moller_trumbore",),
    precisions=("float32",),
    ways=("stack",),
    rays=("primary", "shadow"),
    structures=("kd",),
    peers=("embree",),
    threads=(),
    naive=True,
    judged=True,
    images=False,
    reverse=(),
    config=(),
    processes=3,
    **more,
) -> Path:
    """Write a run; reverse: rules whose times are exchanged, for an order that does not hold."""
    models = models or MODELS
    cells, trees, visits = [], [], []
    times = dict(RULES)
    if reverse:
        one, other = reverse
        times[one], times[other] = times[other], times[one]
    for model, triangles in models.items():
        grown = math.log2(triangles) / math.log2(20_000)
        known = {"model": model, "triangles": triangles}
        blocks = sorted({WAYS[way][1] for way in ways if way != "wide"}) or [8]
        keys = [
            (
                {
                    "structure": "kd",
                    "rule": r,
                    "builder": "nlogn" if r == "sah" else r,
                    "ending": e,
                },
                b,
            )
            for r in rules
            for e in endings
            for b in blocks
        ]
        if "bvh" in structures:
            keys.append(({"structure": "bvh", "rule": "sah", "builder": "bvh", "ending": None}, 8))
        for key, block in keys:
            ns, seconds = times[key["rule"]]
            ns *= grown * ENDINGS.get(key["ending"], 1.0)
            trees += _builds(known | key, block, seconds, ns, processes)
            for name in rays:
                visits.append(_visit(model, key, block, name, ns * RAYS[name], kernels[0]))
            for kernel, precision, way, name in _walks(kernels, precisions, ways, rays):
                of_bvh = way == "wide"
                if of_bvh != (key["structure"] == "bvh") or (not of_bvh and WAYS[way][1] != block):
                    continue
                factor = KERNELS[kernel] * (1.3 if precision == "float64" else 1)
                cell = {"kernel": kernel, "precision": precision, "way": way, "rays": name}
                took = ns * factor * WAYS[way][0] * RAYS[name]
                cells.append(known | key | cell | {"ns": took, "tests": 40 * 1920})
                for number in threads:
                    several = {"way": f"{way}, {number} threads", "ns": took / (0.93 * number)}
                    cells.append(cells[-1] | several)
        for name in peers:
            key = dict.fromkeys(("structure", "rule", "builder", "ending"))
            for way in rays:
                cell = {"kernel": name, "precision": "float32", "way": "peer", "rays": way}
                took = 260.0 * grown * RAYS[way]
                cells.append(known | key | cell | {"ns": took, "tests": 40 * 1920})
            trees += _peers_builds(known, name, processes)
        if naive:
            key = {"structure": "none", "rule": None, "builder": None, "ending": None}
            cell = {"kernel": kernels[0], "precision": precisions[0], "way": "brute_force"}
            cell |= {"rays": "primary", "ns": NAIVE_NS * triangles, "tests": 40 * 64}
            cells.append(known | key | cell)
        if judged:
            visits += [
                _judged(model, k, p, name)
                for k, p, _, name in _walks(kernels, precisions, ways[:1], rays)
            ]
    write(
        folder,
        "trees",
        cells,
        CELL,
        processes=processes,
        config={
            "models": [*models],
            "kernels": list(kernels),
            "builders": ["nlogn"],
            "rules": list(rules),
            "ways": list(ways),
            **dict(config),
        },
        models=[{"model": m, "triangles": n, "source": "generated"} for m, n in models.items()],
        peers=[{"name": name, "title": "Embree", "version": "4.4", "absent": ""} for name in peers],
        peer_answers=[],
        **more,
    )
    _table(folder / "trees.csv", TREE_COLUMNS, trees)
    _table(folder / "visits.csv", VISIT_COLUMNS, visits)
    if images:
        for model in models:
            for rule in rules:
                picture(folder, model, rule)
    return folder


def tree_builders_run(
    folder: Path,
    write,
    sizes=(1000, 3000, 10_000, 30_000, 100_000, 300_000),
    builders=("nlogn", "nlog2n", "n2", "object_median"),
    different=(),
    processes=3,
    **more,
) -> Path:
    """Write a run; different: pairs of builder and size at which it made another tree."""
    random = np.random.default_rng(7)
    grows = {"nlogn": (6e-6, 1.05), "nlog2n": (7e-6, 1.15), "n2": (4e-9, 2.0)}
    builds = []
    for builder in builders:
        factor, power = grows.get(builder, (2e-6, 1.02))
        for size in sizes:
            if builder == "n2" and size > 10_000:
                continue
            for process in range(processes):
                seconds = factor * size**power * random.normal(1, 0.02)
                builds.append(
                    {
                        "builder": builder,
                        "rule": builder if "median" in builder else "sah",
                        "axes": "all",
                        "candidates": "all",
                        "overlap": "clipped",
                        "model": f"scanned:{size}",
                        "triangles": size,
                        "process": process,
                        "seconds": seconds,
                        "cpu_seconds": seconds,
                        "peak_bytes": 300 * size,
                        "nodes": 3 * size,
                        "references": 2 * size,
                        "sah_cost": 60.5,
                        "digest": f"{'other' if (builder, size) in different else 'tree'}{size}",
                    }
                )
    write(
        folder,
        "tree_builders",
        [],
        ["kernel"],
        config={"builders": list(builders), "models": ["scanned"]},
        **more,
    )
    _table(folder / "builds.csv", BUILD_COLUMNS, builds)
    return folder


def picture(folder: Path, model: str, rule: str, size=(24, 32)) -> None:
    """Write a heat map: a ball before nothing."""
    height, width = size
    row, column = np.mgrid[:height, :width]
    distance = np.hypot(row - height / 2, column - width / 2) / (height / 2.2)
    inside = distance < 1
    depth = np.where(inside, 3 - np.sqrt(np.maximum(1 - distance**2, 0)), np.nan)
    more = {"sah": 1, "object_median": 2, "spatial_median": 3}[rule]
    steps = np.where(inside, 20 * more + 30 * distance, 4 * more).astype(np.int32)
    tests = np.where(inside, 5 * more + 9 * distance, 0).astype(np.int32)
    (folder / "images").mkdir(exist_ok=True)
    name = f"{model}-{rule}.npz".replace(":", "-")
    np.savez(folder / "images" / name, steps=steps, tests=tests, depth=depth.astype(np.float32))


def _walks(kernels, precisions, ways, rays):
    return [(k, p, w, r) for k in kernels for p in precisions for w in ways for r in rays]


def _builds(key: dict, block: int, seconds: float, ns: float, processes: int) -> list[dict]:
    n = key["triangles"]
    leaves = 2 * n if key["rule"] != "object_median" else n
    row = key | {
        "axes": "all",
        "candidates": "all",
        "overlap": "clipped",
        "traversal_cost": 2.0,
        "intersection_cost": 1.0,
        "max_leaf": block,
        "block": block,
        "nodes": 2 * leaves - 1,
        "leaves": leaves,
        "empty_leaves": 0 if key["rule"] == "object_median" else leaves // 4,
        "references": 3 * n,
        "depth": 24,
        "bytes": 28 * n,
        "sah_cost": ns / 8,
        "expected_steps": ns / 25,
        "expected_leaves": ns / 120,
        "expected_tests": ns / 90,
        "digest": f"{key['structure']}{key['rule']}{key['ending']}{block}",
    }
    spread = np.linspace(0.95, 1.1, processes) if processes > 1 else [1.0]
    took = [seconds * n / 20_000 * each for each in spread]
    return [
        row | {"process": place, "build_seconds": each, "build_cpu_seconds": each}
        for place, each in enumerate(took)
    ]


def _peers_builds(known: dict, name: str, processes: int) -> list[dict]:
    return [
        known | {"structure": name, "process": process, "build_seconds": 0.03}
        for process in range(processes)
    ]


def _visit(model: str, key: dict, block: int, rays: str, ns: float, kernel: str) -> dict:
    counted = {"rays_counted": 76_800, "hits": 17_000, "steps": ns / 20, "leaves": ns / 100}
    told = {"model": model, "rays": rays, "kernel": kernel, "precision": "float32", "block": block}
    return key | told | counted | {"leaf_tests": ns / 70}


def _judged(model: str, kernel: str, precision: str, rays: str) -> dict:
    told = {"model": model, "rays": rays, "kernel": kernel, "precision": precision}
    return told | {
        "wrong": 0,
        "rays_judged": 1000,
        "exact_wrong": len(kernel) % 5,
        "exact_judged": 500,
    }


def _table(path: Path, columns: list[str], rows: list[dict]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
