"""The stages of a kernel, as the bare strings in its source name them, and its cut forms."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from rtbench.compiled import syntax
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import Kernel


def stages(kernel: Kernel) -> list[str]:
    """Return the names of a kernel's stages, in order; a bare string stands where one ends."""
    marks = (_mark(statement) for statement in _statements(syntax.tree(kernel).body))
    return list(dict.fromkeys(mark for mark in marks if mark is not None))


def cut(kernel: Kernel, stage: str) -> ast.FunctionDef:
    """Return the kernel cut off where a stage ends.

    The cut form returns code 0 and the sum of the values that are live there (those computed so
    far that the rest of the kernel reads), so that the compiler can leave nothing out.

    Raises
    ------
    RtbenchError
        If the kernel has no stage of that name.
    """
    if stage not in stages(kernel):
        raise RtbenchError(unknown(f"stage of kernel {kernel.name!r}", stage, stages(kernel)))
    function = syntax.copy(syntax.tree(kernel))
    outputs = len(kernel.outputs)

    def cut_block(body: list[ast.stmt], assigned: set[str], after: set[str]) -> list[ast.stmt]:
        kept: list[ast.stmt] = []
        for i, statement in enumerate(body):
            _, live = syntax.needed(body[i + 1 :], after)
            if _mark(statement) == stage:
                total = " + ".join(sorted(assigned & live) or ["ZERO"])
                return [*kept, *ast.parse(f"return 0, {', '.join([total] * outputs)}").body]
            if isinstance(statement, ast.If):
                statement.body = cut_block(statement.body, set(assigned), live)
                statement.orelse = cut_block(statement.orelse, set(assigned), live)
            assigned |= syntax.stored(statement)
            kept.append(statement)
        return kept

    function.body = cut_block(function.body, set(), set())
    return ast.fix_missing_locations(function)


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    for statement in body:
        yield statement
        if isinstance(statement, ast.If):
            yield from _statements(statement.body)
            yield from _statements(statement.orelse)


def _mark(statement: ast.stmt) -> str | None:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return statement.value.value if isinstance(statement.value.value, str) else None
    return None
