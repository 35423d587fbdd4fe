"""Šilhavý's statements on how trees, and the times of rays, grow with the number of triangles N."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rtbench.experiments.silhavy_measured import (
    OBJECT,
    SAH,
    SPATIAL,
    Rules,
    missing,
)
from rtbench.experiments.verdicts import (
    decided,
    shown,
    side,
    within,
)
from rtbench.records import derive
from rtbench.records.resampling import Estimate, Times, joined, paired_ratio, seed_of
from rtbench.records.run import Run
from rtbench.records.schema import EMPTY
from rtbench.report.tree_growth import exponent

if TYPE_CHECKING:
    from pandas import DataFrame

SHARE = (0.75, 0.95)  # of the naive way's time
NEARLY_LINEAR = (0.9, 1.1)  # exponents of N
HARDLY = 0.5  # an exponent of N below
FEWEST = 4  # points of a line, to trust the distances of so few from it


@dataclass(frozen=True)
class Slope:
    """The exponent of N in some numbers, with its interval."""

    value: float
    ends: tuple[float, float] | None

    def interval(self) -> tuple[float, float] | None:
        """Return the 95 % interval, None where there is none."""
        return self.ends


def slope(points: Mapping[int, Estimate]) -> Slope | Estimate | None:
    """Return the exponent of N in estimates by N.

    Its interval is that by how far the points lie from the line where they are enough for it, else
    that by their own noise.
    """
    sizes = sorted(points)
    fit = exponent(sizes, [points[n].value for n in sizes])
    if fit is None:
        return None
    if fit.points >= FEWEST and fit.low is not None:
        return Slope(fit.value, (fit.low, fit.high))
    draws = None
    if all(points[n].draws is not None for n in sizes):
        x = np.log(sizes)
        x -= x.mean()
        draws = x / (x @ x) @ np.log([points[n].draws for n in sizes])
    return joined(fit.value, draws, points.values())


def judge_each(found: Mapping[str, object], judge: Callable[[object], int]) -> str:
    """Return the verdict of several models, each judged alike."""
    return decided([judge(each) for each in found.values()])


def listed(found: Mapping[str, object]) -> str:
    """Return models' exponents as text."""
    return ", ".join(f"{name} {shown(each, digits=2)}" for name, each in found.items())


def naive_and_trees(runs):
    """Judge that the naive way is proportional to N, and trees hardly depend on it."""
    run: Rules = runs["sizes"]
    naive, trees = {}, {}
    for kind, models in run.trees.families.items():
        for name, found in (("naive", naive), ("SAH", trees)):
            points = {}
            for model in models:
                rays = next(iter(run.ray_sets(model)), None)
                one = run.best(model, SAH, rays)
                cell = run.trees.naive(one) if one and name == "naive" else one
                if cell is not None:
                    points[run.trees.triangles(model)] = run.trees.median(cell)
            if (fit := slope(points)) is not None:
                found[kind] = fit
    if not naive or not trees:
        return missing("no family of models in several sizes was traced both ways")
    sides = [within(each, *NEARLY_LINEAR) for each in naive.values()]
    sides += [-side(each, HARDLY) for each in trees.values()]
    low, high = NEARLY_LINEAR
    return decided(sides), (
        f"exponent of N in the time of a ray: naive {listed(naive)} (proportional: {low} to "
        f"{high}); SAH {listed(trees)} (hardly: below {HARDLY})"
    )


def cells(runs):
    """Judge that the number of cells grows nearly as N."""
    run: Rules = runs["sizes"]
    found: dict[str, dict[str, object]] = {}
    for kind, models in run.trees.families.items():
        for rule, name in ((SAH, "SAH"), (OBJECT, "object median"), (SPATIAL, "spatial median")):
            points = {
                run.trees.triangles(model): Estimate(float(tree.facts["nodes"]))
                for model in models
                for tree in run.built(model, rule)[:1]
            }
            if (fit := slope(points)) is not None:
                found.setdefault(name, {})[kind] = fit
    if "SAH" not in found:
        return missing("no family of models in several sizes has trees by the SAH")
    low, high = NEARLY_LINEAR
    return judge_each(found["SAH"], lambda each: within(each, low, high)), (
        "exponent of N in the number of nodes: "
        + "; ".join(f"{name}: {listed(each)}" for name, each in found.items())
        + f" (almost linear: the SAH's {low} to {high})"
    )


def tests_share(runs):
    """Judge which part of the naive way's time goes into tests."""
    run: Run = runs["naive"]
    there = derive.cells(run, ["kernel", "precision", "triangles"])
    precision = run.info["config"]["precisions"][0]
    kernels = list(dict.fromkeys(k for k, p, _ in there if k != EMPTY and p == precision))
    found: dict[str, dict[str, Estimate]] = {}
    for scene in run.info["scenes"]:
        for kernel in kernels:
            keys = [(name, precision, scene["pairs"]) for name in (EMPTY, kernel)]
            if not all(key in there for key in keys):
                continue
            times = [_cpu(there[key]) for key in keys]
            rest = paired_ratio(*times, seed_of(run.name))
            if rest is not None:
                draws = None if rest.draws is None else 1 - rest.draws
                one = joined(1 - rest.value, draws, [rest])
                found.setdefault(kernel, {})[f"{scene['triangles']:,} triangles"] = one
    if not found:
        return missing("the naive way with a kernel and with none")
    first = next(iter(found))
    low, high = SHARE
    return judge_each(found[first], lambda each: within(each, low, high)), (
        "; ".join(
            f"{kernel}: "
            + ", ".join(f"{name} {shown(e, ' %', 100, 1)}" for name, e in each.items())
            for kernel, each in found.items()
        )
        + f"; the rest is a loop that only reads the triangles, drawing rays and colours not "
        f"counted; judged by {first}, {low:.0%} to {high:.0%} as said"
    )


def _cpu(samples: DataFrame) -> Times:
    """Return a cell's nanoseconds a test, of the processor: others disturb it less."""
    ns = samples["cpu_ns"].to_numpy(float) / samples["tests"].to_numpy(float)
    return replace(derive.times(samples), ns=np.maximum(ns, 1e-9))
