"""Triangle meshes, and how they are read from files of any format that trimesh reads.

Vertices are shared: whatever is done to a mesh is done to its vertices, so that triangles that met
in an edge before meet in it afterwards, bit for bit.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError, unknown

MODELS = "RTBENCH_MODELS"  # names a folder of mesh files
MEMORY_PER_BYTE = 20  # of a file while it is read: 7 to 18 for a dragon in six formats
MEMINFO = Path("/proc/meminfo")


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles that share their vertices.

    Attributes
    ----------
    name : str
    vertices : (V, 3) float64 array
        Finite.
    faces : (M, 3) int64 array
        Indices of vertices; M at least 1.
    centre : (3,) float64 array
        Where it lies: inside it, if it was generated; else the middle of its bounding box.
    dropped : int
        How many triangles of its file were left out.
    remark : str
        Why these were left out, in one line; empty if none was.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    centre: np.ndarray
    dropped: int = 0
    remark: str = ""

    @cached_property
    def triangles(self) -> np.ndarray:
        """The vertices of each triangle, (M, 3, 3) float64."""
        return self.vertices[self.faces]

    @cached_property
    def degenerate(self) -> int:
        """How many triangles have no area: decided exactly, as `without_area` does."""
        return int(np.count_nonzero(without_area(self.triangles)))

    @cached_property
    def open_edges(self) -> int:
        """How many directed edges (a, b) are there twice, or without their opposite (b, a)."""
        starts, ends = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        count = np.int64(len(self.vertices))
        there = np.sort(starts * count + ends)
        back = np.sort(ends * count + starts)
        twice = np.zeros(len(there), bool)
        twice[1:] |= there[1:] == there[:-1]
        twice[:-1] |= there[1:] == there[:-1]
        return int(np.count_nonzero(twice | ~np.isin(there, back)))

    @property
    def closed(self) -> bool:
        """Whether each directed edge is there once, and its opposite once."""
        return self.open_edges == 0

    def moved(self, offset: tuple[float, float, float]) -> Mesh:
        """Return it moved, in float64."""
        shift = np.asarray(offset, dtype=np.float64)
        return replace(self, vertices=self.vertices + shift, centre=self.centre + shift)

    def scaled(self, factor: float) -> Mesh:
        """Return it made larger by a factor above 0, about (0, 0, 0)."""
        return replace(self, vertices=self.vertices * factor, centre=self.centre * factor)

    def rounded(self, data: type) -> Mesh:
        """Return it with coordinates that a numpy float type can hold."""
        vertices, centre = (a.astype(data).astype(float) for a in (self.vertices, self.centre))
        return replace(self, vertices=vertices, centre=centre)


def load_mesh(
    path: str | os.PathLike, drop_invalid: bool = False, drop_degenerate: bool = False
) -> Mesh:
    """Read the triangles of a mesh file.

    Parameters
    ----------
    path : path
        PLY, STL, OBJ, OFF, glTF or what else trimesh reads; larger polygons are cut.
    drop_invalid : bool
        Leave out triangles that have a vertex which is not finite or not there, rather than refuse
        the file.
    drop_degenerate : bool
        Leave out triangles that have no area.

    Returns
    -------
    Mesh
        Vertices and triangles in the file's order; none is merged or turned, or left out unasked.

    Raises
    ------
    RtbenchError
        In one line: a file that is missing, empty, cut off, none of a mesh or too large for the
        memory; no triangles; coordinates that are no finite numbers and triangles that name
        vertices which are not there, unless dropped.
    """
    path = Path(path)
    found = _read(path)
    vertices = np.array(getattr(found, "vertices", np.empty((0, 3))), dtype=np.float64)
    faces = np.array(getattr(found, "faces", np.empty((0, 3))), dtype=np.int64)
    if not len(faces):
        raise RtbenchError(f"mesh {str(path)!r} has no triangles (or it is cut off)")
    said = _promised(found)
    if said is not None and said > len(faces):
        raise RtbenchError(
            f"mesh {str(path)!r} is cut off: {len(faces)} of the {said} faces that it promises"
        )
    finite = np.isfinite(vertices).all(axis=1)
    absent = ((faces < 0) | (faces >= len(vertices))).any(axis=1)
    infinite = np.zeros(len(faces), bool)
    infinite[~absent] = ~finite[faces[~absent]].all(axis=1)
    if not drop_invalid:
        _refuse(path, vertices, faces, absent, infinite)
    flat = np.zeros(len(faces), bool)
    if drop_degenerate:
        sound = ~(absent | infinite)
        flat[sound] = without_area(vertices[faces[sound]])
    left_out = absent | infinite | flat
    remark = ""
    if left_out.any():
        reasons = [(absent, "vertices that are not there"), (infinite, "vertices not finite")]
        told = [
            f"{np.count_nonzero(which)} with {why}, the first triangle {np.flatnonzero(which)[0]}"
            for which, why in [*reasons, (flat, "no area")]
            if which.any()
        ]
        count = f"{np.count_nonzero(left_out)} of {len(faces)} triangles dropped"
        remark = f"mesh {str(path)!r}: {count}: {'; '.join(told)}"
        faces = faces[~left_out]
    if not len(faces):
        raise RtbenchError(f"{remark}; none is left")
    # Numbers of the vertices that stay; whoever named another has been dropped.
    faces = (np.cumsum(finite) - 1)[faces]
    vertices = vertices[finite]
    centre = vertices.min(axis=0) / 2 + vertices.max(axis=0) / 2
    return Mesh(path.stem, vertices, faces, centre, int(np.count_nonzero(left_out)), remark)


def _refuse(
    path: Path, vertices: np.ndarray, faces: np.ndarray, absent: np.ndarray, infinite: np.ndarray
) -> None:
    """Say in one line what is invalid, if anything is."""
    if absent.any():
        named = faces[(faces < 0) | (faces >= len(vertices))][0]
        raise RtbenchError(
            f"mesh {str(path)!r}: {np.count_nonzero(absent)} of {len(faces)} triangles name "
            f"vertices that are not there, the first vertex {named} (allowed: 0 to "
            f"{len(vertices) - 1}) in triangle {np.flatnonzero(absent)[0]}; --drop-invalid leaves "
            "such triangles out"
        )
    strange = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(strange):
        place = ", ".join(f"{x:g}" for x in vertices[strange[0]])
        used = np.flatnonzero(infinite)
        by = f"the first triangle {used[0]}" if len(used) else "so no triangle"
        raise RtbenchError(
            f"mesh {str(path)!r}: {len(strange)} of {len(vertices)} vertices are not finite, the "
            f"first vertex {strange[0]} ({place}), used by {len(used)} of {len(faces)} triangles, "
            f"{by}; --drop-invalid leaves them out"
        )


def without_area(triangles: np.ndarray) -> np.ndarray:
    """Tell which triangles have no area, exactly: equal corners, or all three on a line.

    A component of the normal that floats find clearly not 0 settles it; the others are computed
    in whole numbers.

    Parameters
    ----------
    triangles : (M, 3, 3) array
        Finite coordinates.

    Returns
    -------
    (M,) bool array
    """
    corners = np.asarray(triangles, dtype=np.float64)
    if not len(corners):
        return np.zeros(0, bool)
    _, power = np.frexp(np.abs(corners).max())
    corners = np.ldexp(corners, -power)  # no product overflows; whatever underflows is in doubt
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # Two products of three roundings each and their difference: 8 units of 2^-53 |e| |f|.
    bound = 2.0**-49 * np.abs(e).max(axis=1) * np.abs(f).max(axis=1) + 2.0**-1000
    found = (np.abs(np.cross(e, f)) <= bound[:, None]).all(axis=1)
    doubtful = np.flatnonzero(found)
    if len(doubtful):
        part, exponent = np.frexp(np.asarray(triangles, dtype=np.float64)[doubtful])
        exponent = np.where(part == 0, exponent.max(), exponent)
        whole = (part * 2.0**53).astype(np.int64).astype(object)
        whole = whole * 2 ** (exponent - exponent.min()).astype(object)
        e, f = whole[:, 1] - whole[:, 0], whole[:, 2] - whole[:, 0]
        pairs = ((1, 2), (2, 0), (0, 1))
        parts = [e[:, i] * f[:, j] == e[:, j] * f[:, i] for i, j in pairs]
        found[doubtful] = np.all(np.array(parts, dtype=bool), axis=0)
    return found


def _read(path: Path) -> object:
    """Return what trimesh makes of a file."""
    try:
        if not path.is_file():
            raise FileNotFoundError(2, "is a folder" if path.is_dir() else "no such file")
        size = path.stat().st_size
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as problem:
        raise RtbenchError(f"mesh {str(path)!r} cannot be read: {problem.strerror}") from None
    if empty:
        raise RtbenchError(f"mesh {str(path)!r} is empty")
    there = available_memory()
    if there is not None and size * MEMORY_PER_BYTE > there:
        raise RtbenchError(
            f"mesh {str(path)!r} is too large: {size / 1e6:.1f} MB take up to "
            f"{size * MEMORY_PER_BYTE / 1e6:.0f} MB of memory to read, {there / 1e6:.0f} MB are "
            "free"
        )
    import trimesh  # here: it costs half a second

    form = path.suffix.lower().removeprefix(".")
    allowed = sorted(trimesh.available_formats())
    if form not in allowed:
        raise RtbenchError(f"mesh {str(path)!r}: {unknown('mesh format', form, allowed)}")
    try:
        return trimesh.load_mesh(path, process=False)
    except MemoryError:
        raise RtbenchError(
            f"mesh {str(path)!r} asks for more memory than there is (or it is damaged)"
        ) from None
    except Exception as problem:  # whatever its readers run into
        reason = " ".join(str(problem).split()) or type(problem).__name__
        raise RtbenchError(f"mesh {str(path)!r} is damaged or no {form} file: {reason}") from None


def available_memory() -> int | None:
    """Return how many bytes can be had without swapping; None where Linux does not say."""
    try:
        found = re.search(r"^MemAvailable:\s+(\d+) kB", MEMINFO.read_text(), re.MULTILINE)
    except OSError:
        return None
    return int(found.group(1)) * 1024 if found else None


def _promised(found: object) -> int | None:
    """Return how many faces a PLY file's head says it has: of one in words trimesh reads fewer."""
    head = getattr(found, "metadata", {}).get("_ply_raw") or {}
    return (head.get("face") or {}).get("length")


def models(folder: str | os.PathLike | None = None) -> dict[str, Path]:
    """Return the mesh files of a folder by name; none where no folder is named or it is not there.

    Parameters
    ----------
    folder : path, optional
        What RTBENCH_MODELS names if not given.
    """
    told = folder or os.environ.get(MODELS)
    return {path.stem: path for path in sorted(Path(told).glob("*.ply"))} if told else {}
