"""How long builders take over N, what they need of memory, and whether their trees agree.

    python tests/speed/builds_by_hand.py MODEL [--builders nlogn,nlog2n] [--overlap clipped]
        [--costs 1,2,3] [--sizes 8] [--rounds 3]

The first N triangles of a mesh in Morton order of their middles, N doubling up to all of them.
Builders are interleaved in one process; a time is the least of the rounds, thread CPU time, the
exponent a least-squares fit of log time over log N. Memory is the peak of the process while it
builds over all triangles, less what it had before, plus the geometry: per triangle.
"""

import argparse
import dataclasses
import re
import time
from pathlib import Path

import numpy as np

from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry
from rtbench.trees.options import Options
from rtbench.workloads.meshes import load_mesh


def in_morton_order(triangles: np.ndarray) -> np.ndarray:
    """Return triangles in the order of their middles' bits, interleaved."""
    middles = triangles.mean(axis=1)
    spread = np.ptp(middles, axis=0)
    cells = ((middles - middles.min(axis=0)) / spread * 1023).astype(np.uint64)
    code = np.zeros(len(cells), np.uint64)
    for bit in range(10):
        for axis in range(3):
            code |= (cells[:, axis] >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return triangles[np.argsort(code, kind="stable")]


def memory(what: str) -> int:
    """Return VmRSS or VmHWM of this process, bytes."""
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    return int(re.search(rf"^{what}:\s+(\d+) kB", status, re.M)[1]) * 1024


def peak_of_build(geometry: Geometry, options: Options) -> int:
    """Return by how many bytes building raises the peak of the process's memory."""
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")  # the peak is now what it has
    before = memory("VmRSS")
    build(geometry, options)
    return memory("VmHWM") - before


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("model")
    parser.add_argument("--builders", default="nlogn")
    parser.add_argument("--overlap", default="clipped")
    parser.add_argument("--costs", default="2", help="K_T, for K_I = 1")
    parser.add_argument("--sizes", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args()
    triangles = in_morton_order(load_mesh(asked.model).triangles)
    builders = asked.builders.split(",")
    sizes = [len(triangles) >> shift for shift in reversed(range(asked.sizes))]
    for cost in map(float, asked.costs.split(",")):
        options = Options(overlap=asked.overlap, traversal_cost=cost)
        every = [dataclasses.replace(options, builder=name) for name in builders]
        for each in every:
            build(Geometry.of(triangles[:100]), each)
        best = np.full((len(builders), len(sizes)), np.inf)
        print(f"K_T {cost:g}, {asked.overlap}: seconds (ns per N log2 N), digest")
        for s, n in enumerate(sizes):
            geometry, digests = Geometry.of(triangles[:n]), {}
            for _ in range(asked.rounds):
                for b, each in enumerate(every):
                    start = time.thread_time()
                    digests[each.builder] = build(geometry, each).digest
                    best[b, s] = min(best[b, s], time.thread_time() - start)
            row = "  ".join(
                f"{name} {t:.3f} ({t / (n * np.log2(n)) * 1e9:.0f}) {digests[name]}"
                for name, t in zip(builders, best[:, s], strict=True)
            )
            print(f"{n:9,}  {row}", flush=True)
        for name, each, times in zip(builders, every, best, strict=True):
            exponent = np.polyfit(np.log(sizes), np.log(times), 1)[0]
            upper = np.polyfit(np.log(sizes[-5:]), np.log(times[-5:]), 1)[0]
            own = geometry.corners.nbytes + geometry.boxes.nbytes
            peak = (own + peak_of_build(geometry, each)) / len(geometry)
            print(
                f"{name}: exponent {exponent:.3f}, of the 5 largest {upper:.3f}; {peak:.0f} B each"
            )


if __name__ == "__main__":
    main()
