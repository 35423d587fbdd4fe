"""The tables that follow from run.json and samples.csv: summary.csv and outcomes.csv."""

from typing import TYPE_CHECKING, Protocol

import numpy as np

from rtbench.records import schema, tabular
from rtbench.records.statistics import Times, median, outliers, seed_of

if TYPE_CHECKING:
    import pandas


class Records(Protocol):
    """What of a run its tables are derived from."""

    name: str
    info: dict

    @property
    def cell(self) -> list[str]:
        """The columns that identify a cell."""

    @property
    def samples(self) -> "pandas.DataFrame":
        """One row a sample."""


_COUNTS = ("samples", "processes", "outliers")
# Keys of an outcome that say what came out, not of which workload.
_COUNTED = frozenset({"outcome", "label", "count", "fraction"})


def times(samples: "pandas.DataFrame") -> Times:
    """Return the samples of one cell for `rtbench.records.statistics`.

    Parameters
    ----------
    samples : pandas.DataFrame
        Rows of ``Run.samples``.

    Returns
    -------
    Times
        Nanoseconds a test; a resumed launch counts as another process.
    """
    launch = samples["launch"].to_numpy(np.int64)
    process = samples["process"].to_numpy(np.int64) + launch * 1_000_000
    # A clock of coarse ticks may say 0: that is less than one nanosecond, and has a logarithm.
    ns = np.maximum(samples["ns"].to_numpy(float), 0.5) / samples["tests"].to_numpy(float)
    return Times(ns, process, samples["round"].to_numpy(np.int64))


def cells(run: Records, columns: list[str]) -> dict[tuple, "pandas.DataFrame"]:
    """Return a run's samples by cell, in the order of its config (samples are taken shuffled).

    Parameters
    ----------
    run : Run, or what has its name, info, cell and samples
        A run with samples.
    columns : list of str
        The columns that identify a cell here.

    Returns
    -------
    dict of tuple to pandas.DataFrame
        Keys are the columns' values, None where absent.
    """
    samples = run.samples
    places: dict[tuple, list[int]] = {}
    values = [[tabular.plain(value) for value in samples[name]] for name in columns]
    for place, key in enumerate(zip(*values, strict=True)):
        places.setdefault(key, []).append(place)
    ranks = [_ranks(run, name, [key[i] for key in places]) for i, name in enumerate(columns)]
    in_order = sorted(places, key=lambda key: [r[v] for r, v in zip(ranks, key, strict=True)])
    return {key: samples.iloc[places[key]] for key in in_order}


def _ranks(run: Records, column: str, values: list) -> dict[object, int]:
    """Return the place of each value of a column: as the config names them, numbers by size."""
    told = run.info.get("config", {}).get(f"{column}s") or []
    if column == "kernel":
        told = [name for name in run.info.get("kernels") or values if name != schema.EMPTY]
        told += [schema.EMPTY]
    told = [*told, *values]

    def key(value: object) -> tuple:
        if value is None:
            return (0,)
        return (1, value) if isinstance(value, (int, float)) else (2, told.index(value))

    return {value: place for place, value in enumerate(sorted(set(values), key=key))}


def summarise(run: Records) -> "pandas.DataFrame":
    """Return the summary of a run's samples.

    Parameters
    ----------
    run : Run, or what has its name, info, cell and samples
        The run; it may be unfinished, or without any sample.

    Returns
    -------
    pandas.DataFrame
        A row a cell with the columns of ``schema.SUMMARY_COLUMNS``, the cell's further columns,
        samples, processes, outliers (counts), and compile_seconds (0 where the code came from the
        cache). Times of groups of one outcome are not in it.
    """
    further = [name for name in run.cell if name not in schema.SUMMARY_COLUMNS]
    columns = [*schema.SUMMARY_COLUMNS, *further, *_COUNTS, "compile_seconds"]
    rows = []
    for key, samples in cells(run, [*run.cell, "outcome"]).items():
        if key[-1] is not None:
            continue
        row = dict(zip(run.cell, key[:-1], strict=True))
        row.setdefault("triangles", _only(samples["triangles"]))
        row |= _timing(samples, seed_of(run.name)) | {"hits": _hits(run, row)}
        compiled = (run.info.get("kernels") or {}).get(row.get("kernel"), {})
        row["compile_seconds"] = compiled.get(row.get("precision"), {}).get("compile_seconds")
        rows.append(row)
    return tabular.frame(rows, columns)


def outcome_table(run: Records) -> "pandas.DataFrame":
    """Return how often each outcome came and how long its pairs took.

    Parameters
    ----------
    run : Run, or what has its name, info, cell and samples
        Its ``outcomes`` of run.json, and its samples that have an outcome, in repeat order.

    Returns
    -------
    pandas.DataFrame
        A row an outcome with the columns of ``schema.OUTCOME_COLUMNS``; pairs_timed is the size of
        the group behind the time. Absent what was not timed.
    """
    groups = _outcome_groups(run)
    entries = list(run.info.get("outcomes") or [])
    totals: dict[tuple, int] = {}
    for entry in entries:
        workload = _workload(entry)
        totals[workload] = totals.get(workload, 0) + entry["count"]
    rows = []
    for entry in entries:
        whole = totals[_workload(entry)]
        row = entry | {"fraction": entry["count"] / whole if whole else None}
        for cell, samples in groups:
            if _agree(entry, cell, without={"triangles", "order", "label"}):
                timing = _timing(samples, seed_of(run.name))
                row |= {name: timing[name] for name in ("ns_per_test", "ci_low", "ci_high")}
                row |= {"tests": timing["tests"], "pairs_timed": _only(samples["triangles"])}
        rows.append({name: row.get(name) for name in schema.OUTCOME_COLUMNS})
    return tabular.frame(rows, schema.OUTCOME_COLUMNS)


def _timing(samples: "pandas.DataFrame", seed: int) -> dict:
    taken = times(samples)
    estimate = median(taken, seed)
    low, high = estimate.interval() or (None, None)
    return {
        "repetitions": int(samples["repetitions"].sum()),
        "tests": int(samples["tests"].sum()),
        "ns_per_test": estimate.value,
        "ci_low": low,
        "ci_high": high,
        "seconds": int(samples["ns"].sum()) / 1e9,
        "samples": len(samples),
        "processes": len(np.unique(taken.process)),
        "outliers": int(outliers(taken).sum()),
    }


def _only(column: "pandas.Series") -> int | None:
    values = column.unique()
    return int(values[0]) if len(values) == 1 else None


def _workload(entry: dict) -> tuple:
    return tuple(sorted((name, str(entry[name])) for name in entry.keys() - _COUNTED))


def _agree(entry: dict, row: dict, without: set[str]) -> bool:
    shared = (entry.keys() & row.keys()) - without
    return all(tabular.plain(entry[name]) == tabular.plain(row[name]) for name in shared)


def _hits(run: Records, row: dict) -> int | None:
    if row.get("kernel") == schema.EMPTY:
        return None
    for part in run.info.get("hits") or []:  # of a part of a workload
        if _agree(part, row, without={"hits"}):
            return part["hits"]
    counted = run.info.get("outcomes") or []
    entries = [entry for entry in counted if _agree(entry, row, without=set(_COUNTED))]
    if not entries:
        return None
    return sum(entry["count"] for entry in entries if entry["outcome"] == 0)


def _outcome_groups(run: Records) -> list[tuple[dict, "pandas.DataFrame"]]:
    columns = [*run.cell, *(() if "outcome" in run.cell else ("outcome",))]
    groups = []
    for key, samples in cells(run, columns).items():
        cell = dict(zip(columns, key, strict=True))
        if cell["outcome"] is not None and cell.get("order") in (None, "repeat"):
            groups.append((cell, samples))
    return groups
