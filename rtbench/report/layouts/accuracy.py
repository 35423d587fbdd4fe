"""Tables of what accuracy costs: points, steps, what filters leave, rays at a mesh, statements."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rtbench.records.statistics import UNRESOLVED
from rtbench.report import accuracy_steps, machine
from rtbench.report.accuracy import (
    BEHIND,
    CORPUS,
    FAR,
    FORMS,
    LEAF,
    LEVEL,
    MEASURES,
    ON_FRONT,
    RANDOM,
    SCALAR,
    UNSURE,
    Accuracy,
    Placed,
)
from rtbench.report.accuracy_steps import Price, gains
from rtbench.report.digits import interval, measured
from rtbench.report.layouts.accuracy_details import (
    fallback_table,
    mesh_table,
    rounded,
    short,
    statements_table,
)
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

WORKLOADS = {
    RANDOM: "random: triangles of the unit cube, half of the tests hit",
    LEAF: "leaf: edges 0.05, origin 2 away, 4.7 % of the tests hit",
    FAR: "far: as random, 1000 from the origin",
}
STANDING = {ON_FRONT: "front", UNSURE: "front?", LEVEL: "level", BEHIND: ""}


def accuracy_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``accuracy``.

    Parameters
    ----------
    run : Run
        Measured, finished or not.

    Returns
    -------
    list of Table
        The points, by form and time; the price of each step; what filters leave undecided; a ray
        at a mesh; what is claimed of the exact kernel. What the run has no cells of has no rows.
    """
    found = Accuracy(run)
    return [
        points_table(found),
        steps_table(found),
        fallback_table(found),
        mesh_table(found),
        statements_table(found),
    ]


def points_table(accuracy: Accuracy) -> Table:
    """Return every point: its time against what it gets wrong."""
    rows = []
    for form, words in FORMS.items():
        for placed in accuracy.front(MEASURES[0], form):
            rows.append(_point(accuracy, placed, words))
    columns = ["form", "kernel", "random_ns", "random_interval", "leaf_ns", "leaf_interval"]
    columns += ["random_ppm", "leaf_ppm", "far_ppm", "corpus_percent", "leaks", "p99_t", "front"]
    headers = {
        "random_ns": "random ns",
        "random_interval": "95 %",
        "leaf_ns": "leaf ns",
        "leaf_interval": "95 %",
        "random_ppm": "random ppm",
        "leaf_ppm": "leaf ppm",
        "far_ppm": "far ppm",
        "corpus_percent": "hard %",
        "p99_t": "p99 t",
    }
    raw = ["form", "kernel", "precision", "flags", "reciprocal"]
    raw += [f"{w}_{what}" for w in (RANDOM, LEAF) for what in ("ns", "low", "high")]
    raw += ["random_ppm", "leaf_ppm", "far_ppm", "corpus_percent", "leaks", "groups", "p99_t"]
    raw += ["relative_t", "standing", "beside"]
    notes = [
        "; ".join(WORKLOADS.values()),
        "ns a test; ppm: wrong answers of a million by the exact oracle, ties not counted; hard %: "
        "of the hard cases (core families)",
        "leaks: closed fans and meshes of the hard cases that a ray passes; p99 t: 99 % error of t "
        "there, in roundoffs of its condition",
        "front: none is faster and wrong no more often of the hard cases (random ns, hard %); "
        "front?: not resolved to be faster than the next one; level: not resolved from one as "
        "right",
        *_counted(accuracy),
        machine.provenance(accuracy.run),
    ]
    title = f"{accuracy.run.info.get('title') or 'Accuracy'}: time against wrong answers"
    return Table("accuracy", rows, columns, title, [*raw], headers=headers, notes=notes)


def _point(accuracy: Accuracy, placed: Placed, form: str) -> dict:
    point = placed.point
    row = {"form": Cell(point.form, form), "kernel": Cell(point.kernel, point.name)}
    row |= {name: getattr(point, name) for name in ("precision", "flags", "reciprocal")}
    for workload in (RANDOM, LEAF):
        if accuracy.has(point, workload):
            time = accuracy.time(point, workload)
            ends = time.interval() or (None, None)
            row[f"{workload}_ns"] = measured(time.value, *ends, most=2)
            row[f"{workload}_interval"] = interval(time.value, *ends, most=2)
            row |= {f"{workload}_low": ends[0], f"{workload}_high": ends[1]}
    for workload in (RANDOM, LEAF, FAR):
        told = accuracy.row(point, workload)
        if told.get("decided"):
            row[f"{workload}_ppm"] = short(1e6 * told["wrong"] / told["decided"])
    hard = accuracy.row(point, CORPUS)
    row["corpus_percent"] = measured(placed.value, placed.value - 0.01, placed.value + 0.01)
    row |= {name: hard.get(name) for name in ("leaks", "groups")}
    row["p99_t"] = short(hard.get("p99_t"))
    row["relative_t"] = hard.get("relative_t")
    beside = placed.beside.name if placed.beside else ""
    words = STANDING[placed.standing]
    row |= {"standing": placed.standing, "beside": beside}
    row["front"] = f"{words} ({beside})" if beside else words
    return row


def _counted(accuracy: Accuracy) -> list[str]:
    """Return how many tests stand behind a count."""
    rows = accuracy.run.accuracy
    found = []
    for workload in (RANDOM, LEAF, FAR, CORPUS):
        some = rows[rows["workload"] == workload]["tests"]
        if len(some):
            most, least = int(some.max()), int(some.min())
            found.append(f"{workload} {least:,}" + (f" to {most:,}" if most != least else ""))
    return [f"answers that are judged: {', '.join(found)}"] if found else []


def steps_table(accuracy: Accuracy, prices: Sequence[Price] | None = None) -> Table:
    """Return what each step costs, per cent of the time, and what it buys."""
    asked = accuracy_steps.prices(accuracy) if prices is None else prices
    rows: dict[tuple, dict] = {}
    raw = []
    for price in asked:
        # A step that goes between other forms in packets is a row of its own there.
        ends = price.start._replace(form=SCALAR), price.end._replace(form=SCALAR)
        row = rows.setdefault((price.step.name, ends), _step(accuracy, price))
        percent, low, high = price.percent
        row[f"{price.form}_{price.workload}"] = percent_cell(price)
        raw.append(
            {
                "step": price.step.name,
                "start": price.start.name,
                "end": price.end.name,
                "form": price.form,
                "workload": price.workload,
                "percent": percent,
                "low": low,
                "high": high,
                "verdict": price.verdict,
                **{
                    f"{name}_{when}": pair[k]
                    for name, pair in gains(accuracy, price.start, price.end).items()
                    for k, when in enumerate(("before", "after"))
                },
            }
        )
    words = {f"{f}_{w}": f"{FORMS[f]}, {w}" for f in FORMS for w in (RANDOM, LEAF)}
    there = [name for name in words if any(name in row for row in rows.values())]
    columns = ["step", "start", "end", *there, "wrong", "leaks", "ppm", "p99_t"]
    columns += ["relative_t"]
    headers = {"start": "from", "end": "to", "wrong": "hard %", "p99_t": "p99 t"} | words
    headers["relative_t"] = "p99 relative t"
    raw_columns = ["step", "start", "end", "form", "workload", "percent", "low", "high", "verdict"]
    raw_columns += [f"{n}_{w}" for n in _GAINS for w in _WHEN]
    notes = [
        "per cent more time (negative: less) with its 95 % interval, paired round by round; =: "
        "no difference resolved; each step by its own interval: of twenty one may err",
        "behind: before > after, of the hard cases (core families), and ppm of all typical tests",
        machine.provenance(accuracy.run),
    ]
    title = "The price of each step of accuracy, and what it buys"
    return Table("steps", list(rows.values()), columns, title, raw_columns, raw, headers, notes)


_WHEN = ("before", "after")
_GAINS = ("wrong", "leaks", "ppm", "p99_t", "relative_t")


def _step(accuracy: Accuracy, price: Price) -> dict:
    row = {"step": price.step.name, "start": price.start.name, "end": price.end.name}
    for name, (before, after) in gains(accuracy, price.start, price.end).items():
        row[name] = f"{short(rounded(before)).text} > {short(rounded(after)).text}"
    return row


def percent_cell(price: Price) -> Cell:
    """Return what a step costs as text: ``12 [10, 14]``, a ``=`` where nothing is resolved."""
    value, low, high = price.percent
    mark = "= " if price.verdict == UNRESOLVED else ""
    if low is None:
        return Cell(value, f"{value:+.1f}")
    places = 0 if high - low >= 3 else 1
    return Cell(value, f"{mark}{value:+.{places}f} [{low:.{places}f}, {high:.{places}f}]")
