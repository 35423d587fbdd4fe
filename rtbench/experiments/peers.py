"""What Python users trace rays with today, asked the same questions as the kernels.

A peer that is not installed is named as absent. Adding one is a function in `adapters` and a line
in PEERS.
"""

from __future__ import annotations

import functools
import importlib
import importlib.metadata
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.experiments import adapters

if TYPE_CHECKING:
    from rtbench.accuracy.cases import Cases

ANY_HIT = (1, 2)  # group rules under which somebody must be hit: once at least, an odd number


@dataclass(frozen=True)
class Peer:
    """A library that finds where rays meet triangles.

    Attributes
    ----------
    name : str
    title : str
    package : str
        What pip installs; what else it needs after it.
    modules : tuple of str
        What must be importable.
    precision : str
        float32 or float64: of the data it takes.
    scene : callable
        An adapter: see `rtbench.experiments.adapters`.
    most : int
        More rays or cases than these would take minutes.
    """

    name: str
    title: str
    package: str
    modules: tuple[str, ...]
    precision: str
    scene: Callable
    most: int = 1 << 62

    @property
    def version(self) -> str:
        """Its package and its version."""
        package = self.package.split()[0]
        return f"{package} {importlib.metadata.version(package)}"


PEERS = (
    Peer("embree", "Embree", "embreex", ("embreex",), "float32", adapters.embree),
    Peer(
        *("embree_robust", "Embree, robust scene", "embreex", ("embreex",), "float32"),
        adapters.embree_robust,
    ),
    Peer(
        *("trimesh_embree", "trimesh over Embree", "trimesh embreex", ("trimesh", "embreex")),
        *("float32", adapters.trimesh_embree),
    ),
    Peer(
        *("trimesh_numpy", "trimesh in numpy", "trimesh rtree", ("trimesh", "rtree")),
        *("float64", adapters.trimesh_numpy, 100_000),
    ),
    Peer("open3d", "Open3D", "open3d", ("open3d",), "float32", adapters.open3d),
    Peer("mitsuba", "Mitsuba 3", "mitsuba", ("mitsuba",), "float32", adapters.mitsuba),
    Peer("warp", "NVIDIA Warp on the CPU", "warp-lang", ("warp",), "float32", adapters.warp),
    Peer("igl", "libigl", "libigl", ("igl",), "float64", adapters.igl),
    Peer(
        "pyvista", "VTK by PyVista", "pyvista", ("pyvista",), "float64", adapters.pyvista, 100_000
    ),
)


def find(name: str) -> Peer:
    """Return the peer of a name.

    Raises
    ------
    RtbenchError
        For a name that is none.
    """
    names = {peer.name: peer for peer in PEERS}
    if name not in names:
        raise RtbenchError(unknown("peer", name, names))
    return names[name]


@functools.cache
def absence(peer: Peer) -> str | None:
    """Return why a peer cannot be asked, in words; None where it can. Imports it."""
    for module in peer.modules:
        try:
            if importlib.util.find_spec(module) is None:
                return f"not installed (pip install {peer.package})"
            importlib.import_module(module)
        except Exception as problem:  # a library of another system's, or one that fails at once
            reason = " ".join(str(problem).split())
            return f"installed, but cannot be imported: {reason}"
    return None


class Found(NamedTuple):
    """What a peer answers, all (N,): hit bool, t, u, v float64 or NaN, triangle int64 or -1.

    ``refused`` counts the scenes that it would not make, or whose ray it would not trace.
    """

    hit: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray
    refused: int = 0


def nearest(
    peer: Peer,
    vertices: np.ndarray,
    faces: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    progress: Callable[[float], None] | None = None,
) -> Found:
    """Ask a peer for the nearest triangle of a mesh along each ray.

    Parameters
    ----------
    peer : Peer
    vertices, faces : (V, 3) float and (M, 3) int arrays
    origins, directions : (N, 3) arrays
        Rounded to the peer's precision first, as vertices are.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Found
        A t that is not above 0 counts as a miss, as a kernel's does.
    """
    vertices, origins, directions = _as_taken(peer, vertices, origins, directions)
    ask = peer.scene(vertices, faces)
    parts = []
    step = 50_000
    for start in range(0, len(origins), step):
        part = slice(start, start + step)
        parts.append(ask(origins[part], directions[part]))
        if progress is not None:
            progress(min(1.0, (start + step) / len(origins)))
    return _found(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def peer_answers(
    peer: Peer, cases: Cases, progress: Callable[[float], None] | None = None
) -> Found:
    """Ask a peer for every case of a corpus, each triangle in a scene of its own.

    Parameters
    ----------
    peer : Peer
    cases : Cases
        N cases; rounded to the peer's precision, so of a float32 peer only those with ``f32_ok``
        mean anything.
    progress : callable, optional

    Returns
    -------
    Found
        Of N cases; a case that a peer refuses with an exception is a miss.
    """
    groups = np.arange(len(cases))[:, None]
    return _by_scene(peer, cases, groups, progress)


def groups_met(
    peer: Peer, cases: Cases, progress: Callable[[float], None] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Ask a peer for the ray of each group of triangles that no ray may slip through.

    Parameters
    ----------
    peer : Peer
    cases : Cases
        Of a group (shared edges, fans, closed meshes) all triangles become one scene.
    progress : callable, optional

    Returns
    -------
    group : (G,) int array
        The groups that somebody must be hit in.
    met : (G,) bool array
        Whether the peer hits any triangle; False is a leak.
    """
    rule = np.asarray(cases.group_rule)[cases.family]
    wanted = (np.asarray(cases.group) >= 0) & np.isin(rule, ANY_HIT)
    members = np.flatnonzero(wanted)
    order = members[np.argsort(cases.group[members], kind="stable")]
    names, starts = np.unique(cases.group[order], return_index=True)
    groups = np.split(order, starts[1:])
    return names, _by_scene(peer, cases, groups if len(names) else [], progress).hit


def _by_scene(peer: Peer, cases: Cases, groups, progress) -> Found:
    """Return what a peer says of the ray of each group's first case, in a scene of the group."""
    corners = np.stack([cases.v0, cases.v1, cases.v2], axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        corners, origins, directions = _as_taken(peer, corners, cases.org, cases.dir)
    refused = 0
    told = (np.full(len(groups), -1), *(np.full(len(groups), np.nan) for _ in range(3)))
    for k, members in enumerate(groups):
        faces = np.arange(3 * len(members)).reshape(-1, 3)
        first = members[:1]
        try:
            with np.errstate(all="ignore"):
                ask = peer.scene(corners[members].reshape(-1, 3), faces)
                answer = ask(origins[first], directions[first])
        except Exception:  # what a library refuses it does not hit
            refused += 1
            continue
        for out, value in zip(told, answer, strict=True):
            out[k] = value[0]
        if progress is not None and k % 500 == 0:
            progress(k / len(groups))
    return _found(*told)._replace(refused=refused)


def _as_taken(peer: Peer, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(np.ascontiguousarray(a, dtype=np.dtype(peer.precision)) for a in arrays)


def _found(triangle: np.ndarray, t: np.ndarray, u: np.ndarray, v: np.ndarray) -> Found:
    hit = (triangle >= 0) & ~(t <= 0)
    for value in (t, u, v):
        value[~hit] = np.nan
    return Found(hit, t, u, v, np.where(hit, triangle, -1))
