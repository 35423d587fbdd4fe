"""Cells of a run's summary: which kernels, precisions, orders and densities, in which order."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from rtbench.records.schema import EMPTY, MEAN
from rtbench.report.digits import absent

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

EMPTY_LOOP = EMPTY
ORDERS = ("repeat", "sweep", "sorted", "shuffled")
PRECISIONS = ("float32", "mixed", "float64")


class Part(NamedTuple):
    """Cells that belong into one table or figure; a published run has one part a table."""

    suffix: str
    title: str
    frame: "DataFrame"


def parts(run: "Run", frame: "DataFrame | None" = None) -> list[Part]:
    """Split a summary by the published table that its rows come from; our own runs stay whole.

    Parameters
    ----------
    run : Run
        The run, for its title.
    frame : DataFrame, optional
        Its rows; all rows of the summary that have a time if not given.

    Returns
    -------
    list of Part
        ``suffix`` is "" or "-4.1", for file names. No rows, no parts.
    """
    if frame is None:
        frame = times_of(run)
    title = str(run.info.get("title") or run.info.get("experiment") or run.name)
    if not len(frame):
        return []
    if "table" not in frame.columns or frame["table"].isna().all():
        return [Part("", title, frame)]
    return [
        Part(f"-{table}", f"{_author(run)}table {table}", frame[frame["table"] == table])
        for table in sorted(values(frame, "table"), key=_table_number)
    ]


def times_of(run: "Run") -> "DataFrame":
    """Return the rows of a run's summary that have a time, kernels as the run's config has them."""
    return timed(by_config(run, run.summary))


def outcomes_of(run: "Run") -> "DataFrame":
    """Return a run's outcomes, kernels as the run's config has them."""
    return by_config(run, run.outcomes)


def by_config(run: "Run", frame: "DataFrame") -> "DataFrame":
    """Sort rows by kernel as the run's config lists them, the empty loop last.

    A summary has its cells as they were sampled, and every round samples them in another order.
    """
    listed = (run.info.get("config") or {}).get("kernels")
    places = {name: place for place, name in enumerate(listed if isinstance(listed, list) else [])}
    places[EMPTY_LOOP] = len(places) + 1
    if "kernel" not in frame.columns:
        return frame
    return frame.sort_values(
        "kernel", kind="stable", key=lambda names: names.map(lambda n: places.get(n, len(places)))
    )


def timed(frame: "DataFrame") -> "DataFrame":
    """Return the rows that have a time."""
    return frame[frame["ns_per_test"].notna()]


def values(frame: "DataFrame", column: str, first: tuple[str, ...] = ()) -> list:
    """Return the values of a column, each once: those of `first`, then as they appear."""
    if column not in frame.columns:
        return []
    there = list(dict.fromkeys(value for value in frame[column] if not absent(value)))
    return [value for value in first if value in there] + [v for v in there if v not in first]


def kernels(frame: "DataFrame") -> list[str]:
    """Return the kernels as they appear, without the empty loop."""
    return [name for name in values(frame, "kernel") if name != EMPTY_LOOP]


def orders(frame: "DataFrame") -> list[str]:
    return values(frame, "order", ORDERS)


def precisions(frame: "DataFrame") -> list[str]:
    return values(frame, "precision", PRECISIONS)


def densities(frame: "DataFrame") -> list:
    """Return the densities from 0 to 1; the word "mean" of a published table comes last."""
    return sorted(values(frame, "density"), key=density_key)


def density_key(density) -> float:
    try:
        return float(density)
    except ValueError:
        return float("inf")


def density_text(density) -> str:
    """Return a density as the head of a column: 0, 0.25, mean."""
    try:
        return f"{float(density):g}"
    except ValueError:
        return str(density)


def density_words(frame: "DataFrame") -> str:
    """Return the densities of some rows in words: "density 0.3", "mean over densities"."""
    texts = list(map(density_text, densities(frame)))
    if texts == [MEAN]:
        return "mean over densities"
    return f"density {', '.join(texts)}" if texts else ""


def where(frame: "DataFrame", **wanted) -> "DataFrame":
    """Return the rows whose columns have these values; an absent column or None asks nothing."""
    for column, value in wanted.items():
        if value is not None and column in frame.columns:
            frame = frame[frame[column] == value]
    return frame


def blocks(frame: "DataFrame") -> Iterator[tuple[str | None, str | None, "DataFrame"]]:
    """Yield precision, order and the rows of both; what a run has no column for is None."""
    for precision in precisions(frame) or [None]:
        rows = where(frame, precision=precision)
        for order in orders(rows) or [None]:
            yield precision, order, where(rows, order=order)


def groups(
    frame: "DataFrame", columns: tuple[str, ...] = ("precision", "order", "density")
) -> Iterator[tuple[dict, "DataFrame"]]:
    """Yield the values of some columns and the rows that have them, in a reader's order.

    Parameters
    ----------
    frame : DataFrame
        Rows of a summary.
    columns : tuple of str
        A column that is not there, or empty, is None.

    Yields
    ------
    dict
        Column to value.
    DataFrame
        The rows; never empty.
    """
    first = {"order": ORDERS, "precision": PRECISIONS}
    if not columns:
        yield {}, frame
        return
    column, *rest = columns
    found = values(frame, column, first.get(column, ()))
    for value in (sorted(found, key=density_key) if column == "density" else found) or [None]:
        for more, rows in groups(where(frame, **{column: value}), tuple(rest)):
            if len(rows):
                yield {column: value, **more}, rows


def differing(frame: "DataFrame", *columns: str) -> list[str]:
    """Return those of the columns in which the rows differ: a table or panel must name them."""
    return [column for column in columns if len(values(frame, column)) > 1]


def group_words(frame: "DataFrame", group: dict) -> str:
    """Return what tells a group from the others in words: "float64, sweep, density 0.5"."""
    words = []
    for column in differing(frame, *group):
        prefix = "density " if column == "density" else ""
        words.append(prefix + density_text(group[column]))
    return ", ".join(words)


def longest_timed(rows: "DataFrame") -> "DataFrame":
    """Return, of the times of one outcome at several densities, the row with the most pairs."""
    found = timed(rows)
    if len(found) < 2:
        return found
    pairs = found["pairs_timed"].fillna(0).to_list()
    return found.iloc[[pairs.index(max(pairs))]]


def _author(run: "Run") -> str:
    """Return "Blecha 2007, " for a published run that says so."""
    source = run.info.get("source")
    if not isinstance(source, dict) or not source.get("author"):
        return ""
    return f"{str(source['author']).split()[-1]} {source.get('year', '')}".strip() + ", "


def _table_number(table: str) -> list[tuple[int, str]]:
    return [(int(word) if word.isdigit() else 0, word) for word in table.split(".")]
