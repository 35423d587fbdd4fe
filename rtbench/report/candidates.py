"""What runs say of each kernel at one hit ratio: its time, what it stores, what it returns."""

import itertools
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rtbench.errors import NotComparable
from rtbench.records import derive, schema
from rtbench.records.statistics import Times, total
from rtbench.records.tabular import plain

if TYPE_CHECKING:
    from rtbench.records.run import Run

# The experiments that can be asked, in groups whose workloads mean the same.
SOUPS = ("soup", "break_even")
PACKETS = ("packets",)
PAIRS = ("density",)
ACCURACY = ("accuracy",)
# Columns of a cell that tell a workload, not a way to do it.
WORKLOAD = ("density", "order", "scene", "triangles", "packet", "angle", "workload", "flags")
# What the rays of a packet share and how far they spread: cells of one kind are compared.
KIND = ("packet", "angle")
# What a config asks, beside how long: a newer run of the same replaces an older one.
ASKED = ("name", "kernels", "precisions", "densities", "triangles", "rays", "sizes", "prepared")
MESH = "mesh"  # of a run of accuracy: rays that meet all of its triangles
SCALAR = "scalar"  # the form of a run of accuracy that is not in packets
ORDER = "sweep"  # as rays meet triangles: nothing is repeated until it is learnt
MACHINE = ("cpu_model", "cpu_family", "cpu_model_number", "cpu_stepping", "cpu_flags", "caches")


@dataclass(frozen=True, eq=False)
class Candidate:
    """One way to test, as one run measured it.

    Attributes
    ----------
    run : Run
        Where it was measured.
    kernel, precision : str
    way : tuple of (column, value)
        What else identifies it: how it was prepared, the width of its packets.
    scene : int
        Number of triangles that were tested.
    times : Times
        ns a test at the hit ratio asked for.
    outside : float
        How far that hit ratio lies outside those that were measured.
    points : tuple of float
        The measured hit ratios that the times are made of.
    """

    run: "Run"
    kernel: str
    precision: str
    way: tuple
    scene: int
    times: Times
    outside: float
    points: tuple[float, ...]

    @property
    def identity(self) -> tuple:
        """What is the same in two runs that measured the same."""
        return self.kernel, self.precision, self.way

    @property
    def method(self) -> dict:
        """What run.json tells of the kernel: stored, outputs, ending."""
        return (self.run.info.get("methods") or {}).get(self.kernel) or {}

    @property
    def facts(self) -> dict:
        """What run.json tells of the kernel in this precision: bytes, digests."""
        return ((self.run.info.get("kernels") or {}).get(self.kernel) or {}).get(
            self.precision
        ) or {}

    @property
    def stored(self) -> str | None:
        """What must be known of a triangle beforehand; None where the run does not tell."""
        return self.method.get("stored")

    @property
    def bytes(self) -> int | None:
        """Bytes that are read of a triangle, in the layout of the run."""
        padded = (self.run.info.get("config") or {}).get("layout") == "padded"
        return self.facts.get("bytes_per_triangle_padded" if padded else "bytes_per_triangle")

    @property
    def preparation(self) -> float | None:
        """ns to prepare a triangle; 0 where nothing is stored, None where it was not timed."""
        if self.stored == "none":
            return 0.0
        for row in self.run.info.get("preparation") or []:
            if (row["kernel"], row["precision"], row["scene"]) == (*self.identity[:2], self.scene):
                return float(row["ns_per_triangle"])
        found = self.facts.get("prepare_ns_per_triangle")
        return None if found is None else float(found)

    @property
    def wrong(self) -> int:
        """How many rays got a nearest triangle that rounding does not explain."""
        return sum(row.get("wrong") or 0 for row in self._rows("nearest"))

    @property
    def estimated(self) -> int:
        """How many rays got another triangle where the reciprocal is only estimated."""
        return sum(row.get("differ") or 0 for row in self._rows("estimates"))

    def _rows(self, part: str) -> list[dict]:
        """Return the rows of a part of run.json that are about this."""
        own = {"kernel": self.kernel, "precision": self.precision} | dict(self.way)
        rows = self.run.info.get(part) or []
        return [row for row in rows if all(row.get(k, v) == v for k, v in own.items())]


def same_machine(one: dict, other: dict) -> bool:
    """Return whether two fingerprints (run.json ``machine``) are of one kind of processor."""
    return all(one.get(name) == other.get(name) for name in MACHINE)


def measured_runs(
    out: Path, machine: dict, packets: bool = False, judged: bool = False
) -> list["Run"]:
    """Return the newest finished run of each config that was made on a machine.

    Parameters
    ----------
    out : Path
        The output folder.
    machine : dict
        The machine's fingerprint, as run.json keeps it.
    packets : bool
        Runs of packets, not of single rays.
    judged : bool
        Runs of the experiment accuracy first, which has the kernels that stay stable.

    Returns
    -------
    list of Run
        Newest first; runs over soups, or over pairs where there are none, or of accuracy.
    """
    found = [run for run in finished_runs(out, machine) if (run.path / schema.SAMPLES).exists()]
    return comparable(found, packets, judged)


def finished_runs(out: Path, machine: dict) -> list["Run"]:
    """Return the newest finished run of each config that a machine made, with samples or not."""
    from rtbench.records.run import Run, read_info

    newest: dict[str, Run] = {}
    for file in Path(out).glob(f"[!.]*/{schema.RUN}"):
        try:
            run = Run(file.parent, read_info(file.parent))
        except NotComparable:
            continue  # damaged, or of a newer rtbench: whoever asks for it by name is told
        if not run.finished or run.published:
            continue
        if not same_machine(run.info.get("machine") or {}, machine):
            continue
        told = run.info.get("config") or {}
        config = json.dumps([run.info.get("experiment"), *(told.get(name) for name in ASKED)])
        if config not in newest or created(newest[config]) < created(run):
            newest[config] = run
    return list(newest.values())


def comparable(runs: Sequence["Run"], packets: bool = False, judged: bool = False) -> list["Run"]:
    """Return those runs, newest first, whose workloads mean the same: packets, soups, or pairs."""
    groups = (PACKETS, ACCURACY) if packets else (SOUPS, PAIRS, ACCURACY)
    for group in (ACCURACY, *groups) if judged else groups:
        found = [run for run in runs if run.info.get("experiment") in group]
        if found:
            return sorted(found, key=created, reverse=True)
    return []


def candidates(run: "Run", hit_ratio: float, packets: bool = False) -> list[Candidate]:
    """Return what a run measured, between its hit ratios as the mixture of both.

    Parameters
    ----------
    run : Run
        With samples; cells in another order than sweep are left out.
    hit_ratio : float
        A measured one (also by its nominal name), one between two, else the nearest is taken.
    packets : bool
        Of a run of accuracy, which has both: what was taken in packets.

    Returns
    -------
    list of Candidate
        One for each kernel, precision, scene and way.
    """
    cells: dict[tuple, dict[float, Times]] = {}
    kind = kind_of_packets(run)
    for key, samples in derive.cells(run, [*run.cell, "outcome"]).items():
        cell = dict(zip([*run.cell, "outcome"], key, strict=True))
        density = cell.get("density")
        if cell["kernel"] == schema.EMPTY or cell["outcome"] is not None:
            continue
        if any(cell[name] != value for name, value in kind.items()):
            continue  # blocks of pairs too: they are of no kind
        if not isinstance(density, float) or cell.get("order", ORDER) != ORDER:
            continue
        if not _is_asked(run, cell, packets):
            continue
        told = (*WORKLOAD, "kernel", "precision")
        told = (*told, "form", "width") if cell.get("form") == SCALAR else told
        way = tuple((k, cell[k]) for k in run.cell if k not in told)
        scene = cell.get("scene") or _scene(run, density)
        same = cells.setdefault((cell["kernel"], cell["precision"], way, scene), {})
        same[density] = derive.times(samples)
    found = []
    for (kernel, precision, way, scene), times in cells.items():
        parts = list(_parts(run, scene, times, hit_ratio))
        mixed = total([replace(part, ns=share * part.ns) for _, share, part in parts])
        if len(mixed.ns):  # a run that was cut off may lack a round
            points = tuple(ratio for ratio, _, _ in parts)
            nominal = hit_ratio in times
            outside = 0.0 if nominal else max(min(points) - hit_ratio, hit_ratio - max(points), 0)
            found.append(Candidate(run, kernel, precision, way, scene, mixed, outside, points))
    return found


def _is_asked(run: "Run", cell: dict, packets: bool) -> bool:
    """Tell whether a cell of a run of accuracy is of a kernel to take; any cell of other runs."""
    if run.info.get("experiment") not in ACCURACY:
        return True
    usual = {"flags": "strict", "reciprocal": "division"}
    usual["form"] = "pairs" if packets else SCALAR
    if cell["kernel"] in (run.info.get("apart") or []) or cell["workload"] == MESH:
        return False
    return all(cell[k] == v for k, v in usual.items())


def kind_of_packets(run: "Run") -> dict:
    """Return which packets are asked: those that most was tried with.

    Parameters
    ----------
    run : Run
        With samples.

    Returns
    -------
    dict
        What their rays share (packet) and how far they spread (angle, degrees); {} for no packets.
    """
    columns = [name for name in KIND if name in run.cell]
    kinds = Counter(
        kind
        for kind in zip(*(map(plain, run.samples[name]) for name in columns), strict=True)
        if None not in kind
    )
    return dict(zip(columns, kinds.most_common(1)[0][0], strict=True)) if kinds else {}


def _parts(
    run: "Run", scene: int, times: dict[float, Times], wanted: float
) -> Iterator[tuple[float, float, Times]]:
    """Yield hit ratio, share and times of what is to be mixed."""
    if wanted in times:
        yield _hit_ratio(run, scene, wanted), 1.0, times[wanted]
        return
    points = sorted((_hit_ratio(run, scene, density), density) for density in times)
    for (low, first), (high, second) in itertools.pairwise(points):
        if low <= wanted <= high and low < high:
            share = (wanted - low) / (high - low)
            yield low, 1 - share, times[first]
            yield high, share, times[second]
            return
    nearest, density = min(points, key=lambda point: abs(point[0] - wanted))
    yield nearest, 1.0, times[density]


def _workload(run: "Run", scene: int | None, density: float) -> dict:
    for row in run.info.get("workloads") or []:
        if row.get("density") == density and scene in (None, row.get("scene", row["triangles"])):
            return row
    return {}


def _scene(run: "Run", density: float) -> int:
    row = _workload(run, None, density)
    return row.get("scene", row.get("triangles", 0))


def _hit_ratio(run: "Run", scene: int, density: float) -> float:
    """Return the exact share of hits; a soup's differs from its nominal one by chance."""
    row = _workload(run, scene, density)
    return float(row.get("hit_ratio") or density)


def created(run: "Run") -> str:
    """Return when a run was begun, as text that sorts."""
    return str(run.info.get("created") or run.name)
