"""Tables of time against density: the thesis's layout, and the one for a single density."""

from typing import TYPE_CHECKING

from rtbench.report import cells, machine
from rtbench.report.digits import absent, interval, measured, percent, usual_decimals
from rtbench.report.ranking import Ranking, rank
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

SLOWER = "slower_than_best_percent"
HEADERS = {
    "ns_per_test": "ns a test",
    "mtests_per_s": "Mtests/s",
    "interval": "95 % interval",
    "seconds": "total s",
    SLOWER: "% slower than best",
    "hits": "hits",
}


def run_table(run: "Run") -> Table:
    """Return what `rtbench run` prints: times in full for one density, else the thesis's layout.

    Parameters
    ----------
    run : Run
        A run with a summary.

    Returns
    -------
    Table
        A row a kernel and order (and precision); without rows if nothing was measured.
    """
    found = cells.parts(run)
    if len(found) == 1 and len(cells.densities(found[0].frame)) > 1:
        return density_table(run)
    if not found:
        return Table("times", [], ["kernel", "order", "ns_per_test"], headers=HEADERS)
    return single_density_table(run, found[0])


def density_table(run: "Run") -> Table:
    """Return the thesis's layout of a run's cells (the first part's, if published)."""
    found = cells.parts(run)
    if not found:
        return Table("times", [], ["kernel", "order", "ns_per_test"], headers=HEADERS)
    return over_densities_table(run, found[0])


def time_tables(run: "Run") -> list[Table]:
    """Return a table of times a part: one for a run, one a published table."""
    return [
        over_densities_table(run, part)
        if len(cells.densities(part.frame)) > 1
        else single_density_table(run, part)
        for part in cells.parts(run)
    ]


def over_densities_table(run: "Run", part: cells.Part) -> Table:
    """Return the thesis's layout: densities as columns in ns a test, then the sums.

    Parameters
    ----------
    run : Run
        The run that the cells are from.
    part : Part
        Its cells.

    Returns
    -------
    Table
        A row a kernel, order and precision: ns a test at each density, total seconds over the
        densities, % slower than the best of its order and precision, and hits in all.
    """
    densities = cells.densities(part.frame)
    most = _usual(part)
    heads = [cells.density_text(density) for density in densities]
    rows, empty, notes = [], [], []
    for precision, order, frame in cells.blocks(part.frame):
        ranking = rank(frame, run)
        notes.append(_note(ranking, precision, order, part))
        for kernel in cells.values(frame, "kernel"):
            mine = cells.where(frame, kernel=kernel)
            row = {"kernel": _shown(kernel), "precision": precision, "order": order}
            for density, head in zip(densities, heads, strict=True):
                for cell in cells.where(mine, density=density).to_dict("records"):
                    low, high = cell.get("ci_low"), cell.get("ci_high")
                    row[head] = measured(cell["ns_per_test"], low, high, most)
            row["seconds"] = _seconds(mine["seconds"].sum(min_count=1))
            row[SLOWER] = percent(ranking.slower.get(kernel), ranking.mark(kernel))
            if kernel == cells.EMPTY_LOOP:
                empty.append(row)
                continue
            row["hits"] = _count(mine["hits"].sum(min_count=1))
            rows.append(row)
    columns = [*_identity(part), *heads, "seconds", SLOWER, "hits"]
    return _finished(run, part, rows + empty, columns, [], notes, "ns a test over density")


def single_density_table(run: "Run", part: cells.Part) -> Table:
    """Return the times at one density in full.

    Parameters
    ----------
    run : Run
        The run that the cells are from.
    part : Part
        Its cells.

    Returns
    -------
    Table
        A row a kernel, order and precision: ns a test with its interval, Mtests/s, total
        seconds, % slower than the best of its order and precision, hits.
    """
    rows, empty, notes = [], [], []
    most, most_of_rate = _usual(part), _usual(part, _rate_ends)
    for precision, order, frame in cells.blocks(part.frame):
        ranking = rank(frame, run)
        notes.append(_note(ranking, precision, order, part))
        for cell in frame.to_dict("records"):
            kernel, ns = cell["kernel"], cell["ns_per_test"]
            low, high = cell.get("ci_low"), cell.get("ci_high")
            row = {
                "kernel": _shown(kernel),
                "precision": precision,
                "order": order,
                "density": cell.get("density"),
                "ns_per_test": measured(ns, low, high, most),
                "mtests_per_s": _rate(ns, low, high, most_of_rate),
                "interval": interval(ns, low, high, most),
                "ci_low": low,
                "ci_high": high,
                "seconds": _seconds(cell.get("seconds")),
                SLOWER: percent(ranking.slower.get(kernel), ranking.mark(kernel)),
            }
            if kernel == cells.EMPTY_LOOP:
                empty.append(row)
                continue
            row["hits"] = _count(cell.get("hits"))
            rows.append(row)
    tail = ["seconds", SLOWER, "hits"]
    raw = ["kernel", "precision", "order", "density", "ns_per_test", "ci_low", "ci_high"]
    has = ["interval"] if any(row["interval"] for row in rows) else []
    columns = [*_identity(part), "ns_per_test", "mtests_per_s", *has, *tail]
    which = cells.density_words(part.frame)
    what = f"ns a test, {which}" if which else "ns a test"
    return _finished(run, part, rows + empty, columns, [*raw, "mtests_per_s", *tail], notes, what)


def _finished(run, part, rows, columns, raw, notes, what) -> Table:
    precisions = cells.precisions(part.frame)
    only = precisions[0] if len(precisions) == 1 else ""
    title = "; ".join(filter(None, [part.title, what, machine.work(run), only]))
    if part.frame["hits"].isna().all() if "hits" in part.frame.columns else True:
        columns = [column for column in columns if column != "hits"]
    return Table(
        "times" + part.suffix,
        rows,
        columns,
        title,
        raw or ["kernel", "precision", *columns[columns.index("order") :]],
        headers=HEADERS,
        notes=[
            *filter(None, dict.fromkeys([*notes, machine.storage(run)])),
            machine.provenance(run),
        ],
    )


def _identity(part: cells.Part) -> list[str]:
    """Return the first columns; the precision stands in the title if there is only one."""
    several = len(cells.precisions(part.frame)) > 1
    return ["kernel", "precision", "order"] if several else ["kernel", "order"]


def _note(ranking: Ranking, precision, order, part: cells.Part) -> str:
    if ranking.single:
        return ranking.note()
    where = [order, precision if len(cells.precisions(part.frame)) > 1 else None]
    behind = ", ".join(word for word in where if word)
    return ranking.note() and f"{ranking.note()}" + (f" ({behind})" if behind else "")


def _shown(kernel: str) -> Cell:
    return Cell(kernel, "(empty loop)" if kernel == cells.EMPTY_LOOP else kernel)


def _usual(part: cells.Part, ends=lambda cell: cell) -> int:
    """Return the decimals of the table's times; those of the empty loop are another matter."""
    kernels = part.frame[part.frame["kernel"] != cells.EMPTY_LOOP]
    return usual_decimals(map(ends, kernels.to_dict("records")))


def _rate_ends(cell: dict) -> dict:
    """Return the interval of million tests a second, from that of ns a test."""
    low, high = cell.get("ci_low"), cell.get("ci_high")
    if absent(low) or absent(high) or low <= 0:
        return {}
    return {"ci_low": 1000 / high, "ci_high": 1000 / low}


def _rate(ns, low, high, most: int) -> Cell:
    if absent(ns) or ns <= 0:
        return Cell(None, "")
    ends = _rate_ends({"ci_low": low, "ci_high": high})
    return measured(1000 / ns, ends.get("ci_low"), ends.get("ci_high"), most)


def _seconds(seconds) -> Cell:
    return Cell(None, "") if absent(seconds) else Cell(float(seconds), f"{float(seconds):,.3f}")


def _count(count) -> int | None:
    return None if absent(count) else int(count)
