"""Packets against the same kernels by hand in AVX intrinsics, and against single rays.

    python tests/speed/packets_against_c.py [--launches 5] [--rounds 31] [--width 16] [--pairs N]

Two questions, each answered for packets of rays (form rays, each packet against all triangles of a
soup) and blocks of pairs (form pairs), at a hit ratio of 0.5, in float32:

- C / lanes: packets.c (gcc -O3 -march=native, without contraction) over rtbench's loop: 0.9 is the
  aim. Both run over the same records in memory and must give the same bits.
- single / lanes: the same kernel, one ray at a time with its early exits, over lanes: 8 is the aim.

All three are interleaved in one process; ratios are those of neighbouring samples.
"""

import argparse
import ctypes
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from against_c import interval, pointer, timed

SOURCE = Path(__file__).with_name("packets.c")
FLAGS = ["-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC"]
KERNELS = ("shevtsov", "perpendicular_planes")
FORMS = ("rays", "pairs")
WHO = ("c", "lanes", "single")
SAMPLE_NS = 10_000_000
TRIANGLES, RAYS = 512, 1024


def build(folder: str, width: int) -> ctypes.CDLL:
    """Compile the intrinsics and load them."""
    library = Path(folder) / "packets.so"
    command = [os.environ.get("CC", "gcc"), *FLAGS, f"-DWIDTH={width}", str(SOURCE)]
    subprocess.run([*command, "-o", str(library)], check=True)
    return ctypes.CDLL(str(library))


def scene(form: str, pairs: int, width: int):
    """Return vertices, origins and directions of which half of the tests hit."""
    from rtbench.experiments.packets import in_blocks
    from rtbench.workloads.bundles import bundles
    from rtbench.workloads.pairs import pairs_at_density
    from rtbench.workloads.soup import soup

    if form == "rays":
        drawn = bundles("general", soup("dense", TRIANGLES, RAYS), RAYS // width, width).soup
        return drawn.triangles, drawn.orig, drawn.dir
    drawn = pairs_at_density(pairs, 0.5, "pcg64", 1)
    order = in_blocks(drawn, width)
    corners = np.stack([drawn.v0, drawn.v1, drawn.v2], axis=1)
    return corners[order], drawn.orig[order], drawn.dir[order]


def contestants(name: str, form: str, given, width: int, library: ctypes.CDLL):
    """Return three functions of ``(first, second)``, their numbers of items, and tests an item."""
    from rtbench.compiled import packets, packing
    from rtbench.compiled.intersect import run_once
    from rtbench.compiled.layout import fill
    from rtbench.compiled.loops import loop
    from rtbench.kernels.registry import find

    corners, origins, directions = given
    chosen = packing.Packing(form, width)
    whole = find(f"{name}_whole")
    triangles = packing.fill_triangles(whole, "float32", chosen, corners)
    rays = packing.fill_rays(whole, "float32", chosen, origins, directions)
    compiled = packets.loop(whole, "float32", chosen)
    outputs = packets.run_once(compiled, whole, "float32", chosen, (triangles, rays), len(origins))
    by_hand = [np.zeros_like(each) for each in outputs[:2]]
    function = getattr(library, f"{name}_{form}")
    function.restype = None

    def in_c(first, second):
        sizes = (ctypes.c_int64(n) for n in (len(triangles), len(first), len(second)))
        function(*sizes, *map(pointer, (first, second, triangles, rays, *by_hand)))

    def in_lanes(first, second):
        compiled.call(triangles, rays, first, second, *outputs)

    kind = "nearest" if form == "rays" else "independent"
    vertices = [corners[:, i] for i in range(3)]
    single = fill(find(name), "own", "float32", vertices, origins, directions, tmax=np.inf)
    scalar = loop(find(name), "float32", "own", kind=kind)
    told = run_once(scalar, find(name), "float32", *single)

    def one_by_one(first, second):
        scalar.call(*single, first, second, *told[:2], *(x[:0] for x in told[2:]))

    once = np.zeros(1, np.uint64), np.arange(len(rays), dtype=np.uint64)
    in_c(*once)
    same = all(a.tobytes() == b.tobytes() for a, b in zip(by_hand, outputs[:2], strict=True))
    hits = (
        each[0].reshape(-1) if form == "rays" else each[0].reshape(-1) == 0
        for each in (outputs, told)
    )
    if not same or not np.array_equal(*hits):
        raise SystemExit(f"{name}, {form}: C, lanes and single rays answer differently")
    tests = len(corners) if form == "rays" else 1
    counts = len(rays), len(rays), len(origins)
    return (in_c, in_lanes, one_by_one), counts, (tests * width, tests * width, tests)


def measure(options) -> list[dict]:
    """Time all cells in interleaved rounds and return the samples of each, ns a test."""
    with tempfile.TemporaryDirectory() as folder:
        library = build(folder, options.width)
    cells = []
    for form in FORMS:
        given = scene(form, options.pairs, options.width)
        for name in options.kernels:
            runs, counts, tests = contestants(name, form, given, options.width, library)
            cell = {"kernel": name, "form": form, "runs": [], **{who: [] for who in WHO}}
            for run, count, each in zip(runs, counts, tests, strict=True):
                order = np.random.default_rng(3).permutation(count).astype(np.uint64)
                once = min(timed(run, (np.zeros(1, np.uint64), order)) for _ in range(3))
                repeated = max(1, round(SAMPLE_NS / once))
                indices = np.zeros(repeated, np.uint64), order
                cell["runs"].append((run, indices, count * repeated * each))
            cells.append(cell)
    for number in range(options.rounds):
        for cell in cells[number % len(cells) :] + cells[: number % len(cells)]:
            each = list(zip(WHO, cell["runs"], strict=True))
            turn = number % len(WHO)
            for who, (run, indices, tests) in each[turn:] + each[:turn]:
                cell[who].append(timed(run, indices) / tests)
    return [{key: value for key, value in cell.items() if key != "runs"} for cell in cells]


def ratio(rows: list[dict], above: str) -> str:
    """Return the median of a ratio of neighbouring samples, its interval, and each launch's."""
    each = [[a / b for a, b in zip(row[above], row["lanes"], strict=True)] for row in rows]
    pooled = [value for launch in each for value in launch]
    low, high = interval(pooled)
    launches = " ".join(f"{statistics.median(launch):.2f}" for launch in each)
    return f"{statistics.median(pooled):6.2f} [{low:.2f}, {high:.2f}] ({launches})"


def show(launches: list[list[dict]]) -> None:
    """Print a row a cell, times in ns a test."""
    print(f"{'kernel':<22}{'form':<7}{'C':>8}{'lanes':>8}{'single':>8}  C/lanes; single/lanes")
    for rows in zip(*launches, strict=True):
        times = "".join(
            f"{statistics.median(x for row in rows for x in row[who]):8.3f}" for who in WHO
        )
        name = f"{rows[0]['kernel']:<22}{rows[0]['form']:<7}"
        print(f"{name}{times}  {ratio(rows, 'c')}; {ratio(rows, 'single')}")


def main() -> None:
    """Launch fresh processes, since each places the code elsewhere, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kernels", nargs="*", default=list(KERNELS), choices=KERNELS)
    parser.add_argument("--launches", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=31)
    parser.add_argument("--width", type=int, default=16, choices=(8, 16))
    parser.add_argument("--pairs", type=int, default=25_000)
    parser.add_argument("--samples-to-stdout", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.samples_to_stdout:
        print(json.dumps(measure(options)))
        return
    command = [sys.executable, __file__, *sys.argv[1:], "--samples-to-stdout"]
    launches = []
    for number in range(options.launches):
        print(f"launch {number + 1} of {options.launches}", file=sys.stderr)
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
        if done.returncode:
            raise SystemExit(done.returncode)
        launches.append(json.loads(done.stdout))
    show(launches)


if __name__ == "__main__":
    main()
