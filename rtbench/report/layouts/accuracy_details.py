"""Tables beside the price of accuracy: what filters leave, a ray at a mesh, what is claimed."""

from rtbench.records.tabular import plain
from rtbench.report import accuracy_claims, machine
from rtbench.report.accuracy import (
    CORPUS,
    FAR,
    LEAF,
    MESH,
    MILLION,
    RANDOM,
    RAYS,
    SCALAR,
    Accuracy,
    Point,
)
from rtbench.report.digits import interval, measured
from rtbench.report.tables import Cell, Table


def fallback_table(accuracy: Accuracy) -> Table:
    """Return how many of a million tests a filter leaves to its fallback."""
    rows, raw = {}, []
    for told in accuracy.run.accuracy.to_dict("records"):
        known = {name: plain(value) for name, value in told.items()}
        if known["undecided"] is None:
            continue
        point = Point(known["kernel"], known["precision"])
        row = rows.setdefault(point, {"kernel": point.name})
        share = MILLION * known["undecided"] / known["tests"]
        more = known["undecided64"]
        words = short(rounded(share)).text
        row[known["workload"]] = Cell(share, words if more is None else f"{words} ({more})")
        raw.append({name: known.get(name) for name in _FALLBACK} | {"ppm": share})
    there = [w for w in (RANDOM, LEAF, FAR, CORPUS) if any(w in row for row in rows.values())]
    return Table(
        "fallback",
        list(rows.values()),
        ["kernel", *there],
        "Tests that a filter leaves to its fallback, of a million",
        [*_FALLBACK, "ppm"],
        raw,
        notes=[
            "in brackets: how many float64 leaves open too, so that exact sums decide; of 4,000 at "
            "most are asked",
            machine.provenance(accuracy.run),
        ],
    )


_FALLBACK = ("kernel", "precision", "workload", "tests", "undecided", "undecided64")


def mesh_table(accuracy: Accuracy) -> Table:
    """Return what a ray costs that looks for its nearest hit of a mesh by brute force."""
    rows = []
    told = {
        (row["kernel"], row["precision"], row["form"]): row
        for row in accuracy.run.info.get("mesh") or []
    }
    points = accuracy.points(MESH)
    for form, words in ((SCALAR, "ray by ray"), (RAYS, "packets of 16")):
        here = [point for point in points if point.form == form]
        if not here:
            continue
        first = min(here, key=lambda point: accuracy.time(point, MESH).value)
        for point in sorted(here, key=lambda point: accuracy.time(point, MESH).value):
            known = told.get((point.kernel, point.precision, form), {})
            size = known.get("triangles") or 1
            time = accuracy.time(point, MESH)
            ends = [None if x is None else x * size for x in time.interval() or (None, None)]
            ratio = accuracy.ratio(point, first, MESH)
            between = ratio.interval() or (None, None)
            rows.append(
                {
                    "form": Cell(form, words),
                    "kernel": Cell(point.kernel, point.name),
                    "precision": point.precision,
                    "ns": measured(time.value * size, *ends, most=1),
                    "interval": interval(time.value * size, *ends, most=1),
                    "low": ends[0],
                    "high": ends[1],
                    "ratio": measured(ratio.value, *between, most=2),
                    "ratio_interval": interval(ratio.value, *between, most=2),
                    "triangles": size,
                    "wrong": known.get("wrong"),
                    "rays": known.get("rays"),
                }
            )
    columns = ["form", "kernel", "ns", "interval", "ratio", "ratio_interval", "wrong"]
    headers = {"ns": "ns a ray", "interval": "95 %", "ratio": "to the fastest"}
    headers |= {"ratio_interval": "95 %", "wrong": "wrong rays"}
    size = next((row["triangles"] for row in rows), 0)
    rays = next((row["rays"] for row in rows), 0) or 0
    return Table(
        "mesh",
        rows,
        columns,
        f"The nearest hit over a sphere of {size} triangles by brute force, {rays:,} rays",
        ["form", "kernel", "precision", "ns", "low", "high", "ratio", "triangles", "rays", "wrong"],
        headers=headers,
        notes=[
            "wrong rays: they hit where nothing may be hit, or nothing where something must",
            machine.provenance(accuracy.run),
        ],
    )


def statements_table(accuracy: Accuracy) -> Table:
    """Return what is claimed of the exact kernel in packets at 50 % hits."""
    found = accuracy_claims.statements(accuracy)
    rows = [{"verdict": each.verdict, "claim": each.claim, "number": each.number} for each in found]
    title = "Claims about exact answers in packets, half of the tests hit"
    return Table("claims", rows, ["verdict", "claim", "number"], title)


def short(value: float | None) -> Cell:
    """Return a number of any size in few characters."""
    if value is None:
        return Cell(None, "")
    extreme = value and not 1e-3 <= abs(value) < 100_000
    return Cell(
        value, f"{value:.1e}" if extreme else f"{value:.3g}" if value % 1 else f"{value:.0f}"
    )


def rounded(value: float) -> float:
    """Return a number with three digits."""
    return float(f"{value:.3g}")
