"""How many operations a kernel needs until it says what it says: a count for each outcome.

The greatest count of `rtbench.compiled.operations` is that of a test that runs to the end; most
tests leave earlier, and what a workload costs is a mixture over its outcomes.
"""

from __future__ import annotations

import ast

from rtbench.compiled import operations, syntax
from rtbench.kernels.contract import HIT, Kernel

Ended = set[tuple[int | None, operations.Path]]


def exits(kernel: Kernel) -> dict[int | None, operations.Counts] | None:
    """Return the greatest number of each operation on any path that ends in an outcome.

    Parameters
    ----------
    kernel : Kernel

    Returns
    -------
    dict or None
        Outcome code to counts, named as by `operations`; None stands for every outcome that
        a path computes instead of naming it. None for a kernel with loops.
    """
    if operations.operations(kernel) is None:
        return None
    ended, _ = _paths(syntax.tree(kernel).body, syntax.helpers(kernel))
    names = tuple(operations._zero())
    found: dict[int | None, list[operations.Path]] = {}
    for code, path in ended:
        found.setdefault(code, []).append(path)
    return {
        code: dict(zip(names, map(max, zip(*paths, strict=True)), strict=True))
        for code, paths in found.items()
    }


def _paths(
    body: list[ast.stmt], helpers: dict[str, ast.FunctionDef]
) -> tuple[Ended, set[operations.Path]]:
    """Return outcome and counts of the paths that return in a block, and those that leave it."""
    names = tuple(operations._zero())
    ended: Ended = set()
    going: set[operations.Path] = {(0,) * len(names)}
    for statement in body:
        added = operations._zero()
        for expression in operations._expressions(statement):
            operations._count(expression, added, helpers)
        if isinstance(statement, ast.AugAssign):
            kind = operations._KINDS.get(type(statement.op))
            added |= {kind: added[kind] + 1} if kind else {}
        if isinstance(statement, ast.If):
            added["cond"] += 1
        going = {operations._plus(path, tuple(added.values())) for path in going}
        if isinstance(statement, ast.Return):
            return ended | {(_outcome(statement), path) for path in going}, set()
        if isinstance(statement, ast.If):
            through: set[operations.Path] = set()
            for branch in (statement.body, statement.orelse):
                inner_ended, inner_going = _paths(branch, helpers)
                ended |= {
                    (code, operations._plus(path, inner))
                    for path in going
                    for code, inner in inner_ended
                }
                through |= {
                    operations._plus(path, inner) for path in going for inner in inner_going
                }
            going = through
    return ended, going


def _outcome(statement: ast.Return) -> int | None:
    first = statement.value.elts[0]
    if isinstance(first, ast.Constant) and isinstance(first.value, int):
        return int(first.value)
    return HIT if isinstance(first, ast.Name) and first.id == "HIT" else None
