"""``rtbench effects``: what it saves to simulate only the effects that a scene calls for."""

from __future__ import annotations

import json
import sys

import click

from rtbench.cli import options

EXAMPLES = """\b
Examples:
  rtbench effects matte --quick
  rtbench effects glass --part proof --processes 1 --samples 1
  rtbench effects matte mirrors --part steps --size 128x96
"""
CONFIG = "effects"


@click.command(epilog=EXAMPLES)
@click.argument("scenes", nargs=-1, metavar="[SCENE]...")
@click.option(
    "--part",
    "parts",
    multiple=True,
    metavar="PART",
    help="tracers, steps or proof; repeatable.  [all three]",
)
@click.option(
    "--size",
    metavar="WxH",
    help="Pixels; scenes that shoot many rays a pixel get fewer.  [256x192]",
)
@click.option(
    "--kernel",
    "-k",
    "kernels",
    multiple=True,
    metavar="NAME",
    help="What tests triangles; repeatable.  [watertight_safe]",
)
@click.option(
    "--precision",
    "precisions",
    multiple=True,
    metavar="P",
    help="float32 or float64; repeatable.  [float64]",
)
@click.option("--processes", type=int, help="Measuring processes, one after another.  [3]")
@click.option("--samples", type=int, help="Rounds in each process.  [3]")
@click.option("--quick", is_flag=True, help="One process, two rounds, only the part tracers.")
@click.option("--label", help="Part of the run folder's name.  [the processor]")
@options.out
@options.table_format
@options.quiet
def command(scenes, parts, size, quick, label, out, form, quiet, **changes):
    """Trace SCENEs (all that come with rtbench) with more compiled in than they call for.

    tracers: each scene by its own tracer, by one with all optical effects, by one with all that the
    inner loop can ask (kinds of primitives, motion), and by one with everything. steps: from
    primary rays and Lambert's law alone, the scene's effects are added one by one. proof: the
    intermediate code of the scene's own tracer beside that of sources from which the blocks of
    absent effects were deleted.

    Prints times with 95 % intervals, ratios and their geometric means. All pictures of a scene but
    the steps' must be equal, bit for bit. Each tracer takes seconds to compile, the first time.

    json is one object: run, path, and tables with a list of rows each; csv is the table of ratios.
    Exit code 4: a picture differs.
    """
    from rtbench.cli.progress import Progress
    from rtbench.cli.render_options import size_of
    from rtbench.experiments import config as configs
    from rtbench.experiments import run

    chosen = configs.find(CONFIG)
    chosen = chosen.quick() if quick else chosen
    width, height = size_of(size) if size is not None else (None, None)
    changes |= {"width": width, "height": height, "scenes": scenes, "parts": parts}
    chosen = chosen.changed(**changes)
    progress = Progress(quiet)
    try:
        done = run.start(chosen, progress, out, label, None, sys.argv)
        told = _told(done, form, progress)
    finally:
        progress.end()
    click.echo(told)


def _told(done, form: str, progress) -> str:
    """Write tables and charts; return what is printed."""
    from rtbench.cli.run import relative
    from rtbench.report import plots
    from rtbench.report.run_tables import render_all, tables_of, write_tables

    tables = tables_of(done)
    progress.say("drawing plots")
    write_tables(done, tables=tables)
    plots.write(done)
    if form == "json":
        rows = {table.name: json.loads(table.render(form)) for table in tables}
        told = {"run": done.name, "path": str(relative(done.path)), "tables": rows}
        return json.dumps(told, indent=2, ensure_ascii=False)
    if form == "csv":
        return tables[0].render(form)
    text = render_all(tables, form)
    if form in ("plain", "github"):
        text += f"\n\nRecords, tables and plots: {relative(done.path)}"
    return text
