"""All tables of a run, and their files."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rtbench.errors import RtbenchError
from rtbench.records.tabular import reason, replace
from rtbench.report.layouts.accuracy import accuracy_tables
from rtbench.report.layouts.break_even import break_even_tables
from rtbench.report.layouts.compilers import compilers_tables
from rtbench.report.layouts.density import time_tables
from rtbench.report.layouts.effects import effects_tables
from rtbench.report.layouts.errors import error_tables
from rtbench.report.layouts.experiments import (
    latency_table,
    penalty_table,
    stages_table,
    working_set_table,
)
from rtbench.report.layouts.naive import naive_table
from rtbench.report.layouts.outcomes import operations_table, outcomes_table
from rtbench.report.layouts.packets import packets_tables
from rtbench.report.layouts.soup import soup_tables
from rtbench.report.layouts.stability import stability_tables
from rtbench.report.layouts.techniques import subsampling_tables, techniques_tables
from rtbench.report.layouts.tree_growth import builders_tables
from rtbench.report.layouts.trees import trees_tables
from rtbench.report.layouts.watertightness import watertightness_tables
from rtbench.report.tables import SUFFIXES, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

FILE_FORMS = ("github", "latex", "csv")
# What stands in place of the table of times over density.
_OWN_LAYOUT = {
    "stages": stages_table,
    "working_set": working_set_table,
    "latency": latency_table,
    "naive": naive_table,
}
_OWN_LAYOUTS = {
    "accuracy": accuracy_tables,
    "soup": soup_tables,
    "break_even": break_even_tables,
    "compilers": compilers_tables,
    "packets": packets_tables,
    "effects": effects_tables,
    "subsampling": subsampling_tables,
    "techniques": techniques_tables,
    "trees": trees_tables,
    "tree_builders": builders_tables,
}


def tables_of(run: "Run") -> list[Table]:
    """Return every table that a run has rows for: times, then outcomes, then what else it has.

    Parameters
    ----------
    run : Run
        A loaded run.

    Returns
    -------
    list of Table
        Empty if nothing was measured or counted yet.
    """
    experiment = run.info.get("experiment")
    own, several = _OWN_LAYOUT.get(experiment), _OWN_LAYOUTS.get(experiment)
    found = [own(run)] if own else (several or time_tables)(run)
    # Where every pair hits, as for stages, or pairs stand beside rays, as for packets, a count of
    # outcomes says nothing.
    outcomes = outcomes_table(run)
    timed = "ns_per_test" in outcomes.columns
    found += [
        penalty_table(run),
        *([outcomes] if timed or not (own or several) else []),
        operations_table(run),
    ]
    found += error_tables(run)
    found += stability_tables(run)
    found += watertightness_tables(run)
    return [table for table in found if table.rows]


def render_all(tables: Sequence[Table], form: str = "plain") -> str:
    """Return several tables as one text.

    Parameters
    ----------
    tables : sequence of Table
        In the order in which they are printed.
    form : str
        As `Table.render` takes it.

    Returns
    -------
    str
        An empty line between two tables; in json one object, table name to list of rows.
    """
    if form == "json":
        found = {table.name: json.loads(table.render(form)) for table in tables}
        return json.dumps(found, indent=2, ensure_ascii=False)
    return "\n\n".join(table.render(form) for table in tables)


def write_tables(
    run: "Run", folder: Path | None = None, tables: list[Table] | None = None
) -> list[Path]:
    """Write tables of a run as Markdown, LaTeX and CSV.

    Parameters
    ----------
    run : Run
        A loaded run.
    folder : Path, optional
        Where to; ``tables`` in the run's folder if not given.
    tables : list of Table, optional
        Which; every table of the run if not given.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    RtbenchError
        If the folder cannot be written.
    """
    folder = Path(folder or run.path / "tables")
    written = []
    for table in tables_of(run) if tables is None else tables:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RtbenchError(f"cannot write {folder}: {reason(error)}") from error
        for form in FILE_FORMS:
            path = folder / f"{table.name}.{SUFFIXES[form]}"
            replace(path, table.render(form) + "\n")
            written.append(path)
    return written
