"""Triangle meshes: read from files of any format that trimesh reads, or generated, closed ones.

Vertices are shared: whatever is done to a mesh is done to its vertices, so that triangles that met
in an edge before meet in it afterwards, bit for bit.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError, unknown

MODELS = "RTBENCH_MODELS"  # names a folder of mesh files


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
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    centre: np.ndarray

    @cached_property
    def triangles(self) -> np.ndarray:
        """The vertices of each triangle, (M, 3, 3) float64."""
        return self.vertices[self.faces]

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


def load_mesh(path: str | os.PathLike) -> Mesh:
    """Read the triangles of a mesh file.

    Parameters
    ----------
    path : path
        PLY, STL, OBJ, OFF, glTF or what else trimesh reads; larger polygons are cut.

    Returns
    -------
    Mesh
        Vertices and triangles in the file's order; none is merged, turned or left out.

    Raises
    ------
    RtbenchError
        In one line: a file that is missing, empty, cut off or none of a mesh; no triangles;
        coordinates that are no finite numbers; triangles that name vertices which are not there.
    """
    path = Path(path)
    found = _read(path)
    vertices = np.array(getattr(found, "vertices", np.empty((0, 3))), dtype=np.float64)
    faces = np.array(getattr(found, "faces", np.empty((0, 3))), dtype=np.int64)
    if not len(faces):
        raise RtbenchError(f"mesh {str(path)!r} has no triangles (or it is cut off)")
    strange = (faces < 0) | (faces >= len(vertices))
    if strange.any():
        raise RtbenchError(
            f"mesh {str(path)!r}: {np.count_nonzero(strange.any(axis=1))} of {len(faces)} "
            f"triangles name vertices that are not there, the first vertex {faces[strange][0]} "
            f"(allowed: 0 to {len(vertices) - 1})"
        )
    infinite = ~np.isfinite(vertices).all(axis=1)
    if infinite.any():
        raise RtbenchError(
            f"mesh {str(path)!r}: {np.count_nonzero(infinite)} of {len(vertices)} vertices are not "
            f"finite, the first vertex {np.flatnonzero(infinite)[0]}"
        )
    said = _promised(found)
    if said is not None and said > len(faces):
        raise RtbenchError(
            f"mesh {str(path)!r} is cut off: {len(faces)} of the {said} faces that it promises"
        )
    return Mesh(path.stem, vertices, faces, (vertices.min(axis=0) + vertices.max(axis=0)) / 2)


def _read(path: Path) -> object:
    """Return what trimesh makes of a file."""
    try:
        if not path.is_file():
            raise FileNotFoundError(2, "is a folder" if path.is_dir() else "no such file")
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as problem:
        raise RtbenchError(f"mesh {str(path)!r} cannot be read: {problem.strerror}") from None
    if empty:
        raise RtbenchError(f"mesh {str(path)!r} is empty")
    import trimesh  # here: it costs half a second

    form = path.suffix.lower().removeprefix(".")
    allowed = sorted(trimesh.available_formats())
    if form not in allowed:
        raise RtbenchError(f"mesh {str(path)!r}: {unknown('mesh format', form, allowed)}")
    try:
        return trimesh.load_mesh(path, process=False)
    except Exception as problem:  # whatever its readers run into
        reason = " ".join(str(problem).split()) or type(problem).__name__
        raise RtbenchError(f"mesh {str(path)!r} is damaged or no {form} file: {reason}") from None


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


def tetrahedron() -> Mesh:
    """Return a regular tetrahedron about (0, 0, 0), its vertices 1 away; outside is its front."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    return _about_zero("tetrahedron", corners, faces)


def cube() -> Mesh:
    """Return the cube from -1 to 1, two triangles a side; its faces lie in planes of the axes."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[q[i] for i in three] for q in quads for three in ((0, 1, 2), (0, 2, 3))]
    return _about_zero("cube", corners, np.array(faces))


def icosphere(subdivisions: int = 2) -> Mesh:
    """Return a sphere of radius 1 of 20 * 4^subdivisions triangles, an icosahedron subdivided.

    Raises
    ------
    RtbenchError
        For subdivisions outside 0 to 8.
    """
    if not 0 <= subdivisions <= 8:
        raise RtbenchError(f"subdivisions {subdivisions} is not allowed (allowed: 0 to 8)")
    golden = (1 + np.sqrt(5)) / 2
    vertices = np.array(
        [np.roll([0, a, b], k) for k in range(3) for a in (-1, 1) for b in (-golden, golden)]
    )
    # A face of the icosahedron is three vertices that are all 2 apart.
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 2.1
    faces = np.array(
        [
            [i, j, k]
            for i in range(12)
            for j in range(i + 1, 12)
            for k in range(j + 1, 12)
            if near[i, j] and near[j, k] and near[i, k]
        ]
    )
    inward = np.linalg.det(vertices[faces]) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(subdivisions):
        vertices, faces = _subdivided(vertices, faces)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return _about_zero(f"icosphere {subdivisions}", vertices, faces)


def _subdivided(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each triangle cut into four at the middles of its edges, which neighbours share."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, place = np.unique(ends, axis=0, return_inverse=True)
    middle = len(vertices) + place.reshape(-1, 3)  # of each face: on edges 01, 12, 20
    (a, b, c), (ab, bc, ca) = faces.T, middle.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    new = np.concatenate([np.stack(part, axis=1) for part in parts])
    return np.concatenate([vertices, vertices[edges].mean(axis=1)]), new


def random_sphere(rings: int = 16, radii: tuple[float, float] = (1.0, 6.0), seed: int = 1) -> Mesh:
    """Return a sphere of latitude and longitude whose vertices lie at random distances.

    Parameters
    ----------
    rings : int
        Latitudes, the poles being two of them, and longitudes: 3 or more.
    radii : (float, float)
        Least and greatest distance of a vertex from (0, 0, 0).
    seed : int

    Raises
    ------
    RtbenchError
        For fewer rings.

    Source
    ------
    pbrt-v4, shapes_test.cpp, Triangle.Watertight (16 x 16, radii 1 to 6). A pole is one vertex
    here.
    """
    if rings < 3:
        raise RtbenchError(f"rings {rings} is not allowed (allowed: 3 or more)")
    theta = np.pi * np.arange(1, rings - 1) / (rings - 1)
    phi = 2 * np.pi * np.arange(rings) / rings
    x, y = (np.outer(np.sin(theta), f(phi)).ravel() for f in (np.cos, np.sin))
    unit = np.stack([x, y, np.repeat(np.cos(theta), rings)], axis=1)
    unit = np.concatenate([unit, [[0, 0, 1], [0, 0, -1]]])
    radius = np.random.default_rng(seed).uniform(*radii, len(unit))
    north, south = len(unit) - 2, len(unit) - 1
    faces = []
    for k in range(rings):
        after = (k + 1) % rings
        faces.append([north, k, after])
        for row in range(0, (rings - 3) * rings, rings):
            below = row + rings
            faces += [[row + k, below + k, below + after], [row + k, below + after, row + after]]
        last = (rings - 3) * rings
        faces.append([south, last + after, last + k])
    return _about_zero(f"random sphere {rings}", unit * radius[:, None], np.array(faces))


def _about_zero(name: str, vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    return Mesh(name, vertices, faces.astype(np.int64), np.zeros(3))
