"""The table of what bounds each kernel."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rtbench.report import cells, machine
from rtbench.report.digits import measured
from rtbench.report.peaks import Peaks
from rtbench.report.roofline import OPERATIONS, Bound
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

_NOTES = (
    "arithmetic, memory: the least ns a test for its operations at the peak of its form (scalar; "
    "vector for packets) and for its bytes at the bandwidth of the level that holds all of them",
    "reached: the greater of both over the measured time; of vector peak: the same of the "
    "arithmetic alone, were it done in vector registers",
    "branches: share of the time that a sorted order saves (sorted against this order of the same "
    "cell); in repeat and sorted order branches are predicted",
    "bounded by: the largest part of the time; latency is what is neither bound nor branches: "
    "waiting for results, and instructions that are no arithmetic (loads, comparisons, stores)",
)


def roofline_table(
    run: "Run", found: Sequence[Bound], left_out: Mapping[str, str], peaks: Peaks
) -> Table:
    """Return what bounds each cell and what part of the bound it reaches.

    Parameters
    ----------
    run : Run
    found : sequence of Bound
    left_out : mapping of str to str
        Kernels and reasons.
    peaks : Peaks

    Returns
    -------
    Table
        A row a cell.
    """
    rows = [_row(one) for one in found]
    own = [name for name in run.cell if name != "kernel"]
    shown = [
        name for name in own if len({str(one.cell[name]) for one in found}) > 1 and name != "form"
    ]
    values = [
        *("ns_per_test", "operations", "bytes", "level", "arithmetic_ns", "memory_ns"),
        *("reached_percent", "vector_percent", "branches_percent", "bounded_by"),
    ]
    raw = [
        *("kernel", *own, "form", "ns_per_test", "ci_low", "ci_high", *OPERATIONS, "by_outcome"),
        *("bytes", "working_set", "level", "arithmetic_ns", "memory_ns", "reached_percent"),
        *("reached_low", "reached_high", "vector_percent", "branches_percent", "branches_low"),
        *("branches_high", "bounded_by"),
    ]
    return Table(
        "roofline",
        rows,
        ["kernel", *shown, *values],
        "roofline: what bounds a test, and what part of the bound it reaches",
        raw,
        headers={
            "ns_per_test": "ns a test",
            "arithmetic_ns": "arithmetic",
            "memory_ns": "memory",
            "reached_percent": "reached %",
            "vector_percent": "of vector peak %",
            "branches_percent": "branches %",
            "bounded_by": "bounded by",
        },
        notes=[
            *_NOTES,
            _counts(found),
            *(f"left out: {kernel} ({why})" for kernel, why in left_out.items()),
            f"{machine.provenance(run)}; peaks of {peaks.machine}",
        ],
    )


def _row(one: Bound) -> dict:
    share, low, high = one.branches, one.branches_low, one.branches_high
    if share is not None:
        ends = (None, None) if low is None else (100 * low, 100 * high)
        branches = measured(100 * share, *ends, most=1)
    else:
        branches = Cell(None, "" if one.predicted else "not measured")
    cell = one.cell | {name: _said(name, value) for name, value in one.cell.items()}
    return cell | {
        "form": one.form,
        "ns_per_test": measured(one.ns, one.low, one.high),
        "ci_low": one.low,
        "ci_high": one.high,
        **one.counts,
        "by_outcome": one.mixed,
        "operations": Cell(one.flops, f"{one.flops:.1f}"),
        "bytes": Cell(one.bytes, f"{one.bytes:.0f}"),
        "working_set": one.working_set,
        "level": one.level,
        "arithmetic_ns": Cell(one.arithmetic, f"{one.arithmetic:.2f}"),
        "memory_ns": Cell(one.memory, f"{one.memory:.2f}"),
        "reached_percent": _percent(one.reached, one.reached_low, one.reached_high),
        "reached_low": 100 * one.reached_low,
        "reached_high": 100 * one.reached_high,
        "vector_percent": _percent(one.vector / one.ns, None, None),
        "branches_percent": branches,
        "branches_low": None if low is None else 100 * low,
        "branches_high": None if high is None else 100 * high,
        "bounded_by": one.bounded_by,
    }


def _percent(part: float, low: float | None, high: float | None) -> Cell:
    if low is None:
        return Cell(100 * part, f"{100 * part:.1f}")
    return measured(100 * part, 100 * low, 100 * high, most=1)


def _said(name: str, value: object) -> object:
    return Cell(value, cells.density_text(value)) if name == "density" and value else value


def _counts(found: Sequence[Bound]) -> str:
    known = [one.mixed for one in found]
    mean, longest = "a mean over the outcomes of the run's pairs", "those of the longest path"
    what = mean if all(known) else f"{mean} where they are known, else {longest}"
    what = what if any(known) else f"{longest}; a test that leaves early does fewer"
    source = "as the source has them (a compiler may share some; roots and arccosines not counted)"
    return f"operations: {source}, {what}"
