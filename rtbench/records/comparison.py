"""Comparing runs cell by cell: ratios with intervals, verdicts, the mean, the rankings."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from rtbench.errors import NotComparable, RtbenchError, unknown
from rtbench.records import environments
from rtbench.records.cell_times import cell_times, form_means
from rtbench.records.rankings import Cells, rank_runs
from rtbench.records.run import Run
from rtbench.records.schema import EMPTY, MEAN
from rtbench.records.shift import beside, shift_of, shift_words
from rtbench.records.statistics import (
    FASTER,
    NO_INTERVAL,
    SLOWER,
    Estimate,
    geometric_mean,
    holm,
    p_value,
    ratio,
    verdict,
)


@dataclass(frozen=True)
class Comparison:
    """Several runs side by side; all tables are lists of dicts that json can write.

    Attributes
    ----------
    runs : list of str
        Names; every later run is compared with the first.
    columns : list of str
        The columns that identify a cell in all of them.
    environment : list of dict
        ``key`` and a value a run: what differs.
    machine_code : list of dict
        ``kernel, precision, run, source, machine_code``: same, different or unknown.
    remarks : list of str
        What makes the numbers doubtful.
    cells : list of dict
        The cell's columns, ``run`` (the later one), ``first_ns``, ``ns``, ``ratio`` (later /
        first), ``low``, ``high`` (95 % interval or None), ``beside_shift`` (the ratio over that of
        the same code on the same processor), ``verdict`` (about the latter). With a reference also
        ``first_relative``, ``relative`` (to that kernel on the same machine), ``relative_ratio``,
        ``relative_low``, ``relative_high``, ``relative_verdict``.
    missing : list of dict
        Cells that only some runs have: the cell's columns, ``run``, and ``is``: missing (the first
        run has it and this one not) or new (the reverse).
    means : list of dict
        A row a later run: geometric mean of the ratios over the cells common to all runs:
        ``run, cells, ratio, low, high, verdict, least, greatest, deviation``.
    rankings : list of dict
        As `rtbench.records.rankings.rank_runs` returns them.
    relative_to : str or None
        The reference kernel.
    """

    runs: list[str]
    columns: list[str]
    environment: list[dict]
    machine_code: list[dict]
    remarks: list[str]
    cells: list[dict]
    missing: list[dict]
    means: list[dict]
    rankings: list[dict] = field(default_factory=list)
    relative_to: str | None = None


def compare(
    runs: Sequence[Run],
    relative_to: str | None = None,
    threshold: float = 0.0,
    allow: Sequence[str] = (),
) -> Comparison:
    """Compare runs with the first of them.

    Parameters
    ----------
    runs : sequence of Run
        Two or more.
    relative_to : str, optional
        A kernel by which every cell is divided, on its own machine.
    threshold : float
        A difference must be resolved to be larger than this fraction to be called one.
    allow : sequence of str
        Differences to accept silently: experiment, workloads, layout, generator, triangles.

    Returns
    -------
    Comparison
        Resampled with seeds that follow from the runs' names: the same runs, the same numbers.

    Raises
    ------
    NotComparable
        If the experiments differ, there is no common cell, or cells cannot be told apart.
    RtbenchError
        If there are fewer than two runs or no such reference kernel.
    """
    if len(runs) < 2:
        raise RtbenchError("diff needs at least two runs")
    if threshold < 0:
        raise RtbenchError(f"a threshold of {threshold:g} is negative; it must be 0 or more")
    runs = _with_names_of_their_own(runs)
    columns = _shared_columns(runs, allow)
    tables = [cell_times(run, columns) for run in runs]
    if "density" in columns:
        form_means(tables, columns)
    common = [key for key in tables[0] if all(key in table for table in tables)]
    if not any(key in table for key in tables[0] for table in tables[1:]):
        raise NotComparable(f"no cell in common: {_kinds(runs, columns, tables)}")
    rows: list[dict] = []
    means: list[dict] = []
    remarks = environments.doubts(runs, allow)
    kernel = columns.index("kernel")
    if relative_to is not None:
        names = {key[kernel] for table in tables for key in table}
        if relative_to not in names:
            raise RtbenchError(unknown("kernel of these runs", relative_to, names))
    for run, table in zip(runs[1:], tables[1:], strict=True):
        both = [key for key in tables[0] if key in table]
        ratios = {key: ratio(table[key], tables[0][key], run.path == runs[0].path) for key in both}
        shift = shift_of(environments.same_code(runs[0], run), columns, ratios)
        if shift is not None and _judge([shift], threshold)[0]["verdict"] in (FASTER, SLOWER):
            remarks.append(shift_words(run, shift))
        own = _rows(run, columns, tables[0], table, ratios, shift, threshold)
        if relative_to is not None:
            _add_relative(own, both, kernel, relative_to, tables[0], table, threshold)
        rows += own
        counted = _counted(common, columns)
        if counted:
            means.append(_mean_row(run, [ratios[key] for key in counted], shift, threshold))
    ranked = [] if "outcome" in columns else rank_runs([run.name for run in runs], columns, tables)
    return Comparison(
        runs=[run.name for run in runs],
        columns=columns,
        environment=environments.differences(runs),
        machine_code=environments.machine_code(runs),
        remarks=remarks,
        cells=rows,
        missing=_missing(runs, columns, tables),
        means=means,
        rankings=ranked,
        relative_to=relative_to,
    )


def _with_names_of_their_own(runs: Sequence[Run]) -> list[Run]:
    # Names head the columns; a copied folder has the name of the original in its run.json.
    named: list[Run] = []
    for run in runs:
        name, number = run.name, 2
        while name in (other.name for other in named):
            name, number = f"{run.name} ({number})", number + 1
        if name != run.name:
            run = Run(run.path, run.info | {"name": name})
        named.append(run)
    return named


def _shared_columns(runs: Sequence[Run], allow: Sequence[str]) -> list[str]:
    kinds = {run.name: run.info.get("experiment") for run in runs}
    if len(set(kinds.values())) > 1 and "experiment" not in allow:
        told = ", ".join(f"{name} is of {kind}" for name, kind in kinds.items())
        raise NotComparable(f"different experiments: {told}")
    columns = [name for name in runs[0].cell if all(name in run.cell for run in runs)]
    if "kernel" not in columns:
        raise NotComparable(f"{' and '.join(kinds)} do not share the column kernel")
    if set(kinds.values()) == {"outcomes"} and "outcome" not in columns:
        columns.append("outcome")
    return columns


def _counted(common: list[tuple], columns: list[str]) -> list[tuple]:
    """Return the cells of the geometric mean: no empty loop, no mean beside what it is made of."""
    kernel = columns.index("kernel")
    keys = [key for key in common if key[kernel] != EMPTY]
    if "density" not in columns:
        return keys
    place = columns.index("density")

    def rest(key: tuple) -> tuple:
        return key[:place] + key[place + 1 :]

    plainly = {rest(key) for key in keys if key[place] != MEAN}
    return [key for key in keys if key[place] != MEAN or rest(key) not in plainly]


def _judge(ratios: Sequence[Estimate], threshold: float) -> list[dict]:
    resolved = holm([p_value(found, 1 + threshold) for found in ratios])
    judged = []
    for found, sure in zip(ratios, resolved, strict=True):
        low, high = found.interval() or (None, None)
        word = verdict(found, sure)
        judged.append({"ratio": found.value, "low": low, "high": high, "verdict": word})
    return judged


def _rows(
    run: Run,
    columns: list[str],
    first: Cells,
    later: Cells,
    ratios: dict[tuple, Estimate],
    shift: Estimate | None,
    threshold: float,
) -> list[dict]:
    corrected = [beside(value, shift) for value in ratios.values()]
    rows = []
    for (key, value), judged in zip(ratios.items(), _judge(corrected, threshold), strict=True):
        low, high = value.interval() or (None, None)
        rows.append(
            dict(zip(columns, key, strict=True))
            | {"run": run.name, "first_ns": first[key].value, "ns": later[key].value}
            | {"ratio": value.value, "low": low, "high": high}
            | {"beside_shift": judged["ratio"], "verdict": judged["verdict"]}
        )
    return rows


def _add_relative(
    rows: list[dict],
    keys: list[tuple],
    kernel: int,
    reference: str,
    first: Cells,
    later: Cells,
    threshold: float,
) -> None:
    chosen, shares = [], []
    for row, key in zip(rows, keys, strict=True):
        by = (*key[:kernel], reference, *key[kernel + 1 :])
        if by not in first or by not in later or key[kernel] == EMPTY:
            continue
        before = ratio(first[key], first[by], paired=True)
        after = ratio(later[key], later[by], paired=True)
        row |= {"first_relative": before.value, "relative": after.value}
        if key != by:
            chosen.append(row)
            shares.append(ratio(after, before))
    for row, words in zip(chosen, _judge(shares, threshold), strict=True):
        row |= {f"relative_{name}": value for name, value in words.items()}


def _mean_row(run: Run, ratios: list[Estimate], shift: Estimate | None, threshold: float) -> dict:
    found = geometric_mean(ratios)
    (words,) = _judge([found.estimate], threshold)
    (judged,) = _judge([beside(found.estimate, shift)], threshold)
    words["verdict"] = judged["verdict"]
    spread = None if found.count < 2 else found.deviation
    extremes = {"least": found.least, "greatest": found.greatest, "deviation": spread}
    return {"run": run.name, "cells": found.count} | words | extremes


def _missing(runs: Sequence[Run], columns: list[str], tables: Sequence[Cells]) -> list[dict]:
    rows = []
    for run, table in zip(runs[1:], tables[1:], strict=True):
        gone = [(key, "missing") for key in tables[0] if key not in table]
        new = [(key, "new") for key in table if key not in tables[0]]
        for key, word in gone + new:
            rows.append(dict(zip(columns, key, strict=True)) | {"run": run.name, "is": word})
    return rows


def _kinds(runs: Sequence[Run], columns: list[str], tables: Sequence[Cells]) -> str:
    told = []
    for run, table in zip(runs, tables, strict=True):
        if not table:
            told.append(f"{run.name} has no times")
            continue
        parts = []
        for place, name in enumerate(columns):
            values = sorted({str(key[place]) for key in table})
            parts.append(f"{name} {' '.join(values[:6])}{' ...' if len(values) > 6 else ''}")
        told.append(f"{run.name} has {', '.join(parts)}")
    return "; ".join(told)


def slowdowns(comparison: Comparison, above: float) -> tuple[list[dict], int]:
    """Return the cells that became slower by more than a fraction.

    Parameters
    ----------
    comparison : Comparison
        Of two or more runs.
    above : float
        The fraction: 0.05 is 5 %.

    Returns
    -------
    cells : list of dict
        Rows whose verdict is slower and whose ratio, beside the shift of the machine, is above
        1 + ``above``; the empty loop is none.
    unjudged : int
        How many rows have no interval: these cannot be resolved and never count as slower.
    """
    rows = [row for row in comparison.cells if row["kernel"] != EMPTY]
    slower = [row for row in rows if row["verdict"] == SLOWER and row["beside_shift"] > 1 + above]
    return slower, sum(row["verdict"] == NO_INTERVAL for row in rows)
