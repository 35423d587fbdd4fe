"""Scalar kernels against the same listings in C, interleaved in one process; run by hand.

    python tests/speed/against_c.py [--launches 5] [--rounds 31] [--density 0.5] [--save FILE]

The C listings (tests/kernels/listings.c) are built with gcc -O3 -march=native, without contraction
and without vectorising, and run in the same loop nest over the same records in memory. A ratio
is C's time over rtbench's, pair by pair of neighbouring samples: 0.95 and above is the aim.
Both tell the same: NaN where a test ends before it knows t, and badouel's t of some misses.
"""

import argparse
import ctypes
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

LISTINGS = Path(__file__).parents[1] / "kernels" / "listings.c"
FLAGS = ["-O3", "-march=native", "-ffp-contract=off", "-fno-tree-vectorize", "-shared", "-fPIC"]
KERNELS = ("moller1", "badouel", "chirkov")
ORDERS = ("repeat", "sweep")
WHO = ("c", "rtbench")
SAMPLE_NS = 10_000_000
REPEATED = 500
REAL = {"float32": "float", "float64": "double"}


def build(folder: Path, precision: str) -> ctypes.CDLL:
    """Compile the listings and load them."""
    library = folder / "listings.so"
    flags = [*FLAGS, f"-DREAL={REAL[precision]}"]
    command = [os.environ.get("CC", "gcc"), *flags, str(LISTINGS), "-o", str(library)]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))


def pairs(count: int, density: float, precision: str, library: ctypes.CDLL):
    """Draw pairs of which exactly the given share hits; return both record arrays."""
    from rtbench.compiled.layout import fill
    from rtbench.kernels.registry import find

    draw = np.random.default_rng(2007).random((60 * count, 5, 3), dtype=np.float32)
    orig, end, *vertices = (draw[:, i] for i in range(5))
    direction = end - orig
    direction /= np.sqrt((direction * direction).sum(axis=1))[:, None]
    tris, rays = fill(find("badouel"), "shared", precision, vertices, orig, direction, end)
    outcome, *rest = (np.zeros(len(tris), dtype) for dtype in [np.int32, *[rest_type(tris)] * 3])
    library.run_moller1(ctypes.c_int64(len(tris)), *map(pointer, (tris, rays, outcome, *rest)))
    hits = round(density * count)
    chosen = np.concatenate(
        [np.flatnonzero(outcome == 0)[:hits], np.flatnonzero(outcome != 0)[: count - hits]]
    )
    if len(chosen) != count:
        raise SystemExit(f"density {density} of {count} pairs is out of reach of this draw")
    np.random.default_rng(1).shuffle(chosen)
    return tris[chosen].copy(), rays[chosen].copy()


def rest_type(tris: np.ndarray) -> np.dtype:
    """Return the type of t."""
    return tris.dtype["d"]


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Return where an array's data lies."""
    return ctypes.c_void_p(array.ctypes.data)


def contestants(name, precision, library, tris, rays):
    """Return the loops over one kernel, functions of (first, second), and what they fill."""
    from rtbench.compiled.loops import empty, loop
    from rtbench.kernels.registry import find

    compiled = loop(empty.kernels[0] if name == "empty" else find(name), precision).call
    real = rest_type(tris)
    outcome = [np.full(len(tris), -1, np.int32) for _ in WHO]
    t = [np.zeros(len(tris), real) for _ in WHO]
    none = np.zeros(0, real)

    nest = getattr(library, f"nest_{name}")
    nest.restype = None
    arrays = [pointer(each) for each in (tris, rays, outcome[0], t[0])]

    def in_c(first, second):
        sizes = ctypes.c_int64(len(first)), ctypes.c_int64(len(second))
        nest(*sizes, pointer(first), pointer(second), *arrays)

    def in_numba(first, second):
        compiled(tris, rays, first, second, outcome[1], t[1], none, none)

    return (in_c, in_numba), outcome, t


def order_indices(order: str, count: int, repetitions: int):
    """Return ``first`` and ``second`` of the loop nest."""
    # Repeated, each pair needs many repetitions within a sample: at each new pair the branch
    # predictor errs a few times, which the 20,000 repetitions of the thesis hide.
    count = min(count, REPEATED) if order == "repeat" else count
    shuffled = np.random.default_rng(3).permutation(count).astype(np.uint64)
    zeros = np.zeros(repetitions, np.uint64)
    return (shuffled, zeros) if order == "repeat" else (zeros, shuffled)


def timed(run, indices) -> int:
    """Return the ns that one call takes."""
    begin = time.perf_counter_ns()
    run(*indices)
    return time.perf_counter_ns() - begin


def measure(options) -> list[dict]:
    """Time all cells in interleaved rounds and return the samples of each, ns a test."""
    with tempfile.TemporaryDirectory() as folder:
        library = build(Path(folder), options.precision)
    tris, rays = pairs(options.pairs, options.density, options.precision, library)
    cells = []
    for name in (*options.kernels, "empty"):
        loops, outcome, t = contestants(name, options.precision, library, tris, rays)
        for order in ORDERS:
            count = options.pairs
            for run in loops:  # warm, and the answers of all
                run(*order_indices("sweep", count, 2))
                run(*order_indices(order, count, 2))
            same = np.array_equal(*outcome) and np.array_equal(*t, equal_nan=True)
            if not same:
                raise SystemExit(f"{name}: C and rtbench answer differently")
            once = min(timed(loops[0], order_indices(order, count, 20)) / 20 for _ in range(3))
            indices = order_indices(order, count, max(2, round(SAMPLE_NS / once)))
            cells.append(
                {"kernel": name, "order": order, "loops": loops, "indices": indices}
                | {who: [] for who in WHO}
            )
    for number in range(options.rounds):
        for cell in cells[number % len(cells) :] + cells[: number % len(cells)]:
            tests = math.prod(map(len, cell["indices"]))
            turn = number % len(WHO)
            each = list(zip(WHO, cell["loops"], strict=True))
            for who, run in each[turn:] + each[:turn]:
                cell[who].append(timed(run, cell["indices"]) / tests)
    return [{key: cell[key] for key in ("kernel", "order", *WHO)} for cell in cells]


def interval(values: list[float]) -> tuple[float, float]:
    """Return a 95 % interval of the median that assumes nothing of the distribution.

    The k-th smallest and k-th largest value, k the largest for which the binomial
    probability of fewer than k of n on one side is at most 2.5 %.
    """
    n, below, k = len(values), 0.0, 0
    while k < n // 2 and below + math.comb(n, k) / 2**n <= 0.025:
        below += math.comb(n, k) / 2**n
        k += 1
    ordered = sorted(values)
    return (ordered[k - 1], ordered[n - k]) if k else (math.nan, math.nan)


def ratio_of(rows: list[dict]) -> tuple[str, str]:
    """Return C's time over rtbench's: the median with its interval, and each launch's median."""
    ratios = [[c / n for c, n in zip(row["c"], row["rtbench"], strict=True)] for row in rows]
    pooled = [ratio for launch in ratios for ratio in launch]
    low, high = interval(pooled)
    each = " ".join(f"{statistics.median(launch):.3f}" for launch in ratios)
    return f"{statistics.median(pooled):.3f} [{low:.3f}, {high:.3f}]", each


def show(launches: list[list[dict]]) -> None:
    """Print a row a cell, times in ns a test, then what each launch gave."""
    print(
        f"{'kernel':<9}{'order':<8}{'C':>8}{'rtbench':>9}"
        f"  {'C / rtbench':<22}  median of each launch"
    )
    cells = list(zip(*launches, strict=True))
    for rows in cells:
        name = f"{rows[0]['kernel']:<9}{rows[0]['order']:<8}"
        c, numba = (statistics.median(x for row in rows for x in row[w]) for w in WHO)
        ratio, each = ratio_of(rows)
        print(f"{name}{c:8.3f}{numba:9.3f}  {ratio:<22}  {each}")
    if len(launches) == 1:
        return
    print("\nns a test, median of each launch")
    for rows in cells:
        name = f"{rows[0]['kernel']:<9}{rows[0]['order']:<8}"
        for who in WHO:
            told = " ".join(f"{statistics.median(row[who]):7.3f}" for row in rows)
            print(f"{name}{who:<9}{told}")


def main() -> None:
    """Launch fresh processes, since each places the code elsewhere, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kernels", nargs="*", default=list(KERNELS))
    parser.add_argument("--launches", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=31)
    parser.add_argument("--pairs", type=int, default=25_000)
    parser.add_argument("--density", type=float, default=0.5)
    parser.add_argument("--precision", choices=REAL, default="float32")
    parser.add_argument("--save", type=Path, help="write all samples to this JSON file")
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
    if options.save:
        options.save.write_text(json.dumps(launches))
    show(launches)


if __name__ == "__main__":
    main()
