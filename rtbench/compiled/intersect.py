"""Rays against triangles, pair by pair, from Python."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtbench.compiled.instantiate import Instance
from rtbench.compiled.layout import DATA_TYPE, REAL_TYPE, check_precision, fill
from rtbench.compiled.loops import loop
from rtbench.errors import RtbenchError
from rtbench.kernels import registry
from rtbench.kernels.contract import HIT, Kernel


@dataclass(frozen=True)
class Hits:
    """What a set of rays met; every array is of shape (N,).

    Attributes
    ----------
    hit : bool array
    outcome : int32 array or None
        The kernel's own code, 0 for a hit; None from a tree.
    t, u, v : float arrays
        In the precision of the arithmetic; t in units of the direction, u the weight of v1 and
        v of v2. NaN on a miss, and where the kernel does not compute them.
    triangle : int64 array or None
        The triangle that was hit, -1 for none; None where each ray had its own.
    """

    hit: np.ndarray
    outcome: np.ndarray | None
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray | None = None


def intersect(
    kernel: str | Kernel,
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    precision: str = "float32",
    tmin: float = 0.0,
    tmax: float = np.inf,
) -> Hits:
    """Test each ray against its own triangle.

    Parameters
    ----------
    kernel : str
        A name from :func:`list_kernels`, or ``FILE.py:NAME``.
    triangles : (N, 3, 3) array of any float dtype
        Vertices v0, v1, v2; rounded to the precision of the kernel's data first. N may be 0.
    origins, directions : (N, 3) arrays of any float dtype
        Directions are used as given, of any length; a segment kernel's (and Chirkov's) end
        point is origin + direction in the kernel's precision.
    precision : str
        float32, float64 or mixed (float32 data, float64 arithmetic).
    tmin, tmax : float
        What counts as a hit, both ends open, in units of the direction.

    Returns
    -------
    Hits
        A line kernel's hit outside (tmin, tmax) has hit False, outcome 0, and t, u, v NaN; a
        kernel that refuses by distance itself gives its own code then. t, u, v are NaN too where
        the kernel has none; one that tests a point takes ``origins`` for it. A kernel as printed
        promises nothing about NaN in its input.

    Raises
    ------
    ValueError
        For wrong shapes, an unknown kernel (with the nearest name) or precision; for a tmin other
        than 0 where the kernel does not say where it hits.
    """
    try:
        chosen = kernel if isinstance(kernel, Kernel) else registry.find(str(kernel))
        check_precision(str(precision))
    except RtbenchError as problem:
        raise ValueError(str(problem)) from None
    triangles, origins, directions = (
        checked(name, array, shape)
        for name, array, shape in (
            ("triangles", triangles, (3, 3)),
            ("origins", origins, (3,)),
            ("directions", directions, (3,)),
        )
    )
    if not len(triangles) == len(origins) == len(directions):
        raise ValueError(
            f"{len(triangles)} triangles, {len(origins)} origins and {len(directions)} directions: "
            "pair by pair needs as many of each"
        )
    data = DATA_TYPE[precision]
    try:
        with np.errstate(all="ignore"):  # what is no number, or too large, is the kernel's
            vertices = tuple(np.ascontiguousarray(triangles[:, i], dtype=data) for i in range(3))
            limit = tmax if chosen.takes_tmax else None
            records = fill(chosen, "own", precision, vertices, origins, directions, tmax=limit)
        compiled = loop(chosen, precision, "own")
    except RtbenchError as problem:
        raise ValueError(str(problem)) from None
    outcome, *values = run_once(compiled, chosen, precision, *records)
    found = dict(zip(chosen.outputs, values, strict=False))
    inside = outcome == HIT
    if chosen.domain is not None and "t" in found:
        # In float64, or numpy would round the limits to the precision of t.
        inside &= (found["t"] > np.float64(tmin)) & (found["t"] < np.float64(tmax))
    elif chosen.domain is not None and tmin != 0.0:
        raise ValueError(f"kernel {chosen.name} returns no t: a tmin of {tmin} cannot be kept")
    nothing = np.full(len(outcome), np.nan, dtype=REAL_TYPE[precision])
    for each in values:
        each[~inside] = np.nan
    return Hits(inside, outcome, *(found.get(name, nothing).copy() for name in ("t", "u", "v")))


def checked(name: str, array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array (N, *shape) of numbers; ValueError, naming it, for any other."""
    array = np.asarray(array)
    wanted = f"(N, {', '.join(map(str, shape))})"
    if array.shape[1:] != shape or array.ndim != len(shape) + 1:
        raise ValueError(f"{name} have shape {array.shape}: {wanted} is wanted")
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} have dtype {array.dtype}: numbers are wanted")
    return array


def run_once(
    instance: Instance, kernel: Kernel, precision: str, triangles: np.ndarray, rays: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Test every pair once and return outcome (N,) int32 and three (N,) arrays.

    Those hold the kernel's outputs in their order, NaN where it has fewer.

    Parameters
    ----------
    instance : Instance
        A loop over the kernel, from :func:`rtbench.compiled.loops.loop`.
    kernel, precision
        What it was made of.
    triangles, rays : (T,) and (N,) structured arrays
        As :func:`rtbench.compiled.layout.fill` makes them; T = N but for loops of kind nearest.
    """
    n = len(rays)
    outcome = np.full(n, -1, dtype=np.int32)
    t, u, v = (np.full(n, np.nan, dtype=REAL_TYPE[precision]) for _ in range(3))
    pairs, once = np.arange(n, dtype=np.uint64), np.zeros(1, dtype=np.uint64)
    instance.call(triangles, rays, pairs, once, outcome, t, u, v)
    return outcome, t, u, v
