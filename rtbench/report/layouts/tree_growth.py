"""Tables of growth: time over the number of triangles; what the SAH expects against the time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rtbench.records.tabular import plain
from rtbench.report import machine
from rtbench.report.digits import absent, measured
from rtbench.report.tables import Cell, Table, four_digits
from rtbench.report.tree_cells import timed_name, tree_name
from rtbench.report.tree_correlation import ALL, MEASURES, correlations
from rtbench.report.tree_growth import Exponent, both_exponents
from rtbench.report.trees import Trees

if TYPE_CHECKING:
    from rtbench.records.run import Run

_GROWTH = ("exponent", "exponent_largest")
_ENDS = tuple(f"{name}_{end}" for name in _GROWTH for end in ("low", "high"))
_OPTIONS = ("rule", "axes", "candidates", "overlap")
_USUAL = ("all", "all", "clipped")
EXACT = ("nlogn", "nlog2n", "n2")  # the same tree by definition


def builders_tables(run: "Run") -> list[Table]:
    """Return the table of a run of the experiment ``tree_builders``."""
    return [builders_table(run)]


def builders_table(run: "Run") -> Table:
    """Return seconds to build over the number of triangles, with exponents: a row a builder.

    Parameters
    ----------
    run : Run
        Its builds.

    Returns
    -------
    Table
        A column a size: the median of the processes. Then the exponent of N over all sizes and
        over the larger half, the bytes a triangle at the peak of the largest, and whether exact
        builders made the same tree as the first of them.
    """
    groups = grouped_builds(run)
    rows, raw = [], []
    for key, builds in groups.items():
        sizes, seconds = curve(builds)
        row = dict(zip(("model", "builder", *_OPTIONS), key, strict=True))
        row |= {f"{n}": _seconds(s) for n, s in zip(sizes, seconds, strict=True)}
        row |= _exponents(sizes, seconds)
        last = max(builds, key=lambda build: build["triangles"])
        if not absent(last["peak_bytes"]):
            each = last["peak_bytes"] / last["triangles"]
            row["bytes_per_triangle"] = Cell(each, f"{each:,.0f}")
        row["same_tree"] = _same(key, groups)
        rows.append(row)
        raw += builds
    sizes = sorted({build["triangles"] for build in raw})
    columns = ["builder", *(n for n in ("model", *_OPTIONS) if len({r[n] for r in rows}) > 1)]
    if set(columns) >= {"builder", "rule"}:
        columns.remove("rule")  # a median's builder bears its name
    columns += [*(f"{n}" for n in sizes), *_GROWTH, "bytes_per_triangle", "same_tree"]
    headers = {f"{n}": f"{n:,}" for n in sizes}
    headers |= {"exponent": "exponent", "exponent_largest": "largest half"}
    headers |= {"bytes_per_triangle": "B/tri", "same_tree": "same tree"}
    raw_columns = ["builder", *_OPTIONS, "model", "triangles", "process", "seconds"]
    raw_columns += ["cpu_seconds", "peak_bytes", "nodes", "references", "sah_cost", "digest"]
    notes = [
        "CPU seconds, median of the processes; B/tri: memory at the peak, of the most triangles",
        "exponent: of N, by least squares of the logarithms, with the 95 % interval by how far the "
        "points lie from the line",
        f"same tree: nodes and references have one digest (exact builders: {', '.join(EXACT)})",
        machine.provenance(run),
    ]
    title = f"{run.info.get('title') or 'Builders'}: seconds to build over the triangles"
    return Table("tree-builders", rows, columns, title, raw_columns, raw, headers, notes)


def grouped_builds(run: "Run") -> dict[tuple, list[dict]]:
    """Return the builds of a run by model's family, builder and options, smallest first."""
    found: dict[tuple, list[dict]] = {}
    for row in run.builds.to_dict("records"):
        row = {name: plain(value) for name, value in row.items()}
        key = (str(row["model"]).partition(":")[0], row["builder"], *(row[n] for n in _OPTIONS))
        found.setdefault(key, []).append(row)
    for builds in found.values():
        builds.sort(key=lambda build: build["triangles"])
    # They are measured in a shuffled order: of a builder, what changes least first.
    told = list((run.info.get("config") or {}).get("builders") or [])

    def place(key: tuple) -> tuple:
        builder, changed = (
            key[1],
            [n for n, usual in zip(key[3:], _USUAL, strict=True) if n != usual],
        )
        rank = told.index(builder) if builder in told else len(told)
        return (key[0], builder not in EXACT, rank, len(changed), [str(name) for name in changed])

    return dict(sorted(found.items(), key=lambda item: place(item[0])))


def is_usual(key: tuple) -> bool:
    """Tell whether a group of builds has the usual options, or is of a builder without any."""
    options = [None if absent(name) else name for name in key[3:]]
    return key[2] != "sah" or None in options or tuple(options) == _USUAL


def curve(builds: Sequence[dict]) -> tuple[list[int], list[float]]:
    """Return the sizes and the median seconds of the processes of each."""
    sizes = sorted({build["triangles"] for build in builds})
    seconds = [
        float(np.median([cpu_seconds(b) for b in builds if b["triangles"] == size]))
        for size in sizes
    ]
    return sizes, seconds


def cpu_seconds(build: dict) -> float:
    """Return the processor's seconds of a build, which others disturb less than the clock's."""
    return float(build["seconds"] if absent(build["cpu_seconds"]) else build["cpu_seconds"])


def _same(key: tuple, groups: dict[tuple, list[dict]]) -> str:
    """Return whether a builder made the tree that the first exact one did, wherever both built."""
    model, builder, *options = key
    rivals = [k for k in groups if k[0] == model and k[1] in EXACT and k[2:] == tuple(options)]
    first = next(
        (k for name in EXACT for k in groups if k[0] == model and k[1:] == (name, *options)), None
    )
    if builder not in EXACT or first == key or len(rivals) < 2:
        return "first" if first == key and len(rivals) > 1 else ""
    wanted = {b["triangles"]: b["digest"] for b in groups[first]}
    told = {
        b["triangles"]: b["digest"] == wanted[b["triangles"]]
        for b in groups[key]
        if b["triangles"] in wanted
    }
    if not told:
        return ""
    good = sum(told.values())
    return f"yes, {good} of {len(told)}" if good == len(told) else f"NO: {good} of {len(told)}"


def sizes_tables(trees: Trees) -> list[Table]:
    """Return how times grow with the size of a model: a table a family of three sizes or more."""
    return [sizes_table(trees, family) for family in trees.families]


def sizes_table(trees: Trees, family: str) -> Table:
    """Return seconds to build and ns a ray over the size: a row a tree and what is timed.

    Parameters
    ----------
    trees : Trees
    family : str
        Of `Trees.families`.
    """
    rows: dict[tuple, dict] = {}
    values: dict[tuple, dict[int, float]] = {}
    for model in trees.families[family]:
        n = trees.triangles(model)
        for tree in trees.built(model):
            seconds = float(np.median(tree.seconds))
            key = ("build s", tree_name(tree.key), "", "", "", tree.block)
            rows.setdefault(key, _head(key))[f"{n}"] = _seconds(seconds)
            values.setdefault(key, {})[n] = seconds
        for one in trees.of(model):
            estimate = trees.median(one)
            way = "" if one.cell["way"] in ("peer", "brute_force") else one.cell["way"]
            key = (f"{one.cell['rays']} ns/ray", timed_name(one), *one.form, way, None)
            ends = estimate.interval() or (None, None)
            rows.setdefault(key, _head(key))[f"{n}"] = measured(estimate.value, *ends, most=1)
            values.setdefault(key, {})[n] = estimate.value
    for key, row in rows.items():
        row |= _exponents(list(values[key]), list(values[key].values()))
    sizes = sorted({n for known in values.values() for n in known})
    first = {"kernel": 2, "precision": 3, "way": 4}
    named = [name for name, place in first.items() if len({k[place] for k in rows if k[2]}) > 1]
    in_order = sorted(rows, key=lambda key: (key[0] != "build s", _place(trees, key[0])))
    return Table(
        f"tree-sizes-{family}",
        [rows[key] for key in in_order],
        ["what", "tree", *named, *(f"{n}" for n in sizes), *_GROWTH],
        f"{family}: time over the number of triangles",
        ["what", "tree", *first, *(f"{n}" for n in sizes), *_GROWTH, *_ENDS],
        headers={f"{n}": f"{n:,}" for n in sizes} | {"exponent_largest": "largest half"},
        notes=[
            "exponent: of N, by least squares of the logarithms, with the 95 % interval by how far "
            "the points lie from the line",
            machine.provenance(trees.run),
        ],
    )


def _place(trees: Trees, what: str) -> int:
    sets = [f"{rays} ns/ray" for rays in trees.ray_sets()]
    return sets.index(what) if what in sets else -1


def _head(key: tuple) -> dict:
    what, tree, kernel, precision, way, block = key
    tree = f"{tree}, blocks of {block}" if block and block > 1 else tree
    return {"what": what, "tree": tree, "kernel": kernel, "precision": precision, "way": way}


def _exponents(sizes: Sequence[float], seconds: Sequence[float]) -> dict:
    found = {}
    for name, one in zip(_GROWTH, both_exponents(sizes, seconds), strict=True):
        if isinstance(one, Exponent):
            found[name] = Cell(one.value, one.text)
            found |= {f"{name}_low": one.low, f"{name}_high": one.high}
    return found


def _seconds(value: float) -> Cell:
    return Cell(value, f"{value:.3f}" if value < 10 else four_digits(value))


def expected_table(trees: Trees) -> Table:
    """Return how well what is known of a tree tells its time: rank correlations over all trees.

    Parameters
    ----------
    trees : Trees

    Returns
    -------
    Table
        A row a model, ray set, kernel and way; a column a measure: Spearman's rho.
    """
    rows: dict[tuple, dict] = {}
    found = correlations(trees)
    for one in found:
        kernel, precision, way = one.form
        row = rows.setdefault((one.model, one.rays, one.form), {})
        row |= {"model": one.model if one.model != ALL else "all models", "rays": one.rays}
        row |= {"kernel": kernel, "precision": precision, "way": way}
        row["trees"] = max(one.trees, row.get("trees", 0))
        sure = "" if one.p < 0.05 else "?"
        row[one.measure] = Cell(one.rho, f"{one.rho:.2f}{sure}")
        row[f"{one.measure}_p"] = one.p
    listed = list(rows.values())
    named = [n for n in ("kernel", "precision") if len({row[n] for row in listed}) > 1]
    measures = [name for name in MEASURES if any(name in row for row in listed)]
    raw = ["model", "rays", "kernel", "precision", "way", "trees"]
    return Table(
        "tree-correlation",
        listed,
        ["model", "rays", *named, "way", "trees", *measures],
        "what the SAH expects, and what is counted, against measured ns a ray: rank correlation",
        [*raw, *(f"{name}{end}" for name in measures for end in ("", "_p"))],
        headers={name: words.replace("expected", "exp.") for name, words in MEASURES.items()},
        notes=[
            "Spearman's rho over the k-d trees of a model (Havran's question)"
            + ("; ?: not resolved from 0 at 5 %" if _unsure(listed) else ""),
            machine.provenance(trees.run),
        ],
    )


def _unsure(rows: list[dict]) -> bool:
    cells = (cell for row in rows for cell in row.values() if isinstance(cell, Cell))
    return any(cell.text.endswith("?") for cell in cells)
