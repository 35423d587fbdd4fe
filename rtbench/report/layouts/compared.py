"""What the tables of packets share: rows in order, a column for each change of the base."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rtbench.report import cells, machine, packed
from rtbench.report.digits import frequency, interval, measured
from rtbench.report.methods import methods_of, variants
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

MOST = 1  # decimals of a speed
_KEY = ("kernel", "precision", "prepared", "density")
_LANES = ("form", "width", "packet", "angle", "exit", "layout", "axes", "reciprocal")
_TIMES = ("ns_per_test", "ci_low", "ci_high", "mtests_per_s")
_ERRORS = ("rays", "differ", "median", "most")


class Line(NamedTuple):
    """A row to be: what it shows first, what it changes of the base, the cells it chooses from."""

    shown: dict
    changed: dict
    block: "DataFrame"


def lines_of(run: "Run", frame: "DataFrame", ways: Sequence[tuple[dict, dict]]) -> Iterator[Line]:
    """Yield the rows of a table in order: ways, precisions, hit ratios, kernels."""
    methods = methods_of(run, cells.kernels(frame))
    for way, changed in ways:
        for group, _ in variants(frame):
            for facts, part in cells.groups(cells.where(frame, **group), ("density",)):
                ratio = Cell(facts["density"], cells.density_text(facts["density"]))
                for name in cells.kernels(part):
                    named = {"kernel": methods[name].base, "ending": methods[name].ending}
                    shown = way | named | group | {"density": ratio}
                    yield Line(shown, changed, cells.where(part, kernel=name))


@dataclass(frozen=True)
class Comparison:
    """What a table puts side by side.

    Attributes
    ----------
    name, about : str
        The table's name, and what its title says after the run's.
    columns : dict of str to dict
        Head of a column to what is changed of the base there.
    ways : sequence of (dict, dict)
        Of each block of rows what it shows first, and what is changed of the base in all of it.
    notes : sequence of str
        Lines below the table.
    between : bool
        Whether the intervals are printed.
    errors : bool
        Whether the errors that the records tell of an estimate stand behind.
    """

    name: str
    about: str
    columns: dict[str, dict]
    ways: Sequence[tuple[dict, dict]] = (({}, {}),)
    notes: Sequence[str] = ()
    between: bool = True
    errors: bool = False


def compared(run: "Run", what: Comparison) -> Table:
    """Return a table with a column for each of some changes of the base.

    Parameters
    ----------
    run : Run
        A run of the experiment ``packets``.
    what : Comparison
        What stands side by side.

    Returns
    -------
    Table
        A row a way, precision, hit ratio and kernel, if it has two of the columns at least.
    """
    frame = cells.times_of(run)
    base, estimates = packed.base(run, frame), run.info.get("estimates") or []
    rows, raw = [], []
    for line in lines_of(run, frame, what.ways):
        found = {
            head: packed.cell(line.block, base, **line.changed, **changed)
            for head, changed in what.columns.items()
        }
        found = {head: cell for head, cell in found.items() if cell}
        if len(found) < 2:
            continue
        row = line.shown | {head: speed_text(cell, what.between) for head, cell in found.items()}
        for cell in found.values():
            errors = _errors(cell, estimates) if what.errors else {}
            row |= _printed(errors)
            raw.append(told(cell) | errors)
        rows.append(row)
    there = [head for head in what.columns if any(head in row for row in rows)]
    there += ["error", "most", "differ"] if what.errors else []
    changes = [*what.columns.values(), *(changed for _, changed in what.ways)]
    notes = [alike(base, {name for change in changes for name in change}), *what.notes]
    return table_of(run, what, rows, raw, there, notes, _ERRORS if what.errors else ())


def table_of(
    run: "Run",
    what: Comparison,
    rows: list[dict],
    raw: list[dict],
    columns: Sequence[str],
    notes: Sequence[str],
    more: Sequence[str] = (),
) -> Table:
    """Return a table of such rows, with the columns that vary and what does not vary below.

    Parameters
    ----------
    run : Run
    what : Comparison
        Its name, title and ways are taken.
    rows, raw : list of dict
        To print, and for csv and json.
    columns : sequence of str
        What stands behind the columns that say which kernel a row is of.
    notes : sequence of str
        Lines below the table; the work and the machine are added.
    more : sequence of str
        Columns that csv and json have behind the times.
    """
    frame = cells.times_of(run)
    only = cells.precisions(frame)
    first = list(dict.fromkeys(name for shown, _ in what.ways for name in shown))
    endings: dict[str, list[str]] = {}
    for row in rows:
        if row["ending"] not in endings.setdefault(row["kernel"], []):
            endings[row["kernel"]].append(row["ending"])
    # Where each method is there with one ending, a line says which.
    told_below = all(len(several) == 1 for several in endings.values())
    kernel = ["kernel", *([] if told_below else ["ending"])]
    kernel += [*cells.differing(frame, "precision", "prepared"), "density"]
    title = [str(run.info.get("title") or "packets"), what.about]
    return Table(
        what.name,
        rows,
        [*first, *kernel, *columns],
        "; ".join([*title, *(only if len(only) == 1 else [])]),
        [*_KEY, *_LANES, *_TIMES, *more],
        raw,
        {"density": "ratio", "differ": "rays"},
        [
            *filter(None, notes),
            *(_endings({base: found for base, (found,) in endings.items()}) if told_below else []),
            *_work(run),
            machine.provenance(run),
        ],
    )


def speed_text(cell: dict, between: bool = True) -> Cell:
    """Return the speed of a row of a summary as it is printed, with its interval or without."""
    found = packed.speed(cell)
    # Without the commas of thousands more columns fit on a line.
    text = measured(*found, MOST).text.replace(",", "")
    ends = [end.replace(",", "") for end in interval(*found, MOST).split(", ")]
    return Cell(found.middle, f"{text} {', '.join(ends)}".strip() if between else text)


def told(cell: dict) -> dict:
    """Return what csv and json have of a row of a summary."""
    found = {name: cell.get(name) for name in (*_KEY, *_LANES, *_TIMES)}
    return found | {"mtests_per_s": packed.speed(cell).middle}


def _errors(cell: dict, estimates: list[dict]) -> dict:
    """Return what the records say of a cell that took the estimate, nothing of others."""
    key = ("kernel", "precision", "density", "reciprocal")
    found = (one for one in estimates if all(one.get(name) == cell[name] for name in key))
    return {name: one.get(name) for one in found for name in _ERRORS}


def _printed(errors: dict) -> dict:
    if not errors:
        return {}
    words = {"error": "median", "most": "most"}
    found = {name: Cell(errors[key], _power(errors[key])) for name, key in words.items()}
    return found | {"differ": errors["differ"]}


def _power(error: float | None) -> str:
    return "" if error is None else f"{error:.1e}" if error else "0"


def _endings(ending: dict[str, str]) -> list[str]:
    """Return the line that says how kernels end, those that differ from most by name."""
    found = list(ending.values())
    usual = max(found, key=found.count, default="")
    others = [f"{base} {words}" for base, words in ending.items() if words != usual]
    return [f"endings: {', '.join([usual, *others])}"] if usual else []


def alike(base: dict, changed: set[str]) -> str:
    """Return what all cells of a table have in common, but for what it changes."""
    words = {
        "form": base["form"],
        "width": f"{base['width']} at a time",
        "packet": f"{base['packet']} packets",
        "angle": f"{base['angle']:g}° wide" if base["angle"] is not None else "",
        "exit": "no exit",
        "layout": "blocks",
        "axes": "axes stored",
        "reciprocal": "division",
    }
    kept = [text for name, text in words.items() if name not in changed and text]
    return f"everywhere: {', '.join(kept)}"


def _work(run: "Run") -> list[str]:
    size = packed.work(run)
    ratios = [
        f"hit ratio {cells.density_text(work['density'])}: {frequency(work['hit_ratio']).text} %"
        for work in run.info.get("workloads") or []
        if work.get("hit_ratio") is not None
    ]
    return ["; ".join([*([size] if size else []), *ratios])] if size or ratios else []
