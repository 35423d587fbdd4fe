"""How triangles and rays lie in memory: the thesis's records, or just what a kernel needs.

``shared`` is the TRIANGLE of 64 bytes and the RAY of 36 of Blecha 2007, section 4.5 (in
float32), whatever the kernel reads of them; ``own`` holds the fields that the kernel reads, and
``padded`` the same in rows of 16 bytes, as Havel 2008 keeps them (section 4.2.5): a vector begins
a row, a number fills a hole.
"""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled import preparation, syntax
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import TMAX, Kernel
from rtbench.kernels.stored_plane import stored_plane

LAYOUTS = ("shared", "own", "padded")
ROW = 16  # bytes; what SSE loads at once
# In which arithmetic what is stored is prepared: the kernel's own, or double and then rounded.
PREPARED = ("own", "double")
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
def record_types(
    kernel: Kernel, layout: str, precision: str, keeps: tuple[str, ...] = ()
) -> tuple[np.dtype, np.dtype]:
    """Return the dtypes of a triangle and of a ray as this kernel finds them in memory.

    A ray has a tmax where the kernel takes one; ``keeps`` are fields that a loop reads itself.

    Raises
    ------
    RtbenchError
        For an unknown layout or precision, and for a field that nothing provides.
    """
    if layout not in LAYOUTS:
        raise RtbenchError(unknown("layout", layout, LAYOUTS))
    check_precision(precision)
    none = np.empty((0, 3), dtype=DATA_TYPE[precision])
    columns = _triangle_columns(kernel, layout, precision, (none, none, none))
    rays = _ray_columns(precision, none, none, None, None)
    triangle_fields, ray_fields = syntax.fields(kernel)
    ray_fields = (*ray_fields, *keeps, *([TMAX] if kernel.takes_tmax else []))
    if layout == "shared":
        triangle_fields = TRIANGLE + tuple(f for f in triangle_fields if f not in TRIANGLE)
        ray_fields = RAY + tuple(f for f in ray_fields if f not in RAY)
    triangle = _record(kernel, "tri", triangle_fields, columns)
    return (
        _in_rows(triangle) if layout == "padded" else triangle,
        _record(kernel, "ray", ray_fields, rays),
    )


def _record(kernel: Kernel, what: str, wanted: tuple, columns: dict) -> np.dtype:
    order = [name for name in columns if name in wanted]
    for name in wanted:
        if name not in columns:
            raise RtbenchError(
                f"kernel {kernel.name!r} reads {what}.{name}: {unknown('field', name, columns)}"
            )
    return np.dtype(
        [(name, columns[name].dtype, columns[name].shape[1:]) for name in order], align=True
    )


def _in_rows(packed: np.dtype) -> np.dtype:
    """Return a record's fields in rows of 16 bytes: vectors begin one, numbers fill the holes."""
    offsets: dict[str, int] = {}
    end, holes = 0, []
    for name in sorted(packed.names, key=lambda name: not packed[name].shape):  # vectors first
        size = packed[name].itemsize
        place = next((i for i, (_, room) in enumerate(holes) if room >= size), None)
        if packed[name].shape or place is None:
            offsets[name] = end
            end += -(-size // ROW) * ROW
            holes.append((offsets[name] + size, end - offsets[name] - size))
        else:
            offset, room = holes[place]
            offsets[name] = offset
            holes[place] = (offset + size, room - size)
    names = sorted(packed.names, key=offsets.get)  # a file of records wants them in this order
    return np.dtype(
        {
            "names": names,
            "formats": [packed[name] for name in names],
            "offsets": [offsets[name] for name in names],
            "itemsize": end,
        },
        align=True,
    )


def bytes_per_triangle(kernel: Kernel, layout: str = "own", precision: str = "float32") -> int:
    """Return the bytes of the fields that a kernel reads of a triangle: packed, or padded."""
    return record_types(kernel, layout, precision)[0].itemsize


def fill(
    kernel: Kernel,
    layout: str,
    precision: str,
    vertices: tuple[np.ndarray, np.ndarray, np.ndarray],
    origins: np.ndarray,
    directions: np.ndarray,
    ends: np.ndarray | None = None,
    tmax: float | np.ndarray | None = None,
    prepared: str = "own",
    keeps: tuple[str, ...] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Put triangles and rays into the records that a kernel reads.

    Parameters
    ----------
    kernel, layout, precision
        Which records: see :func:`record_types`.
    vertices : three (T, 3) arrays
        v0, v1, v2; rounded to the precision of the data first.
    origins, directions : (N, 3) arrays
        Likewise; directions as given, of any length.
    ends : (N, 3) array, optional
        A second point of each ray; origin + direction in the kernel's precision if not given.
    tmax : float or (N,) array, optional
        How far a ray reaches, in units of its direction: kept for kernels that take it, and for
        every kernel if given. Infinity if not given.
    prepared : str
        In which arithmetic ``prepare`` computes what is stored beside the vertices: ``own``, that
        of the kernel, or ``double``, rounded to the kernel's afterwards.
    keeps : tuple of str
        Fields that a ray has also where the kernel does not read them.

    Returns
    -------
    triangles : (T,) structured array
    rays : (N,) structured array
    """
    if prepared not in PREPARED:
        raise RtbenchError(unknown("preparation", prepared, PREPARED))
    keeps = keeps if tmax is None else (*keeps, TMAX)
    triangle, ray = record_types(kernel, layout, precision, keeps)
    data = DATA_TYPE[precision]
    corners = tuple(np.asarray(v, dtype=data) for v in vertices)
    columns = _triangle_columns(kernel, layout, precision, corners, prepared)
    rays = _ray_columns(precision, origins, directions, ends, tmax)
    return _records(triangle, columns), _records(ray, rays)


def arithmetics(precision: str, prepared: str = "own") -> tuple[type, type, type]:
    """Return the types of vertices, of what is computed of them and of what of it is stored."""
    real = REAL_TYPE[precision]
    return DATA_TYPE[precision], np.float64 if prepared == "double" else real, real


def _records(dtype: np.dtype, columns: dict[str, np.ndarray]) -> np.ndarray:
    records = np.zeros(len(next(iter(columns.values()))), dtype=dtype)
    for name in dtype.names:
        records[name] = columns[name]
    return records


def _triangle_columns(kernel, layout, precision, corners, prepared="own"):
    columns = dict(zip(preparation.VERTICES, corners, strict=True))
    made = [(kernel.prepare, prepared)] if kernel.prepare is not None else []
    if layout == "shared" and kernel.prepare is not stored_plane:
        made.insert(0, (stored_plane, "own"))
    for function, how in made:
        stored = preparation.prepared(function, corners, *arithmetics(precision, how))
        columns |= {name: stored[name] for name in stored.dtype.names}
    return columns


def _ray_columns(precision, origins, directions, ends, tmax) -> dict[str, np.ndarray]:
    data, real = DATA_TYPE[precision], REAL_TYPE[precision]
    orig, direction = np.asarray(origins, dtype=data), np.asarray(directions, dtype=data)
    if ends is None:
        end = orig.astype(real) + direction.astype(real)
    else:
        end = np.asarray(ends, dtype=data).astype(real)
    limit = np.empty(len(orig), dtype=real)
    limit[:] = np.inf if tmax is None else tmax
    return {"orig": orig, "end": end, "dir": direction, TMAX: limit}
