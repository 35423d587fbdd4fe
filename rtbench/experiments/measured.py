"""The cells of a run as estimates that were resampled together, and what is made of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from rtbench.records import derive
from rtbench.records.resampling import (
    Estimate,
    Times,
    joined,
    mean,
    median,
    ratio,
    seed_of,
    total,
)
from rtbench.records.run import Run


class Measured:
    """The cells of a run as estimates that were resampled together."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self._seed = seed_of(run.name)

    @cached_property
    def _cells(self) -> dict[tuple, object]:
        return derive.cells(self.run, ["kernel", "order", "density", self._last, "outcome"])

    @property
    def _last(self) -> str:
        return "stage" if "stage" in self.run.cell else "precision"

    def times(
        self,
        kernel: str,
        density: float,
        order: str = "repeat",
        stage: str | None = None,
        outcome: int | None = None,
    ) -> Times:
        """Return the samples of a cell."""
        last = stage if self._last == "stage" else self.run.info["config"]["precisions"][0]
        return derive.times(self._cells[kernel, order, density, last, outcome])

    def cost(self, kernel: str, density: float, **which: object) -> Estimate:
        """Return ns a test of a cell."""
        return median(self.times(kernel, density, **which), self._seed)

    def whole(self, kernel: str) -> Estimate:
        """Return the sum over the run's densities in repeat order."""
        densities = self.run.info["config"]["densities"]
        return median(total([self.times(kernel, d) for d in densities]), self._seed)

    def groups(self, kernel: str, density: float | None) -> dict[int, tuple[int, Estimate]]:
        """Return count and cost of each outcome that occurs."""
        return {
            entry["outcome"]: (
                entry["count"],
                self.cost(kernel, density, outcome=entry["outcome"]),
            )
            for entry in self.run.info["outcomes"]
            if entry["kernel"] == kernel and entry["density"] == density and entry["count"]
        }

    def mixture(self, kernel: str, density: float) -> Estimate:
        """Return sum f_i t_i over the outcomes."""
        found = self.groups(kernel, density).values()
        return weighted([cost for _, cost in found], [count for count, _ in found])


class Soups:
    """The cells of a run over soups as estimates that were resampled together."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.ratios = run.info["config"]["densities"]
        self.methods = run.info.get("methods") or {}

    @cached_property
    def cells(self) -> dict[tuple, object]:
        """The samples by kernel, precision and hit ratio."""
        return derive.cells(self.run, ["kernel", "precision", "density"])

    def cost(self, kernel: str, density: float, precision: str = "float32") -> Estimate:
        """Return ns a test of a cell."""
        times = derive.times(self.cells[kernel, precision, density])
        return median(times, seed_of(self.run.name))

    def whole(self, kernel: str, precision: str = "float32") -> Estimate:
        """Return the mean over the hit ratios."""
        costs = [self.cost(kernel, density, precision) for density in self.ratios]
        return mean(costs)

    def compared(self, slow: str, fast: str) -> Estimate:
        """Return how many times as long the first takes, over all hit ratios."""
        return ratio(self.whole(slow), self.whole(fast), paired=True)


def weighted(costs: list[Estimate], weights: list[float]) -> Estimate:
    """Return the weighted mean of estimates that were resampled together."""
    share = np.asarray(weights, float) / np.sum(weights)
    draws = None
    if all(cost.draws is not None for cost in costs):
        draws = share @ np.array([cost.draws for cost in costs])
    return joined(float(share @ [cost.value for cost in costs]), draws, costs)


def kind_of(stage: str) -> str:
    """Return what a stage does, by its name: conditions, divisions, differences or products."""
    if stage.startswith("condition"):
        return "conditions"
    if "division" in stage:
        return "divisions"
    differences = ("edges", "difference", "T = O")  # what subtracts vectors
    return "differences" if stage.startswith(differences) else "products"


def _parts(run: Measured, kernel: str) -> dict[str, tuple[float, np.ndarray | None]]:
    """Return the share of each stage in the kernel's cost: value and resamples."""
    rows = run.run.summary.query("kernel == @kernel").sort_values("stage_index")
    stages = list(rows["stage"])
    costs = [run.cost("empty", 1.0)] + [run.cost(kernel, 1.0, stage=stage) for stage in stages]
    known = all(cost.draws is not None for cost in costs)
    return {
        stage: (
            (after.value - before.value) / (costs[-1].value - costs[0].value),
            (after.draws - before.draws) / (costs[-1].draws - costs[0].draws) if known else None,
        )
        for stage, before, after in zip(stages, costs, costs[1:], strict=False)
    }


def share(run: Measured, kernel: str, chosen: Callable[[str], bool]) -> Estimate:
    """Return the part of a kernel's time that the chosen stages take."""
    parts = [part for stage, part in _parts(run, kernel).items() if chosen(stage)]
    draws = None if any(d is None for _, d in parts) else sum(d for _, d in parts)
    return joined(sum(value for value, _ in parts), draws, [run.cost(kernel, 1.0, stage="whole")])
