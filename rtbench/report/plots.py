"""Which charts a run has, and their files."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rtbench.report import cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtbench.records.run import Run

DEFAULT_FORMATS = ("png", "svg")
MACHINES = "machines"


def figures(run: "Run") -> dict[str, "Figure"]:
    """Return every chart of a run that it has data for.

    Parameters
    ----------
    run : Run
        A loaded run, finished or not, published or measured.

    Returns
    -------
    dict of str to Figure
        File name without suffix to chart; empty if there is nothing to plot.
    """
    from rtbench.report.charts.accuracy import front_charts
    from rtbench.report.charts.break_even import break_even_chart
    from rtbench.report.charts.break_even_map import break_even_map
    from rtbench.report.charts.compilers import compilers_chart
    from rtbench.report.charts.density import density_chart
    from rtbench.report.charts.drift import drift_chart
    from rtbench.report.charts.errors import errors_chart
    from rtbench.report.charts.latency import latency_chart
    from rtbench.report.charts.outcomes import outcomes_chart
    from rtbench.report.charts.packets import packets_chart
    from rtbench.report.charts.packing import has_packings, packing_chart
    from rtbench.report.charts.penalty import penalty_chart
    from rtbench.report.charts.soup import soup_chart
    from rtbench.report.charts.spread import has_spread, spread_chart
    from rtbench.report.charts.stability import curve_charts, families_chart
    from rtbench.report.charts.stages import stages_chart
    from rtbench.report.charts.tree_growth import builders_chart
    from rtbench.report.charts.watertightness import leaks_chart
    from rtbench.report.charts.working_set import working_set_chart

    own = {"stages": stages_chart, "working_set": working_set_chart, "latency": latency_chart}
    own |= {"soup": soup_chart, "break_even": break_even_map}
    own |= {"compilers": compilers_chart, "packets": packets_chart}
    experiment = run.info.get("experiment")
    found = {}
    if experiment == "accuracy":
        found |= front_charts(run)
    elif experiment == "trees":
        found |= tree_charts(run)
    elif experiment == "effects":
        found |= effects_of(run)
    elif experiment in ("subsampling", "techniques"):
        found |= techniques_of(run)
    elif experiment == "tree_builders":
        if len(run.builds):
            found["builders"] = builders_chart(run)
    elif experiment in own:
        if len(cells.times_of(run)):
            name = "break_even_map" if experiment == "break_even" else experiment
            found[name] = own[experiment](run)
    else:
        for part in cells.parts(run):
            found["density" + part.suffix] = density_chart(run, part)
    if experiment == "packets" and has_spread(run):
        found["spread"] = spread_chart(run)
    if experiment == "packets" and has_packings(run):
        found["packing"] = packing_chart(run)
    if run.info.get("break_even"):
        found["break_even"] = break_even_chart(run)
    if (run.info.get("fit") or {}).get("points"):
        found["penalty"] = penalty_chart(run)
    # Counts alone are a table; a chart of outcomes is one of their times.
    if len(cells.timed(run.outcomes)):
        found["outcomes"] = outcomes_chart(run)
    if len(run.errors):
        found["errors"] = errors_chart(run)
    if len(run.families):
        found["families"] = families_chart(run)
    found |= curve_charts(run)
    if len(run.leaks):
        found["leaks"] = leaks_chart(run)
    if _repeated(run):
        found["drift"] = drift_chart(run)
    return found


def effects_of(run: "Run") -> dict[str, "Figure"]:
    """Return the charts of a run of the experiment ``effects``, by file name."""
    from rtbench.report.charts.effects import effects_charts
    from rtbench.report.effects import Effects

    return effects_charts(Effects(run))


def techniques_of(run: "Run") -> dict[str, "Figure"]:
    """Return the charts of a run of ``subsampling`` or ``techniques``, by file name."""
    from rtbench.report.charts.techniques import subsampling_charts, techniques_charts
    from rtbench.report.techniques import Techniques, Ways

    if run.info["experiment"] == "subsampling":
        return subsampling_charts(Ways(run))
    return techniques_charts(Techniques(run))


def tree_charts(run: "Run") -> dict[str, "Figure"]:
    """Return the charts of a run of the experiment ``trees``, by file name."""
    from rtbench.report.charts.heat_maps import heat_charts
    from rtbench.report.charts.tree_expected import expected_charts
    from rtbench.report.charts.tree_growth import growth_charts
    from rtbench.report.charts.tree_kernels import kernels_charts
    from rtbench.report.charts.trees import trees_charts
    from rtbench.report.trees import Trees

    trees = Trees(run)
    found = trees_charts(trees) | growth_charts(trees) | kernels_charts(trees)
    return found | expected_charts(trees) | heat_charts(run)


def _repeated(run: "Run") -> bool:
    """Whether some cell has two samples: one alone lies on its own median."""
    samples = run.samples
    return bool(samples.duplicated([*dict.fromkeys([*run.cell, "outcome"])]).any())


def write(
    run: "Run", out: Path | None = None, formats: Sequence[str] = DEFAULT_FORMATS
) -> list[Path]:
    """Write every chart of a run.

    Parameters
    ----------
    run : Run
        A loaded run.
    out : Path, optional
        The folder; ``plots`` in the run's folder if not given.
    formats : sequence of str
        Of ``png``, ``svg`` and ``pdf``.

    Returns
    -------
    list of Path
        What was written; empty if the run has nothing to plot.

    Raises
    ------
    RtbenchError
        For an unknown format, or if nothing can be written there.
    """
    from rtbench.report.charts.style import save

    folder = Path(out or run.path / "plots")
    charts = figures(run)
    return [path for name in charts for path in save(charts[name], folder / name, formats)]


def write_machines(
    runs: Sequence["Run"], out: Path, formats: Sequence[str] = DEFAULT_FORMATS
) -> list[Path]:
    """Write the chart that puts several runs side by side.

    Parameters
    ----------
    runs : sequence of Run
        At least two, of different machines as a rule.
    out : Path
        The folder.
    formats : sequence of str
        Of ``png``, ``svg`` and ``pdf``.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    NotComparable
        If the runs share no kernel at the same densities.
    RtbenchError
        For an unknown format, or if nothing can be written there.
    """
    from rtbench.report.charts.machines import machines_chart
    from rtbench.report.charts.style import save

    return save(machines_chart(runs), Path(out) / MACHINES, formats)
