"""Tables of what the kernels returned, how long each outcome takes, and what they compute."""

from typing import TYPE_CHECKING

from rtbench.report import cells, machine
from rtbench.report.digits import absent, frequency, interval, measured, usual_decimals
from rtbench.report.tables import Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

HEADERS = {
    "fraction": "%",
    "outcome": "code",
    "ns_per_test": "ns a test",
    "interval": "95 % interval",
    "pairs_timed": "pairs timed",
    "cond": "conditions",
    "add": "+",
    "sub": "-",
    "mul": "*",
    "div": "/",
    "crosses": "cross products",
    "dots": "dot products",
}
_MOST_DENSITIES = 5
COUNTS = ("add", "sub", "mul", "div", "cond", "differences", "crosses", "dots")


def outcomes_table(run: "Run") -> Table:
    """Return frequency and time of each outcome of each kernel.

    Parameters
    ----------
    run : Run
        A run whose outcomes were counted.

    Returns
    -------
    Table
        A row a kernel, precision and outcome: label, count, frequency, ns a test with interval,
        and the number of distinct pairs that were timed; a column of frequencies a density where
        there are several. csv and json have a row a density. No rows without outcomes.
    """
    frame = cells.outcomes_of(run)
    rows, notes, most = [], [machine.provenance(run)], usual_decimals(frame.to_dict("records"))
    for found in frame.to_dict("records"):
        ns, low, high = (found.get(key) for key in ("ns_per_test", "ci_low", "ci_high"))
        row = {key: None if absent(value) else value for key, value in found.items()}
        for key in ("outcome", "count", "pairs_timed"):
            row[key] = None if row.get(key) is None else int(row[key])
        rows.append(
            {
                **row,
                "fraction": frequency(found.get("fraction")),
                "ns_per_test": measured(ns, low, high, most),
                "interval": interval(ns, low, high, most),
            }
        )
    there = set().union(*rows) if rows else set()
    key = ["kernel", "precision", "density"]
    raw = [*key, "outcome", "label", "count", "fraction", "ns_per_test", "ci_low", "ci_high"]
    densities = cells.densities(frame)
    shown, shares = rows, ["count", "fraction"]
    if len(densities) > 1:
        if len(densities) > _MOST_DENSITIES:
            notes.insert(0, f"frequencies at all {len(densities)} densities: see csv or json")
            step = (len(densities) - 1) / (_MOST_DENSITIES - 1)
            densities = [densities[round(place * step)] for place in range(_MOST_DENSITIES)]
        shares = [_share_head(density) for density in densities]
        shown = _over_densities(rows)
    precision = ["precision"] if len(cells.precisions(frame)) > 1 else []
    has = [
        column
        for column in ("ns_per_test", "interval", "pairs_timed")
        if any(row.get(column) not in (None, "", (None, "")) for row in rows)
    ]
    title = "outcomes: frequency" + (", and ns a test of pairs that all return it" if has else "")
    return Table(
        "outcomes",
        shown,
        ["kernel", *precision, "outcome", "label", *shares, *has],
        title,
        [*raw, "pairs_timed", *(column for column in ("table",) if column in there)],
        rows if shown is not rows else [],
        HEADERS,
        notes,
    )


def _over_densities(rows: list[dict]) -> list[dict]:
    """Join the rows of an outcome at several densities; its time is that of the most pairs."""
    joined: dict[tuple, dict] = {}
    for row in rows:
        outcome = tuple(row.get(key) for key in ("kernel", "precision", "outcome"))
        one = joined.setdefault(outcome, dict(row))
        one[_share_head(row["density"])] = row["fraction"]
        if (row.get("pairs_timed") or 0) > (one.get("pairs_timed") or 0):
            one |= {key: row.get(key) for key in ("ns_per_test", "interval", "pairs_timed")}
    return list(joined.values())


def _share_head(density) -> str:
    return f"% at {cells.density_text(density)}"


def operations_table(run: "Run") -> Table:
    """Return how often each operation can occur, greatest count on any path through a kernel.

    Parameters
    ----------
    run : Run
        A run of the experiment ``operations``.

    Returns
    -------
    Table
        A row a kernel; without rows if the run counted nothing.
    """
    rows = [
        {"kernel": found["kernel"]}
        | {key: None if absent(found.get(key)) else int(found[key]) for key in COUNTS}
        for found in run.operations.to_dict("records")
    ]
    columns = [key for key in COUNTS if any(row[key] is not None for row in rows)]
    title = "operations: greatest number on any path through the kernel"
    return Table("operations", rows, ["kernel", *columns], title, headers=HEADERS)
