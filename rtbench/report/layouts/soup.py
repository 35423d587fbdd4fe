"""Tables of Havel's soup: every ray against all triangles, times and what is stored for them."""

from typing import TYPE_CHECKING

import numpy as np

from rtbench.report import cells, machine
from rtbench.report.digits import absent, frequency, interval, measured, percent, usual_decimals
from rtbench.report.layouts.density import SLOWER
from rtbench.report.methods import Method, methods_of, storage, variants
from rtbench.report.ranking import MARK, Ranking, rank
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

MANY = 3  # names level with the best that still fit on a line
_BYTES = ("bytes_per_triangle", "bytes_per_triangle_padded")
_PREPARE = "prepare_ns_per_triangle"
_GROUP = ("precision", "prepared")
_METHOD = ("kernel", "base", "ending", "division", "early", "stored")


def soup_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``soup``.

    Parameters
    ----------
    run : Run
        Measured, finished or not.

    Returns
    -------
    list of Table
        The times, then what each method stores; without rows if nothing was measured.
    """
    return [soup_table(run), stored_table(run)]


def soup_table(run: "Run") -> Table:
    """Return the times of the kernels at each hit ratio.

    Parameters
    ----------
    run : Run
        A run of the experiment ``soup``.

    Returns
    -------
    Table
        A row a kernel, precision and way of preparing: for each hit ratio ns a test, its 95 %
        interval and million tests a second; then % slower than the best over the hit ratios. In
        csv and json a row a hit ratio.
    """
    frame = cells.times_of(run)
    methods = methods_of(run, cells.kernels(frame))
    ratios = cells.densities(frame)
    most = {r: usual_decimals(cells.where(frame, density=r).to_dict("records")) for r in ratios}
    rows, raw, notes = [], [], []
    for group, words in variants(frame):
        block = cells.where(frame, **group)
        ranking = rank(block, run)
        notes += _level(ranking, words)
        for kernel in cells.kernels(block):
            method = methods[kernel]
            slower = percent(ranking.slower.get(kernel), ranking.mark(kernel))
            row = {"kernel": method.base, "ending": method.ending, "stored": method.stored}
            row |= {**group, SLOWER: slower}
            for cell in cells.where(block, kernel=kernel).to_dict("records"):
                row |= _times(cell, most[cell["density"]])
                raw.append(_told(method, group, cell, run) | {SLOWER: slower})
            rows.append(row)
    several = cells.differing(frame, *_GROUP)
    times = [name for ratio in ratios for name in _columns(ratio)]
    # With a column more the classes would not fit; they stand in the table of what is stored.
    tail = [SLOWER] if several else [SLOWER, "stored"]
    heads = {SLOWER: "% slower"}
    for ratio in ratios:
        ns, between, rate = _columns(ratio)
        text = cells.density_text(ratio)
        heads |= {ns: f"ns {text}", between: "95 % interval", rate: "M/s"}
    ending = ["ending"] if any(row["ending"] for row in rows) else []
    return Table(
        "soup",
        rows,
        ["kernel", *ending, *several, *times, *tail],
        _title(run, frame),
        [
            *(*_METHOD, *_GROUP, "density", "hit_ratio", "ns_per_test", "ci_low", "ci_high"),
            *("mtests_per_s", SLOWER, *_BYTES, _PREPARE),
        ],
        raw,
        heads,
        [
            *_units(ratios),
            *dict.fromkeys(notes),
            *_workloads(run),
            *_nearest(run),
            machine.provenance(run),
        ],
    )


def stored_table(run: "Run") -> Table:
    """Return what each method stores of a triangle.

    Parameters
    ----------
    run : Run
        A run of the experiment ``soup``.

    Returns
    -------
    Table
        A row a method and precision: the class of what is stored, bytes of a triangle packed and
        padded to rows of 16 bytes, ns to prepare one (of several kernels the middle one).
    """
    frame = cells.times_of(run)
    methods = methods_of(run, cells.kernels(frame))
    found: dict[tuple, list] = {}
    for group, block in cells.groups(frame, ("precision",)):
        for kernel in cells.kernels(block):
            facts = storage(run, kernel, group["precision"])
            key = methods[kernel].base, group["precision"], *(facts[name] for name in _BYTES)
            found.setdefault(key, []).append((methods[kernel], facts[_PREPARE]))
    rows = []
    for (base, precision, packed, padded), told in found.items():
        if packed is None:
            continue
        taken = [ns for _, ns in told if not absent(ns)]
        prepare = float(np.median(taken)) if taken else None
        rows.append(
            {
                "kernel": base,
                "method": told[0][0].title,
                "precision": precision,
                "stored": told[0][0].stored,
                "bytes_per_triangle": packed,
                "bytes_per_triangle_padded": padded,
                _PREPARE: Cell(prepare, "" if prepare is None else f"{prepare:,.0f}"),
            }
        )
    columns = ["kernel", "method", *cells.differing(frame, "precision"), "stored", *_BYTES]
    return Table(
        "stored",
        rows,
        [*columns, _PREPARE],
        "what is read of a triangle: bytes packed and in rows of 16 bytes, ns to prepare one",
        ["kernel", "method", "precision", "stored", *_BYTES, _PREPARE],
        headers={
            "bytes_per_triangle": "bytes packed",
            "bytes_per_triangle_padded": "bytes padded",
            _PREPARE: "ns to prepare",
        },
        notes=[machine.provenance(run)],
    )


def _columns(ratio) -> tuple[str, str, str]:
    text = cells.density_text(ratio)
    return f"ns_{text}", f"interval_{text}", f"mtests_{text}"


def _times(cell: dict, most: int) -> dict:
    ns, between, rate = _columns(cell["density"])
    value, low, high = cell["ns_per_test"], cell.get("ci_low"), cell.get("ci_high")
    return {
        ns: measured(value, low, high, most),
        between: interval(value, low, high, most),
        rate: measured(*_rate(value, low, high), 1),
    }


def _rate(value, low, high) -> tuple:
    """Return million tests a second and the ends of its interval."""
    ends = (None, None) if absent(low) or absent(high) or low <= 0 else (1e3 / high, 1e3 / low)
    return 1e3 / value if value > 0 else None, *ends


def _told(method: Method, group: dict, cell: dict, run: "Run") -> dict:
    facts = method._asdict() | group | storage(run, method.kernel, group["precision"])
    facts["hit_ratio"] = next(
        (
            work.get("hit_ratio")
            for work in run.info.get("workloads") or []
            if work.get("density") == cell["density"]
        ),
        None,
    )
    names = ("density", "ns_per_test", "ci_low", "ci_high")
    told = {name: cell.get(name) for name in names}
    return facts | told | {"mtests_per_s": _rate(cell["ns_per_test"], None, None)[0]}


def _title(run: "Run", frame) -> str:
    only = cells.precisions(frame)
    title = str(run.info.get("title") or "soup")
    return f"{title}; {only[0]}" if len(only) == 1 else title


def _units(ratios: list) -> list[str]:
    over = " and ".join(map(cells.density_text, ratios))
    return [f"ns a test and million tests a second (M/s) at hit ratio {over}"] if ratios else []


def _level(ranking: Ranking, words: str) -> list[str]:
    """Return the line on the kernels level with the best; many are marked in the table alone."""
    if not ranking.note():
        return []
    behind = f" ({words})" if words and ranking.level else ""
    if len(ranking.level) > MANY:
        return [f"{MARK} no difference resolved from {ranking.best}{behind}"]
    return [ranking.note() + behind]


def _workloads(run: "Run") -> list[str]:
    """Return a line a workload: how many triangles and rays, and how the tests end."""
    lines = []
    for work in run.info.get("workloads") or []:
        words = [f"{work['scene']:,} triangles x {work['rays']:,} rays"]
        if not absent(work.get("hit_ratio")):
            words.append(f"{frequency(work['hit_ratio']).text} % of the pairs hit")
        if not absent(work.get("distance_share")):
            share = frequency(work["distance_share"]).text
            words.append(f"{share} % of the tests end at a distance test that comes first")
        lines.append(f"hit ratio {cells.density_text(work.get('density'))}: {', '.join(words)}")
    return lines


def _nearest(run: "Run") -> list[str]:
    """Return who does not find the exact nearest triangle of a ray, or that all do."""
    checked = run.info.get("nearest") or []
    other = [row for row in checked if row.get("differ")]
    if not checked:
        return []
    if not other:
        return ["nearest triangle: every kernel finds the exact one on every ray"]
    words = []
    for row in other:
        ways = {way.get("prepared") for way in checked}
        which = [str(row.get("precision")), f"hit ratio {cells.density_text(row.get('density'))}"]
        which += [f"prepared in {row.get('prepared')}"] if len(ways) > 1 else []
        beyond = f", {row['wrong']:,} beyond rounding" if row.get("wrong") else ""
        told = f"{row['differ']:,} of {row['rays']:,} rays{beyond}"
        words.append(f"{row['kernel']} ({', '.join(which)}) {told}")
    return [f"nearest triangle, not the exact one: {'; '.join(words)}"]
