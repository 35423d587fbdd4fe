"""What bounds each kernel of a run, and what part of that bound it reaches.

The roofline model (Williams, Waterman & Patterson 2009), with what mispredicted branches cost
beside it: a test cannot take less time than its arithmetic at the machine's peak, nor less than
its bytes at the bandwidth of the level of memory in which they lie.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rtbench.errors import RtbenchError
from rtbench.records.cell_times import cell_times
from rtbench.records.statistics import ratio
from rtbench.records.tabular import plain
from rtbench.report import cells
from rtbench.report.peaks import Peak, Peaks
from rtbench.report.traffic import traffic, workload_of

if TYPE_CHECKING:
    from rtbench.records.run import Run

OPERATIONS = ("add", "sub", "mul", "div")
NO_FUSING = (None, "strict")
# In these orders a predictor has learnt the branches: nothing is left to be estimated.
PREDICTED = ("repeat", "sorted")
# The code of a distance test in every generated ending, and that of no outcome.
DISTANCE, _OTHER = 1, -1

Counts = Mapping[str, float]
Exits = Mapping[int | None, Counts]
"""Outcome code to the operations of a test that ends so; None: of every other outcome."""


@dataclass(frozen=True)
class Bound:
    """A cell and its bounds; times in nanoseconds a test.

    Attributes
    ----------
    cell : dict
        The columns that identify it.
    ns, low, high : float or None
        Measured, with its interval.
    form : str
        scalar or vector: which peak its code could reach.
    counts : dict
        Operations a test, a mean over its outcomes where they are known.
    mixed : bool
        Whether they are; else the counts are those of the longest path.
    bytes : float
        Bytes a test reads and writes.
    working_set : float
        Bytes that are touched again and again.
    level : str
        The smallest level of memory that holds them.
    arithmetic, memory : float
        The least time for the operations, and for the bytes.
    unit : str
        What of the arithmetic takes longest: arithmetic, or division.
    vector : float
        The least time for the operations in vector registers, whatever the form.
    reached, reached_low, reached_high : float
        The greater of both over the measured time.
    branches, branches_low, branches_high : float or None
        Share of the time that shuffled tests take and sorted ones do not.
    predicted : bool
        Whether the order is one whose branches are learnt, so that there is no such share.
    bounded_by : str
        The largest of: what bounds it, branches, and what is neither.
    """

    cell: dict
    ns: float
    low: float | None
    high: float | None
    form: str
    counts: dict
    mixed: bool
    bytes: float
    working_set: float
    level: str
    arithmetic: float
    memory: float
    unit: str
    vector: float
    reached: float
    reached_low: float
    reached_high: float
    branches: float | None
    branches_low: float | None
    branches_high: float | None
    predicted: bool
    bounded_by: str

    @property
    def flops(self) -> float:
        """Floating-point operations a test, divisions included."""
        return sum(self.counts.values())

    @property
    def intensity(self) -> float:
        """Operations a byte."""
        return self.flops / self.bytes


def bounds(
    run: "Run", peaks: Peaks, operations: Mapping[str, Exits | None]
) -> tuple[list[Bound], dict[str, str]]:
    """Return what bounds each cell of a run.

    Parameters
    ----------
    run : Run
        Measured by rtbench.
    peaks : Peaks
        Of the machine that it was made on.
    operations : mapping
        Kernel to its operations by outcome; None, or absent, where nothing counts them.

    Returns
    -------
    list of Bound
        In the order of the run's config.
    dict of str to str
        Kernel to the reason why it is left out.

    Raises
    ------
    RtbenchError
        For a published run, and for one in which no cell has a time.
    """
    check(run)
    frame = cells.times_of(run)
    shares = _branch_shares(run)
    found, left_out = [], {}
    for row in frame.to_dict("records"):
        row = {name: plain(value) for name, value in row.items()}
        name = row["kernel"]
        if name == cells.EMPTY_LOOP:
            continue
        counted = operations.get(name)
        moved = traffic(run, row)
        if counted is None:
            left_out[name] = "nothing counts its operations"
        elif row.get("stage") not in (None, "whole"):
            left_out[name] = "cut off after a stage"
        elif isinstance(moved, str):
            left_out[name] = moved
        else:
            cell = {column: row.get(column) for column in run.cell}
            share = shares.get(tuple(cell.values()))
            found.append(_bound(run, row, cell, counted, moved, peaks, share))
    kept = {one.cell["kernel"] for one in found}
    return found, {name: why for name, why in left_out.items() if name not in kept}


def check(run: "Run") -> None:
    """Raise RtbenchError for a published run, and for one in which no cell has a time."""
    if run.published:
        raise RtbenchError(f"{run.name} was published: it has no samples of this machine to bound")
    if not len(cells.times_of(run)):
        raise RtbenchError(f"{run.name} has nothing to bound: no cell has a time")


def _bound(run, row, cell, counted, moved, peaks: Peaks, share) -> Bound:
    precision = row.get("precision") or "float32"
    form = "vector" if (row.get("width") or 1) > 1 else "scalar"
    fused = row.get("flags") not in NO_FUSING
    counts, mixed = _work(run, row, counted)
    level = peaks.level(moved.working_set)
    times = _arithmetic(counts, peaks, form, precision, fused)
    unit = max(times, key=lambda name: times[name][1])
    vector = max(
        time[1] for time in _arithmetic(counts, peaks, "vector", precision, fused).values()
    )
    memory = _interval(moved.bytes, level.bandwidth)
    least = [max(ends) for ends in zip(times[unit], memory, strict=True)]
    ns, low, high = (row.get(name) for name in ("ns_per_test", "ci_low", "ci_high"))
    reached = least[1] / ns
    predicted = row.get("order") in PREDICTED
    bounding = unit if times[unit][1] >= memory[1] else f"memory ({level.name})"
    return Bound(
        cell=cell,
        ns=ns,
        low=low,
        high=high,
        form=form,
        counts=counts,
        mixed=mixed,
        bytes=moved.bytes,
        working_set=moved.working_set,
        level=level.name,
        arithmetic=times[unit][1],
        memory=memory[1],
        unit=unit,
        vector=vector,
        reached=reached,
        reached_low=least[0] / (high or ns),
        reached_high=least[2] / (low or ns),
        branches=share[0] if share else None,
        branches_low=share[1] if share else None,
        branches_high=share[2] if share else None,
        predicted=predicted,
        bounded_by=_largest(bounding, reached, share, predicted),
    )


def _largest(bounding: str, reached: float, share: tuple | None, predicted: bool) -> str:
    """Return the name of the largest part of the time: bound, branches, or neither of both."""
    branches = share[0] if share and (share[1] is None or share[1] > 0) else 0.0
    rest = 1 - reached - branches
    neither = "latency" if predicted or share else "latency or branches"
    parts = {bounding: reached, "branches": branches, neither: rest}
    return max(parts, key=lambda name: parts[name])


def _work(run: "Run", row: Mapping, counted: Exits) -> tuple[dict, bool]:
    """Return a test's operations and whether they are a mean over outcomes.

    Of a part of a workload the outcomes are those of the whole.
    """
    longest = {name: max(counts[name] for counts in counted.values()) for name in OPERATIONS}
    if set(counted) == {None}:  # nothing is skipped, whatever the outcome
        return longest, True
    if (row.get("width") or 1) > 1:  # lanes end together; with an exit it depends on them all
        return longest, row.get("exit") != "any"
    seen = _outcomes(run, row, counted)
    total = sum(seen.values())
    if not total:
        return longest, False
    mean = dict.fromkeys(OPERATIONS, 0.0)
    for code, count in seen.items():
        counts = counted.get(code) or counted.get(None) or longest
        for name in OPERATIONS:
            mean[name] += counts[name] * count / total
    return mean, True


def _outcomes(run: "Run", row: Mapping, counted: Exits) -> dict[int, float]:
    """Return how often each outcome comes, as far as the run says so."""
    seen: dict[int, float] = {}
    for entry in run.info.get("outcomes") or []:
        shared = (entry.keys() & row.keys()) - {"triangles", "outcome", "label", "count"}
        if all(entry[name] == row[name] for name in shared):
            seen[entry["outcome"]] = seen.get(entry["outcome"], 0) + entry["count"]
    method = (run.info.get("methods") or {}).get(row["kernel"]) or {}
    share = workload_of(run, row).get("distance_share")
    if not seen and share is not None and method.get("ending") and DISTANCE in counted:
        # It is the share where distance is tested first; tested last, it is the longest path.
        others = [counted[code] for code in counted if code != DISTANCE]
        first = all(counted[DISTANCE]["mul"] < counts["mul"] for counts in others)
        return {DISTANCE: share, _OTHER: 1 - share} if first else {}
    return seen


def _arithmetic(
    counts: Counts, peaks: Peaks, form: str, precision: str, fused: bool
) -> dict[str, tuple[float, float, float]]:
    """Return the least time for what goes to the adders and multipliers, and to the divider.

    Both may work at once, as may adders and multipliers where they are different ones.
    """
    sums, products = counts["add"] + counts["sub"], counts["mul"]
    limits = {"add": sums, "mul": products, "both": sums + products}
    if fused and peaks.has_fma(form, precision):  # a sum may ride on a product
        limits = {"fma": sums + products}
    times = [
        _interval(amount, peaks.arithmetic(form, precision, operation))
        for operation, amount in limits.items()
    ]
    division = _interval(counts["div"], peaks.arithmetic(form, precision, "div"))
    return {"arithmetic": max(times, key=lambda time: time[1]), "division": division}


def _interval(amount: float, peak: Peak) -> tuple[float, float, float]:
    """Return low end, middle and high end of the time in ns that an amount takes."""
    return 1e9 * amount / peak.high, 1e9 * amount / peak.rate, 1e9 * amount / peak.low


def _branch_shares(run: "Run") -> dict[tuple, tuple]:
    """Return 1 - sorted / own with its interval for each cell whose order is not learnt."""
    if "order" not in run.cell:
        return {}
    place = run.cell.index("order")
    times = cell_times(run, run.cell)
    found = {}
    for key, own in times.items():
        learnt = times.get((*key[:place], "sorted", *key[place + 1 :]))
        if key[place] in PREDICTED or learnt is None:
            continue
        less = ratio(learnt, own, paired=True)
        low, high = less.interval() or (None, None)
        ends = (None, None) if low is None else (1 - high, 1 - low)
        found[key] = (1 - less.value, *ends)
    return found
