"""Table of what each rule builds of a model: seconds, nodes, memory, what the SAH expects."""

import numpy as np

from rtbench.report import machine
from rtbench.report.digits import absent
from rtbench.report.tables import Cell, Table
from rtbench.report.tree_cells import EXPECTED, TREE, Built, file_name, is_peer, tree_name
from rtbench.report.trees import Trees

FACTS = ("nodes", "leaves", "empty_leaves", "references", "depth", "bytes", "sah_cost")


def quality_table(trees: Trees, model: str) -> Table:
    """Return what was built of a model: a row a tree.

    Parameters
    ----------
    trees : Trees
    model : str

    Returns
    -------
    Table
        Seconds to build (the median of the processes and their range), what the tree is made of,
        its SAH cost, and what a ray is expected to meet. A library tells its seconds alone.
    """
    rows = [_built(trees, tree) for tree in trees.built(model)]
    columns = ["tree", "build_seconds", "build_range", "nodes", "empty_percent"]
    columns += ["references_per_triangle", "depth", "megabytes", "sah_cost", *EXPECTED]
    if len({row["block"] for row in rows if row["block"] is not None}) > 1:
        columns.insert(1, "block")
    if not any("build_range" in row for row in rows):
        columns.remove("build_range")
    headers = {
        "build_seconds": "build s",
        "build_range": "range",
        "empty_percent": "% empty",
        "references_per_triangle": "refs/tri",
        "megabytes": "MB",
        "sah_cost": "SAH cost",
        "expected_steps": "exp. steps",
        "expected_leaves": "leaves",
        "expected_tests": "tests",
    }
    raw = ["model", "triangles", *TREE, "block", "axes", "candidates", "overlap"]
    raw += ["traversal_cost", "intersection_cost", "max_leaf", "build_seconds", "build_least"]
    raw += ["build_greatest", "processes", *FACTS, "empty_percent", "references_per_triangle"]
    raw += ["megabytes", *EXPECTED, "digest"]
    notes = [
        "build s: CPU time, of libraries by the clock; median of the processes and their range",
        "% empty: of the leaves; refs/tri: references to a triangle",
        "exp. steps, leaves (such as hold any), tests: of a ray that meets the scene's box, as the "
        "SAH expects it",
        *_costs(rows),
        machine.provenance(trees.run),
    ]
    title = f"{model_words(trees, model)}: what each rule builds"
    return Table(
        f"trees-{file_name(model)}", rows, columns, title, raw, headers=headers, notes=notes
    )


def _built(trees: Trees, tree: Built) -> dict:
    facts, seconds = tree.facts, tree.seconds[np.isfinite(tree.seconds)]
    row = dict(facts) | dict(zip(TREE, tree.key, strict=True))
    row |= {"tree": tree_name(tree.key), "block": tree.block, "processes": len(seconds)}
    if len(seconds):
        middle, low, high = float(np.median(seconds)), float(seconds.min()), float(seconds.max())
        row |= {"build_seconds": _seconds(middle), "build_least": low, "build_greatest": high}
        if len(seconds) > 1:
            row["build_range"] = f"{_seconds(low).text} to {_seconds(high).text}"
    if is_peer(tree):
        return row
    if not absent(facts.get("leaves")) and facts["leaves"]:
        share = 100 * facts["empty_leaves"] / facts["leaves"]
        row["empty_percent"] = Cell(share, f"{share:.1f}")
    if not absent(facts.get("references")) and facts.get("triangles"):
        each = facts["references"] / facts["triangles"]
        row["references_per_triangle"] = Cell(each, f"{each:.2f}")
    if not absent(facts.get("bytes")):
        size = facts["bytes"] / 1e6
        row["megabytes"] = Cell(size, f"{size:.{1 if size >= 10 else 2}f}")
    for name in ("sah_cost", *EXPECTED):
        if not absent(facts.get(name)):
            row[name] = Cell(float(facts[name]), f"{facts[name]:.1f}")
    return row


def _seconds(value: float) -> Cell:
    return Cell(value, f"{value:.{3 if value < 1 else 2}f}")


def _costs(rows: list[dict]) -> list[str]:
    """Return K_T and K_I of the trees: an SAH cost is in their unit."""
    told = {
        (row.get("traversal_cost"), row.get("intersection_cost"))
        for row in rows
        if not absent(row.get("traversal_cost"))
    }
    words = [f"K_T {a:g}, K_I {b:g}" for a, b in sorted(told)]
    return [f"SAH cost with {' and '.join(words)}"] if words else []


def model_words(trees: Trees, model: str) -> str:
    """Return a model's name and size in words."""
    count = trees.triangles(model)
    return f"{model}, {count:,} triangles" if count else model
