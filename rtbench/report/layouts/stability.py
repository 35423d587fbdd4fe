"""Tables of what kernels get wrong of hard cases: by kernel, by family, over the length of dir."""

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from rtbench.records import schema
from rtbench.report import machine
from rtbench.report.digits import absent, percent
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

HOLDS, FAILS = "x", "."
NUMBERS = ("c_star", "p99_t", "p99_u", "p99_v")
LEGEND = (
    "wrong, unstable (eta > 16 roundoffs), leaks, doubles, perm, C*, p99: of the core families",
    "C*: greatest eta of a wrong answer, in roundoffs; p99: of the errors of hits, in roundoffs of "
    "condition and value",
    "S1 nothing unstable; S2 no leak; S3 no invalid input accepted; S4 no hit with NaN or inf",
    "S5 p99 at most 64 in every core family; S6 same answer in any order of the vertices",
    "R1 nothing unstable in subnormal and overflow; X1 nothing wrong in any family; X2 every group "
    "hit once",
    "edges: a ray through an edge that two triangles share, in exact arithmetic: both are hit "
    "(closed), one (half-open), or none in some orders of the vertices",
)
CAUSES = {
    "wrong_by_method": "method",
    "wrong_by_stored_data": "stored data",
    "wrong_by_arithmetic": "arithmetic",
    "leaks_by_method": "leaks of method",
}


def stability_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``stability``; without rows otherwise.

    Parameters
    ----------
    run : Run
        Its stability, families and curves.

    Returns
    -------
    list of Table
        All kernels; why wrong answers are wrong; by family, a column a kernel; and wrong answers
        over the length of the direction.
    """
    rows, families = run.stability.to_dict("records"), run.families.to_dict("records")
    notes = [machine.provenance(run)]
    return [
        summary_table(rows, [*LEGEND, *whys(rows), *notes]),
        causes_table(rows, notes),
        wrong_table(families, notes),
        lengths_table(run.curves.to_dict("records"), notes),
    ]


def summary_table(rows: Iterable[Mapping], notes: Iterable[str] = LEGEND) -> Table:
    """Return the table of kernels.

    Parameters
    ----------
    rows : iterable of mappings
        Of the columns schema.STABILITY_COLUMNS.
    notes : iterable of str
        What stands below it.

    Returns
    -------
    Table
        A row a kernel and precision; in csv all columns.
    """
    rows = list(rows)
    shown = []
    for row in rows:
        share = percent(row["wrong"] / row["decided"] if row["decided"] else None)
        shown.append(
            {name: row[name] for name in ("kernel", "precision", "unstable", "doubles", "edges")}
            | {
                "wrong": Cell(row["wrong"], f"{row['wrong']} ({share.text} %)"),
                "leaks": Cell(row["leaks"], f"{row['leaks']}/{row['groups']}"),
                "invalid": row["invalid_accepted"],
                "perm": row["permutation"],
            }
            | {name: number(row[name]) for name in NUMBERS}
            | {name: HOLDS if row[name] else FAILS for name in schema.CRITERIA}
        )
    counts = ("wrong", "unstable", "leaks", "doubles", "invalid", "perm")
    return Table(
        "stability",
        shown,
        ["kernel", "precision", *counts, *NUMBERS, *schema.CRITERIA, "edges"],
        "hard cases: what each kernel gets wrong",
        list(schema.STABILITY_COLUMNS),
        rows,
        {"c_star": "C*", "p99_t": "p99 t", "p99_u": "p99 u", "p99_v": "p99 v"},
        list(notes),
    )


def whys(rows: Iterable[Mapping]) -> list[str]:
    """Return a line for each kernel that fails, of its first precision that does."""
    found = {}
    for row in rows:
        if not absent(row["why"]):
            found.setdefault(row["kernel"], f"{row['kernel']} {row['precision']} {row['why']}")
    return list(found.values())


def causes_table(rows: Iterable[Mapping], notes: Iterable[str] = ()) -> Table:
    """Return whose fault the wrong answers are; without rows where no kernel has an exact form."""
    shown = [row for row in rows if not absent(row.get("wrong_by_method"))]
    return Table(
        "stability-causes",
        [{**row, "edges": row["edges"]} for row in shown],
        ["kernel", "precision", "wrong", *CAUSES, "edges"],
        "whose fault: wrong in exact arithmetic too, wrong for what was rounded and stored, or not",
        headers=CAUSES,
        notes=list(notes),
    )


def wrong_table(rows: Iterable[Mapping], notes: Iterable[str] = ()) -> Table:
    """Return wrong answers by family in per cent, a column a kernel; in csv every number.

    Parameters
    ----------
    rows : iterable of mappings
        Of the columns schema.FAMILY_COLUMNS.
    notes : iterable of str
    """
    rows = list(rows)
    several = len({row["precision"] for row in rows}) > 1
    shown: dict[str, dict] = {}
    names = []
    for row in rows:
        name = f"{row['kernel']} {row['precision']}" if several else row["kernel"]
        if name not in names:
            names.append(name)
        if row["decided"]:
            line = shown.setdefault(row["family"], {"family": row["family"]})
            line[name] = percent(row["wrong"] / row["decided"])
    return Table(
        "stability-families",
        list(shown.values()),
        ["family", *names],
        "wrong answers by family, in % of the cases that are no ties",
        list(schema.FAMILY_COLUMNS),
        rows,
        notes=list(notes),
    )


def family_table(rows: Iterable[Mapping], name: str, notes: Iterable[str] = ()) -> Table:
    """Return one kernel's table by family.

    Parameters
    ----------
    rows : iterable of mappings
        Of the columns schema.FAMILY_COLUMNS, of one kernel and precision.
    name : str
        Of the kernel and its precision.
    notes : iterable of str

    Returns
    -------
    Table
        Errors at the 99th percentile: t, u, v over condition; t relative and in ulps.
    """
    rows = list(rows)
    counts = ("wrong", "unstable", "knee", "c_star", "leaks", "doubles", "strange")
    shown = []
    for row in rows:
        share = percent(row["wrong"] / row["decided"] if row["decided"] else None)
        line = {key: row[key] for key in ("family", "cases", "unstable", "doubles", "strange")}
        line["wrong"] = Cell(row["wrong"], f"{row['wrong']} ({share.text or 0} %)")
        line["leaks"] = Cell(row["leaks"], f"{row['leaks']}/{row['groups']}" * bool(row["groups"]))
        line["knee"] = number(row["knee"])
        keys = (*NUMBERS, "relative_t", "ulps_t")
        shown.append(line | {key: number(row[key]) for key in keys})
    return Table(
        f"families-{name.replace(' ', '-')}",
        shown,
        ["family", "cases", *counts, *NUMBERS[1:], "relative_t", "ulps_t"],
        f"{name} by family",
        list(schema.FAMILY_COLUMNS),
        rows,
        {
            "c_star": "C*",
            "strange": "not finite",
            **{f"p99_{x}": f"p99 {x}" for x in "tuv"},
            "relative_t": "p99 rel. t",
            "ulps_t": "p99 ulps t",
        },
        [
            "knee: the first difficulty at which more than 1 % are wrong; the difficulty's unit is "
            "the family's own",
            *notes,
        ],
    )


def lengths_table(rows: Iterable[Mapping], notes: Iterable[str] = ()) -> Table:
    """Return wrong answers over log10 of the length of dir, a row a kernel and precision.

    Parameters
    ----------
    rows : iterable of mappings
        Of the columns schema.CURVE_COLUMNS; only those of the family schema.LENGTHS are taken.
    notes : iterable of str
    """
    rows = [row for row in rows if row["family"] == schema.LENGTHS]
    lines: dict[tuple, dict] = {}
    for row in rows:
        key = row["kernel"], row["precision"]
        line = lines.setdefault(key, {"kernel": key[0], "precision": key[1]})
        line[_power(row["difficulty"])] = percent(row["wrong_share"])
    powers = sorted({row["difficulty"] for row in rows})
    return Table(
        "stability-lengths",
        list(lines.values()),
        ["kernel", "precision", *map(_power, powers)],
        "wrong answers in % over log10 of the length of dir",
        list(schema.CURVE_COLUMNS),
        rows,
        notes=list(notes),
    )


def _power(difficulty: float) -> str:
    return f"{difficulty:g}"


def number(value) -> Cell:
    """Return a number that may be of any size with two digits: 0.48, 12, 5,821, 5.8e6."""
    if absent(value):
        return Cell(None, "")
    value = float(value)
    if not math.isfinite(value):
        return Cell(value, "infinite")
    size = abs(value)
    if value and not 1e-2 <= size < 99_999.5:
        digits, power = f"{value:.1e}".split("e")
        return Cell(value, f"{digits}e{int(power)}")
    return Cell(value, f"{value:,.0f}" if size >= 10 else f"{value:.2g}")
