"""Tables of trees: what each rule builds of a model, and how long a ray takes in it."""

from typing import TYPE_CHECKING

import numpy as np

from rtbench.report import machine
from rtbench.report.digits import absent, interval, measured
from rtbench.report.layouts.tree_growth import expected_table, sizes_tables
from rtbench.report.layouts.tree_kernels import accuracy_tables, kernels_tables
from rtbench.report.layouts.tree_peers import peers_table
from rtbench.report.layouts.tree_quality import model_words, quality_table
from rtbench.report.layouts.tree_threads import threads_table
from rtbench.report.ranking import MARK
from rtbench.report.tables import Cell, Table
from rtbench.report.tree_cells import (
    TREE,
    VISITS,
    Timed,
    clock_note,
    file_name,
    timed_name,
)
from rtbench.report.tree_order import order_notes, steps
from rtbench.report.trees import Trees, level_with_best

if TYPE_CHECKING:
    from rtbench.records.run import Run


def trees_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``trees``.

    Parameters
    ----------
    run : Run
        Measured, finished or not.

    Returns
    -------
    list of Table
        For each model what the trees are and how long rays take in them; what grows with the size
        of a model; kernels and ways; what accuracy costs in a tree; libraries; what the SAH expects
        against what was measured. What the run has no cells of has no rows.
    """
    trees = Trees(run)
    found = []
    for model in trees.alone:
        found.append(quality_table(trees, model))
        if not trees.only_kernels(model):
            found.append(times_table(trees, model))
    return [
        *found,
        *sizes_tables(trees),
        *kernels_tables(trees),
        *accuracy_tables(trees),
        peers_table(trees),
        threads_table(trees),
        expected_table(trees),
    ]


def times_table(trees: Trees, model: str) -> Table:
    """Return how long rays take in each tree of a model: a row a ray set and tree.

    Parameters
    ----------
    trees : Trees
    model : str

    Returns
    -------
    Table
        Nanoseconds a ray with their 95 % interval, how many times as long as in the fastest tree
        that takes (paired by rounds), how many times faster than without a tree it is, and what
        the rays met. Libraries and the naive way stand below the trees.
    """
    rows = []
    for rays in trees.ray_sets(model):
        timed = trees.of(model, rays)
        ours = [one for one in timed if one.ours]
        best, level = level_with_best(trees, ours)
        rows += [_timed(trees, one, best or timed[0], level) for one in timed]
    columns = ["rays", "tree"]
    columns += [name for name in ("kernel", "precision", "way") if _differ(rows, name)]
    resolved = any(row["interval"] for row in rows)
    columns += ["ns_per_ray", *(["interval"] if resolved else []), "ratio"]
    columns += ["ratio_interval"] if resolved else []
    if any(not absent(row["naive"].value) for row in rows):
        columns.append("naive")
    counted = [f"counted_{name}" for name in VISITS]
    columns += [name for name in counted if any(name in row for row in rows)]
    headers = {
        "ns_per_ray": "ns/ray",
        "interval": "95 %",
        "ratio": "x best",
        "ratio_interval": "95 %",
        "naive": "x naive",
        "counted_steps": "steps",
        "counted_leaves": "leaves",
        "counted_leaf_tests": "tests",
    }
    raw = ["model", "triangles", "rays", *TREE, "kernel", "precision", "way", "rays_timed"]
    raw += [
        "ns_per_ray",
        "ns_low",
        "ns_high",
        "clock_ns",
        "ratio",
        "ratio_low",
        "ratio_high",
        "best",
    ]
    raw += ["level_with_best", "naive", "naive_low", "naive_high", *counted, "hit_percent"]
    notes = [
        *order_notes(steps(trees, model)),
        *(["* no difference resolved from the best tree"] if _marked(rows) else []),
        *([] if resolved or not rows else ["one process: no interval, nothing is resolved"]),
        *_ways(trees, model, columns),
        clock_note(trees.of(model)),
        *_naive_note(trees, model, rows),
        "steps, leaves, tests: counted, a ray that meets the scene's box"
        + _in_blocks(trees, model),
        *_peers_note(trees, model),
        machine.provenance(trees.run),
    ]
    title = f"{model_words(trees, model)}: time a ray"
    return Table(
        f"tree-times-{file_name(model)}", rows, columns, title, raw, headers=headers, notes=notes
    )


def _timed(trees: Trees, one: Timed, best: Timed, level: list[Timed]) -> dict:
    estimate = trees.median(one)
    ends = estimate.interval() or (None, None)
    row = dict(one.cell) | dict(zip(TREE, one.key, strict=True))
    row |= {"tree": timed_name(one), "triangles": one.triangles, "rays_timed": one.rays}
    row |= {"ns_per_ray": measured(estimate.value, *ends, most=1)}
    row |= {"interval": interval(estimate.value, *ends, most=1)}
    row |= {"ns_low": ends[0], "ns_high": ends[1]}
    row["clock_ns"] = float(np.median(one.times.ns))
    row |= {"best": timed_name(best), "level_with_best": int(one in level or one is best)}
    ratio = trees.ratio(one, best)
    mark = MARK if one in level and ratio is not None and ratio.draws is not None else ""
    if one is best:
        row["ratio"] = Cell(1.0, "1")
    elif ratio is not None:
        low, high = ratio.interval() or (None, None)
        row["ratio"] = Cell(ratio.value, f"{measured(ratio.value, low, high, 2).text}{mark}")
        row |= {"ratio_low": low, "ratio_high": high}
        row["ratio_interval"] = interval(ratio.value, low, high, most=2)
    row |= naive_of(trees, one)
    counted = trees.visits(one) if one.ours else {}
    for name in VISITS:
        if not absent(counted.get(name)):
            row[f"counted_{name}"] = Cell(float(counted[name]), f"{counted[name]:.1f}")
    if counted.get("rays_counted") and not absent(counted.get("hits")):
        row["hit_percent"] = 100 * counted["hits"] / counted["rays_counted"]
    return row


def naive_of(trees: Trees, one: Timed) -> dict:
    """Return how many times faster a cell is than the naive way of the same kernel and rays."""
    naive = trees.naive(one)
    ratio = trees.ratio(naive, one) if naive is not None and naive is not one else None
    if ratio is None:
        return {"naive": Cell(None, "")}
    low, high = ratio.interval() or (None, None)
    places = 0 if ratio.value >= 10 else 1
    found = {"naive": Cell(ratio.value, f"{ratio.value:,.{places}f}")}
    return found | {"naive_low": low, "naive_high": high}


def _naive_note(trees: Trees, model: str, rows: list[dict]) -> list[str]:
    """Return from how many rays the naive way's time is taken for all of them."""
    naive = [one for one in trees.of(model) if one.cell["way"] == "brute_force"]
    told = []
    for one in naive:
        whole = max(o.rays for o in trees.of(model, one.cell["rays"]))
        minutes = trees.median(one).value * whole / 1e9
        told.append(
            f"{one.cell['rays']} from {one.rays:,} rays (all {whole:,} would take {minutes:,.1f} s)"
        )
    if not told:
        return []
    return [f"naive: every triangle, timed on a sample of the rays: {'; '.join(told)}"]


def _in_blocks(trees: Trees, model: str) -> str:
    """Return in which ways leaves are of blocks: a test there is one of a block."""
    found = {}
    for one in trees.of(model):
        tree = trees.tree(one) if one.ours else None
        if tree is not None and (tree.block or 1) > 1:
            found[one.cell["way"].partition(",")[0]] = tree.block
    told = "; ".join(f"{way}: tests of {block} triangles at once" for way, block in found.items())
    return f"; {told}" if told else ""


def _differ(rows: list[dict], name: str) -> bool:
    """Tell whether trees differ in a column within one ray set."""
    found: dict[str, set] = {}
    for row in rows:
        if row["way"] not in ("brute_force", "peer"):
            found.setdefault(row["rays"], set()).add(row[name])
    return any(len(values) > 1 for values in found.values())


def _marked(rows: list[dict]) -> bool:
    return any(row.get("ratio") and row["ratio"].text.endswith(MARK) for row in rows)


def _ways(trees: Trees, model: str, columns: list[str]) -> list[str]:
    """Return kernel, precision and way of each ray set, those that are no columns."""
    told = []
    for rays in trees.ray_sets(model):
        ours = [one for one in trees.of(model, rays) if one.ours]
        words = [
            "/".join(dict.fromkeys(str(one.cell[name]) for one in ours))
            for name in ("kernel", "precision", "way")
            if name not in columns
        ]
        if ours and any(words):
            told.append(f"{rays}: {max(one.rays for one in ours):,} rays, {', '.join(words)}")
    return ["; ".join(told)] if told else []


def _peers_note(trees: Trees, model: str) -> list[str]:
    """Return who the libraries of the table are."""
    there = {str(one.cell["kernel"]) for one in trees.of(model) if one.cell["way"] == "peer"}
    told = [p for p in trees.run.info.get("peers") or [] if p.get("name") in there]
    words = [f"{p['name']}: {p.get('title') or ''} {p.get('version') or ''}".strip() for p in told]
    return ["; ".join(words)] if words else []
