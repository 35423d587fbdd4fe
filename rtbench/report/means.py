"""Means over the densities that several runs share, so that machines can be put side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rtbench.records import derive, statistics
from rtbench.records.schema import FIVE_DENSITIES, MEAN
from rtbench.report import cells
from rtbench.report.digits import absent

if TYPE_CHECKING:
    from rtbench.records.run import Run

NAN = float("nan")


class Mean(NamedTuple):
    """A mean of ns a test over densities; the ends of its interval are NaN if it has none."""

    value: float
    low: float
    high: float
    estimate: statistics.Estimate | None = None

    def over(self, best: "Mean") -> "Mean":
        """Return this mean relative to that of the machine's best, drawn in the same rounds."""
        value, span = self.value / best.value, None
        if self is not best and self.estimate is not None and best.estimate is not None:
            span = statistics.ratio(self.estimate, best.estimate, paired=True).interval()
        return Mean(value, *(span or (NAN, NAN)))


@dataclass(frozen=True)
class CommonMeans:
    """What several runs share.

    Attributes
    ----------
    over : str
        The densities in words.
    kernels : list of str
        The kernels that every run has in one of the groups.
    groups : dict of (str, str) to list
        Precision and order to one dict a run: kernel to `Mean`, the same kernels in all.
    """

    over: str
    kernels: list[str]
    groups: dict[tuple[str | None, str | None], list[dict[str, Mean]]]


def common_means(runs: Sequence["Run"]) -> CommonMeans:
    """Return the mean of each kernel over densities that all runs have.

    Parameters
    ----------
    runs : sequence of Run
        Published or measured. A published mean over the five densities (table 4.3) stands for
        these five; a measured run must have all five to be put beside it.

    Returns
    -------
    CommonMeans
        Without kernels if there is nothing in common.
    """
    frames = [cells.times_of(run) for run in runs]
    if not runs or any(not len(frame) for frame in frames):
        return CommonMeans("", [], {})
    densities = _common_densities(frames)
    if not densities:
        return CommonMeans("", [], {})
    groups = {}
    for precision, order in _common_groups(frames):
        found = [
            _means(run, cells.where(frame, precision=precision, order=order), densities)
            for run, frame in zip(runs, frames, strict=True)
        ]
        common = set(found[0]).intersection(*found[1:])
        if common:
            groups[precision, order] = [
                {name: mean for name, mean in of_run.items() if name in common} for of_run in found
            ]
    kernels = [name for group in groups.values() for found in group for name in found]
    over = "density " + ", ".join(f"{density:g}" for density in densities)
    return CommonMeans(over, list(dict.fromkeys(kernels)), groups)


def _common_densities(frames) -> list[float]:
    common = None
    for frame in frames:
        there = {cells.density_key(density) for density in cells.values(frame, "density")}
        if MEAN in cells.values(frame, "density"):
            there |= set(FIVE_DENSITIES)
        there = {density for density in there if density <= 1}
        common = there if common is None else common & there
    # Where every run has a mean, or could form one, the mean is what the thesis compared.
    return sorted(FIVE_DENSITIES if set(FIVE_DENSITIES) <= common else common)


def _common_groups(frames) -> list[tuple[str | None, str | None]]:
    groups = [[(p, o) for p, o, _ in cells.blocks(frame)] for frame in frames]
    return [group for group in groups[0] if all(group in other for other in groups[1:])]


def _means(run: "Run", frame, densities: list[float]) -> dict[str, Mean]:
    found = {}
    for kernel in cells.kernels(frame):
        rows = cells.where(frame, kernel=kernel)
        whole = rows[[density == MEAN for density in rows["density"]]]
        if len(whole) and densities == list(FIVE_DENSITIES):
            found[kernel] = Mean(float(whole["ns_per_test"].iloc[0]), NAN, NAN)
            continue
        chosen = rows[[cells.density_key(density) in densities for density in rows["density"]]]
        # A kernel may stand in two published tables, measured twice: one of them has them all.
        if "table" in chosen.columns and len(chosen) > len(densities):
            whole_tables = [part for _, part in chosen.groupby("table")]
            chosen = next((t for t in whole_tables if len(t) == len(densities)), chosen)
        if len(chosen) == len(densities):
            found[kernel] = _mean(run, chosen)
    return found


def _mean(run: "Run", rows) -> Mean:
    value = float(rows["ns_per_test"].astype(float).mean())
    if run.published or rows["ci_low"].isna().any() or not len(run.samples):
        return Mean(value, NAN, NAN)
    wanted = {
        tuple(None if absent(row[column]) else row[column] for column in run.cell)
        for row in rows.to_dict("records")
    }
    seed = statistics.seed_of(run.name)
    estimates = [
        statistics.median(derive.times(samples), seed)
        for key, samples in derive.cells(run, [*run.cell, "outcome"]).items()
        if key[-1] is None and key[:-1] in wanted
    ]
    if len(estimates) != len(rows):
        return Mean(value, NAN, NAN)
    whole = statistics.mean(estimates)
    return Mean(value, *(whole.interval() or (NAN, NAN)), whole)
