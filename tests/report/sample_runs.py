"""Writes run folders by the words of schema 1, with times that look like a machine's.

Nothing here is rtbench's own code: the numbers in a folder, medians included, are made by numpy.
"""

import csv
import json
from pathlib import Path

import numpy as np

CELL = ["kernel", "precision", "order", "density"]
TIMING = ["process", "launch", "round", "position", "triangles", "repetitions", "tests", "ns"]
LABELS = {
    "moller1": [
        "hit",
        "det > 0, u outside",
        "det > 0, v outside",
        "det < 0, u outside",
        "det < 0, v outside",
        "parallel",
    ],
    "badouel": ["hit", "parallel", "u1 = 0, beta outside", "beta outside", "alpha outside"],
    "chirkov": ["hit", "miss"],
}
CACHES = [
    {"level": 1, "type": "data", "size_bytes": 32768, "shared_by": 1},
    {"level": 1, "type": "instruction", "size_bytes": 32768, "shared_by": 1},
    {"level": 2, "type": "unified", "size_bytes": 1048576, "shared_by": 1},
    {"level": 3, "type": "unified", "size_bytes": 33554432, "shared_by": 8},
]
# ns a test at density 0 and at density 1, in repeat order.
ENDS = {
    "moller0": (9.1, 11.2),
    "moller1": (6.1, 8.9),
    "moller2": (6.6, 9.0),
    "moller3": (7.4, 8.6),
    "badouel": (9.8, 12.1),
    "chirkov": (6.9, 8.8),
    "empty": (0.4, 0.4),
}


def write_run(
    folder: Path,
    experiment: str,
    cells: list[dict],
    cell: list[str] = CELL,
    *,
    processes: int = 5,
    rounds: int = 6,
    triangles: int = 25_000,
    seed: int = 1,
    spread: float = 0.01,
    **info,
) -> Path:
    """Write a run; a cell needs ``ns``, the time that its samples scatter about."""
    folder.mkdir(parents=True)
    random = np.random.default_rng(seed)
    columns = [*cell, *(name for name in ["outcome", *TIMING, "cpu_ns"] if name not in cell)]
    placement = random.normal(1, spread, (processes, len(cells)))
    rows = []
    for number in range(rounds):  # the processes take turns
        for process in range(processes):
            for position, place in enumerate(random.permutation(len(cells))):
                one = cells[place]
                pairs = int(one.get("triangles") or triangles)
                factor = placement[process, place] * random.normal(1, spread / 2)
                factor *= 1 + 0.004 * number + (random.random() < 0.02) * random.exponential(0.4)
                tests = int(one.get("tests") or pairs * 40)
                ns = round(one["ns"] * factor * tests)
                rows.append(
                    {
                        **one,
                        "process": process,
                        "launch": 0,
                        "round": number,
                        "position": position,
                        "triangles": pairs,
                        "repetitions": 40,
                        "tests": tests,
                        "ns": ns,
                        "cpu_ns": ns,
                    }
                )
    with (folder / "samples.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    record = {
        "schema": 1,
        "name": folder.name,
        "created": "2026-01-02T03:04:05+00:00",
        "finished": "2026-01-02T03:05:05+00:00",
        "experiment": experiment,
        "title": f"{experiment.replace('_', ' ')}: a sample",
        "cell": cell,
        "config": {
            "kernels": list(dict.fromkeys(one["kernel"] for one in cells)),
            "triangles": triangles,
            "repetitions": 40 * processes * rounds,
            "bytes_per_pair": 100,
        },
        "seed": seed,
        "command": ["rtbench", "run"],
        "plan": {},
        "machine": {"label": "amd-epyc-9b14", "cpu_model": "AMD EPYC 9B14", "caches": CACHES},
        "software": {"python": "3.12.3", "numba": "0.68.0", "llvm": "20.1.8", "numpy": "2.4.6"},
        "load": {},
        "workloads": [],
        "kernels": {},
        "outcomes": [],
        "remarks": [],
    }
    (folder / "run.json").write_text(json.dumps(record | info), encoding="utf-8")
    return folder


def density_run(
    folder: Path,
    kernels=("moller1", "badouel", "chirkov"),
    densities=(0.0, 0.25, 0.5, 0.75, 1.0),
    orders=("repeat", "sweep"),
    precisions=("float32",),
    triangles: int = 25_000,
    ends=ENDS,
    **more,
) -> Path:
    cells, outcomes = [], []
    for precision in precisions:
        for order in orders:
            for density in densities:
                for kernel in [*kernels, "empty"]:
                    cells.append(
                        {
                            "kernel": kernel,
                            "precision": precision,
                            "order": order,
                            "density": density,
                            "ns": _ns(ends[kernel], order, density)
                            * (1.15 if precision == "float64" else 1),
                        }
                    )
        outcomes += _counts(kernels, precision, densities, triangles)
    return write_run(folder, "density", cells, triangles=triangles, outcomes=outcomes, **more)


def outcomes_run(folder: Path, **more) -> Path:
    times = {
        "moller1": [8.9, 5.6, 7.9, 6.0, 8.2, 4.4],
        "badouel": [12.1, 2.2, 8.0, 8.7, 11.5],
        "chirkov": [8.8, 6.9],
    }
    counts = {
        "moller1": [120720, 317737, 121256, 318641, 121632, 14],
        "badouel": [120720, 0, 11, 636800, 242469],
        "chirkov": [120720, 879280],
    }
    cells, outcomes = [], []
    for kernel, labels in LABELS.items():
        for code, label in enumerate(labels):
            known = {"kernel": kernel, "precision": "float32", "outcome": code}
            outcomes.append(
                {**known, "triangles": 1_000_000, "label": label, "count": counts[kernel][code]}
            )
            if counts[kernel][code]:
                cells.append(
                    {
                        **known,
                        "order": "repeat",
                        "ns": times[kernel][code],
                        "triangles": min(counts[kernel][code], 2500),
                    }
                )
    return write_run(
        folder, "outcomes", cells, ["kernel", "precision", "order"], outcomes=outcomes, **more
    )


def stages_run(folder: Path, **more) -> Path:
    parts = {
        "moller1": [
            ("edges", 0.9),
            ("P = D x E2", 0.8),
            ("det = E1 . P", 0.6),
            ("condition: sign of det", 0.9),
            ("T = O - V0", 0.3),
            ("u = T . P", 0.5),
            ("condition: u", 1.1),
            ("Q = T x E1", 0.6),
            ("v = D . Q", 0.5),
            ("condition: v", 0.8),
            ("t (division)", 1.3),
        ],
        "chirkov": [
            ("N . O and N . E", 1.6),
            ("edges", 0.5),
            ("first product", 1.4),
            ("condition: first side", 1.0),
            ("second product", -0.3),
            ("condition: second side", 0.9),
            ("t (division)", 1.4),
        ],
    }
    cells = [
        {"kernel": "empty", "precision": "float32", "stage": None, "stage_index": None, "ns": 0.4}
    ]
    for kernel, stages in parts.items():
        total = 0.4
        for index, (stage, adds) in enumerate(stages):
            total += adds
            cells.append(
                {
                    "kernel": kernel,
                    "precision": "float32",
                    "stage": stage,
                    "stage_index": index,
                    "ns": total,
                }
            )
    return write_run(
        folder,
        "stages",
        cells,
        ["kernel", "precision", "stage", "stage_index"],
        spread=0.004,
        **more,
    )


def working_set_run(folder: Path, **more) -> Path:
    cells = []
    for kernel, base, miss in (("moller1", 8, 14), ("badouel", 11, 12), ("chirkov", 9, 9)):
        for pairs in (256, 512, 1024, 2048, 4096, 8192, 16384, 65536, 262144, 1_000_000):
            learnt = 1 / (1 + np.exp(-(np.log2(pairs) - 11.5)))
            memory = 5 / (1 + np.exp(-(np.log2(pairs) - 18.5) * 2))
            cells.append(
                {
                    "kernel": kernel,
                    "precision": "float32",
                    "triangles": pairs,
                    "ns": base + miss * learnt + memory,
                }
            )
    return write_run(
        folder, "working_set", cells, ["kernel", "precision", "triangles"], **{"rounds": 3} | more
    )


def latency_run(folder: Path, **more) -> Path:
    cells = [
        {"kernel": kernel, "precision": "float32", "chain": chain, "ns": ns}
        for kernel, times in {
            "moller1": (6.2, 17.5),
            "badouel": (10.1, 24.0),
            "chirkov": (6.8, 20.2),
        }.items()
        for chain, ns in zip(("independent", "dependent"), times, strict=True)
    ]
    return write_run(folder, "latency", cells, ["kernel", "precision", "chain"], **more)


def prediction_run(folder: Path, **more) -> Path:
    points = []
    for kernel in ("moller1", "badouel", "chirkov"):
        for density in (0.0, 0.25, 0.5, 0.75, 1.0):
            mixture = _ns(ENDS[kernel], "repeat", density)
            branches = 1.3 - 1.1 * density + 0.3 * density * (1 - density)
            predicted = mixture + 5.2 * branches
            measured = predicted + 0.5 * np.sin(7 * density + len(kernel))
            points.append(
                {
                    "kernel": kernel,
                    "precision": "float32",
                    "density": density,
                    "measured": measured,
                    "ci_low": measured - 0.3,
                    "ci_high": measured + 0.25,
                    "mixture": mixture,
                    "branches_m": branches,
                    "predicted": predicted,
                }
            )
    fit = {"penalty_ns": 5.2, "ci": [4.8, 5.55], "points": points}
    path = density_run(folder, orders=("repeat", "sweep", "sorted"), fit=fit, **more)
    record = json.loads((path / "run.json").read_text(encoding="utf-8"))
    record["experiment"] = "prediction"
    (path / "run.json").write_text(json.dumps(record), encoding="utf-8")
    return path


def operations_run(folder: Path, **more) -> Path:
    write_run(folder, "operations", [], ["kernel"], **more)
    (folder / "operations.csv").write_text(
        "kernel,add,sub,mul,div,cond,differences,crosses,dots\n"
        "moller1,9,16,25,1,4,3,2,4\nbadouel,8,11,13,3,4,,,2\nchirkov,11,20,29,1,2,,,3\n",
        encoding="utf-8",
    )
    return folder


def _ns(ends: tuple[float, float], order: str, density: float) -> float:
    straight = ends[0] + (ends[1] - ends[0]) * density
    if order != "sweep" or ends[0] < 1:
        return straight
    return straight + 5.2 * (1.3 - 1.1 * density + 0.3 * density * (1 - density))


def _counts(kernels, precision: str, densities, triangles: int) -> list[dict]:
    found = []
    for kernel in kernels:
        for density in densities:
            hits = round(density * triangles)
            for code, count in enumerate((hits, triangles - hits)):
                found.append(
                    {
                        "kernel": kernel,
                        "precision": precision,
                        "density": density,
                        "triangles": triangles,
                        "outcome": code,
                        "label": ("hit", "miss")[code],
                        "count": count,
                    }
                )
    return found
