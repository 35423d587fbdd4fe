"""Run folders of Havel's experiments, by the words of their records; times made by numpy alone.

`write` is `sample_runs.write_run`.
"""

from pathlib import Path

import numpy as np

RATIOS = (0.1, 0.5)
# Method and what it stores, by base; ns a test at both hit ratios, ns to prepare, bytes packed
# and padded.
METHODS = {
    "moller_trumbore": ("Möller-Trumbore", "none", (18.5, 12.7), None, 36, 48),
    "kensler_shirley": ("Kensler-Shirley", "none", (9.5, 6.4), None, 36, 48),
    "kensler_shirley_stored": ("Kensler-Shirley", "precomputed", (7.8, 5.6), 27.0, 48, 64),
    "half_spaces_perpendicular": ("Half-spaces", "none", (26.0, 21.0), None, 36, 48),
    "signed_areas": ("Signed areas", "normal", (12.0, 10.4), 24.0, 48, 64),
    "wald": ("Wald", "precomputed", (6.9, 4.6), 130.0, 48, 48),
}
# What an ending does to a time.
ENDINGS = {
    "tuv": ("first", True, 1.0),
    "uvt": ("first", True, 1.7),
    "last_tuv": ("last", True, 1.04),
    "last_uvt": ("last", True, 1.75),
    "whole": ("first", False, 0.85),
    "last_whole": ("last", False, 0.97),
}
# The size, from which on a cache is left, counts in bytes; the memory is slow for all of them.
STORED_KERNELS = {
    "moller_trumbore_last_whole_uv": (6.8, 6.8),
    "kensler_shirley_last_tuv_uv": (7.9, 5.9),
    "kensler_shirley_stored_last_whole_uv": (5.6, 5.5),
    "wald_last_whole_uv": (4.2, 4.2),
    "wald_last_tuv_uv": (6.2, 3.9),
}
SIZES = (64, 512, 4096, 32768, 262144)


def soup_run(
    folder: Path,
    write,
    bases=tuple(METHODS),
    endings=("last_tuv",),
    precisions=("float32",),
    ratios=RATIOS,
    prepared=("own",),
    differ=0,
    **more,
) -> Path:
    cells, nearest = [], []
    for precision in precisions:
        for ratio in ratios:
            for base in bases:
                stores = METHODS[base][3] is not None
                for ending in endings:
                    for way in prepared if stores else prepared[:1]:
                        cell = {
                            "kernel": f"{base}_{ending}_uv",
                            "precision": precision,
                            "order": "sweep",
                            "density": ratio,
                            "prepared": way,
                        }
                        factor = ENDINGS[ending][2] * (1.25 if precision == "float64" else 1)
                        cells.append(cell | {"ns": METHODS[base][2][RATIOS.index(ratio)] * factor})
                        nearest.append(
                            cell | {"triangles": 524288, "rays": 1024, "differ": 0, "wrong": 0}
                        )
    if differ:
        nearest[1] |= {"differ": differ, "wrong": 1}
    names = [(base, ending) for base in bases for ending in endings]
    return write(
        folder,
        "soup",
        cells,
        ["kernel", "precision", "order", "density", "prepared"],
        triangles=524288,
        methods={f"{base}_{ending}_uv": _method(base, ending) for base, ending in names},
        kernels={
            f"{base}_{ending}_uv": {precision: _stored(base, precision) for precision in precisions}
            for base, ending in names
        },
        workloads=[_workload(ratio, 512, 1024) for ratio in ratios],
        nearest=nearest,
        **more,
    )


def break_even_run(folder: Path, write, precisions=("float32",), sizes=SIZES, **more) -> Path:
    cells, preparation, rows = [], [], []
    for precision in precisions:
        wide = 2 if precision == "float64" else 1
        for size in sizes:
            times = {}
            for kernel, ns in STORED_KERNELS.items():
                base, padded = _base(kernel), METHODS[_base(kernel)][5] * wide
                filled = 1 / (1 + np.exp(-(np.log2(size * padded / 8e6)) * 2))
                for place, ratio in enumerate(RATIOS):
                    times[kernel, ratio] = ns[place] * wide**0.3 + 1.6 * filled * padded / 48
                    cells.append(
                        {
                            "kernel": kernel,
                            "precision": precision,
                            "order": "sweep",
                            "density": ratio,
                            "prepared": "own",
                            "scene": size,
                            "triangles": 524288,
                            "ns": times[kernel, ratio],
                        }
                    )
                if METHODS[base][3] is None:
                    continue
                prepare = METHODS[base][3] * (1 + 200 / size)
                preparation.append(
                    {
                        "kernel": kernel,
                        "precision": precision,
                        "scene": size,
                        "ns_per_triangle": prepare,
                        "ci_low": 0.97 * prepare,
                        "ci_high": 1.02 * prepare,
                        "samples": [0.97 * prepare, prepare, prepare, prepare, 1.02 * prepare],
                        "bytes_per_triangle": padded,
                    }
                )
            rows += _break_even(precision, size, times, preparation)
    return write(
        folder,
        "break_even",
        cells,
        ["kernel", "precision", "order", "density", "prepared", "scene"],
        triangles=524288,
        methods={
            kernel: _method(_base(kernel), kernel.removeprefix(f"{_base(kernel)}_")[:-3])
            for kernel in STORED_KERNELS
        },
        kernels={
            kernel: {precision: _stored(_base(kernel), precision) for precision in precisions}
            for kernel in STORED_KERNELS
        },
        workloads=[
            _workload(ratio, size, max(8, 524288 // size)) for size in sizes for ratio in RATIOS
        ],
        preparation=preparation,
        break_even=rows,
        **more,
    )


def _break_even(precision: str, size: int, times: dict, preparation: list[dict]) -> list[dict]:
    rows = []
    for ratio in RATIOS:
        plain = {
            kernel: ns
            for (kernel, density), ns in times.items()
            if density == ratio and METHODS[_base(kernel)][1] == "none"
        }
        against = min(plain, key=plain.get)
        for one in preparation:
            if (one["precision"], one["scene"]) != (precision, size):
                continue
            saved = plain[against] - times[one["kernel"], ratio]
            rays = one["ns_per_triangle"] / saved if saved > 0 else None
            rows.append(
                {
                    "kernel": one["kernel"],
                    "precision": precision,
                    "density": ratio,
                    "scene": size,
                    "against": against,
                    "ns_per_test": times[one["kernel"], ratio],
                    "against_ns": plain[against],
                    "preparation_ns": one["ns_per_triangle"],
                    "rays_per_triangle": rays,
                    "ci_low": 0.8 * rays if rays else 300.0,
                    "ci_high": 1.3 * rays if rays else None,
                }
            )
    return rows


def _base(kernel: str) -> str:
    return max((base for base in METHODS if kernel.startswith(base)), key=len)


def _method(base: str, ending: str) -> dict:
    method, stored = METHODS[base][:2]
    division, early, _ = ENDINGS[ending]
    return {
        "title": f"{method}; {ending}",
        "method": method,
        "outputs": ["t", "u", "v"],
        "operations": {"add": 9, "sub": 15, "mul": 28, "div": 1, "cond": 3},
        "base": base,
        "stored": stored,
        "ending": ending,
        "division": division,
        "early": early,
    }


def _stored(base: str, precision: str) -> dict:
    wide = 2 if precision == "float64" else 1
    *_, prepare, packed, padded = METHODS[base]
    sizes = {"bytes_per_triangle": packed * wide, "bytes_per_triangle_padded": padded * wide}
    return sizes if prepare is None else sizes | {"prepare_ns_per_triangle": prepare}


def _workload(ratio: float, triangles: int, rays: int) -> dict:
    return {
        "density": ratio,
        "triangles": triangles * rays,
        "scene": triangles,
        "rays": rays,
        "hits": round(1.037 * ratio * triangles * rays),
        "hit_ratio": 1.037 * ratio,
        "rays_that_hit": rays,
        "distance_share": 0.9014,
    }
