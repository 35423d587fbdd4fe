"""How triangles and rays lie in memory: the thesis's records, or just what a kernel needs.

``shared`` is the TRIANGLE of 64 bytes and the RAY of 36 of Blecha 2007, section 4.5 (in
float32), whatever the kernel reads of them; ``own`` holds the fields that the kernel reads.
"""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled import syntax
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import Kernel
from rtbench.kernels.stored_plane import stored_plane

LAYOUTS = ("shared", "own")
TRIANGLE = ("v0", "v1", "v2", "normal", "d", "i0", "i1", "i2")
RAY = ("orig", "end", "dir")

# Data is what a user hands over; what is computed from it is kept in the arithmetic's precision.
DATA_TYPE = {"float32": np.float32, "float64": np.float64, "mixed": np.float32}
REAL_TYPE = {"float32": np.float32, "float64": np.float64, "mixed": np.float64}
PRECISIONS = tuple(DATA_TYPE)


def check_precision(precision: str) -> None:
    """Raise RtbenchError for a precision that is none of float32, float64 and mixed."""
    if precision not in PRECISIONS:
        raise RtbenchError(unknown("precision", precision, PRECISIONS))


@functools.cache
def record_types(kernel: Kernel, layout: str, precision: str) -> tuple[np.dtype, np.dtype]:
    """Return the dtypes of a triangle and of a ray as this kernel finds them in memory.

    Raises
    ------
    RtbenchError
        For an unknown layout or precision, and for a field that nothing provides.
    """
    if layout not in LAYOUTS:
        raise RtbenchError(unknown("layout", layout, LAYOUTS))
    check_precision(precision)
    one = np.array([[0.25, 0.5, 0.75]], dtype=DATA_TYPE[precision])
    columns = _triangle_columns(kernel, layout, precision, one, one[:, ::-1], one * one)
    rays = _ray_columns(precision, one, one, None)
    triangle_fields, ray_fields = syntax.fields(kernel)
    if layout == "shared":
        triangle_fields = TRIANGLE + tuple(f for f in triangle_fields if f not in TRIANGLE)
        ray_fields = RAY + tuple(f for f in ray_fields if f not in RAY)
    return (
        _record(
            kernel, "tri", [f for f in columns if f in triangle_fields], triangle_fields, columns
        ),
        _record(kernel, "ray", [f for f in rays if f in ray_fields], ray_fields, rays),
    )


def _record(kernel: Kernel, what: str, order: list[str], wanted: tuple, columns: dict) -> np.dtype:
    for name in wanted:
        if name not in columns:
            raise RtbenchError(
                f"kernel {kernel.name!r} reads {what}.{name}: {unknown('field', name, columns)}"
            )
    return np.dtype(
        [(name, columns[name].dtype, columns[name].shape[1:]) for name in order], align=True
    )


def bytes_per_triangle(kernel: Kernel) -> int:
    """Return the bytes of the fields that a kernel reads of a triangle: float32, packed."""
    triangle, _ = record_types(kernel, "own", "float32")
    return sum(triangle.fields[name][0].itemsize for name in triangle.names)


def fill(
    kernel: Kernel,
    layout: str,
    precision: str,
    vertices: tuple[np.ndarray, np.ndarray, np.ndarray],
    origins: np.ndarray,
    directions: np.ndarray,
    ends: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Put triangles and rays into the records that a kernel reads.

    Parameters
    ----------
    kernel, layout, precision
        Which records: see :func:`record_types`.
    vertices : three (N, 3) arrays
        v0, v1, v2; rounded to the precision of the data first.
    origins, directions : (N, 3) arrays
        Likewise; directions as given, of any length.
    ends : (N, 3) array, optional
        A second point of each ray; origin + direction in the kernel's precision if not given.

    Returns
    -------
    triangles, rays : (N,) structured arrays
        What a kernel stores beside the vertices is computed by its ``prepare`` in the
        precision of the arithmetic.
    """
    triangle, ray = record_types(kernel, layout, precision)
    data = DATA_TYPE[precision]
    v0, v1, v2 = (np.asarray(v, dtype=data) for v in vertices)
    columns = _triangle_columns(kernel, layout, precision, v0, v1, v2)
    rays = _ray_columns(precision, origins, directions, ends)
    return _records(triangle, columns), _records(ray, rays)


def _records(dtype: np.dtype, columns: dict[str, np.ndarray]) -> np.ndarray:
    records = np.zeros(len(next(iter(columns.values()))), dtype=dtype)
    for name in dtype.names:
        records[name] = columns[name]
    return records


def _triangle_columns(kernel, layout, precision, v0, v1, v2) -> dict[str, np.ndarray]:
    columns = {"v0": v0, "v1": v1, "v2": v2}
    real = [v.astype(REAL_TYPE[precision]) for v in (v0, v1, v2)]
    if layout == "shared":
        columns |= stored_plane(*real)
    if kernel.prepare is not None and not (layout == "shared" and kernel.prepare is stored_plane):
        columns |= kernel.prepare(*real)
    return columns


def _ray_columns(precision, origins, directions, ends) -> dict[str, np.ndarray]:
    data, real = DATA_TYPE[precision], REAL_TYPE[precision]
    orig, direction = np.asarray(origins, dtype=data), np.asarray(directions, dtype=data)
    if ends is None:
        end = orig.astype(real) + direction.astype(real)
    else:
        end = np.asarray(ends, dtype=data).astype(real)
    return {"orig": orig, "end": end, "dir": direction}
