"""Which configs repeat which tables, and what is printed of them."""

from __future__ import annotations

from pathlib import Path

from rtbench.errors import RtbenchError, unknown
from rtbench.experiments import blecha, havel, silhavy
from rtbench.experiments.config import Config, read, shipped
from rtbench.experiments.run import Watcher
from rtbench.records.run import Run
from rtbench.records.store import load_run
from rtbench.report import plots, reproduction
from rtbench.report.charts import style
from rtbench.report.run_tables import tables_of, write_tables
from rtbench.report.tables import Table

THESES = {"blecha": blecha, "havel": havel, "silhavy": silhavy}


def configs(table: str) -> list[Config]:
    """Return the configs of a table, or of a whole thesis.

    Parameters
    ----------
    table : str
        A thesis, or what the name of one of its configs ends in, or that name.

    Raises
    ------
    RtbenchError
        For a table that no config repeats.
    """
    known: dict[str, Path] = {}
    named: dict[str, Path] = {}
    whole: dict[str, list[Path]] = {}
    for thesis in THESES:
        own = {
            name.removeprefix(f"{thesis}-"): path
            for name, path in shipped().items()
            if name.startswith(f"{thesis}-")
        }
        whole[thesis] = [own[name] for name in sorted(own, key=_in_order)]
        known |= own
        named |= {f"{thesis}-{name}": path for name, path in own.items()}
    if table in whole:
        return [read(path) for path in whole[table]]
    if table not in known | named:
        raise RtbenchError(unknown("table", table, [*sorted(known, key=_in_order), *THESES]))
    return [read((known | named)[table])]


def _in_order(table: str) -> tuple:
    """Sort 4.10 behind 4.9, and what is no table's number last."""
    parts = table.split(".")
    return (0, *map(int, parts)) if all(p.isdigit() for p in parts) else (1, table)


def thesis_of(config: Config) -> str:
    """Return whose table a config repeats."""
    return config.name.partition("-")[0]


def key(config: Config) -> str:
    """Return the name by which statements call a config's run."""
    return config.name.removeprefix(f"{thesis_of(config)}-")


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


def statements(thesis: str, runs: dict[str, Run], watcher: Watcher) -> Table:
    """Return what a thesis states, as far as the runs can judge it, and what became of it."""
    told = THESES[thesis]
    further = told.further(runs, watcher) if hasattr(told, "further") else {}
    return Table(
        "statements",
        told.judged(runs, **further),
        ["section", "statement", "verdict", "number"],
        f"What {told.THESIS} states, on this machine",
    )
