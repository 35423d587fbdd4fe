"""Tables of break-even: from how many rays per triangle on preparing pays, and who is best then."""

import math
from typing import TYPE_CHECKING

from rtbench.report import cells, machine
from rtbench.report.break_even import Costs, costs_of
from rtbench.report.digits import absent, measured
from rtbench.report.methods import Method, methods_of
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

NEVER = "never"
_COLUMNS = ("kernel", "base", "ending", "stored")
_RAYS = ("rays_per_triangle", "ci_low", "ci_high")


def break_even_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``break_even``.

    Parameters
    ----------
    run : Run
        Measured; what is not concluded yet (``break_even`` in run.json) has no rows.

    Returns
    -------
    list of Table
        From how many rays per triangle on each stored form pays; the cheapest kernel by rays and
        triangles; the times and preparations behind both.
    """
    return [pays_table(run), cheapest_table(run), costs_table(run)]


def pays_table(run: "Run") -> Table:
    """Return from how many rays per triangle on each kernel that prepares triangles pays.

    Parameters
    ----------
    run : Run
        A run of the experiment ``break_even``.

    Returns
    -------
    Table
        A row a kernel and hit ratio (and precision), a column a number of triangles: rays per
        triangle with their 95 % interval, or never. In csv and json a row a number of triangles.
    """
    told = run.info.get("break_even") or []
    methods = methods_of(run, list(dict.fromkeys(row["kernel"] for row in told)))
    sizes = sorted({row["scene"] for row in told})
    rows: dict[tuple, dict] = {}
    for one in sorted(told, key=lambda row: (str(row["precision"]), row["density"])):
        key = one["precision"], one["density"], one["kernel"]
        row = rows.setdefault(key, _named(methods[one["kernel"]], one))
        row[f"{one['scene']}"] = Cell(one["rays_per_triangle"], _pays(one))
    several = ["precision"] if len({row["precision"] for row in told}) > 1 else []
    columns = ["kernel", "ending", *several, "density", *map(str, sizes)]
    raw = [methods[one["kernel"]]._asdict() | one for one in told]
    plain = ("against", "ns_per_test", "against_ns", "preparation_ns")
    return Table(
        "break_even",
        list(rows.values()),
        columns,
        "break-even: rays per triangle from which on preparing it pays [95 % interval], over the "
        "number of triangles",
        [*_COLUMNS, "precision", "density", "scene", *plain, *_RAYS],
        raw,
        {"density": "hit ratio"} | {str(size): f"{size:,}" for size in sizes},
        [
            "never: no less a test than what stores nothing; (> n): the interval leaves it open "
            "from n rays on",
            *_against(told),
            machine.provenance(run),
        ],
    )


def cheapest_table(run: "Run") -> Table:
    """Return which kernel costs least, preparing included, by triangles and rays per triangle.

    Parameters
    ----------
    run : Run
        A run of the experiment ``break_even``.

    Returns
    -------
    Table
        A row a stretch of rays per triangle in which one kernel is the cheapest: hit ratio (and
        precision), triangles, from and to how many rays, the kernel, its ns a test and to
        prepare a triangle.
    """
    found = costs_of(run, resamples=False)
    methods = methods_of(run, _kernels(found))
    rows = []
    for costs in found:
        for place, size in enumerate(costs.sizes):
            for stretch in costs.stretches(place):
                number = costs.kernels.index(stretch.kernel)
                prepared = float(costs.preparation[number, place])
                rows.append(
                    _named(methods[stretch.kernel], costs.__dict__)
                    | {
                        "scene": int(size),
                        "from_rays": stretch.start,
                        "to_rays": None if math.isinf(stretch.end) else stretch.end,
                        "rays": Cell(stretch.start, _span(stretch.start, stretch.end)),
                        "stored": methods[stretch.kernel].stored,
                        "ns_per_test": measured(float(costs.test[number, place])),
                        "preparation_ns": Cell(prepared, f"{prepared:,.0f}" if prepared else ""),
                        "name": stretch.kernel,
                    }
                )
    several = ["precision"] if len({costs.precision for costs in found}) > 1 else []
    return Table(
        "cheapest",
        rows,
        [
            *(*several, "density", "scene", "rays", "kernel", "ending", "stored"),
            *("ns_per_test", "preparation_ns"),
        ],
        "the kernel of least cost, ns a test + ns to prepare / rays per triangle",
        [
            *("precision", "density", "scene", "from_rays", "to_rays", "name", "kernel"),
            *("ending", "stored", "ns_per_test", "preparation_ns"),
        ],
        headers={
            "density": "hit ratio",
            "scene": "triangles",
            "rays": "rays per triangle",
            "ns_per_test": "ns a test",
            "preparation_ns": "ns to prepare",
        },
        notes=[machine.provenance(run)],
    )


def costs_table(run: "Run") -> Table:
    """Return ns a test of every kernel over the number of triangles, and what preparing takes.

    Parameters
    ----------
    run : Run
        A run of the experiment ``break_even``.

    Returns
    -------
    Table
        A row a kernel and hit ratio (and precision), a column a number of triangles: ns a test,
        and behind a plus sign ns to prepare a triangle where the kernel stores something.
    """
    frame = cells.times_of(run)
    methods = methods_of(run, cells.kernels(frame))
    prepared = {
        (row["kernel"], row["precision"], row["scene"]): row["ns_per_triangle"]
        for row in run.info.get("preparation") or []
    }
    sizes = sorted(cells.values(frame, "scene"))
    rows, raw = [], []
    for group, block in cells.groups(frame, ("precision", "density")):
        for kernel in cells.kernels(block):
            row = _named(methods[kernel], group)
            for cell in cells.where(block, kernel=kernel).to_dict("records"):
                scene, ns = int(cell["scene"]), cell["ns_per_test"]
                low, high = cell.get("ci_low"), cell.get("ci_high")
                made = prepared.get((kernel, group["precision"], scene))
                text = measured(ns, low, high).text + (f" + {made:,.0f}" if made else "")
                row[str(scene)] = Cell(ns, text)
                raw.append(
                    methods[kernel]._asdict()
                    | group
                    | {"scene": scene, "ns_per_test": ns, "ci_low": low, "ci_high": high}
                    | {"preparation_ns": made}
                )
            rows.append(row)
    several = cells.differing(frame, "precision")
    return Table(
        "costs",
        rows,
        ["kernel", "ending", *several, "density", *(str(int(size)) for size in sizes)],
        "ns a test + ns to prepare a triangle, over the number of triangles",
        [
            *(*_COLUMNS, "precision", "density", "scene"),
            *("ns_per_test", "ci_low", "ci_high", "preparation_ns"),
        ],
        raw,
        {"density": "hit ratio"} | {str(int(size)): f"{int(size):,}" for size in sizes},
        [machine.provenance(run)],
    )


def _named(method: Method, group: dict) -> dict:
    named = {"kernel": method.base, "ending": method.ending}
    density = Cell(group["density"], cells.density_text(group["density"]))
    return named | {"precision": group.get("precision"), "density": density}


def _pays(row: dict) -> str:
    """Return rays per triangle with their interval as text."""
    value, low, high = (row.get(name) for name in _RAYS)
    if absent(value):
        return NEVER if absent(low) else f"{NEVER} (> {_rays(low)})"
    if absent(low):
        return _rays(value)
    return f"{_rays(value)} [{_rays(low)}, {'inf' if absent(high) else _rays(high)}]"


def _rays(number: float) -> str:
    """Return a number of rays with two digits or all whole ones."""
    return f"{number:,.0f}" if number >= 9.95 else f"{number:.1f}"


def _span(start: float, end: float) -> str:
    if math.isinf(end):
        return f"from {_rays(start)} on" if start else "any"
    return f"{_rays(start)} to {_rays(end)}" if start else f"up to {_rays(end)}"


def _against(told: list[dict]) -> list[str]:
    """Return a line a hit ratio: what the stored forms were compared with, by size."""
    lines = []
    for precision, density in dict.fromkeys((row["precision"], row["density"]) for row in told):
        by_name: dict[str, list[int]] = {}
        for row in told:
            if (row["precision"], row["density"]) == (precision, density):
                sizes = by_name.setdefault(row["against"], [])
                sizes += [] if row["scene"] in sizes else [row["scene"]]
        several = len({row["precision"] for row in told}) > 1
        where = f"hit ratio {cells.density_text(density)}" + (f", {precision}" if several else "")
        words = [
            name + (f" ({', '.join(f'{size:,}' for size in sorted(sizes))})" if other else "")
            for other in [len(by_name) > 1]
            for name, sizes in by_name.items()
        ]
        lines.append(f"against the fastest that stores nothing, {where}: {'; '.join(words)}")
    return lines


def _kernels(found: list[Costs]) -> list[str]:
    return list(dict.fromkeys(name for costs in found for name in costs.kernels))
