"""The tables of a comparison: environments first, then cells, mean, rankings, turnovers."""

from typing import TYPE_CHECKING

from rtbench.report.cells import density_text
from rtbench.report.digits import four_digits
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.comparison import Comparison


def tables(found: "Comparison") -> list[Table]:
    """Return the tables of a comparison in the order in which they are read.

    Parameters
    ----------
    found : Comparison
        Two or more runs.

    Returns
    -------
    list of Table
        environment, machine_code, cells, relative, missing, means, ranking, turnovers; those
        without rows are left out, but for the cells.
    """
    made = [
        _environment(found),
        Table(
            "machine_code",
            found.machine_code,
            ["kernel", "precision", "run", "source", "machine_code"],
            "Was the same code timed?",
            headers={"machine_code": "machine code"},
        ),
        _cells(found),
        _relative(found),
        _missing(found),
        _means(found),
        _ranking(found),
        _turnovers(found),
    ]
    return [table for table in made if table.rows or table.name == "cells"]


def _environment(found: "Comparison") -> Table:
    rows = [{key: _shortened(value) for key, value in row.items()} for row in found.environment]
    return Table("environment", rows, ["key", *found.runs], "Environments: what differs")


def _cells(found: "Comparison") -> Table:
    rows = [
        row
        | _density(row)
        | {"ratio": _ratio(row["ratio"])}
        | {"interval": _interval(row["low"], row["high"])}
        | {"beside_shift": _ratio(row["beside_shift"])}
        for row in found.cells
    ]
    raw = [*found.columns, "run", "first_ns", "ns", "ratio", "low", "high", "beside_shift"]
    raw += ["verdict"]
    if found.relative_to:
        raw += ["first_relative", "relative", "relative_ratio", "relative_low", "relative_high"]
        raw += ["relative_verdict"]
    shown, same = _shown(found, found.cells)
    columns = [*shown, "first_ns", "ns", "ratio", "interval", "beside_shift", "verdict"]
    if all(row["beside_shift"] == row["ratio"] for row in found.cells):
        columns.remove("beside_shift")
    two = len(found.runs) == 2
    headers = {
        "first_ns": f"{found.runs[0]}, ns/test",
        "ns": f"{found.runs[1]}, ns/test" if two else "ns/test",
        "interval": "95 % interval",
        "beside_shift": "beside the machine's shift",
    }
    title = f"Cells{same}: time divided by that of {found.runs[0]}"
    return Table("cells", rows, columns, title, raw_columns=raw, headers=headers)


def _relative(found: "Comparison") -> Table:
    there = [row for row in found.cells if "relative" in row]
    rows = [
        row
        | _density(row)
        | {name: _ratio(row[name]) for name in ("first_relative", "relative")}
        | {"change": _ratio(row.get("relative_ratio"))}
        | {"interval": _interval(row.get("relative_low"), row.get("relative_high"))}
        for row in there
    ]
    two = len(found.runs) == 2
    headers = {
        "first_relative": found.runs[0],
        "relative": found.runs[1] if two else "this run",
        "interval": "95 % interval",
        "relative_verdict": "verdict",
    }
    shown, same = _shown(found, there)
    columns = [*shown, "first_relative", "relative", "change", "interval"]
    title = f"Relative to {found.relative_to} on the same machine{same}"
    return Table("relative", rows, [*columns, "relative_verdict"], title, headers=headers)


def _missing(found: "Comparison") -> Table:
    # A row for all densities of a kernel; csv and json of the whole comparison name each cell.
    rest = [name for name in found.columns if name != "density"]
    grouped: dict[tuple, list[str]] = {}
    for row in found.missing:
        key = tuple(row[name] for name in (*rest, "run", "is"))
        density = row.get("density")
        grouped.setdefault(key, []).append("" if density is None else density_text(density))
    columns = [*rest, "run", "is"]
    rows = [
        dict(zip(columns, key, strict=True)) | {"density": " ".join(densities)}
        for key, densities in grouped.items()
    ]
    if "density" in found.columns:
        columns.append("density")
    title = f"Cells without a partner (missing: only in {found.runs[0]}; new: not in it)"
    return Table("missing", rows, columns, title)


def _means(found: "Comparison") -> Table:
    rows = [
        row
        | {name: _ratio(row[name]) for name in ("ratio", "least", "greatest", "deviation")}
        | {"interval": _interval(row["low"], row["high"])}
        for row in found.means
    ]
    columns = ["run", "cells", "ratio", "interval", "verdict", "least", "greatest", "deviation"]
    headers = {"interval": "95 % interval", "deviation": "geometric sd"}
    title = f"Geometric mean over the cells of all runs, relative to {found.runs[0]}"
    return Table("means", rows, columns, title, headers=headers)


def _ranking(found: "Comparison") -> Table:
    rows = []
    for ranked in found.rankings:
        over = " ".join(density_text(value) for value in ranked["densities"] if value is not None)
        for place in range(len(ranked["kernels"][found.runs[0]])):
            row = ranked["group"] | {"densities": over, "place": place + 1}
            for run in found.runs:
                name = ranked["kernels"][run][place]
                row[run] = f"{name} ({four_digits(ranked['ns'][run][name])} ns)"
            rows.append(row)
    group = list(found.rankings[0]["group"]) if found.rankings else []
    notes = []
    for ranked in found.rankings:
        where = " ".join(str(value) for value in ranked["group"].values())
        notes += [
            f"Kendall's tau of {found.runs[0]} and {run}{', ' + where if where else ''}: {tau:.2f}"
            for run, tau in ranked["tau"].items()
            if tau is not None
        ]
    columns = [*group, "densities", "place", *found.runs]
    title = "Ranking on each machine, fastest first"
    return Table("ranking", rows, columns, title, notes=notes)


def _turnovers(found: "Comparison") -> Table:
    rows = []
    group: list[str] = []
    for ranked in found.rankings:
        group = list(ranked["group"])
        for turn in ranked["turnovers"]:
            sure = turn["resolved"]
            row = ranked["group"] | {"kernels": f"{turn['faster']}, {turn['slower']}"}
            row["faster_here"] = f"{turn['faster']} on {turn['run']}: {turn['ratio']:.3f} times"
            by = 1 / turn["other_ratio"]
            row["faster_there"] = f"{turn['slower']} on {turn['other_run']}: {by:.3f} times"
            rows.append(row | {"resolved": sure})
    headers = {"faster_here": "faster", "faster_there": "but faster"}
    columns = [*group, "kernels", "faster_here", "faster_there", "resolved"]
    title = "Kernels that change places"
    return Table("turnovers", rows, columns, title, headers=headers)


def _shown(found: "Comparison", rows: list[dict]) -> tuple[list[str], str]:
    """Return the columns to print, and in words what is the same in every row."""
    columns, same = [], []
    for name in (*found.columns, "run"):
        values = {str(row[name]) for row in rows}
        if name == "kernel" or len(values) > 1:
            columns.append(name)
        elif rows and name != "run" and rows[0][name] is not None:
            value = rows[0][name]
            same.append(f"density {density_text(value)}" if name == "density" else str(value))
    return columns, f" ({', '.join(same)})" if same else ""


def _density(row: dict) -> dict:
    density = row.get("density")
    return {} if density is None else {"density": Cell(density, density_text(density))}


def _ratio(value: float | None) -> Cell:
    return Cell(value, "" if value is None else f"{value:.3f}")


def _interval(low: float | None, high: float | None) -> str:
    return "" if low is None or high is None else f"[{low:.3f}, {high:.3f}]"


def _shortened(value: object, most: int = 60) -> str:
    text = str(value)
    return text if len(text) <= most else text[: most - 3] + "..."
