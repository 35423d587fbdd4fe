"""``rtbench reproduce``: repeat a thesis's table, beside its numbers."""

from __future__ import annotations

import sys
import textwrap

import click

from rtbench.cli import options

EXAMPLES = """\b
Examples:
  rtbench reproduce 4.5
  rtbench reproduce 4.2 --quick
  rtbench reproduce 5.1.2
  rtbench reproduce havel --quick
  rtbench reproduce silhavy-builders
  rtbench reproduce silhavy --quick
"""


@click.command(epilog=EXAMPLES)
@click.argument("table")
@click.option("--quick", is_flag=True, help="A tenth of the work.")
@click.option(
    "--order",
    "orders",
    multiple=True,
    metavar="ORDER",
    help="As in rtbench run.  [repeat, what the thesis did; 4.2: sweep too]",
)
@click.option("--processes", type=int, help="Measuring processes.  [5]")
@click.option("--samples", type=int, help="Rounds in each process.  [up to 5]")
@click.option("--cpu", type=int, help="Pin the measuring processes to this CPU.")
@click.option("--label", help="Part of the run folders' names.  [the processor]")
@options.out
@options.table_format
@options.quiet
def command(table, quick, orders, processes, samples, cpu, label, out, form, quiet):
    """Repeat TABLE of a thesis and print its numbers and ours side by side.

    TABLE is a table of Blecha 2007 (4.1 to 4.10) or "stages" (its section 4.4); an illustration of
    Havel 2008 by its section (5.1.1 to 5.5), "order", "compilers" or "break-even"; a config of
    Šilhavý 2010, whose tables are lost: "5" (split rules and endings), "builders", "sizes",
    "kernels", "accuracy", "peers"; or "blecha", "havel" or "silhavy": all of that thesis, and then
    its statements, each confirmed, refuted or not resolved on this machine, with the number that
    decides. Trees are built over the models that RTBENCH_MODELS names, and over generated ones.
    """
    from rtbench.cli.progress import Progress
    from rtbench.cli.run import relative
    from rtbench.experiments import reproduce, run

    progress = Progress(quiet)
    runs = {}
    names = reproduce.configs(table)
    try:
        for number, config in enumerate(names, 1):
            if len(names) > 1:
                progress.plan(f"{config.name} ({number} of {len(names)})")
            chosen = config.quick() if quick else config
            chosen = chosen.changed(orders=orders, processes=processes, samples=samples)
            done = run.start(chosen, progress, out, label, cpu, sys.argv)
            runs[reproduce.key(config)] = done
            progress.say("drawing plots")
            tables = reproduce.tables(done)
            progress.end()
            for printed in tables:
                click.echo(printed.render(form))
                click.echo()
            if form in ("plain", "github"):
                click.echo(f"Records, tables and plots: {relative(done.path)}\n")
        progress.say("judging statements")
        statements = reproduce.statements(reproduce.thesis_of(names[0]), runs, progress)
    finally:
        progress.end()
    if statements.rows:
        click.echo(_paragraphs(statements) if form == "plain" else statements.render(form))


def _paragraphs(statements) -> str:
    """Return statements as a person reads them: the verdict, the claim, and the number below."""
    lines = [statements.title, ""]
    for row in statements.rows:
        lines.append(f"{row['verdict']:<14}{row['section']:<7}{row['statement']}")
        lines += textwrap.wrap(
            row["number"], 100, initial_indent=" " * 21, subsequent_indent=" " * 21
        )
    return "\n".join(lines)
