"""The kernels as a list of plain facts; needs no compiler."""

from __future__ import annotations

import ast

from rtbench.compiled import layout, syntax
from rtbench.compiled.operations import (
    OPERATIONS,
    VECTOR_OPERATIONS,
    operations,
    preparation_operations,
)
from rtbench.kernels import registry
from rtbench.kernels.contract import Kernel


def facts(kernel: Kernel) -> dict:
    """Return what is known of a kernel without running it, as JSON can hold it."""
    counts = operations(kernel)
    return {
        "name": kernel.name,
        "title": kernel.title,
        "method": kernel.method,
        "domain": kernel.domain,
        "outputs": list(kernel.outputs),
        "precisions": list(kernel.precisions),
        "exact": kernel.exact,
        "stored": kernel.stored,
        "ending": kernel.ending and kernel.ending.name,
        "bytes_per_triangle": layout.bytes_per_triangle(kernel),
        "bytes_per_triangle_padded": layout.bytes_per_triangle(kernel, "padded"),
        "operations": counts and {name: counts[name] for name in OPERATIONS},
        "preparation": preparation_operations(kernel),
        "vector_operations": counts and {name: counts[name] for name in VECTOR_OPERATIONS},
        "outcomes": list(kernel.outcomes),
        "source": kernel.source,
    }


def list_kernels() -> list[dict]:
    """Return every kernel of the package.

    Returns
    -------
    list of dict
        ``name``, ``method``, ``domain`` (line, ray, segment; None where a point is tested),
        ``outputs``, ``precisions``, ``stored`` (none, normal, precomputed), ``ending`` (None for a
        whole listing), ``bytes_per_triangle`` (float32, own layout, packed) and
        ``bytes_per_triangle_padded`` (in rows of 16 bytes), ``operations`` (add, sub, mul, div,
        cond; None where no tree bounds them), ``source`` and more.
    """
    return [facts(kernel) for kernel in registry.all_kernels().values()]


def listing(kernel: Kernel) -> str:
    """Return the source of a kernel as it is compiled: its declared outputs and no more."""
    return ast.unparse(syntax.tree(kernel))
