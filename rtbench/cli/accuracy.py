"""``rtbench accuracy``: what accuracy costs in time."""

from __future__ import annotations

import json
import sys

import click

from rtbench.cli import options

EXAMPLES = """\b
Examples:
  rtbench accuracy --quick
  rtbench accuracy --kernel moller_trumbore_uv --kernel adaptive_exact_uv
"""


@click.command(epilog=EXAMPLES)
@click.argument("run", metavar="[RUN]", required=False)
@click.option(
    "--kernel",
    "-k",
    "kernels",
    multiple=True,
    metavar="NAME",
    help="A kernel's name, a glob, or FILE.py:NAME; repeatable.  [those of the config accuracy]",
)
@click.option(
    "--precision",
    "precisions",
    multiple=True,
    metavar="P",
    help="float32, float64 or mixed; repeatable.  [all three]",
)
@click.option("--quick", is_flag=True, help="A tenth of the work.")
@click.option("--processes", type=int, help="Measuring processes, one after another.  [5]")
@click.option("--samples", type=int, help="Rounds in each process.  [5]")
@click.option("--cpu", type=int, help="Pin the measuring processes to this CPU.")
@click.option("--label", help="Part of the run folder's name.  [the processor]")
@options.out
@options.table_format
@options.quiet
def command(run, quick, cpu, label, out, form, quiet, **changes):
    """What each step of accuracy costs in time on this machine, and what it buys.

    Times every form of a kernel, one by one and in packets, over random tests, over such as a leaf
    of a tree meets, and over a mesh, and counts what it gets wrong: of a million tests of each
    kind, and of the hard cases of rtbench check. Prints all of it, the price of each step with its
    95 % interval (an epsilon, a division, a stable t, precision, watertightness, exactness, and
    what contraction and fastmath save), what is claimed of exact answers, and one paragraph to
    quote; draws time against wrong answers with its front.

    With RUN, a run that is there is told again: a path or a folder name under the output folder.
    json is one object: run, path, paragraph, and tables with a list of rows each; csv is the table
    of steps alone.
    """
    from rtbench.cli.progress import Progress
    from rtbench.cli.run import relative
    from rtbench.errors import RtbenchError
    from rtbench.report import plots
    from rtbench.report.accuracy import Accuracy
    from rtbench.report.layouts.accuracy_words import paragraph
    from rtbench.report.run_tables import render_all, tables_of, write_tables

    progress = Progress(quiet)
    changes |= {"cpu": cpu, "label": label}
    try:
        if run is None:
            done = _measured(progress, out, quick, changes)
        else:
            done = _told(run, out, quick, changes)
        progress.say("drawing plots")
        tables, words = tables_of(done), paragraph(Accuracy(done))
        if not done.published:
            write_tables(done, tables=tables)
            plots.write(done)
    finally:
        progress.end()
    if form == "json":
        rows = {table.name: json.loads(table.render(form)) for table in tables}
        told = {"run": done.name, "path": str(relative(done.path)), "paragraph": words}
        click.echo(json.dumps(told | {"tables": rows}, indent=2, ensure_ascii=False))
    elif form == "csv":
        steps = [table for table in tables if table.name == "steps"]
        if not steps:
            raise RtbenchError(f"{done.name} has both ends of no step")
        click.echo(steps[0].render(form))
    else:
        click.echo(render_all(tables, form))
        click.echo(f"\n{_text(words, form)}")
        if form in ("plain", "github"):
            click.echo(f"\nRecords, tables and plots: {relative(done.path)}")


def _measured(progress, out, quick, changes):
    from rtbench.experiments import config as configs
    from rtbench.experiments import run as runs

    cpu, label = changes.pop("cpu"), changes.pop("label")
    chosen = configs.find("accuracy")
    chosen = (chosen.quick() if quick else chosen).changed(**changes)
    return runs.start(chosen, progress, out, label, cpu, sys.argv)


def _told(run, out, quick, changes):
    """Return a run that is there; nothing is measured, so no option may ask for it."""
    from rtbench.errors import RtbenchError
    from rtbench.records.store import load_run

    if quick or any(value not in (None, ()) for value in changes.values()):
        raise RtbenchError(
            f"{run!r} is there already: no other options than --out, --format and --quiet go "
            "with it"
        )
    found = load_run(run, out)
    experiment = found.info.get("experiment")
    if experiment != "accuracy":
        raise RtbenchError(f"{found.name} is a run of {experiment}, not of accuracy")
    return found


def _text(words: str, form: str) -> str:
    import textwrap

    if form == "latex":
        from rtbench.report.tables import latex_text

        return latex_text(words)
    return textwrap.fill(words, 100) if form == "plain" else words
