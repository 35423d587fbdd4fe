"""Tables of how far t, u, v lie from a reference (Havel 2008, illustration 11)."""

from typing import TYPE_CHECKING

from rtbench.report import cells, machine
from rtbench.report.digits import absent
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

QUANTITIES = ("t", "u", "v")
OWN_REFERENCE = "moller_trumbore_uv"
REFERENCES = {
    "exact": "exact",
    "moller_trumbore": "Möller-Trumbore in double",
    "unrounded": "exact, data before rounding",
}
# What a mean is printed in: the thesis's millionths, and what is readable in double.
UNITS = {"float32": (1e-6, "millionths")}
SMALL_UNIT = (1e-15, "1e-15")
TAILS = {
    "median": "med",
    "p99": "p99",
    "over_condition_p99": "p99/c",
    "over_condition_max": "max/c",
}


def error_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``relative_error``; without rows otherwise.

    Parameters
    ----------
    run : Run
        Its errors and choices.

    Returns
    -------
    list of Table
        The mean relative errors in each precision, their medians and tails, what the choice of
        reference changes, and for how many rays two kernels choose different triangles.
    """
    frame = run.errors
    tables = [
        table(run, precision)
        for table in (means_table, tails_table)
        for precision in cells.values(frame, "precision")
    ]
    return [*tables, references_table(run), choices_table(run)]


def unit_of(precision: str) -> tuple[float, str]:
    """Return what a relative error in this precision is counted in, and its name."""
    return UNITS.get(precision, SMALL_UNIT)


def means_table(run: "Run", precision: str) -> Table:
    """Return the mean relative errors of every kernel in one precision, against exact answers."""
    unit, name = unit_of(precision)
    frame = cells.where(run.errors, precision=precision)
    rows = []
    for kernel, prepared, block in ways(cells.where(frame, reference="exact")):
        row = {"kernel": kernel, "prepared": prepared}
        for found in block.to_dict("records"):
            row[found["quantity"]] = _mean(found, unit)
        rows.append(row)
    hits = [int(count) for count in frame["hits"]]
    return Table(
        f"errors-{precision}",
        rows,
        [*_who(frame), *QUANTITIES],
        f"mean relative error of t, u, v against exact answers, {name}, {precision}",
        list(frame.columns),
        frame.to_dict("records"),
        {quantity: f"{quantity} [95 %]" for quantity in QUANTITIES},
        [
            f"over {min(hits):,} to {max(hits):,} hits with |x| > 0.001",
            "prepared: in which arithmetic what is stored was computed",
            machine.provenance(run),
        ],
    )


def tails_table(run: "Run", precision: str) -> Table:
    """Return median and greatest errors in one precision, relative and over the condition."""
    unit, name = unit_of(precision)
    frame = cells.where(run.errors, precision=precision)
    rows = []
    for kernel, prepared, block in ways(cells.where(frame, reference="exact")):
        row = {"kernel": kernel, "prepared": prepared}
        for found in block.to_dict("records"):
            for key in TAILS:
                scale = 1.0 if key.startswith("over_condition") else unit
                row[f"{found['quantity']}_{key}"] = _scaled(found[key], scale)
        rows.append(row)
    columns = [f"{quantity}_{key}" for quantity in QUANTITIES for key in TAILS]
    return Table(
        f"error-tails-{precision}",
        rows,
        [*_who(frame), *columns],
        f"relative error in {name}, and error over condition, {precision}",
        headers={f"{q}_{key}": f"{q} {short}" for q in QUANTITIES for key, short in TAILS.items()},
        notes=[
            "/c: error in roundoffs of (condition + |x|); a few is as good as can be",
            machine.provenance(run),
        ],
    )


def references_table(run: "Run") -> Table:
    """Return least and greatest mean errors by reference: what the choice of reference changes."""
    frame = run.errors
    rows = []
    for precision in cells.values(frame, "precision"):
        for reference in cells.values(frame, "reference"):
            for quantity in QUANTITIES:
                block = cells.where(
                    frame, precision=precision, reference=reference, quantity=quantity
                )
                block = block[block["mean"].notna()]
                if len(block):
                    key = {"precision": precision, "reference": REFERENCES[reference]}
                    rows.append(key | {"quantity": quantity} | _extremes(block))
    return Table(
        "error-references",
        rows,
        ["precision", "reference", "quantity", "least", "of", "greatest", "of_", "own", "place"],
        "mean relative error by reference: the least and the greatest of all kernels",
        headers={
            "reference": "against",
            "of_": "of",
            "own": OWN_REFERENCE,
            "place": "its place, 1 = greatest",
        },
        notes=[machine.provenance(run)],
    )


def choices_table(run: "Run") -> Table:
    """Return for how many rays two kernels choose different triangles, and one an inexact one."""
    frame = run.choices
    rows = []
    for found in frame[frame["kernel"].isna()].to_dict("records"):
        block = cells.where(frame, precision=found["precision"], density=found["density"])
        named = block[block["kernel"].notna()]
        worst = named.loc[named["differ"].idxmax()]
        rows.append(
            {
                "precision": found["precision"],
                "density": Cell(found["density"], cells.density_text(found["density"])),
                "kernels": int(named["kernel"].nunique()),
                "rays": int(found["rays"]),
                "differ": int(found["differ"]),
                "within_rounding": int(found["within_rounding"]),
                "most": int(worst["differ"]),
                "by": worst["kernel"] if worst["differ"] else None,
            }
        )
    return Table(
        "choices",
        rows,
        ["precision", "density", "kernels", "rays", "differ", "within_rounding", "most", "by"],
        "rays for which some two kernels choose different triangles",
        headers={
            "density": "hit ratio",
            "differ": "rays that differ",
            "within_rounding": "of them within rounding",
            "most": "most that differ from exact",
            "by": "by",
        },
        notes=[machine.provenance(run)],
    )


def ways(frame: "DataFrame"):
    """Yield kernel, preparation (None: none) and rows, in the order of the records."""
    for kernel in cells.values(frame, "kernel"):
        block = cells.where(frame, kernel=kernel)
        told = [None if absent(way) else way for way in block["prepared"]]
        for way in dict.fromkeys(told):
            yield kernel, way, block[[one == way for one in told]]


def _extremes(block: "DataFrame") -> dict:
    means = block["mean"].astype(float)
    least, greatest = means.idxmin(), means.idxmax()
    row = {"least": _power(means[least]), "of": _named(block.loc[least])}
    row |= {"greatest": _power(means[greatest]), "of_": _named(block.loc[greatest])}
    own = means[block["kernel"] == OWN_REFERENCE]
    if len(own):
        row["own"] = _power(own.iloc[0])
        row["place"] = f"{1 + int((means > own.iloc[0]).sum())} of {len(means)}"
    return row


def _named(found) -> str:
    way = found["prepared"]
    return found["kernel"] + ("" if absent(way) else f" ({way})")


def _who(frame: "DataFrame") -> list[str]:
    return ["kernel", *(["prepared"] if frame["prepared"].nunique() > 1 else [])]


def _mean(found: dict, unit: float) -> Cell:
    value, low, high = (found[key] for key in ("mean", "ci_low", "ci_high"))
    if absent(value):
        return Cell(None, "")
    text = f"{value / unit:.2f}"
    if not absent(low) and not absent(high):
        text += f" [{low / unit:.2f}, {high / unit:.2f}]"
    return Cell(float(value), text)


def _scaled(value, unit: float) -> Cell:
    return Cell(None, "") if absent(value) else Cell(float(value), f"{value / unit:.2f}")


def _power(value: float) -> Cell:
    return Cell(float(value), f"{value:.2e}" if value else "0")
