"""Table of the naive way: what a test takes in it, and what is left where none is made."""

from typing import TYPE_CHECKING

from rtbench.records import schema
from rtbench.report import machine
from rtbench.report.digits import interval, measured
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run


def naive_table(run: "Run") -> Table:
    """Return the table of a run of the experiment ``naive``: a row a kernel and scene.

    Parameters
    ----------
    run : Run
        Measured.

    Returns
    -------
    Table
        Nanoseconds a ray and triangle with their 95 % interval, a ray's microseconds, and how much
        of them a loop takes that only reads the triangles.
    """
    scenes = {scene["pairs"]: scene for scene in run.info.get("scenes") or []}
    rows = []
    for one in run.summary.to_dict("records"):
        scene = scenes.get(one["triangles"])
        if scene is None:
            continue
        ends = one["ci_low"], one["ci_high"]
        row = {"triangles": scene["triangles"], "kernel": one["kernel"]}
        row |= {"precision": one["precision"], "rays": scene["rays"]}
        row["ns_per_test"] = measured(one["ns_per_test"], *ends)
        row["interval"] = interval(one["ns_per_test"], *ends)
        each = one["ns_per_test"] * scene["triangles"] / 1000
        row["microseconds_per_ray"] = Cell(each, f"{each:,.{1 if each < 100 else 0}f}")
        rows.append(row)
    for row in rows:
        alone = [
            other["ns_per_test"].value
            for other in rows
            if other["kernel"] == schema.EMPTY
            and (other["triangles"], other["precision"]) == (row["triangles"], row["precision"])
        ]
        if alone and row["kernel"] != schema.EMPTY:
            share = 100 * alone[0] / row["ns_per_test"].value
            row["loop_percent"] = Cell(share, f"{share:.1f}")
    columns = ["triangles", "kernel", "ns_per_test", "interval", "microseconds_per_ray"]
    columns += ["loop_percent"]
    if len({row["precision"] for row in rows}) > 1:
        columns.insert(2, "precision")
    notes = ["empty: a loop that reads each triangle and tests none", machine.provenance(run)]
    return Table(
        "naive",
        rows,
        columns,
        f"{run.info.get('title') or 'The naive way'}; primary rays against every triangle",
        headers={
            "ns_per_test": "ns a test",
            "interval": "95 %",
            "microseconds_per_ray": "us a ray",
            "loop_percent": "% loop",
        },
        notes=notes,
    )
