"""What lanes are filled with: triangles and rays in blocks of W, in arrays, or as they are.

Havel 2008, sections 4.2.2 (packets), 4.2.3 (layouts) and 4.2.5 (axes).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from rtbench.compiled import lanes
from rtbench.compiled.layout import fill
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import Kernel

WIDTHS = (4, 8, 16)
FORMS = {
    "pairs": "W pairs of a triangle and a ray at a time",
    "rays": "W rays against one triangle",
    "triangles": "W triangles against one ray",
}
PACKETS = {"general": (), "common": ("orig",), "parallel": ("dir",)}  # what all lanes share
AXES = ("stored", "table", "fixed")
RECIPROCALS = ("division", "estimate")
PRECISIONS = ("float32", "float64")
AXIS, INDEX = "axis", "index"


@dataclass(frozen=True)
class Packing:
    """How a kernel is taken in lanes.

    Attributes
    ----------
    form : str
        One of FORMS.
    width : int
        W, one of WIDTHS.
    packet : str
        What the rays of a packet share: nothing (``general``), their origin (``common``) or their
        direction (``parallel``); form rays.
    exit : str
        ``any``: packets leave after the kernel's first test unless some lane passed
        it; ``none``: they never do.
    layout : str
        Of the side that lies in lanes: ``blocks`` of W, ``soa`` (an array a number) or ``aos``
        (an array of records, from which lanes are gathered); packets of rays: general ones.
    axes : str
        How the axes of projection are found: ``stored`` indices, a ``table`` from one stored
        number, or ``fixed`` in the code, once for each axis, the triangles sorted by it.
    reciprocal : str
        ``division``, or ``estimate``: the processor's estimate and one Newton step.

    Raises
    ------
    RtbenchError
        For values and combinations that are not allowed.
    """

    form: str = "rays"
    width: int = 16
    packet: str = "general"
    exit: str = "none"
    layout: str = "blocks"
    axes: str = "stored"
    reciprocal: str = "division"

    def __post_init__(self) -> None:
        for what, allowed in (
            ("form", FORMS),
            ("packet", PACKETS),
            ("exit", lanes.EXITS),
            ("layout", lanes.LAYOUTS),
            ("axes", AXES),
            ("reciprocal", RECIPROCALS),
        ):
            if getattr(self, what) not in allowed:
                raise RtbenchError(unknown(what, str(getattr(self, what)), allowed))
        if self.width not in WIDTHS:
            raise RtbenchError(
                f"packets of {self.width} are not allowed (allowed: {', '.join(map(str, WIDTHS))})"
            )
        if self.packet != "general" and (self.form != "rays" or self.layout != "blocks"):
            raise RtbenchError(
                f"{self.packet} packets are of rays in blocks: form {self.form!r} and layout "
                f"{self.layout!r} do not go with them"
            )


def check_precision(precision: str, reciprocal: str = "division") -> None:
    """Raise RtbenchError for a precision that lanes are not made in."""
    if precision not in PRECISIONS:
        raise RtbenchError(unknown("precision of packets", precision, PRECISIONS))
    if reciprocal == "estimate" and precision != "float32":
        raise RtbenchError(f"reciprocal 'estimate' is of float32; {precision} divides")


@functools.cache
def axis_fields(kernel: Kernel) -> dict[str, tuple[int, int, int]]:
    """Return the fields of a triangle that choose axes, and what they hold of the three planes.

    Returns
    -------
    dict
        Of each field its value where the normal is greatest along x, y and z; empty where a
        kernel does not project.
    """
    corners = np.array([np.roll(np.eye(3) * [0, 1, 1], turn, axis=1) for turn in range(3)])
    records = _records(kernel, "float32", corners)
    return {
        name: tuple(records[name].tolist())
        for name in records.dtype.names
        if records.dtype[name].kind == "u"
    }


def axis_of(kernel: Kernel, triangles: np.ndarray) -> np.ndarray:
    """Return of each record the axis that its kernel projects along: 0, 1, 2; 0 if it does not."""
    found = np.zeros(len(triangles), np.int32)
    for axis in range(3):
        same = [triangles[name] == values[axis] for name, values in axis_fields(kernel).items()]
        if same:
            found[np.all(same, axis=0)] = axis
    return found


def triangle_type(kernel: Kernel, precision: str, packing: Packing, count: int) -> np.dtype:
    """Return the dtype of what a loop in lanes reads of triangles; count: how many with soa."""
    one = np.zeros((packing.width, 3, 3))
    corners = one if packing.layout != "soa" else np.zeros((count, 3, 3))
    records = _with_axis(_records(kernel, precision, corners))
    return _laid_out(records, packing, packing.form != "rays").dtype


def ray_type(kernel: Kernel, precision: str, packing: Packing, count: int) -> np.dtype:
    """Return the dtype of what a loop in lanes reads of rays; count: how many with soa."""
    count = count if packing.layout == "soa" else packing.width
    zeros = np.zeros((count, 3))
    return fill_rays(kernel, precision, packing, zeros, zeros).dtype


def tri_side(kernel: Kernel, packing: Packing, dtype: np.dtype) -> lanes.Side:
    """Return where a triangle's numbers lie, of records as `fill_triangles` makes them."""
    in_lanes = packing.form != "rays"
    names = frozenset(n for n in dtype.names if dtype[n].base.kind != "u" and n != AXIS)
    if not in_lanes:
        return lanes.Side(axes=_axes(kernel, packing, ""))
    start = "[start]" if packing.layout == "soa" else ""
    return lanes.Side(names, packing.layout, dtype.itemsize, _axes(kernel, packing, start))


def ray_side(packing: Packing, dtype: np.dtype) -> lanes.Side:
    """Return where a ray's numbers lie, of records as `fill_rays` makes them."""
    if packing.form == "triangles":
        return lanes.Side()
    names = frozenset(dtype.names) - set(PACKETS[packing.packet])
    return lanes.Side(names, packing.layout, dtype.itemsize)


def _axes(kernel: Kernel, packing: Packing, start: str) -> tuple[tuple[str, str], ...]:
    names = axis_fields(kernel)
    if packing.axes == "table":
        return tuple((name, f"TABLE_{name.upper()}[tri.{AXIS}{start}]") for name in names)
    if packing.axes == "fixed":
        return tuple((name, f"FIXED_{name.upper()}") for name in names)
    return tuple((name, f"tri.{name}{start}") for name in names)


def fill_triangles(
    kernel: Kernel,
    precision: str,
    packing: Packing,
    corners: np.ndarray,
    prepared: str = "own",
) -> np.ndarray:
    """Return triangles as a loop in lanes reads them.

    Parameters
    ----------
    kernel, precision, packing
    corners : (T, 3, 3) array
        Vertices. In form pairs T is a multiple of W, and W neighbours share the axis that the
        kernel projects along. Elsewhere triangles are sorted by that axis where the packing needs
        it, and blocks filled up with triangles that nothing hits.
    prepared : str
        As for `rtbench.compiled.layout.fill`.

    Returns
    -------
    structured array
        One record a block (blocks), one in all (soa), or one a triangle (aos, and form rays).
        ``index`` holds places in ``corners``, ``axis`` the axis of projection.

    Raises
    ------
    RtbenchError
        If pairs are no whole blocks, or a block has two axes.
    """
    records = _records(kernel, precision, corners, prepared)
    axis, order = axis_of(kernel, records), np.arange(len(corners))
    width = packing.width
    if packing.form == "pairs":
        if len(corners) % width or (axis.reshape(-1, width) != axis[::width, None]).any():
            raise RtbenchError(
                f"pairs must come in whole blocks of {width} that share an axis of projection: "
                f"{len(corners)} pairs do not"
            )
    elif is_sorted(kernel, packing) or packing.form == "triangles":
        parts = [np.flatnonzero(axis == each) for each in range(3)]
        if packing.form == "triangles":
            parts = [np.pad(part, (0, -len(part) % width), constant_values=-1) for part in parts]
        axis = np.repeat(np.arange(3), [len(part) for part in parts])
        order = np.concatenate(parts)
        vertices = np.where((order < 0)[:, None, None], np.nan, corners[order])
        records = _records(kernel, precision, vertices, prepared)
        for name, values in axis_fields(kernel).items():  # also of what fills a block up
            records[name] = np.array(values)[axis]
    return _laid_out(_with_axis(records, axis, order), packing, packing.form != "rays")


def is_sorted(kernel: Kernel, packing: Packing) -> bool:
    """Tell whether triangles are not taken in the order of their indices."""
    return bool(axis_fields(kernel)) and (packing.form == "triangles" or packing.axes == "fixed")


def fill_rays(
    kernel: Kernel,
    precision: str,
    packing: Packing,
    origins: np.ndarray,
    directions: np.ndarray,
    tmax: float = np.inf,
) -> np.ndarray:
    """Return rays as a loop in lanes reads them.

    Parameters
    ----------
    kernel, precision, packing
    origins, directions : (N, 3) arrays
        Ray after ray, packets of W one after the other; N a multiple of W but in form triangles.
        What a packet's rays share is taken from the first.
    tmax : float
        How far rays reach.

    Returns
    -------
    structured array
        One record a packet (blocks), one in all (soa), or one a ray.

    Raises
    ------
    RtbenchError
        If the rays do not make whole packets.
    """
    check_precision(precision)
    if packing.form != "triangles" and len(origins) % packing.width:
        raise RtbenchError(f"{len(origins)} rays do not make whole packets of {packing.width}")
    vertices = [np.ones((1, 3))] * 3
    _, rays = fill(kernel, "own", precision, vertices, origins, directions, tmax=tmax)
    return _laid_out(rays, packing, packing.form != "triangles", PACKETS[packing.packet])


def held(packing: Packing, triangles: np.ndarray, rays: np.ndarray) -> int:
    """Return how many triangles or rays one record holds with layout soa; 0 with the others."""
    dtype = (rays if packing.form == "rays" else triangles).dtype
    return dtype[0].shape[-1] if packing.layout == "soa" else 0


def _records(kernel, precision, corners, prepared="own") -> np.ndarray:
    """Return records of triangles as single rays find them."""
    check_precision(precision)
    vertices = [corners[:, i] for i in range(3)]
    rays = np.ones((len(corners), 3))
    return fill(kernel, "own", precision, vertices, rays, rays, prepared=prepared)[0]


def _with_axis(records: np.ndarray, axis: object = 0, indices: object = 0) -> np.ndarray:
    """Return records with two more fields: the axis and the index."""
    more = [(AXIS, np.int32), (INDEX, np.int32)]
    kinds = [(name, records.dtype[name]) for name in records.dtype.names]
    wider = np.zeros(len(records), np.dtype(kinds + more, align=True))
    for name in records.dtype.names:
        wider[name] = records[name]
    wider[AXIS], wider[INDEX] = axis, indices
    return wider


def _laid_out(
    records: np.ndarray, packing: Packing, in_lanes: bool, shared: tuple[str, ...] = ()
) -> np.ndarray:
    """Return records in the packing's layout, ``shared`` fields and axes once a record."""
    if not in_lanes:
        return records
    width, count = packing.width, len(records)
    alone = {n for n in records.dtype.names if records.dtype[n].base.kind == "u" or n == AXIS}
    alone |= set(shared)
    kinds = []
    for name in records.dtype.names:
        base, shape = records.dtype[name].base, records.dtype[name].shape
        if packing.layout == "aos":
            kinds.append((name, base, shape if shape or name in alone else (1,)))
        elif packing.layout == "soa":
            kinds.append((name, base, (*shape, count)))
        else:
            kinds.append((name, base, shape if name in alone else (*shape, width)))
    dtype = np.dtype(kinds, align=True)
    if packing.layout == "aos":
        return records.view(dtype)  # a number becomes an array of one, that has an address
    made = np.zeros(1 if packing.layout == "soa" else count // width, dtype)
    for name in dtype.names:
        values = records[name]
        if packing.layout == "soa":
            made[name][0] = np.moveaxis(values, 0, -1)
        elif name in alone:
            made[name] = values[::width]
        else:
            rows = values.reshape(-1, width, *values.shape[1:])
            made[name] = np.moveaxis(rows, 1, -1)
    return made
