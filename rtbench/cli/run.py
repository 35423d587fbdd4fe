"""``rtbench run``: measure kernels."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from rtbench.cli import options

EXAMPLES = """\b
Examples:
  rtbench run --density 0.3 --tris 2000 --reps 10000
  rtbench run --kernel 'moller?' --precision float64 --density 0.5 --reps 2000
  rtbench run working-set --quick
"""


@click.command(epilog=EXAMPLES, no_args_is_help=False)
@click.argument("config", required=False)
@click.option(
    "--density",
    "-d",
    "densities",
    type=float,
    multiple=True,
    help="Fraction of the pairs that hit, exactly; repeatable.  [0 0.25 0.5 0.75 1]",
)
@click.option("--tris", "triangles", type=int, help="Pairs of a triangle and a ray.  [25000]")
@click.option(
    "--reps",
    "repetitions",
    type=int,
    help="How often each pair is tested, over all samples of a cell.  [20000]",
)
@click.option(
    "--kernel",
    "-k",
    "kernels",
    multiple=True,
    metavar="NAME",
    help="A kernel's name, a glob, or FILE.py:NAME; repeatable.  [moller1 badouel chirkov]",
)
@click.option(
    "--precision",
    "precisions",
    multiple=True,
    metavar="P",
    help="float32, float64 or mixed (float32 data, float64 arithmetic); repeatable.  [float32]",
)
@click.option(
    "--order",
    "orders",
    multiple=True,
    metavar="ORDER",
    help="repeat: each pair many times in a row; sweep: shuffled pairs, again and again; "
    "sorted: a sweep over pairs sorted by outcome; shuffled: all repetitions in one "
    "random sequence, which no predictor learns; repeatable.  [repeat sweep]",
)
@click.option(
    "--layout",
    metavar="LAYOUT",
    help="shared: the thesis's records of 64 and 36 bytes; own: what the kernel reads.  [shared]",
)
@click.option("--generator", metavar="NAME", help="pcg64, or msvc: the C library of 2007.  [pcg64]")
@click.option("--seed", type=int, help="Of the workload and the order of the cells.  [1]")
@click.option("--processes", type=int, help="Measuring processes, one after another.  [5]")
@click.option("--samples", type=int, help="Rounds in each process.  [up to 5]")
@click.option("--cpu", type=int, help="Pin the measuring processes to this CPU.")
@click.option("--quick", is_flag=True, help="A tenth of the work.")
@click.option("--label", help="Part of the run folder's name.  [the processor]")
@options.out
@click.option("--resume", metavar="RUN", help="End a run that was cut off.")
@options.table_format
@options.quiet
def command(config, quick, label, out, resume, cpu, form, quiet, **changes):
    """Measure kernels and keep the records.

    CONFIG is a TOML file, or the name of one that comes with rtbench (blecha-4.2, working-set,
    ...); options override it. Without one: the density experiment.

    Every kernel is timed on the same pairs, and its answers are checked before, during and after.
    Prints a table of times with their 95 % intervals, the outcomes, and the folder that holds all
    of it. json is one object: run, path, and tables with a list of rows each; csv is the first
    table alone. Exit code 4: a kernel gave a wrong answer; 130: stopped by Ctrl-C.
    """
    if resume is not None:
        _only_resume(config, quick, label, cpu, changes)
    from rtbench.cli.progress import Progress
    from rtbench.experiments import config as configs
    from rtbench.experiments import run as runs

    progress = Progress(quiet)
    try:
        if resume is not None:
            done = runs.resume(resume, progress, out)
        else:
            chosen = configs.find(config) if config else configs.Config()
            chosen = chosen.changed(**changes)
            chosen = chosen.quick() if quick else chosen
            done = runs.start(chosen, progress, out, label, cpu, sys.argv)
    finally:
        progress.end()
    show(done, form, progress)


def _only_resume(config, quick, label, cpu, changes) -> None:
    from rtbench.errors import RtbenchError

    given = [name for name, value in changes.items() if value not in (None, ())]
    if config or quick or label or cpu is not None or given:
        raise RtbenchError(
            "--resume goes on with what the run's own config says: no CONFIG and no other options "
            "than --out, --format and --quiet"
        )


def show(done, form: str, progress) -> None:
    """Print a run's tables, write its files, and say where they are."""
    from rtbench.report import plots
    from rtbench.report.run_tables import tables_of, write_tables

    tables = tables_of(done)
    if form == "json":
        told = {table.name: json.loads(table.render(form)) for table in tables}
        told = {"run": done.name, "path": str(relative(done.path)), "tables": told}
        click.echo(json.dumps(told, indent=2, ensure_ascii=False))
    else:
        for table in tables[:1] if form == "csv" else tables:
            click.echo(table.render(form))
            if form != "csv":
                click.echo()
    progress.say("drawing plots")
    write_tables(done)
    plots.write(done)
    progress.end()
    if form in ("plain", "github"):
        click.echo(f"Records, tables and plots: {relative(done.path)}")


def relative(path: Path) -> Path:
    path = path.resolve()
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
