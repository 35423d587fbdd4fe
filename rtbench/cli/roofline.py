"""``rtbench roofline``: what bounds each kernel of a run."""

from __future__ import annotations

import json
from pathlib import Path

import click

from rtbench.cli import options
from rtbench.errors import RtbenchError


@click.command("roofline", epilog="Example: rtbench roofline")
@click.argument("run", metavar="[RUN]", required=False)
@click.option(
    "--peaks",
    "kept",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE.json",
    help="Take the machine's peaks from this file instead of measuring them.",
)
@options.table_format
@options.out
@options.quiet
def command(run: str | None, kept: Path | None, form: str, out: Path, quiet: bool) -> None:
    """What bounds each kernel of a run, and what part of that bound it reaches.

    The bounds are arithmetic at the machine's peak, bytes at its measured bandwidth, and
    mispredicted branches, where the run has both the order sorted and the order shuffled or sweep.
    The peaks are measured here and now, in seconds, so run it on the machine of the run. Table,
    peaks and plot go into the run's folder (tables, plots); RUN is a path or a folder name under
    the output folder. Without RUN: the machine's peaks alone; in json they are what --peaks takes,
    as is the run's tables/peaks.json.
    """
    from rtbench.report.peaks import peaks_table, read_peaks

    chosen = None
    if run is not None:
        from rtbench.records.store import load_run
        from rtbench.report.roofline import check

        chosen = load_run(run, out)
        check(chosen)  # before anything is measured
    peaks = read_peaks(kept) if kept else measured_peaks(quiet)
    if chosen is None:
        text = (
            json.dumps(peaks.told, indent=1) if form == "json" else peaks_table(peaks).render(form)
        )
        click.echo(text)
        return
    show(chosen, peaks, form)


def measured_peaks(quiet: bool):
    """Return the machine's peaks, telling on stderr how far it is."""
    from rtbench.cli.progress import Progress
    from rtbench.measure.peaks import peaks
    from rtbench.report.peaks import Peaks

    progress = Progress(quiet)
    try:
        progress.say("preparing the machine's peaks")
        return Peaks(peaks(say=progress.say, progress=progress.progress))
    finally:
        progress.end()


def show(run, peaks, form: str) -> None:
    """Print the table, write it with the peaks and the plot, and say where they are."""
    from rtbench.records.tabular import replace
    from rtbench.report.charts.roofline import roofline_chart
    from rtbench.report.charts.style import save
    from rtbench.report.layouts.roofline import roofline_table
    from rtbench.report.peaks import peaks_table
    from rtbench.report.roofline import bounds
    from rtbench.report.run_tables import render_all, write_tables

    found, left_out = bounds(run, peaks, operations_of(run))
    if not found:
        why = "; ".join(f"{kernel}: {reason}" for kernel, reason in left_out.items())
        raise RtbenchError(f"{run.name} has nothing to bound: {why}")
    tables = [roofline_table(run, found, left_out, peaks), peaks_table(peaks)]
    click.echo(tables[0].render("csv") if form == "csv" else render_all(tables, form))
    told = (run.info.get("machine") or {}).get("label")
    if told and told != peaks.machine:
        click.echo(
            f"rtbench: the run was made on {told}, the peaks are of {peaks.machine}", err=True
        )
    write_tables(run, tables=tables)
    replace(run.path / "tables" / "peaks.json", json.dumps(peaks.told, indent=1) + "\n")
    save(roofline_chart(run, found, peaks), run.path / "plots" / "roofline")
    click.echo(f"rtbench: written to {run.path / 'tables'} and {run.path / 'plots'}", err=True)


def operations_of(run) -> dict:
    """Return the operations of the kernels of a run by outcome, also of those from a file."""
    from rtbench.compiled.exits import exits
    from rtbench.kernels import registry

    listed = registry.all_kernels()
    files = [name for name in run.info.get("config", {}).get("kernels", []) if ".py:" in name]
    named = {name.rpartition(":")[2]: name for name in files}
    found = {}
    for name in run.info.get("kernels") or {}:
        if name in named and Path(named[name].rpartition(":")[0]).is_file():
            found[name] = exits(registry.find(named[name]))
        elif name in listed:
            found[name] = exits(listed[name])
    return found
