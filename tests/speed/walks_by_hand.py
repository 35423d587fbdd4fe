"""Walks of many rays at a time beside embreex, run by hand.

    RTBENCH_MODELS=... python tests/speed/walks_by_hand.py [bunny dragon ...] [--costs 0.5 1]

Rays: random ones, and primary rays of an image of 1024 x 768 in tiles of 4 x 4 pixels. Everybody
gets the same rays in the same order and all run interleaved in one process; thread CPU time. Ratios
are those of neighbouring samples to embreex (its scene's run with output=True): 1.2 is the aim for
random rays in lanes, 1.8 for primary rays in packets. Without embreex only rates are told.
"""

import argparse
import statistics
import time
from functools import partial

import numpy as np

KERNEL, PRECISION = "moller_trumbore", "float32"
RANDOM = 200_000
WIDTH, HEIGHT = 1024, 768


def peer(corners: np.ndarray):
    """Return what traces rays with embreex; None where it is not installed."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError:
        return None
    scene = EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(corners, np.float32))
    return lambda origins, directions: scene.run(origins, directions, output=True)


def rays_of(mesh) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    from rtbench.workloads.cameras import primary_rays, recommended
    from rtbench.workloads.ray_sets import random_rays

    primary = primary_rays(recommended(mesh), WIDTH, HEIGHT)[:2]
    both = {"random": random_rays(mesh, RANDOM), "primary": primary}
    return {what: tuple(a.astype(np.float32) for a in rays) for what, rays in both.items()}


def contestants(geometry, tree, origins, directions):
    """Return functions that walk all rays once, and what each finds."""
    from rtbench.kernels.registry import find
    from rtbench.trees import leaves
    from rtbench.trees.traversal import lanes, packets, walks

    kernel = find(KERNEL)
    read = leaves.blocks(kernel, PRECISION, geometry, tree)
    rays = leaves.rays(kernel, PRECISION, origins, directions)
    scene = np.concatenate([geometry.base, geometry.box, [geometry.reach]])
    order = np.zeros(1, np.uint64), np.arange(len(rays), dtype=np.uint64)
    made = {
        "single": walks.walk(kernel, PRECISION, "stack", "nearest", leaves.IN_BLOCKS),
        "lanes": lanes.walk(kernel, PRECISION),
        "packets": packets.walk(kernel, PRECISION),
    }
    runs, found = {}, {}
    for name, compiled in made.items():
        outputs = [np.full(len(rays), -2, np.int32), np.zeros(len(rays), np.float32)]
        rest = np.zeros(0, np.float32), np.zeros(0, np.float32), np.zeros((0, 3), np.int32)
        given = (read.nodes, read.refs, read.triangles, scene, rays, *order, *outputs, *rest)
        runs[name] = partial(compiled.call, *given)
        runs[name]()
        found[name] = outputs
    same = all(
        np.array_equal(a, b)
        for outputs in found.values()
        for a, b in zip(outputs, found["single"], strict=True)
    )
    if not same:
        raise SystemExit("single rays, lanes and packets answer differently")
    return runs, found["single"][0] >= 0


def timed(run) -> float:
    begin = time.thread_time()
    run()
    return time.thread_time() - begin


def compare(runs: dict, rounds: int) -> dict[str, list[float]]:
    """Return the seconds of each, interleaved, in an order that turns."""
    taken = {name: [] for name in runs}
    names = list(runs)
    for number in range(rounds):
        turn = number % len(names)
        for name in names[turn:] + names[:turn]:
            taken[name].append(timed(runs[name]))
    return taken


def show(what: str, taken: dict[str, list[float]], count: int, hits: float) -> None:
    told = [f"{what:<34}{hits:5.0%} hit "]
    for name, each in taken.items():
        told.append(f" {name} {count / statistics.median(each) / 1e6:5.2f}")
        if name != "embreex" and "embreex" in taken:
            ratios = [a / b for a, b in zip(taken["embreex"], each, strict=True)]
            told.append(f" x{statistics.median(ratios):.2f}")
    print("".join(told), "Mray/s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", default=["bunny", "dragon", "buddha", "sponza"])
    parser.add_argument("--costs", nargs="*", type=float, default=[0.5, 1.0], help="K_T")
    parser.add_argument("--blocks", nargs="*", type=int, default=[8])
    parser.add_argument("--max-leaf", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=12)
    given = parser.parse_args()

    from rtbench.trees.building import build
    from rtbench.trees.geometry import Geometry
    from rtbench.trees.options import Options
    from rtbench.workloads.meshes import load_mesh, models

    there = models()
    for name in given.models:
        mesh = load_mesh(there[name])
        geometry = Geometry.of(mesh.triangles, PRECISION)
        embreex, rays = peer(geometry.corners), rays_of(mesh)
        for cost in given.costs:
            for block in given.blocks:
                chosen = Options(traversal_cost=cost, block=block, max_leaf=given.max_leaf)
                tree = build(geometry, chosen)
                for what, (origins, directions) in rays.items():
                    runs, hit = contestants(geometry, tree, origins, directions)
                    if embreex:
                        runs["embreex"] = partial(embreex, origins, directions)
                    row = f"{name} {what}, K_T {cost:g}, block {block}"
                    show(row, compare(runs, given.rounds), len(origins), hit.mean())


if __name__ == "__main__":
    main()
