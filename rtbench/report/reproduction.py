"""A published table and ours side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtbench.records import schema
from rtbench.records.statistics import kendall_tau, ranking, slower_than_best
from rtbench.report import cells, machine
from rtbench.report.digits import absent, percent
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from rtbench.records.run import Run

OPERATIONS = schema.OPERATION_COLUMNS[1:]
MSVC = (
    "Generator msvc from state {seed}: found by searching all 2^31 states for the counts of table "
    "4.5; some state matches by luck with a probability of about 0.6 to 2 %, and it is not proven "
    "to be the author's. Table 4.7 comes from other data."
)


def beside_published(run: Run, published: Run) -> list[Table]:
    """Return what a run and the published record of its table have in common.

    Parameters
    ----------
    run : Run
        Made from a config that names a table.
    published : Run
        The record that holds it.

    Returns
    -------
    list of Table
        Times relative to each side's best with the agreement of the rankings, counts of
        outcomes, or counts of operations: whatever the table is about.
    """
    table = run.info["config"]["table"]
    if run.info["experiment"] == "operations":
        return [_operations(run, published, table)]
    if run.info["experiment"] == "outcomes":
        return [_outcomes(run, published, table)]
    return [_times(run, published, table)]


def times_of(run: Run, table: str) -> DataFrame:
    """Return the cells of a run that a table is about: repeat order, no empty loop."""
    frame = run.summary
    if run.published:
        frame = frame[frame["table"] == table]
    return frame[(frame["order"] == "repeat") & (frame["kernel"] != schema.EMPTY)]


def chart(run: Run, published: Run) -> Figure | None:
    """Return the chart of both sides, None where the table holds no times over density."""
    from rtbench.report.charts.side_by_side import side_by_side

    table = run.info["config"]["table"]
    if run.info["experiment"] != "density":
        return None
    ours, theirs = times_of(run, table), times_of(published, table)
    if "mean" in set(theirs["density"]):
        ours, theirs = _means(ours), theirs.assign(density=None)
    return side_by_side(
        ours.to_dict("records"),
        theirs.to_dict("records"),
        f"Table {table}: thesis and here",
        f"{_source(published)}; here: {machine.processor(run)}; repeat order; bars: 95 % interval",
    )


def _means(frame: DataFrame) -> DataFrame:
    """Return the mean over densities of each kernel, as table 4.3 has it."""
    return frame.groupby("kernel", as_index=False, sort=False)["ns_per_test"].mean()


def _times(run: Run, published: Run, table: str) -> Table:
    sides = {"thesis": times_of(published, table), "here": times_of(run, table)}
    mean_only = "mean" in set(sides["thesis"]["density"])
    densities = [] if mean_only else cells.densities(sides["thesis"])
    means, rows = {}, []
    for side, frame in sides.items():
        means[side] = dict(_means(frame)[["kernel", "ns_per_test"]].values)
    for kernel in dict.fromkeys([*means["thesis"], *means["here"]]):
        for side, frame in sides.items():
            if kernel not in means[side]:
                continue
            best = min(means[side].values())
            row = {"kernel": kernel, "where": side}
            for density in densities:
                for cell in cells.where(frame, kernel=kernel, density=density).to_dict("records"):
                    row[cells.density_text(density)] = _relative(cell["ns_per_test"] / best)
            row["mean"] = _relative(means[side][kernel] / best)
            row["slower"] = percent(slower_than_best(means[side])[kernel] / 100)
            rows.append(row)
    shared = [kernel for kernel in means["thesis"] if kernel in means["here"]]
    ranks = {side: ranking({k: means[side][k] for k in shared}) for side in sides}
    tau = kendall_tau(*([means[side][k] for k in shared] for side in sides))
    notes = [
        f"each side divided by the mean of its own fastest; {_source(published)}",
        f"ranking in the thesis: {', '.join(ranks['thesis'])}; here: {', '.join(ranks['here'])}; "
        f"Kendall's tau {'undefined' if tau is None else f'{tau:.2f}'}",
    ]
    missing = [kernel for kernel in means["here"] if kernel not in means["thesis"]]
    if missing:
        notes.append(f"not in the thesis's table: {', '.join(missing)}")
    columns = ["kernel", "where", *map(cells.density_text, densities), "mean", "slower"]
    return Table(
        "beside-thesis",
        rows,
        columns,
        f"Table {table}, thesis and here: time relative to the best (repeat order)",
        headers={"slower": "% slower than best"},
        notes=notes,
    )


def _relative(value: float) -> Cell:
    return Cell(value, f"{value:.3f}")


def _source(published: Run) -> str:
    return f"thesis: {machine.processor(published)}"


def _outcomes(run: Run, published: Run, table: str) -> Table:
    theirs = published.outcomes[published.outcomes["table"] == table]
    rows, counts = [], ([], [])
    hit = {"thesis": _hit_time(theirs), "here": _hit_time(run.outcomes)}
    for ours in run.outcomes.to_dict("records"):
        same = cells.where(theirs, kernel=ours["kernel"], outcome=ours["outcome"])
        for there in same.to_dict("records"):
            counts[0].append(int(there["count"]))
            counts[1].append(int(ours["count"]))
            rows.append(
                {
                    "kernel": ours["kernel"],
                    "outcome": ours["outcome"],
                    "label": ours["label"],
                    "thesis": Cell(counts[0][-1], f"{counts[0][-1]:,}"),
                    "here": Cell(counts[1][-1], f"{counts[1][-1]:,}"),
                    "equal": "yes" if counts[0][-1] == counts[1][-1] else "no",
                    "time_thesis": _to_hit(there["ns_per_test"], hit["thesis"]),
                    "time_here": _to_hit(ours["ns_per_test"], hit["here"]),
                }
            )
    notes = ["time / hit: time of a test that returns this code over that of a hit"]
    equal = counts[0] == counts[1]
    if not rows:
        notes.append("nothing in common to compare")
    elif equal:
        notes.append(f"all {len(rows)} counts are equal")
    else:
        notes.append(_chi_square(counts, _source(published)))
    if run.info["config"]["generator"] == "msvc":
        notes.append(MSVC.format(seed=run.info["seed"]))
    return Table(
        "beside-thesis",
        rows,
        ["kernel", "outcome", "label", "thesis", "here", "equal", "time_thesis", "time_here"],
        f"Table {table}, thesis and here: how often each code is returned, and its time",
        headers={
            "outcome": "code",
            "thesis": "count in the thesis",
            "here": "count here",
            "time_thesis": "time / hit, thesis",
            "time_here": "time / hit, here",
        },
        notes=notes,
    )


def _hit_time(frame: DataFrame) -> float:
    times = frame[frame["outcome"] == 0]["ns_per_test"]
    return float(times.iloc[0]) if len(times) and not absent(times.iloc[0]) else float("nan")


def _to_hit(value: object, hit: float) -> Cell:
    return Cell(None, "") if absent(value) else Cell(value / hit, f"{value / hit:.2f}")


def _chi_square(counts: tuple[list[int], list[int]], source: str) -> str:
    """Say whether two samples may come from one distribution; rare outcomes are put together."""
    from scipy.stats import chi2_contingency

    rare = [a + b < 20 for a, b in zip(*counts, strict=True)]
    table = [
        [*(n for n, few in zip(side, rare, strict=True) if not few)]
        + ([sum(n for n, few in zip(side, rare, strict=True) if few)] if any(rare) else [])
        for side in counts
    ]
    if any(rare) and not any(side[-1] for side in table):
        table = [side[:-1] for side in table]
    result = chi2_contingency(table)
    word = "agree" if result.pvalue >= 0.05 else "differ"
    return (
        f"other data than the thesis's, compared by chi-square: {result.statistic:.2f} with "
        f"{result.dof} degrees of freedom, p = {result.pvalue:.3g}: the frequencies {word}"
    )


def _operations(run: Run, published: Run, table: str) -> Table:
    rows, differ = [], []
    for ours in run.operations.to_dict("records"):
        for there in cells.where(published.operations, kernel=ours["kernel"]).to_dict("records"):
            for side, counts in (("thesis", there), ("here", ours)):
                told = {
                    name: None if absent(counts[name]) else int(counts[name]) for name in OPERATIONS
                }
                rows.append({"kernel": ours["kernel"], "where": side} | told)
            differ += [
                f"{ours['kernel']} {name}"
                for name in OPERATIONS
                if not absent(there[name]) and there[name] != ours[name]
            ]
    verdict = f"not equal: {', '.join(differ)}" if differ else "every count is equal"
    if not rows:
        verdict = "nothing in common to compare"
    return Table(
        "beside-thesis",
        rows,
        ["kernel", "where", *OPERATIONS],
        f"Table {table}, thesis and here: the greatest number of operations on any path",
        notes=[verdict, "differences, crosses, dots: vector operations, section 4.5"],
    )
