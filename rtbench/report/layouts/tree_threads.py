"""Table of threads: how many times more rays a second two of them trace, and what of them ran."""

import numpy as np

from rtbench.records import statistics
from rtbench.report import machine
from rtbench.report.digits import interval, measured
from rtbench.report.layouts.tree_kernels import head_of
from rtbench.report.tables import Cell, Table
from rtbench.report.trees import Trees


def threads_table(trees: Trees) -> Table:
    """Return the gain of more threads over one: a row a model, ray set, tree, way and kernel.

    Parameters
    ----------
    trees : Trees

    Returns
    -------
    Table
        Nanoseconds a ray by the clock, in one thread and in several; the gain with its 95 %
        interval, paired by rounds; CPU time over time by the clock, which says how many threads had
        a core. Without rows where all ran in one.
    """
    rows = []
    for several in (one for one in trees.timed if one.threads > 1):
        alike = {**several.cell, "way": several.cell["way"].rpartition(",")[0]}
        single = next((one for one in trees.timed if one.cell == alike), None)
        if single is None:
            continue
        row = alike | {"tree": head_of(single), "threads": several.threads}
        for name, one in (("one_ns", single), ("ns", several)):
            estimate = statistics.median(one.times, trees.seed)
            row[name] = measured(estimate.value, *(estimate.interval() or (None, None)), most=1)
        gain = statistics.paired_ratio(single.times, several.times, trees.seed)
        if gain is not None:
            low, high = gain.interval() or (None, None)
            row |= {"gain": measured(gain.value, low, high, 2), "low": low, "high": high}
            row["interval"] = interval(gain.value, low, high, most=2)
        shares = several.cpu.ns / several.times.ns
        if np.isfinite(shares).all():
            share = float(np.median(shares))
            row["cpu_wall"] = Cell(share, f"{share:.2f}")
        rows.append(row)
    kernels = len({(row["kernel"], row["precision"]) for row in rows}) > 1
    columns = ["model", "rays", "tree", *(["kernel", "precision"] if kernels else []), "threads"]
    columns += ["one_ns", "ns", "gain", "interval", "cpu_wall"]
    raw = [*trees.run.cell, "threads", "one_ns", "ns", "gain", "low", "high", "cpu_wall"]
    return Table(
        "tree-threads",
        rows,
        columns,
        "more threads: how many times the rays a second of one",
        raw,
        headers={
            "one_ns": "one: ns/ray",
            "ns": "ns/ray",
            "interval": "95 %",
            "cpu_wall": "CPU / clock",
        },
        notes=[
            "by the clock; CPU / clock: how many threads had a core of their own while it ran: a "
            "gain can be no greater",
            machine.provenance(trees.run),
        ],
    )
