"""Trees for users: built once over triangles, asked for nearest hits and for shadows."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rtbench.compiled.intersect import Hits, checked
from rtbench.compiled.layout import REAL_TYPE, check_precision
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels import registry
from rtbench.kernels.contract import Kernel
from rtbench.trees import leaves, ways
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry

CHUNK = 8192  # rays that a thread walks at a time


class Tree:
    """Triangles that rays can be sent into.

    Parameters
    ----------
    triangles : (M, 3, 3) array of any float dtype
        Vertices; rounded to the precision of the data first. M may be 0. Degenerate ones are kept.
    structure : str
        ``kd``, or ``bvh``: a bounding volume hierarchy of eight boxes a node.
    rule : str
        Where cells are cut: ``sah``, ``object_median``, ``spatial_median``.
    builder : str
        How the SAH's best plane is found: ``nlogn``, ``nlog2n``, ``n2`` (all the same tree),
        ``binned``.
    kernel : str
        What tests triangles: a name from `rtbench.list_kernels` that returns t.
    precision : str
        float32, float64, or mixed (float32 data, float64 arithmetic).
    progress : callable, optional
        Called while it is built with the fraction done.
    **options
        Further ones of `rtbench.trees.options.Options`.

    Raises
    ------
    ValueError
        For wrong shapes, unknown names (with the nearest one) or values, and triangles that are
        not finite, naming the first.

    Notes
    -----
    The answers are those of brute force with the same kernel, bit for bit, whatever the tree: the
    least t, and of equal ones the lowest index. This holds as far as a kernel is off by no more
    than a few roundings: see `rtbench.trees.traversal.entering`. A ray that is not finite, or
    whose direction is 0, hits nothing.
    """

    def __init__(
        self,
        triangles: np.ndarray,
        structure: str = "kd",
        rule: str = "sah",
        builder: str = "nlogn",
        kernel: str | Kernel = "watertight_safe",
        precision: str = "float32",
        *,
        progress: Callable[[float], None] | None = None,
        **options: object,
    ) -> None:
        try:
            self.kernel = kernel if isinstance(kernel, Kernel) else registry.find(str(kernel))
            check_precision(str(precision))
            leaves.must_be_fit(self.kernel)
            self.precision = precision
            self.form = leaves.form_of(self.kernel, precision)
            self.options = ways.options(
                self.form, structure=structure, rule=rule, builder=builder, **options
            )
        except (RtbenchError, TypeError) as problem:
            raise ValueError(str(problem)) from None
        self.geometry = Geometry.of(triangles, precision)
        begin = time.perf_counter()
        self.built = build(self.geometry, self.options, progress)
        self.build_seconds = time.perf_counter() - begin
        self._leaves: dict[tuple[str, bool], leaves.Leaves] = {}

    def __len__(self) -> int:
        """Return how many triangles it is over."""
        return len(self.geometry)

    def nearest(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        tmax: float | np.ndarray = np.inf,
        threads: int = 1,
        way: str | None = None,
    ) -> Hits:
        """Return the nearest hit of each ray.

        Parameters
        ----------
        origins, directions : (N, 3) arrays of any float dtype
            Directions are used as given, of any length. N may be 0.
        tmax : float or (N,) array
            Hits count where 0 < t < tmax, in units of the direction.
        threads : int
            How many to walk in; the answer is the same.
        way : str, optional
            How rays walk, one of `rtbench.trees.ways.WAYS` that this tree has: by default one by
            one or in lanes, in packets where neighbouring rays run together.

        Returns
        -------
        Hits
            triangle -1, and t, u, v NaN, on a miss; u, v NaN where the kernel does not return them;
            outcome None.

        Raises
        ------
        ValueError
            For wrong shapes and an unknown way.
        """
        outcome, t, u, v = self._asked("nearest", origins, directions, tmax, threads, way)
        hit = outcome >= 0
        for each in (t, u, v):
            each[~hit] = np.nan
        return Hits(hit, None, t, u, v, outcome.astype(np.int64))

    def occluded(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        tmax: float | np.ndarray = np.inf,
        threads: int = 1,
        way: str | None = None,
    ) -> np.ndarray:
        """Return whether each ray hits anything where 0 < t < tmax, (N,) bool; else as `nearest`.

        With a direction from a point to a light and a tmax of 1: whether the point is in shadow.
        """
        return self._asked("any", origins, directions, tmax, threads, way)[0] > 0

    def quality(self) -> dict[str, object]:
        """Return how good the tree is.

        Returns
        -------
        dict
            Flat: nodes, leaves, empty_leaves, references, depth, bytes (nodes and leaves as the
            default walk reads them), sah_cost, build_seconds, digest and more: see
            `rtbench.trees.quality.quality`.
        """
        found = ways.quality(self.built, self.geometry)
        return found | {
            "bytes": self.leaves(ways.default(self.options, self.form)).bytes,
            "build_seconds": self.build_seconds,
            "digest": self.built.digest,
        }

    def leaves(self, way: str) -> leaves.Leaves:
        """Return nodes and triangles as a way of walking reads them."""
        key = ways.form(way, self.form), way == "brute_force"
        if key not in self._leaves:
            self._leaves[key] = ways.leaves_of(
                self.kernel, self.precision, self.geometry, self.built, way
            )
        return self._leaves[key]

    @property
    def scene(self) -> np.ndarray:
        """What a walk must know of the scene: see `rtbench.trees.traversal.entering.enter`."""
        geometry = self.geometry
        return np.concatenate([geometry.base, geometry.box, [geometry.reach]]).astype(np.float64)

    def _asked(self, query, origins, directions, tmax, threads, way):
        origins, directions = (
            checked(name, array, (3,))
            for name, array in (("origins", origins), ("directions", directions))
        )
        if len(origins) != len(directions):
            raise ValueError(f"{len(origins)} origins and {len(directions)} directions")
        tmax = np.asarray(tmax, dtype=np.float64)
        if tmax.shape not in ((), (len(origins),)):
            raise ValueError(
                f"tmax has shape {tmax.shape}: a number or ({len(origins)},) is wanted"
            )
        if not (isinstance(threads, int) and threads >= 1):
            raise ValueError(f"threads {threads} is not allowed (allowed: 1 or more)")
        with np.errstate(all="ignore"):  # what is no number, or too large, is a miss
            rays = leaves.rays(self.kernel, self.precision, origins, directions, tmax)
        allowed = ways.allowed(self.options, self.form)
        way = way or ways.chosen(self.options, self.form, rays)
        if way not in allowed:
            raise ValueError(unknown("way", way, allowed))
        return run(self, way, query, rays, threads)


def run(
    tree: Tree, way: str, query: str, rays: np.ndarray, threads: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Walk all rays once; return outcome (N,) int32 and t, u, v (N,) as the walk writes them."""
    walk = ways.walk(tree.kernel, tree.precision, way, query, tree.form)
    read, real, n = tree.leaves(way), REAL_TYPE[tree.precision], len(rays)
    outcome = np.full(n, -1, np.int32)
    t, u, v = (np.full(n, np.nan, real) for _ in range(3))
    inputs = read.nodes, read.refs, read.triangles, tree.scene, rays, np.zeros(1, np.uint64)
    outputs = outcome, t, u, v, np.zeros((0, 3), np.int32)
    indices = np.arange(n, dtype=np.uint64)
    if threads == 1:
        walk.call(*inputs, indices, *outputs)
        return outcome, t, u, v
    parts = [indices[start : start + CHUNK] for start in range(0, n, CHUNK)]
    with ThreadPoolExecutor(min(threads, os.cpu_count() or 1, max(1, len(parts)))) as pool:
        list(pool.map(lambda part: walk.call(*inputs, part, *outputs), parts))
    return outcome, t, u, v
