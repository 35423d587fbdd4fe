"""``rtbench plot``: a run's charts, or several machines side by side."""

from __future__ import annotations

from pathlib import Path

import click

from rtbench.errors import RtbenchError

RESULTS = Path("results")
_LONGEST_NAME = 120


@click.command("plot", epilog="Example: rtbench plot blecha-pc1")
@click.argument("runs", metavar="RUN [RUN ...]", nargs=-1, required=True)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Where the plots go. By default into the run's folder (plots), of published or several "
    "runs into results/NAME-plots.",
)
@click.option(
    "--format",
    "forms",
    type=click.Choice(["png", "svg", "pdf"]),
    multiple=True,
    default=["png", "svg"],
    show_default=True,
    help="May be given more than once.",
)
def command(runs: tuple[str, ...], out: Path | None, forms: tuple[str, ...]) -> None:
    """Draw the charts of a run, or put several runs side by side; print the paths of the files.

    A RUN is a path, a folder name under ./results, or the name of a published run. Nothing is
    measured. Of one run: time over density, outcomes, working set, stages, the penalty fit, drift,
    as far as it has them. Of several: the means of the kernels that they share, a group a machine.
    """
    from rtbench.records.store import load_run
    from rtbench.report import plots

    found = [load_run(run, RESULTS) for run in runs]
    forms = tuple(dict.fromkeys(forms))
    if len(found) > 1:
        name = "-".join(run.name for run in found)[:_LONGEST_NAME]
        written = plots.write_machines(found, out or RESULTS / f"{name}-plots", forms)
    else:
        only = found[0]
        if out is None and only.published:
            out = RESULTS / f"{only.name}-plots"
        written = plots.write(only, out, forms)
        if not written:
            raise RtbenchError(f"{only.name} has nothing to plot: no cell has a time")
    for path in written:
        click.echo(path)
