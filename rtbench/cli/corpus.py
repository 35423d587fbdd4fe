"""``rtbench corpus``: write the hard cases with their exact answers."""

from __future__ import annotations

from pathlib import Path

import click

from rtbench.cli import options
from rtbench.errors import RtbenchError

COLUMNS = ("family", "cases", "float32", "groups", "range", "difficulty", "classes")
HEADS = {"range": "from to"}


@click.command("corpus", epilog="Example: rtbench corpus --out hard-cases.npz")
@click.option(
    "--out",
    "file",
    type=click.Path(path_type=Path),
    required=True,
    metavar="FILE.npz",
    help="The file to write.",
)
@click.option("--seed", type=int, default=1, show_default=True, help="Of what is drawn.")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
@options.table_format
@options.quiet
def command(file: Path, seed: int, force: bool, form: str, quiet: bool) -> None:
    """Write hard cases with their exact answers, and print what is among them.

    Each case is one ray (t > 0) and one triangle with the answer of rational arithmetic. The file
    loads without pickle; rtbench check takes it, or one that somebody else made, as --corpus.
    """
    _refuse(file, force)
    from rtbench.cli.progress import Progress
    from rtbench.report.tables import Table
    from rtbench.workloads import hard_cases

    shown = Progress(quiet)
    shown.say("drawing hard cases and deciding them exactly")
    try:
        cases = hard_cases.corpus(seed, shown.progress)
    finally:
        shown.end()
    _refuse(file, force)  # it may have come meanwhile
    cases.save(file)
    rows = hard_cases.describe(cases)
    for row in rows:
        found = {name: row[name] for name in cases.class_names if row[name]}
        row["classes"] = ", ".join(f"{name} {count}" for name, count in found.items())
        if row["easiest"] != row["hardest"]:
            row["range"] = f"{row['easiest']:.3g} {row['hardest']:.3g}"
    table = Table(
        "corpus",
        rows,
        list(COLUMNS),
        raw_columns=[name for name in rows[0] if name not in ("classes", "range")],
        headers=HEADS,
        notes=[
            f"{len(cases):,} cases, {cases.f32_ok.sum():,} of them float32 numbers, in "
            f"{sum(row['groups'] for row in rows):,} groups and alone; version "
            f"{hard_cases.VERSION}, seed {seed}"
        ],
    )
    click.echo(table.render(form))
    click.echo(f"rtbench: written to {file}", err=True)


def _refuse(file: Path, force: bool) -> None:
    """Complain about a file that cannot be written, before any work is done."""
    if file.is_dir():
        raise RtbenchError(f"cannot write {file}: it is a folder (allowed: a file's name)")
    if not file.parent.is_dir():
        raise RtbenchError(f"cannot write {file}: there is no folder {str(file.parent)!r}")
    if file.exists() and not force:
        raise RtbenchError(f"{file} is there already: choose another name, or say --force")
