"""Run folders of the experiments packets and compilers; times made by numpy and by hand.

`write` is `sample_runs.write_run`.
"""

import itertools
from pathlib import Path

# Kernel to title, base, ending, ns a test one by one and in packets of 16, whether it projects.
KERNELS = {
    "moller_trumbore_uv": ("Möller-Trumbore", "moller_trumbore", "uvt", 9.0, 0.38, False),
    "kensler_shirley_stored_uv": (
        *("Kensler-Shirley", "kensler_shirley_stored", "tuv", 2.4, 0.31, False),
    ),
    "wald_uv": ("Wald", "wald", "tuv", 2.3, 0.30, True),
}
LAST = {
    "moller_trumbore_last_uv": ("Möller-Trumbore", "moller_trumbore", "last_uvt", 13.0),
    "wald_last_uv": ("Wald", "wald", "last_tuv", 3.4),
    "moller_trumbore_last_whole_uv": ("Möller-Trumbore", "moller_trumbore", "last_whole", 8.0),
}
TARGETS = {"x86-64": 1.15, "avx2": 1.0, "avx512-512": 0.93}
FLAGS = {"strict": 1.0, "contract": 0.97, "fast": 0.94}
BASE = {
    "form": "rays",
    "width": 16,
    "packet": "general",
    "angle": 10.0,
    "exit": "none",
    "layout": "blocks",
    "axes": "stored",
    "reciprocal": "division",
}
COLUMNS = ["kernel", "precision", "order", "density", "prepared"]


def compilers_run(
    folder: Path,
    write,
    kernels=tuple(LAST),
    ratios=(0.1, 0.5),
    precisions=("float32",),
    targets=tuple(TARGETS),
    other_hits=(),
    **more,
) -> Path:
    """Write a run; other_hits: kernel, target, flags and how many rays have another triangle."""
    cells, variants = [], []
    wrong = {tuple(key): rays for *key, rays in other_hits}
    for precision, ratio, kernel in itertools.product(precisions, ratios, kernels):
        for target, flags in itertools.product(targets, FLAGS):
            key = {"kernel": kernel, "precision": precision, "density": ratio}
            key |= {"target": target, "flags": flags}
            factor = TARGETS[target] * FLAGS[flags] * (1.4 if precision == "float64" else 1)
            ns = LAST[kernel][3] * factor * (1 - ratio / 4)
            cells.append(key | {"order": "sweep", "prepared": "own", "ns": ns})
            fused = flags != "strict" and target != "x86-64"
            hits = wrong.get((kernel, target, flags), 0)
            counts = {"rays": 1024, "other_hits": hits, "other_t": 700 if fused else hits}
            variants.append(key | counts)
    return write(
        folder,
        "compilers",
        cells,
        [*COLUMNS, "target", "flags"],
        triangles=524288,
        variants=variants,
        config={"kernels": list(kernels), "targets": list(targets)},
        methods={kernel: _method(*LAST[kernel][:3]) for kernel in kernels},
        workloads=[_workload(ratio) for ratio in ratios],
        **more,
    )


def packets_run(
    folder: Path,
    write,
    kernels=tuple(KERNELS),
    ratios=(0.1, 0.5),
    precisions=("float32",),
    widths=(16, 8, 4),
    packets=("general", "common", "parallel"),
    angles=(10.0, 0.0, 1.0, 30.0, 90.0),
    forms=("rays", "triangles", "pairs"),
    packings=True,
    **more,
) -> Path:
    cells, estimates = [], []
    for precision, ratio, kernel in itertools.product(precisions, ratios, kernels):
        base = BASE | {"packet": packets[0], "angle": angles[0], "width": widths[0]}
        start = {"kernel": kernel, "precision": precision, "order": "sweep"}
        start |= {"density": ratio, "prepared": "own"}
        wide = 2 if precision == "float64" else 1
        *_, scalar, packed, projects = KERNELS[kernel]
        cells.append(start | base | {"width": 1, "layout": "own", "ns": scalar})
        for kind, angle in itertools.product(packets, angles):
            shared = base | {"packet": kind, "angle": angle}
            ns = packed * wide
            cells.append(start | shared | {"ns": ns})
            cells.append(start | shared | {"exit": "any", "ns": ns * (0.8 + angle / 100)})
        for form, width in itertools.product(forms[:2], widths):
            if (form, width) != ("rays", widths[0]):
                ns = packed * wide * 16 / width * (1.1 if form == "triangles" else 1)
                cells.append(start | base | {"form": form, "width": width, "ns": ns})
        if packings:
            cells += [start | one for one in _packings(base, packed * wide, forms, projects)]
        if packings and precision == "float32":
            estimate = base | {"reciprocal": "estimate"}
            cells.append(start | estimate | {"ns": packed * 1.05})
            told = {"rays": 1024, "differ": 2, "median": 3e-8, "most": 1.9e-7}
            estimates.append(start | estimate | told)
    cells += _pairs(kernels, precisions, widths) if "pairs" in forms else []
    config = {"packets": list(packets), "angles": list(angles), "forms": list(forms)}
    config |= {"triangles": 512, "rays": 1024, "kernels": list(kernels)}
    return write(
        folder,
        "packets",
        cells,
        [*COLUMNS, *BASE],
        triangles=524288,
        estimates=estimates,
        config=config,
        methods={kernel: _method(*KERNELS[kernel][:3]) for kernel in kernels},
        workloads=[*(_workload(ratio) for ratio in ratios), {"density": 0.5, "triangles": 32768}],
        **more,
    )


def _packings(base: dict, ns: float, forms, projects: bool) -> list[dict]:
    cells = [
        base | {"form": form, "layout": layout, "ns": ns * (1 if layout == "soa" else 2.5)}
        for form in forms[:2]
        for layout in ("soa", "aos")
    ]
    return cells + [
        base | {"axes": axes, "ns": ns * factor}
        for axes, factor in (("table", 1.02), ("fixed", 0.9))
        if projects
    ]


def _pairs(kernels, precisions, widths) -> list[dict]:
    cells = []
    for precision, kernel in itertools.product(precisions, kernels):
        start = {"kernel": kernel, "precision": precision, "order": "sweep"}
        start |= {"density": 0.5, "prepared": "own"} | BASE
        start |= {"form": "pairs", "packet": None, "angle": None, "triangles": 32768}
        cells.append(start | {"width": 1, "layout": "own", "ns": 11.0})
        cells += [start | {"width": width, "ns": 1.0 + 2 / width} for width in widths]
        cells += [start | {"layout": layout, "ns": 2.6} for layout in ("soa", "aos")]
    return cells


def _method(method: str, base: str, ending: str) -> dict:
    return {
        "title": f"{method}; {ending}",
        "method": method,
        "outputs": ["t", "u", "v"],
        "operations": {},
        "base": base,
        "stored": "none" if base == "moller_trumbore" else "precomputed",
        "ending": ending,
        "division": "last" if ending.startswith("last") else "first",
        "early": not ending.endswith("whole"),
    }


def _workload(ratio: float) -> dict:
    return {
        "density": ratio,
        "triangles": 524288,
        "scene": 512,
        "rays": 1024,
        "hits": round(1.037 * ratio * 524288),
        "hit_ratio": 1.037 * ratio,
        "rays_that_hit": 1024,
        "distance_share": 0.9014,
    }
