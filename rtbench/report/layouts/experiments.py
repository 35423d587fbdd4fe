"""Tables of the experiments beside density: stages, prediction, working set, latency."""

from typing import TYPE_CHECKING

from rtbench.report import cells, machine
from rtbench.report.digits import absent, interval, measured, percent, usual_decimals
from rtbench.report.stages import stages_of
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

CHAINS = ("independent", "dependent")
_GROUP = ("precision", "order", "density")


def stages_table(run: "Run") -> Table:
    """Return how long each stage of a kernel takes.

    Parameters
    ----------
    run : Run
        A run of the experiment ``stages``: the time of each kernel cut off after each stage.

    Returns
    -------
    Table
        A row a kernel, precision and stage: ns up to its end with interval, what it adds to the
        stage before, and that as % of the whole kernel. What it adds may be negative: the cut
        kernel does other work at its end (a sum of what is alive), and code is laid out anew.
    """
    rows = []
    for stage in stages_of(run):
        rows.append(
            {
                "kernel": stage.kernel,
                "precision": stage.precision,
                "order": stage.order,
                "density": _density(stage.density),
                "stage_index": stage.index,
                "stage": stage.name,
                "ns_per_test": measured(stage.end, stage.ci_low, stage.ci_high),
                "interval": interval(stage.end, stage.ci_low, stage.ci_high),
                "ci_low": stage.ci_low,
                "ci_high": stage.ci_high,
                "added_ns": measured(stage.added, stage.ci_low, stage.ci_high),
                "added_percent": percent(stage.share),
            }
        )
    columns = ["kernel", *cells.differing(run.summary, *_GROUP), "stage"]
    raw = ["kernel", *_GROUP, "stage_index", "stage"]
    return Table(
        "stages",
        rows,
        [*columns, "ns_per_test", "interval", "added_ns", "added_percent"],
        "stages: ns a test of a kernel cut off after each stage, and what the stage adds",
        [*raw, "ns_per_test", "ci_low", "ci_high", "added_ns", "added_percent"],
        headers={
            "ns_per_test": "ns up to here",
            "interval": "95 % interval",
            "added_ns": "adds ns",
            "added_percent": "% of kernel",
        },
        notes=[machine.provenance(run)],
    )


def working_set_table(run: "Run") -> Table:
    """Return ns a test against the number of distinct pairs.

    Parameters
    ----------
    run : Run
        A run of the experiment ``working_set``.

    Returns
    -------
    Table
        A row a number of pairs (and precision, order, density), a column a kernel.
    """
    frame = cells.times_of(run)
    names = cells.values(frame, "kernel")
    rows = []
    for group, block in cells.groups(frame, _GROUP):
        for pairs in sorted(cells.values(block, "triangles")):
            row = {"pairs": int(pairs), **group, "density": _density(group["density"])}
            for cell in cells.where(block, triangles=pairs).to_dict("records"):
                low, high = cell.get("ci_low"), cell.get("ci_high")
                row[cell["kernel"]] = measured(cell["ns_per_test"], low, high)
            rows.append(row)
    return Table(
        "working_set",
        rows,
        ["pairs", *cells.differing(frame, *_GROUP), *names],
        "working set: ns a test over the number of distinct pairs",
        ["pairs", *_GROUP, *names],
        headers={cells.EMPTY_LOOP: "(empty loop)"},
        notes=[machine.provenance(run)],
    )


def latency_table(run: "Run") -> Table:
    """Return tests that wait for each other against tests that do not.

    Parameters
    ----------
    run : Run
        A run of the experiment ``latency``.

    Returns
    -------
    Table
        A row a kernel (and precision, order, density): ns of an independent and of a dependent
        test, and their ratio.
    """
    frame = cells.times_of(run)
    rows = []
    for group, block in cells.groups(frame, _GROUP):
        for kernel in cells.values(block, "kernel"):
            shown = Cell(kernel, "(empty loop)" if kernel == cells.EMPTY_LOOP else kernel)
            row = {"kernel": shown, **group, "density": _density(group["density"])}
            for cell in cells.where(block, kernel=kernel).to_dict("records"):
                low, high = cell.get("ci_low"), cell.get("ci_high")
                row[cell["chain"]] = measured(cell["ns_per_test"], low, high)
                row[f"{cell['chain']}_interval"] = interval(cell["ns_per_test"], low, high)
            first, second = (row[chain].value if chain in row else None for chain in CHAINS)
            if not absent(first) and not absent(second) and first > 0:
                row["ratio"] = Cell(second / first, f"{second / first:.2f}")
            rows.append(row)
    times = [name for chain in CHAINS for name in (chain, f"{chain}_interval")]
    return Table(
        "latency",
        rows,
        ["kernel", *cells.differing(frame, *_GROUP), *times, "ratio"],
        "latency: ns a test where tests are independent, and where each waits for the one before",
        ["kernel", *_GROUP, *CHAINS, "ratio"],
        headers={
            "independent_interval": "95 % interval",
            "dependent_interval": "95 % interval",
            "ratio": "dependent / independent",
        },
        notes=[machine.provenance(run)],
    )


def penalty_table(run: "Run") -> Table:
    """Return measured against predicted costs.

    Parameters
    ----------
    run : Run
        A run of the experiment ``prediction`` with a ``fit`` in its run.json.

    Returns
    -------
    Table
        A row a kernel, precision and density; without rows if nothing was fitted.
    """
    fit = run.info.get("fit") or {}
    rows = []
    points = fit.get("points") or []
    most = usual_decimals(points)
    names = list(dict.fromkeys(point["kernel"] for point in points))
    # By kernel: a reader follows one curve at a time.
    points = sorted(points, key=lambda point: names.index(point["kernel"]))
    for point in points:
        low, high = point.get("ci_low"), point.get("ci_high")
        rows.append(
            {
                "kernel": point["kernel"],
                "precision": point["precision"],
                "density": Cell(point["density"], cells.density_text(point["density"])),
                "measured": measured(point["measured"], low, high, most),
                "mixture": measured(point["mixture"], low, high, most),
                "branches_m": Cell(point["branches_m"], f"{point['branches_m']:.3f}"),
                "predicted": measured(point["predicted"], low, high, most),
                "residual": measured(point["measured"] - point["predicted"], low, high, most),
            }
        )
    notes = [machine.provenance(run)]
    if rows and not absent(fit.get("penalty_ns")):
        low, high = fit.get("ci") or (None, None)
        price = f"{measured(fit['penalty_ns'], low, high).text} ns"
        span = interval(fit["penalty_ns"], low, high)
        alone = [f"{name} {own:.1f} ns" for name, own in (fit.get("kernels") or {}).items()]
        # A branch that waits for a long computation is found out late, and throws away more.
        if len(alone) > 1:
            notes.insert(0, f"fitted to one kernel alone: {', '.join(alone)}")
        notes.insert(0, f"a mispredicted branch costs {price}" + (f" {span}" if span else ""))
    return Table(
        "penalty",
        rows,
        [
            "kernel",
            "precision",
            "density",
            "measured",
            "mixture",
            "branches_m",
            "predicted",
            "residual",
        ],
        "prediction: cost in ns a test, measured and as sum of f_i t_i + m x penalty",
        headers={"mixture": "sum f_i t_i", "branches_m": "m"},
        notes=notes,
    )


def _density(density) -> Cell:
    return Cell(density, "" if density is None else cells.density_text(density))
