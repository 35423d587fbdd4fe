"""A model in a worker: its trees, its rays, and walks of the ones through the others."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from typing import ClassVar

import numpy as np

from rtbench.compiled.instantiate import Instance
from rtbench.compiled.layout import DATA_TYPE, REAL_TYPE
from rtbench.errors import RtbenchError
from rtbench.experiments.tree_cells import ANY, BRUTE_FORCE, NEAREST, PEER, query
from rtbench.kernels import registry
from rtbench.kernels.contract import Kernel
from rtbench.measure.worker import loaded
from rtbench.trees import leaves, ways
from rtbench.trees.geometry import Geometry
from rtbench.trees.leaves import Leaves
from rtbench.trees.tree import CHUNK
from rtbench.workloads import ray_sets

BRUTE_TESTS = 50_000_000  # at most so many to judge a group: tenths of a second


class Cell:
    """Rays that walk through a tree, or that a peer traces, again and again.

    Attributes
    ----------
    threads, rays, hits : int
        Hits are those of its group.
    """

    def __init__(self, trace, compared, forget, rays: int, threads: int = 1) -> None:
        self.trace = trace
        self._compared = compared
        self.forget = forget
        self.rays = rays
        self.threads = threads
        self.hits: int | None = None

    def compared(self) -> dict:
        """Return ``differ``: None, or how many answers are not those of the group."""
        told = self._compared(self)
        return {"differ": told}


class Scene:
    """A model, what was built over it, and its rays."""

    _kernels: ClassVar[dict[str, Kernel]] = {}

    def __init__(self, told: dict) -> None:
        self.vertices, self.faces = (np.load(told[name]) for name in ("vertices", "faces"))
        self.triangles = self.vertices[self.faces]
        self.light = np.array(told["light"])
        self.width, self.height = told["width"], told["height"]
        self.sets: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}
        self.pixels = None
        for name, paths in told["rays"].items():
            origins, directions = loaded(paths["origins"]), loaded(paths["directions"])
            self.sets[name] = origins, directions, np.full(len(origins), np.inf)
            if "pixels" in paths:
                self.pixels = loaded(paths["pixels"])
        self.built: list = []
        self.peers: dict = {}
        self.answers: dict[tuple, tuple] = {}  # by group: outcome, t, u, v of who came first
        self._geometries: dict = {}
        self._leaves: dict = {}
        self._rays: dict = {}
        self._room: dict = {}

    @classmethod
    def kernels_of(cls, names: list[str]) -> None:
        """Let this process know the kernels that names and FILE.py:NAME select."""
        for kernel in registry.select(names):
            cls._kernels[kernel.name] = kernel

    @classmethod
    def kernel(cls, name: str) -> Kernel:
        """Return a kernel by its name."""
        return cls._kernels.get(name) or registry.find(name)

    @classmethod
    def walk_of(
        cls, kernel: str, precision: str, way: str, query: str, counted: bool = False
    ) -> Instance:
        """Return the compiled walk of a way."""
        chosen = cls.kernel(kernel)
        form = leaves.form_of(chosen, precision)
        return ways.walk(chosen, precision, way, query, form, counted)

    def geometry(self, precision: str) -> Geometry:
        """Return the triangles as trees over a precision see them."""
        data = DATA_TYPE[precision]
        if data not in self._geometries:
            try:
                self._geometries[data] = Geometry.of(self.triangles, precision)
            except ValueError as problem:
                raise RtbenchError(str(problem)) from None
        return self._geometries[data]

    def leaves(self, kernel: str, precision: str, tree: int | None, way: str) -> Leaves:
        """Return nodes and leaves as a way reads them; triangles one by one are kept once."""
        chosen = self.kernel(kernel)
        form = ways.form(way, leaves.form_of(chosen, precision))
        key = kernel, precision, form, -1 if tree is None else tree, way == BRUTE_FORCE
        if key in self._leaves:
            return self._leaves[key]
        built = self.built[tree or 0]
        plain = kernel, precision, "triangles"
        one_by_one = form == leaves.ONE_BY_ONE and built.options.structure == "kd"
        if one_by_one and way != BRUTE_FORCE and plain in self._leaves:
            found = dataclasses.replace(self._leaves[plain], nodes=built.nodes, refs=built.refs)
        else:
            geometry = self.geometry(precision)
            found = ways.leaves_of(chosen, precision, geometry, built, way)
            if one_by_one and way != BRUTE_FORCE:
                self._leaves[plain] = found
        self._leaves[key] = found
        return found

    def rays(self, kernel: str, precision: str, name: str) -> np.ndarray:
        """Return a set of rays as a walk reads them."""
        key = kernel, precision, name
        if key not in self._rays:
            self._rays[key] = leaves.rays(self.kernel(kernel), precision, *self.sets[name])
        return self._rays[key]

    def room(self, precision: str, rays: int) -> tuple[np.ndarray, ...]:
        """Return where answers are written; cells take turns in it."""
        key = precision, rays
        if key not in self._room:
            real = REAL_TYPE[precision]
            values = (np.empty(rays, real) for _ in range(3))
            self._room[key] = np.empty(rays, np.int32), *values
        return self._room[key]

    def inputs(self, kernel: str, precision: str, tree: int | None, way: str, rays: str) -> tuple:
        """Return what a compiled walk reads, but for the second list of indices."""
        read, geometry = self.leaves(kernel, precision, tree, way), self.geometry(precision)
        scene = np.concatenate([geometry.base, geometry.box, [geometry.reach]])
        return (
            *(read.nodes, read.refs, read.triangles, scene.astype(np.float64)),
            *(self.rays(kernel, precision, rays), np.zeros(1, np.uint64)),
        )

    def cell(
        self,
        kernel: str,
        precision: str,
        tree: int | None,
        way: str,
        rays: str,
        threads: int,
        most: int | None,
    ) -> Cell:
        """Return a cell; of no tree, and of slow peers, over ``most`` rays."""
        if way == PEER:
            return self._peer_cell(kernel, rays, most)
        call = self.walk_of(kernel, precision, way, query(rays)).call
        inputs, outputs = (
            self.inputs(kernel, precision, tree, way, rays),
            self.room(precision, len(self.sets[rays][0])),
        )
        whole = len(outputs[0])
        indices = sample(whole, whole if most is None else most).astype(np.uint64)
        none = np.zeros((0, 3), np.int32)
        pool = ThreadPoolExecutor(threads) if threads > 1 else None

        def trace(part: float = 1.0) -> None:
            own = indices if part == 1.0 else indices[: max(1, int(part * len(indices)))]
            if pool is None:
                call(*inputs, own, *outputs, none)
            else:
                parts = [own[start : start + CHUNK] for start in range(0, len(own), CHUNK)]
                list(pool.map(lambda each: call(*inputs, each, *outputs, none), parts))

        def forget() -> None:
            for values in outputs:
                values.view(np.uint8).fill(0xAA)

        def compared(cell: Cell) -> dict | None:
            group = kernel, precision, rays
            if group not in self.answers:
                self.answers[group] = tuple(values.copy() for values in outputs)
            known = self.answers[group]
            hit = known[0][indices] > (0 if query(rays) == ANY else -1)
            cell.hits = int(np.count_nonzero(hit))
            used = len(self.kernel(kernel).outputs) if query(rays) == NEAREST else 0
            differ = known[0][indices] != outputs[0][indices]
            for before, now in zip(known[1 : 1 + used], outputs[1:], strict=False):
                differ |= hit & (_bits(before[indices]) != _bits(now[indices]))
            found = np.flatnonzero(differ)
            return {"rays": len(found), "first": int(indices[found[0]])} if len(found) else None

        return Cell(trace, compared, forget, len(indices), threads)

    def _peer_cell(self, name: str, rays: str, most: int | None) -> Cell:
        origins, directions, tmax = self.sets[rays]
        rows = sample(len(origins), len(origins) if most is None else most)
        traced = self.peers[name].prepare(origins[rows], directions[rows], tmax[rows], query(rays))
        return Cell(traced, lambda cell: None, lambda: None, len(rows))

    def counted(self, kernel: str, precision: str, tree: int, way: str, rays: str):
        """Return steps, leaves and tests (N, 3) of each ray, its outcome and its t."""
        call = self.walk_of(kernel, precision, way, query(rays), True).call
        inputs = self.inputs(kernel, precision, tree, way, rays)
        outputs = self.room(precision, len(self.sets[rays][0]))
        counts = np.zeros((len(outputs[0]), 3), np.int32)
        call(*inputs, np.arange(len(counts), dtype=np.uint64), *outputs, counts)
        return counts, outputs[0], outputs[1]

    def add_shadow_rays(self, kernel: str, precision: str, tree: int, way: str) -> int:
        """Make the set of shadow rays from where primary rays hit; return how many."""
        call = self.walk_of(kernel, precision, way, NEAREST).call
        origins, directions, _ = self.sets["primary"]
        outputs = self.room(precision, len(origins))
        call(
            *self.inputs(kernel, precision, tree, way, "primary"),
            np.arange(len(origins), dtype=np.uint64),
            *(*outputs, np.zeros((0, 3), np.int32)),
        )
        found = ray_sets.shadow_rays(
            self.triangles, origins, directions, outputs[1], outputs[0], self.light
        )
        self.sets["shadow"] = found[:3]
        return len(found[0])

    def judged_by_brute_force(self, kernel: str, precision: str, rays: str, most: int) -> dict:
        """Compare a group's answers with those of every triangle, over a sample of its rays."""
        known = self.answers[kernel, precision, rays]
        few = min(most, max(16, BRUTE_TESTS // len(self.triangles)))
        rows = sample(len(known[0]), few)
        call = self.walk_of(kernel, precision, BRUTE_FORCE, NEAREST).call
        outputs = tuple(np.empty_like(values) for values in known)
        call(
            *self.inputs(kernel, precision, None, BRUTE_FORCE, rays),
            *(rows.astype(np.uint64), *outputs, np.zeros((0, 3), np.int32)),
        )
        now, before = outputs[0][rows], known[0][rows]
        if query(rays) == ANY:
            wrong = (now >= 0) != (before > 0)
        else:
            same = _bits(outputs[1][rows]) == _bits(known[1][rows])
            wrong = (now != before) | ((now >= 0) & ~same)
        first = int(rows[wrong][0]) if wrong.any() else None
        return {
            "wrong": int(np.count_nonzero(wrong)),
            "rays_judged": len(rows),
            "first": first,
        }


def sample(whole: int, few: int) -> np.ndarray:
    """Return ``few`` of ``whole`` rays, evenly spread, all where there are no more."""
    if few >= whole:
        return np.arange(whole)
    return (np.arange(few) * whole) // few


def _bits(values: np.ndarray) -> np.ndarray:
    return values.view(np.uint32 if values.itemsize == 4 else np.uint64)
