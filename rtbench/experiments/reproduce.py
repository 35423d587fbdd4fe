"""Which configs repeat which tables, and what is printed of them."""

from __future__ import annotations

from rtbench.errors import RtbenchError, unknown
from rtbench.experiments.config import Config, read, shipped
from rtbench.records.run import Run
from rtbench.records.store import load_run
from rtbench.report import plots, reproduction
from rtbench.report.charts import style
from rtbench.report.run_tables import tables_of, write_tables
from rtbench.report.tables import Table

THESIS = "blecha"


def configs(table: str) -> list[Config]:
    """Return the configs of a table, or of a whole thesis.

    Raises
    ------
    RtbenchError
        For a table that no config repeats.
    """
    known = {
        name.removeprefix(f"{THESIS}-"): path
        for name, path in shipped().items()
        if name.startswith(f"{THESIS}-")
    }
    if table == THESIS:
        return [read(known[name]) for name in sorted(known, key=_in_order)]
    if table not in known:
        raise RtbenchError(unknown("table", table, [*sorted(known, key=_in_order), THESIS]))
    return [read(known[table])]


def _in_order(table: str) -> tuple:
    """Sort 4.10 behind 4.9, and what is no table's number last."""
    parts = table.split(".")
    return (0, *map(int, parts)) if all(p.isdigit() for p in parts) else (1, table)


def key(config: Config) -> str:
    """Return the name by which statements call a config's run."""
    return config.name.removeprefix(f"{THESIS}-")


def tables(run: Run) -> list[Table]:
    """Write a run's tables and plots, and return what is to be printed.

    Returns
    -------
    list of Table
        The run's own tables, then the thesis's numbers beside ours.
    """
    found = tables_of(run)
    write_tables(run)
    plots.write(run)
    name = run.info["config"]["published"]
    if name:
        published = load_run(name)
        beside = reproduction.beside_published(run, published)
        found += beside
        write_tables(run, tables=beside)
        figure = reproduction.chart(run, published)
        if figure is not None:
            style.save(figure, run.path / "plots" / "beside-thesis", plots.DEFAULT_FORMATS)
    return found


def statement_table(rows: list[dict]) -> Table:
    """Return the statements of chapter 4 and what became of them."""
    return Table(
        "statements",
        rows,
        ["section", "statement", "verdict", "number"],
        "What Blecha 2007 states, on this machine",
    )
