"""Tables of rays that leak out of a closed mesh, and of hard cases as libraries answer them."""

from typing import TYPE_CHECKING

from rtbench.records import schema
from rtbench.report import cells, machine
from rtbench.report.digits import absent
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

AIMS = {"vertex": "at vertices", "edge": "at edges", "face": "at faces"}
RULE_OF_THREE = 3.0  # of n without one event: fewer than 3 / n, at 95 %
LEGEND = (
    "leaks: rays from inside that meet no triangle, of how many; none: below 3 in so many, at 95 %",
    "elsewhere: the nearest triangle found is not one of those that the ray was aimed at",
)
PEER_NUMBERS = {"c_star": "C*", "p99_t": "p99 t", "p99_u": "p99 u", "p99_v": "p99 v"}
PEER_COUNTS = ("wrong", "unstable", "leaks", "doubles", "scene_leaks", "invalid_accepted")


def watertightness_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``watertightness``; without rows otherwise.

    Parameters
    ----------
    run : Run
        Its leaks and peers.

    Returns
    -------
    list of Table
        A table a place of the mesh, and the hard cases as the peers answer them.
    """
    return [
        *(leaks_table(run, place) for place in cells.values(run.leaks, "place")),
        peers_table(run),
    ]


def upper_bound(leaks: int, rays: int) -> float:
    """Return the share of leaks; where there is none, what it is below at 95 %."""
    return leaks / rays if leaks else RULE_OF_THREE / rays


def leaks_table(run: "Run", place: str) -> Table:
    """Return how many rays leak of a mesh at one place: a row a kernel or peer and precision."""
    frame = cells.where(run.leaks, place=place)
    rows: dict[tuple, dict] = {}
    raw = []
    for found in frame.to_dict("records"):
        who = found["kernel"], found["precision"]
        row = rows.setdefault(who, {"kernel": who[0], "precision": who[1]})
        leaks, asked = int(found["leaks"]), int(found["rays"])
        row[found["aim"]] = _leaks(leaks, asked)
        if not absent(found["elsewhere"]):
            row["elsewhere"] = row.get("elsewhere", 0) + int(found["elsewhere"])
        raw.append(found | {"share": upper_bound(leaks, asked), "bound": int(leaks == 0)})
    exact = {
        w["data"]: w["exact"] / w["rays"]
        for w in run.info.get("workloads") or []
        if w.get("place") == place and w["rays"]
    }
    told = ", ".join(f"{100 * share:.0f} % in {data}" for data, share in exact.items())
    return Table(
        f"leaks-{place.replace(',', '').replace(' ', '-')}",
        list(rows.values()),
        ["kernel", "precision", *AIMS, "elsewhere"],
        f"leaks of a closed mesh {place}",
        [*schema.LEAK_COLUMNS, "share", "bound"],
        raw,
        AIMS,
        [
            *LEGEND,
            *([f"rays that pass through what they are aimed at exactly: {told}"] if told else []),
            *_libraries(run),
            machine.provenance(run),
        ],
    )


def peers_table(run: "Run") -> Table:
    """Return what peers and some kernels get wrong of the hard cases."""
    rows, raw = [], run.peers.to_dict("records")
    for found in raw:
        row = {name: _count(found[name]) for name in PEER_COUNTS}
        if not absent(found["groups"]):
            row["leaks"] = Cell(found["leaks"], f"{found['leaks']}/{found['groups']}")
        row |= {name: _number(found[name]) for name in PEER_NUMBERS}
        rows.append({"kernel": found["kernel"], "precision": found["precision"]} | row)
    return Table(
        "peers",
        rows,
        ["kernel", "precision", *PEER_COUNTS, *PEER_NUMBERS],
        "hard cases: what libraries for Python get wrong, beside some kernels",
        list(schema.PEER_COLUMNS),
        raw,
        PEER_NUMBERS | {"scene_leaks": "leaks, one scene", "invalid_accepted": "invalid"},
        [
            "each triangle alone; wrong, unstable, leaks, doubles, C* and p99 as of the stability "
            "table, over the core families; one scene: groups whose triangles are in one scene and "
            "of which none is hit; empty: not asked, or never told",
            *_libraries(run),
            machine.provenance(run),
        ],
    )


def _libraries(run: "Run") -> list[str]:
    """Return who the peers are, with their versions, and which are absent."""
    told = run.info.get("peers") or []
    there = [f"{p['name']}: {p['title']}, {p['version']}" for p in told if not p["absent"]]
    absent_ones = [f"{p['name']}: {p['absent']}" for p in told if p["absent"]]
    changed = [
        f"after {p['name']} this process flushes subnormal numbers to zero"
        for p in told
        if any((p.get("float_state") or {}).get(name) for name in ("ftz", "daz"))
    ]
    notes = ["; ".join(there)] if there else []
    return notes + (["absent: " + "; ".join(absent_ones)] if absent_ones else []) + changed


def _leaks(leaks: int, rays: int) -> Cell:
    return Cell(leaks, f"{leaks:,} of {rays:,}" if leaks else f"0 of {rays:,}")


def _count(value) -> Cell:
    return Cell(None, "") if absent(value) else Cell(int(value), f"{int(value):,}")


def _number(value) -> Cell:
    return Cell(None, "") if absent(value) else Cell(float(value), f"{float(value):.3g}")
