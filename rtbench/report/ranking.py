"""The thesis's last column: how much slower a kernel is than the best, over all densities."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rtbench.records import derive, statistics
from rtbench.records.tabular import plain
from rtbench.report import cells

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

MARK = "*"


@dataclass(frozen=True)
class Ranking:
    """The kernels of one precision and order against their best.

    Attributes
    ----------
    best : str
        The kernel with the smallest sum; "" if no kernel has every density.
    slower : dict of str to float
        Kernel to its sum over the densities / the best sum - 1; a kernel that lacks a density
        is not in it, and neither is the empty loop.
    level : list of str
        The kernels that the measurement cannot tell apart from the best, without the best.
    single : bool
        Whether there is one sample a cell, from which nothing can be told apart.
    """

    best: str = ""
    slower: dict[str, float] = field(default_factory=dict)
    level: list[str] = field(default_factory=list)
    single: bool = False

    def mark(self, kernel: str) -> str:
        """Return the sign of a kernel that cannot be told apart from the best, or nothing."""
        return MARK if kernel in self.level else ""

    def note(self) -> str:
        """Return the line that names the kernels level with the best, or nothing."""
        if self.single:
            return "one sample a cell: no interval, and no difference can be resolved"
        if not self.level:
            return ""
        return f"{MARK} no difference resolved from {self.best}: {', '.join(self.level)}"


def rank(frame: "DataFrame", run: "Run | None" = None) -> Ranking:
    """Rank the kernels of one precision and order by the sum of their times over the densities.

    Parameters
    ----------
    frame : DataFrame
        Rows of a summary: one precision, one order, a row a kernel and density.
    run : Run, optional
        The run with its samples, for the kernels level with the best; none without it.

    Returns
    -------
    Ranking
        By the sum of ns_per_test, medians: one disturbed sample moves it less than the seconds.
    """
    densities = cells.densities(frame)
    sums = {}
    for kernel in cells.kernels(frame):
        rows = cells.timed(cells.where(frame, kernel=kernel))
        if len(rows) == max(len(densities), 1):
            sums[kernel] = float(rows["ns_per_test"].sum())
    if not sums:
        return Ranking()
    best = min(sums, key=sums.get)
    slower = {name: value / 100 for name, value in statistics.slower_than_best(sums).items()}
    sampled = run is not None and not run.published and len(run.samples)
    times = _times(list(sums), frame, run) if sampled else {}
    if any(len(total.ns) < 2 for total in times.values()):
        return Ranking(best, slower, single=True)
    seed = statistics.seed_of(run.name) if times else 0
    return Ranking(best, slower, _level_with(best, times, seed))


def _times(names: list[str], frame: "DataFrame", run: "Run") -> dict[str, statistics.Times]:
    """Return the sums over the densities of each kernel, one a round that has them all."""
    wanted = {column: set(map(plain, frame[column])) for column in run.cell if column in frame}
    taken: dict[str, list] = {}
    for key, samples in derive.cells(run, [*run.cell, "outcome"]).items():
        cell = dict(zip([*run.cell, "outcome"], key, strict=True))
        # Times of a group of pairs that share an outcome belong to no density.
        if key[-1] is None and all(cell[column] in wanted[column] for column in wanted):
            taken.setdefault(str(cell["kernel"]), []).append(derive.times(samples))
    times = {name: statistics.total(taken[name]) for name in names if name in taken}
    return {name: total for name, total in times.items() if len(total.ns)}


def _level_with(best: str, times: dict[str, statistics.Times], seed: int) -> list[str]:
    """Return the kernels whose sums over the densities are not resolved from the best one's."""
    if len(times) < 2:
        return []
    least, others = statistics.not_separable(times, seed)
    # The median of sums and the sum of medians may disagree on the best of two near ones.
    return [name for name in times if name != best and name in (least, *others)]
