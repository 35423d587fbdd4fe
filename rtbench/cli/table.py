"""``rtbench table``: a run as tables."""

from __future__ import annotations

from pathlib import Path

import click

from rtbench.cli import options
from rtbench.errors import RtbenchError, unknown


@click.command("table", epilog="Example: rtbench table blecha-pc1 --format github")
@click.argument("run", metavar="RUN")
@options.table_format
@click.option(
    "--only",
    metavar="NAME",
    multiple=True,
    help="Print this table only (times, outcomes ...); may be given more than once.",
)
@options.out
def command(run: str, form: str, only: tuple[str, ...], out: Path) -> None:
    """Print a run's tables, and write them as Markdown, LaTeX and CSV into its folder.

    RUN is a path, a folder name under the output folder, or the name of a published run; of a
    published run, which cannot be written, the tables are printed only. json is one object with a
    list of rows a table.
    """
    from rtbench.records.store import load_run
    from rtbench.report.run_tables import render_all, tables_of, write_tables

    found = load_run(run, out)
    tables = tables_of(found)
    if not tables:
        raise RtbenchError(f"{found.name} has nothing for a table yet: no sample, no count")
    names = [table.name for table in tables]
    for name in only:
        if name not in names:
            raise RtbenchError(unknown("table", name, names))
    click.echo(render_all([table for table in tables if not only or table.name in only], form))
    if found.published:
        return
    try:
        write_tables(found)
    except RtbenchError as problem:
        click.echo(f"rtbench: {problem}", err=True)
        return
    click.echo(f"rtbench: written to {found.path / 'tables'}", err=True)
