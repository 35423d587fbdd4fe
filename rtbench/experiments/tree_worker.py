"""A process that builds trees and sends rays through them, as its parent tells it.

It reads a line of JSON at a time from its stdin, ``{"do": NAME, ...}``, and answers each with one
line, what the method `Place.NAME` returns, or ``{"error": ..., "code": ...}``; it ends when its
stdin closes. So that what is measured comes from a fresh process, it builds every tree itself.
"""

from __future__ import annotations

import gc
import json
import signal
import sys
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.experiments import tree_exact, tree_peers
from rtbench.experiments.tree_scene import Scene
from rtbench.measure.machine import pin
from rtbench.measure.peak import Peak
from rtbench.measure.sampler import timed
from rtbench.trees import quality, ways
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.never_hit import never_hit
from rtbench.trees.nodes import KdTree
from rtbench.trees.options import Options
from rtbench.workloads.cameras import picture

WARM = 64  # triangles over which a builder is run before it is timed
LARGEST_LEAF = 128  # that is told of in a histogram
PART = 8  # an eighth of the rays warms the caches


class Place:
    """What the process holds: one model, its trees, its rays, the cells."""

    def __init__(self) -> None:
        self.scene: Scene | None = None
        self.cells: list = []

    def start(self, cpu: int | None, kernels: list[str]) -> dict:
        """Begin; ``cpu``: to be pinned to."""
        if cpu is not None:
            pin(cpu)
        Scene.kernels_of(kernels)
        return {}

    def compile(self, kernel: str, precision: str, way: str, query: str, counted: bool) -> dict:
        """Compile a walk, or find it compiled."""
        made = Scene.walk_of(kernel, precision, way, query, counted)
        return {"fresh": made.fresh}

    def compile_builder(self, options: dict) -> dict:
        """Compile a builder by building a few triangles."""
        _warm(_few(), Options(**options))
        return {}

    def model(self, **told) -> dict:
        """Take a model; what was before it is forgotten."""
        self.scene = None
        self.cells = []
        gc.unfreeze()
        gc.enable()
        gc.collect()
        self.scene = Scene(told)
        return {}

    def build(self, options: dict, judged: bool) -> dict:
        """Build a tree; time it, and say how good it is where that is wanted."""
        scene, chosen = self.scene, Options(**options)
        _warm(Geometry.of(scene.triangles[:WARM]), chosen)
        built, wall, cpu = timed(lambda: build(scene.geometry("float32"), chosen))
        scene.built.append(built)
        found = ways.quality(built, scene.geometry("float32")) if judged else {}
        found = {name: value for name, value in found.items() if not hasattr(value, "__len__")}
        return {
            "build_seconds": wall / 1e9,
            "build_cpu_seconds": cpu / 1e9,
            "digest": built.digest,
            "quality": found,
            "leaf_sizes": _leaf_sizes(built) if judged else [],
        }

    def build_once(self, options: dict, judged: bool) -> dict:
        """Build a tree that nobody needs: as `build`, and ``peak_bytes``."""
        scene, chosen = self.scene, Options(**options)
        geometry = scene.geometry("float32")
        _warm(Geometry.of(scene.triangles[:WARM]), chosen)
        gc.collect()
        memory = Peak()
        built, wall, cpu = timed(lambda: build(geometry, chosen))
        found = {"seconds": wall / 1e9, "cpu_seconds": cpu / 1e9, "peak_bytes": memory.bytes()}
        if judged:
            good = ways.quality(built, geometry)
            found |= {name: good[name] for name in ("nodes", "references", "sah_cost")}
        return found | {"digest": built.digest}

    def peer(self, name: str) -> dict:
        """Let a peer build what it has; its absence or failure is told, never raised."""
        try:
            tree_peers.import_it(name)
            made, wall, cpu = timed(lambda: tree_peers.scene(name, self.scene))
        except Exception as problem:  # a library that fails must not cost the others' times
            reason = " ".join(str(problem).split()) or type(problem).__name__
            return {"failed": reason}
        self.scene.peers[name] = made
        return {"build_seconds": wall / 1e9, "build_cpu_seconds": cpu / 1e9}

    def compare(self, name: str, kernel: str, precision: str, rays: str) -> dict:
        """Compare a peer's answers with a group's."""
        return tree_peers.compared(self.scene, name, kernel, precision, rays)

    def shadow(self, kernel: str, precision: str, tree: int, way: str) -> dict:
        """Make the shadow rays, from where primary rays hit."""
        return {"rays": self.scene.add_shadow_rays(kernel, precision, tree, way)}

    def cell(self, **told) -> dict:
        """Add a cell: walk its rays once, and compare the answers with those of its group.

        Returns
        -------
        dict
            ``ns`` of the first pass, ``rays``, ``hits``, and ``differ``: None, or how many answers
            and which ray first.
        """
        made = self.scene.cell(**told)
        self.cells.append(made)
        made.forget()
        _, wall, _ = timed(made.trace)
        compared = made.compared()
        return {"ns": wall, "rays": made.rays, "hits": made.hits} | compared

    def count(
        self, kernel: str, precision: str, tree: int, way: str, rays: str, image: str | None
    ) -> dict:
        """Count what rays meet, of each that meets the box; keep an image of it where wanted."""
        counts, outcome, t = self.scene.counted(kernel, precision, tree, way, rays)
        if image:
            depth = np.where(outcome >= 0, t, np.nan).astype(np.float32)
            parts = {"steps": counts[:, 0], "tests": counts[:, 2], "depth": depth}
            places = self.scene.pixels, self.scene.width, self.scene.height
            Path(image).parent.mkdir(exist_ok=True)
            np.savez_compressed(image, **{n: picture(v, *places) for n, v in parts.items()})
        met = quality.per_ray(counts)
        return {"rays_counted": met["rays"]} | {
            name: None if np.isnan(met[name]) else met[name] for name in quality.COUNTS
        }

    def brute(self, kernel: str, precision: str, rays: str, most: int) -> dict:
        """Put a sample of a group's rays to brute force; say how many answers differ."""
        return self.scene.judged_by_brute_force(kernel, precision, rays, most)

    def exact(self, kernel: str, precision: str, rays: str, most: int) -> dict:
        """Put a sample of a group's rays to exact arithmetic; say how many answers are wrong."""
        return tree_exact.judge(self.scene, kernel, precision, rays, most)

    def never_hit(self, kernel: str) -> dict:
        """Count the triangles that a kernel's absolute EPSILON hides from every ray."""
        found = never_hit(Scene.kernel(kernel), self.scene.triangles)
        return {"never_hit": int(np.count_nonzero(found))}

    def ready(self) -> dict:
        """Stop collecting garbage."""
        gc.collect()
        gc.freeze()
        gc.disable()
        return {}

    def time(self, cell: int, repetitions: int) -> dict:
        """Time a cell so many times in a row; its answers are compared once more."""
        made = self.cells[cell]
        made.trace(1 / PART)
        made.forget()

        def walk():
            for _ in range(repetitions):
                made.trace()

        _, wall, cpu = timed(walk, made.threads)
        return {"ns": wall, "cpu_ns": cpu} | made.compared()

    def costs(self, kernel: str, precision: str, triangles: int) -> dict:
        """Measure what a step and a test cost here."""
        from rtbench.experiments import tree_costs

        return tree_costs.measured(Scene.kernel(kernel), precision, triangles)


def _leaf_sizes(built: object) -> list[int]:
    """Return how many leaves of a k-d tree hold 0, 1, 2 ... triangles, up to LARGEST_LEAF."""
    return (
        quality.leaf_sizes(built)[: LARGEST_LEAF + 1].tolist() if isinstance(built, KdTree) else []
    )


def _warm(geometry: Geometry, options: Options) -> None:
    build(geometry, options)


def _few() -> Geometry:
    return Geometry.of(np.random.default_rng(1).random((WARM, 3, 3), np.float32))


def tell(message: object) -> None:
    print(json.dumps(message), flush=True)


def serve(place: object) -> None:
    """Do what the parent tells until it closes our stdin."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    for line in sys.stdin:
        message = json.loads(line)
        try:
            answer = getattr(place, message.pop("do"))(**message)
        except RtbenchError as problem:
            answer = {"error": str(problem), "code": problem.exit_code}
        except MemoryError:
            answer = {"error": "there is not enough memory for this tree", "code": 2}
        tell(answer)


if __name__ == "__main__":
    try:
        serve(Place())
    except BrokenPipeError:  # the parent is gone
        sys.stderr.close()
