"""``rtbench diff``: two or more runs side by side."""

import dataclasses
import json
import re

import click

from rtbench.cli import options
from rtbench.errors import CheckFailed, RtbenchError


class Percent(click.ParamType):
    """``5%`` or ``5``: a percentage, as a fraction."""

    name = "percent"

    def convert(self, value, param, ctx) -> float:
        if isinstance(value, float):
            return value
        if not re.fullmatch(r"\d+(\.\d*)?\s*%?", value):
            raise RtbenchError(f"{param.opts[0]} {value!r} is not a percentage of 0 or more: 5%")
        return float(value.rstrip("% ")) / 100


@click.command(epilog="Example: rtbench diff blecha-pc1 blecha-pc4")
@click.argument("runs", metavar="A B [C ...]", nargs=-1, required=True)
@click.option("--relative-to", metavar="KERNEL", help="Also divide every cell by this kernel's.")
@click.option(
    "--fail-above",
    type=Percent(),
    metavar="P%",
    help="Exit with 1 if a cell of a later run is resolved to be slower, by more than this.",
)
@click.option(
    "--threshold",
    type=Percent(),
    default="0%",
    show_default=True,
    metavar="P%",
    help="Only differences larger than this are differences.",
)
@click.option(
    "--allow",
    multiple=True,
    type=click.Choice(["experiment", "workloads", "layout", "generator", "triangles"]),
    help="Compare although this differs.",
)
@options.table_format
@options.out
def command(runs, relative_to, fail_above, threshold, allow, form, out) -> None:
    """Compare runs with the first of them, cell by cell.

    A run is a path, a folder name under the output folder, or the name of a published run. What
    differs in the environments comes first, then the ratio of the medians of each cell with its
    95 % interval and a verdict: faster, slower, no difference resolved, or no interval (a single
    printed value; such a cell never fails). Then the geometric mean, the rankings and the pairs of
    kernels that change places. In csv there is the table of cells alone, in json one object.
    """
    from rtbench.records.comparison import compare, slowdowns
    from rtbench.records.store import load_run

    if len(runs) < 2:
        raise RtbenchError(f"diff needs two runs or more, not only {runs[0]!r}")
    found = compare([load_run(run, out) for run in runs], relative_to, threshold, allow)
    if form == "json":
        click.echo(json.dumps(dataclasses.asdict(found), indent=1, ensure_ascii=False))
    else:
        from rtbench.report.comparison import tables

        shown = tables(found)
        if form == "csv":
            shown = [table for table in shown if table.name == "cells"]
        click.echo("\n\n".join(table.render(form) for table in shown))
    for remark in found.remarks:
        click.echo(f"rtbench: {remark}", err=True)
    if fail_above is None:
        return
    slower, unjudged = slowdowns(found, fail_above)
    if unjudged:
        click.echo(
            f"rtbench: {unjudged} cells have no interval: whether they are slower cannot be told",
            err=True,
        )
    if slower:
        worst = max(slower, key=lambda row: row["ratio"])
        where = " ".join(str(worst[name]) for name in found.columns if worst[name] is not None)
        raise CheckFailed(
            f"{len(slower)} cells are slower by more than {100 * fail_above:g} %, "
            f"most of all {where} in {worst['run']}: {100 * (worst['ratio'] - 1):.1f} %"
        )
