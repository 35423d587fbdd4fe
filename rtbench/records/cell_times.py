"""The cells of a run as they enter a comparison: a key of columns and a resampled time."""

from collections.abc import Sequence

from rtbench.errors import NotComparable
from rtbench.records.derive import cells, times
from rtbench.records.rankings import Cells
from rtbench.records.run import Run
from rtbench.records.schema import FIVE_DENSITIES, MEAN
from rtbench.records.statistics import Estimate, mean, median, seed_of
from rtbench.records.tabular import plain


def cell_times(run: Run, columns: list[str]) -> Cells:
    """Return the time of each cell of a run.

    Parameters
    ----------
    run : Run
        Measured or published.
    columns : list of str
        The columns that identify a cell here; with ``outcome`` among them, cells are the timed
        groups of one outcome, else those are left out.

    Returns
    -------
    dict of tuple to Estimate
        Nanoseconds a test, with resamples where the run has samples of it.

    Raises
    ------
    NotComparable
        If several cells of the run are the same in these columns, or a time is not positive.
    """
    found: Cells = {}
    sampled = len(run.samples) > 0
    if sampled:
        # Times of groups of one outcome are cells only where the outcome is a column.
        whole = [*dict.fromkeys([*run.cell, *columns, "outcome"])]
        groups = cells(run, whole)
        values = {key: median(times(rows), _seed(run)) for key, rows in groups.items()}
    else:
        frame = run.outcomes if "outcome" in columns else run.summary
        whole = [name for name in dict.fromkeys([*run.cell, *columns]) if name in frame.columns]
        lines = (
            dict(zip(frame.columns, row, strict=True)) for row in frame.itertuples(index=False)
        )
        values = {
            tuple(plain(line[name]) for name in whole): Estimate(float(line["ns_per_test"]))
            for line in lines
            if plain(line["ns_per_test"]) is not None
        }
        if any(value.value <= 0 for value in values.values()):
            raise NotComparable(f"{run.path} has a time of 0 or less: it is damaged")
    for key, value in values.items():
        cell = dict(zip(whole, key, strict=True))
        if "outcome" not in columns and cell.get("outcome") is not None:
            continue
        if "outcome" in columns and cell.get("outcome") is None:
            continue
        short = tuple(cell.get(name) for name in columns)
        if short in found:
            raise NotComparable(
                f"{run.name} has several cells where {', '.join(columns)} are the same: "
                f"its cells also differ in {', '.join(set(whole) - set(columns) - {'outcome'})}"
            )
        found[short] = value
    return found


def _seed(run: Run) -> int:
    return seed_of(run.path.resolve().name)


def form_means(tables: Sequence[Cells], columns: list[str]) -> None:
    """Add the mean over the five densities to the runs that lack it, where another has it.

    Parameters
    ----------
    tables : sequence of dict
        The cells of each run; changed in place.
    columns : list of str
        The columns of their keys, density among them.
    """
    place = columns.index("density")

    def at(key: tuple, density: object) -> tuple:
        return (*key[:place], density, *key[place + 1 :])

    wanted = {key for table in tables for key in table if key[place] == MEAN}
    for table in tables:
        for key in wanted - table.keys():
            five = [table.get(at(key, density)) for density in FIVE_DENSITIES]
            if None not in five:
                table[key] = mean(five)
