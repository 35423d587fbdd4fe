"""What Havel 2008 states of errors and of the triangles that are chosen (section 5.5)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rtbench.experiments.measured import Soups
from rtbench.experiments.verdicts import CONFIRMED, REFUTED, decided


def same_triangles(runs: Mapping[str, Soups]) -> tuple[str, str]:
    """Judge: no two methods choose different triangles for a ray."""
    counted = [
        entry
        for run in runs.values()
        for entry in run.run.info.get("nearest") or []
        if not entry["kernel"].startswith("angle_sum")
    ]
    if "5.5" in runs:
        choices = runs["5.5"].run.choices
        counted += choices[choices["kernel"].notna()].to_dict("records")
    differ = [entry for entry in counted if entry["differ"]]
    total = sum(entry["rays"] for entry in counted)
    return (REFUTED if differ else CONFIRMED), (
        f"{sum(entry['differ'] for entry in differ)} of {total} rays end at another triangle than "
        "the exact one, over all kernels, precisions and sets but angle sum"
        + (": " + ", ".join(sorted({entry["kernel"] for entry in differ})) if differ else "")
    )


def _errors(run: Soups, precision: str):
    frame = run.run.errors
    return frame[(frame["precision"] == precision) & (frame["reference"] == "exact")]


def order_of_errors(runs: Mapping[str, Soups]) -> tuple[str, str]:
    """Judge: errors are of the order of 1e-6 in single precision and 1e-14 in double."""
    single, double = (_errors(runs["5.5"], p)["mean"] for p in ("float32", "float64"))
    good = single.between(1e-7, 1e-5).all() and double.between(1e-16, 1e-13).all()
    return (CONFIRMED if good else REFUTED), (
        f"means from {single.min():.2g} to {single.max():.2g} in single and from "
        f"{double.min():.2g} to {double.max():.2g} in double precision (confirmed within a factor "
        "of 10 of 1e-6, and of 100 of 1e-14: his double-precision reference had errors of its own)"
    )


def largest_error(runs: Mapping[str, Soups]) -> tuple[str, str]:
    """Judge: Möller-Trumbore's errors are the largest."""
    frame = _errors(runs["5.5"], "float32")
    numbers, sides = [], []
    for quantity, rows_ in frame.groupby("quantity"):
        own = rows_[rows_["kernel"] == "moller_trumbore_uv"].iloc[0]
        worst = rows_.loc[rows_["mean"].idxmax()]
        larger = int((rows_["mean"] > own["mean"]).sum())
        sides.append(-1 if worst["ci_low"] > own["ci_high"] else int(larger == 0))
        numbers.append(
            f"{quantity}: {own['mean'] * 1e6:.2f} [{own['ci_low'] * 1e6:.2f}, "
            f"{own['ci_high'] * 1e6:.2f}] millionths, {larger} of {len(rows_)} are larger "
            f"({worst['kernel']} {worst['mean'] * 1e6:.2f})"
        )
    return decided(sides), f"Möller-Trumbore against exact answers: {'; '.join(numbers)}"


def moved_error(runs: Mapping[str, Soups]) -> tuple[str, str]:
    """Judge: moving the division does not change the errors."""
    frame = _errors(runs["5.5"], "float32").set_index(["kernel", "prepared", "quantity"])
    found = {}
    for (kernel, prepared, quantity), row in frame.iterrows():
        last = kernel.removesuffix("_uv") + "_last_uv", prepared, quantity
        if last in frame.index:
            found[last] = frame.loc[last, "mean"] / row["mean"]
    low, high = min(found.values()), max(found.values())
    worst = max(found, key=lambda key: abs(np.log(found[key])))
    verdict = CONFIRMED if low >= 0.8 and high <= 1.25 else REFUTED
    return verdict, (
        f"mean error with the division last / first: {low:.2f} to {high:.2f} over {len(found)} "
        f"cells, most {' '.join(worst)} {found[worst]:.2f} (confirmed between 0.8 and 1.25)"
    )


def compiler_error(runs: Mapping[str, Soups]) -> tuple[str, str]:
    """Judge: the compiler does not change the errors."""
    variants = runs["compilers"].run.info["variants"]
    numbers, strict = [], 0
    for flags in dict.fromkeys(each["flags"] for each in variants):
        own = [each for each in variants if each["flags"] == flags]
        rays_, hits, t = (sum(e[name] for e in own) for name in ("rays", "other_hits", "other_t"))
        strict = t if flags == "strict" else strict
        numbers.append(f"{flags}: another t for {t / rays_:.1%}, another triangle for {hits}")
    return (REFUTED if strict else CONFIRMED), (
        f"against strict arithmetic for {variants[0]['target']}, of all rays, {'; '.join(numbers)} "
        "(confirmed if strict arithmetic is the same for every target)"
    )
