"""How many bytes a test of a run's cell moves, and how many lie under it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from rtbench.records.run import Run

_SIZE = {"float32": 4, "mixed": 4, "float64": 8}
# Of a pair's bytes the index (8) and the outcome (4) are the same in every precision.
_FIXED = 12
_PARTS = frozenset({"triangles", "hits"})


class Traffic(NamedTuple):
    """Bytes a test, and bytes of all that is touched again and again."""

    bytes: float
    working_set: float


def traffic(run: "Run", row: Mapping) -> Traffic | str:
    """Return what a cell moves.

    Parameters
    ----------
    run : Run
        Its ``workloads`` say ``bytes_per_pair``, or ``rays`` (``packets``) where each goes through
        all triangles of a ``scene``; its ``kernels`` say ``bytes_per_triangle``.
    row : mapping
        A row of the summary.

    Returns
    -------
    Traffic or str
        Or why it cannot be told.
    """
    precision = row.get("precision") or "float32"
    workload = workload_of(run, row)
    triangles = row.get("triangles") or workload.get("triangles")
    if not triangles:
        return "the run does not say over how many triangles"
    if workload.get("rays") or workload.get("packets"):
        # The ray stays in registers; what streams past it is the triangles, one for all lanes.
        each = _of_triangle(run, row["kernel"], precision)
        if each is None:
            return "the run does not say how many bytes it reads of a triangle"
        lanes = row.get("width") or 1
        return Traffic(each / lanes, each * (workload.get("scene") or triangles))
    each = _of_pair(run, workload, precision)
    if each is None:
        each = _of_triangle(run, row["kernel"], precision)
    if each is None:
        return "the run does not say how many bytes a test moves"
    return Traffic(each, each if row.get("order") == "repeat" else each * triangles)


def workload_of(run: "Run", row: Mapping) -> dict:
    """Return the workload that agrees with a cell wherever both say something."""
    for entry in run.info.get("workloads") or []:
        shared = (entry.keys() & row.keys()) - _PARTS
        if all(entry[name] is None or entry[name] == row[name] for name in shared):
            return entry
    return {}


def _of_pair(run: "Run", workload: Mapping, precision: str) -> float | None:
    config = run.info.get("config") or {}
    told = workload.get("bytes_per_pair") or config.get("bytes_per_pair")
    if isinstance(told, dict):
        told = told.get(precision)
        return None if told is None else float(told)
    if not isinstance(told, int | float) or isinstance(told, bool):
        return None
    # One number is that of the run's first precision.
    first = workload.get("precision") or next(iter(config.get("precisions") or [precision]))
    return (told - _FIXED) * _SIZE[precision] / _SIZE.get(first, 4) + _FIXED


def _of_triangle(run: "Run", kernel: str, precision: str) -> float | None:
    facts = ((run.info.get("kernels") or {}).get(kernel) or {}).get(precision) or {}
    packed, padded = (facts.get(f"bytes_per_triangle{what}") for what in ("", "_padded"))
    if padded is not None:  # then both are of this precision
        layout = (run.info.get("config") or {}).get("layout")
        return padded if layout == "padded" or packed is None else packed
    # Recorded for float32.
    return None if packed is None else packed * _SIZE[precision] / 4
