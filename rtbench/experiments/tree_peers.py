"""What other libraries are asked in the rounds of the tree experiment: prepared once, then timed.

What is timed is the library's own call over arrays as it takes them. Of Embree that is embreex's
``run``, which copies each ray and returns what was hit; of the others their adapter's call.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rtbench.experiments import peers
from rtbench.experiments.tree_cells import ANY

if TYPE_CHECKING:
    from rtbench.experiments.tree_scene import Scene

SLOW = 500  # rays of a peer that would take minutes over all
WITH_SHADOWS = ("embree", "embree_robust")  # that are asked whether anything is hit
T_DIFFERS = 1e-4  # of t: more than what float32 rounds


@dataclass(frozen=True)
class PeerScene:
    """A peer's own scene; ``ask`` and ``any_hit`` take origins, directions and tmax."""

    name: str
    precision: type
    ask: Callable
    any_hit: Callable | None

    def prepare(self, origins, directions, tmax, query: str) -> Callable:
        """Return what traces these rays each time it is called."""
        rays = [np.ascontiguousarray(a, self.precision) for a in (origins, directions, tmax)]
        asked = self.any_hit if query == ANY else self.ask
        few = [values[: max(1, len(values) // 8)] for values in rays]
        return lambda part=1.0: asked(*(rays if part == 1.0 else few))


def import_it(name: str) -> None:
    """Import what a peer needs, and let it build a triangle: the first scene takes longer."""
    peers.absence(peers.find(name))
    peers.find(name).scene(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]]))


def scene(name: str, model: Scene) -> PeerScene:
    """Return a peer's scene over a model."""
    peer = peers.find(name)
    precision = np.dtype(peer.precision).type
    vertices = model.vertices.astype(precision)
    if name in WITH_SHADOWS:
        return _embree(name, vertices, model.faces)
    ask = peer.scene(vertices, model.faces)
    return PeerScene(name, precision, lambda o, d, far: ask(o, d), None)


def _embree(name: str, vertices: np.ndarray, faces: np.ndarray) -> PeerScene:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    made = EmbreeScene(robust=name == "embree_robust")
    mesh = TriangleMesh(made, vertices, faces.astype(np.int32))

    def ask(origins, directions, far, mesh=mesh):
        return made.run(origins, directions, dists=far, output=1)

    def any_hit(origins, directions, far, mesh=mesh):
        return made.run(origins, directions, dists=far, query="OCCLUDED")

    # A scene is built when it is first asked.
    one = np.zeros((1, 3), np.float32)
    ask(one, one + 1, np.full(1, np.inf, np.float32))
    return PeerScene(name, np.float32, ask, any_hit)


def compared(model: Scene, name: str, kernel: str, precision: str, rays: str) -> dict:
    """Return where a peer's answers differ from a kernel's: in hit or miss, in t.

    Returns
    -------
    dict
        ``compared`` rays, ``hit_differs``, ``t_differs`` (by more than a part in 10,000).
    """
    from rtbench.experiments.tree_scene import sample

    known = model.answers[kernel, precision, rays]
    origins, directions, tmax = model.sets[rays]
    rows = sample(len(origins), min(len(origins), limit(name) or len(origins)))
    taken = [origins[rows], directions[rows], tmax[rows]]
    asked = model.peers[name].prepare(*taken, ANY if rays == "shadow" else "nearest")()
    if rays == "shadow":
        hit, t = np.asarray(asked) >= 0, None
        ours = known[0][rows] > 0
    elif isinstance(asked, dict):
        hit, t = np.asarray(asked["primID"]) >= 0, np.asarray(asked["tfar"], np.float64)
        ours = known[0][rows] >= 0
    else:
        hit, t = np.asarray(asked[0]) >= 0, np.asarray(asked[1], np.float64)
        ours = known[0][rows] >= 0
    found = {"compared": len(rows), "hit_differs": int(np.count_nonzero(hit != ours))}
    if t is not None and np.isfinite(t[hit]).any():
        both = hit & ours
        away = np.abs(t[both] - known[1][rows][both])
        found["t_differs"] = int(np.count_nonzero(away > T_DIFFERS * known[1][rows][both]))
    return found


def limit(name: str) -> int | None:
    """Return how many rays a peer is asked at most, None: all."""
    return SLOW if peers.find(name).most < 1 << 62 else None


def asks(name: str, rays: str) -> bool:
    """Tell whether a peer is asked a set of rays."""
    return rays != "shadow" or name in WITH_SHADOWS
