"""``rtbench trees``: what each rule makes of a model, and how fast rays go through it."""

from __future__ import annotations

import json
import sys

import click

from rtbench.cli import options

EXAMPLES = """\b
Examples:
  rtbench trees scanned:20000 --quick
  rtbench trees robots:20000 --quick --rule sah --structure kd --structure bvh
  rtbench trees even:20000 --quick --ending both --kernel watertight_safe --precision float64
"""
CONFIG = "silhavy-5"
# A BVH has ways of its own, and the SAH alone.
WAYS = {"kd": "stack", "bvh": "wide"}


@click.command(epilog=EXAMPLES)
@click.argument("model")
@click.option(
    "--rule",
    "rules",
    multiple=True,
    metavar="RULE",
    help="sah, object_median or spatial_median; repeatable.  [all three]",
)
@click.option(
    "--structure",
    "structures",
    multiple=True,
    metavar="S",
    help="kd or bvh (8 boxes a node); repeatable.  [kd]",
)
@click.option(
    "--builder",
    "builders",
    multiple=True,
    metavar="B",
    help="Of the SAH: nlogn, nlog2n, n2, binned or as_printed; repeatable.  [nlogn]",
)
@click.option(
    "--ending",
    "endings",
    multiple=True,
    metavar="E",
    help="Where a cell is no more cut: automatic (by cost), ad_hoc (by count and depth) or both; "
    "repeatable.  [all three]",
)
@click.option(
    "--kernel",
    "-k",
    "kernels",
    multiple=True,
    metavar="NAME",
    help="What tests triangles in the leaves: a name, a glob, or FILE.py:NAME; repeatable.  "
    "[moller_trumbore]",
)
@click.option(
    "--precision",
    "precisions",
    multiple=True,
    metavar="P",
    help="float32, float64 or mixed; repeatable.  [float32]",
)
@click.option(
    "--way",
    "ways",
    multiple=True,
    metavar="WAY",
    help="How rays walk: stack, recursive, mailboxes, blocks, packets, lanes; of a BVH wide; "
    "repeatable.  [stack; of a BVH wide]",
)
@click.option("--rays", type=int, help="Random rays beside primary and shadow ones; 0: none.  [0]")
@click.option("--width", type=int, help="Of the image, in pixels.  [320]")
@click.option("--height", type=int, help="Of the image, in pixels.  [240]")
@click.option("--triangles", type=int, help="Of a generated model without a number.  [50000]")
@click.option("--drop-invalid", is_flag=True, help="Leave out triangles that are not finite.")
@click.option("--peers", is_flag=True, help="Time libraries too: Embree and what else is there.")
@click.option(
    "--threads", type=int, multiple=True, help="In how many threads rays walk; repeatable.  [1]"
)
@click.option("--processes", type=int, help="Measuring processes, one after another.")
@click.option("--samples", type=int, help="Rounds in each process.")
@click.option("--quick", is_flag=True, help="Half the image, one process, two rounds.")
@click.option("--label", help="Part of the run folder's name.  [the processor]")
@options.out
@options.table_format
@options.quiet
def command(
    model, structures, ways, rays, drop_invalid, peers, quick, label, out, form, quiet, **changes
):
    """Build trees over MODEL and trace rays through them.

    MODEL is a mesh file (PLY, STL, OBJ, OFF, glTF ...), the stem of a PLY file in the folder that
    RTBENCH_MODELS names, or a generated model, with its triangles after a colon: even, scanned (a
    scanned surface), robots (dense objects in an empty scene), stairs.

    Prints what each rule builds: seconds, nodes, memory, and what the SAH expects of it; and the
    time of primary, shadow and random rays, with 95 % intervals, beside the naive way. All trees
    give the same answers, bit for bit, and so does a sample by brute force: that is checked. Draws
    bars, the number of rays from which a build pays, and the steps of each pixel's ray as an image.

    json is one object: run, path, and tables with a list of rows each; csv is the table of times.
    Exit code 4: an answer was wrong.
    """
    from rtbench.cli.progress import Progress
    from rtbench.experiments import config as configs
    from rtbench.experiments import run

    chosen = configs.find(CONFIG)
    changes |= {"structures": structures, "ways": ways or _ways(structures)}
    chosen = _of_one(chosen.changed(models=(model,), **changes), rays, drop_invalid, peers)
    chosen = chosen.quick() if quick else chosen
    # What was asked for stays as it was asked, quick or not.
    kept = {name: changes[name] for name in ("width", "height", "processes", "samples")}
    chosen = chosen.changed(models=(model,), rays=rays or None, **kept)
    progress = Progress(quiet)
    progress.say(f"model {model}")
    try:
        _never_hit(chosen)
    finally:
        progress.end()
    try:
        done = run.start(chosen, progress, out, label, None, sys.argv)
    finally:
        progress.end()
    if quiet:
        _remark(done)
    _show(done, form, progress)


def _ways(structures) -> tuple[str, ...]:
    from rtbench.errors import RtbenchError, unknown

    for structure in structures:
        if structure not in WAYS:
            raise RtbenchError(unknown("structure", structure, WAYS))
    return tuple(WAYS[structure] for structure in structures or ("kd",))


def _of_one(chosen, rays, drop_invalid, peers):
    """Return a config for one model: every ending of it, however large, and no variants."""
    import dataclasses

    from rtbench.errors import RtbenchError
    from rtbench.experiments.tree_config import PEERS

    more = {"axes": chosen.axes[:1], "candidates": chosen.candidates[:1], "large": 0}
    if rays is not None and rays < 0:
        raise RtbenchError(f"rays {rays} is not allowed (allowed: 0 or more)")
    if rays:
        more["ray_sets"] = (*chosen.ray_sets, "random")
    if peers:
        more["peers"] = tuple(peer.name for peer in PEERS)
    return dataclasses.replace(chosen, drop_invalid=drop_invalid, **more)


def _never_hit(chosen) -> None:
    """Say which triangles a kernel can never hit; and what is wrong with a file, at once."""
    from rtbench.experiments import tree_models
    from rtbench.kernels import registry
    from rtbench.trees import never_hit

    kernels = registry.select(chosen.kernels)
    mesh = tree_models.mesh_of(chosen.models[0], chosen)
    for kernel in kernels:
        remark = never_hit.remark(kernel, mesh.triangles)
        if remark:
            click.echo(f"rtbench: {remark}", err=True)


def _remark(done) -> None:
    """Say what a quiet run has left out: that is no progress."""
    for remark in done.info.get("remarks") or []:
        if not remark.startswith("disturbed: "):
            click.echo(f"rtbench: {remark}", err=True)


def _show(done, form: str, progress) -> None:
    from rtbench.cli.run import relative
    from rtbench.report import plots
    from rtbench.report.run_tables import render_all, tables_of, write_tables

    tables = tables_of(done)
    if form == "json":
        rows = {table.name: json.loads(table.render(form)) for table in tables}
        told = {"run": done.name, "path": str(relative(done.path)), "tables": rows}
        click.echo(json.dumps(told, indent=2, ensure_ascii=False))
    elif form == "csv":
        times = [t for t in tables if t.name.startswith(("tree-times", "tree-kernels"))]
        click.echo((times or tables)[0].render(form))
    else:
        click.echo(render_all(tables, form))
    progress.say("drawing plots")
    write_tables(done, tables=tables)
    plots.write(done)
    progress.end()
    if form in ("plain", "github"):
        click.echo(f"\nRecords, tables and plots: {relative(done.path)}")
