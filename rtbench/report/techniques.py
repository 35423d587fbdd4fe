"""What runs of ``subsampling`` and ``techniques`` say: times, paired ratios, errors."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rtbench.records.derive import cells, times
from rtbench.records.statistics import (
    Estimate,
    Times,
    geometric_mean,
    median,
    paired_ratio,
    seed_of,
)
from rtbench.report.digits import absent

if TYPE_CHECKING:
    from rtbench.records.run import Run

FULL, NONE = "full", "none"
CACHE, FIRST_HIT = "shadow_cache", "first_hit"
FREE = 0.9  # of the time a lone thread must run, for cores to be called free
RAYS = ("primary", "shadow", "reflection", "refraction", "indirect")
Group = tuple[str, str]  # kernel and precision


class _Cells:
    """The cells of a run by its columns, wall and processor time apart."""

    def __init__(self, run: "Run", columns: list[str], table) -> None:
        self.run = run
        self.seed = seed_of(run.name)
        self.times: dict[tuple, Times] = {}
        self.cpu: dict[tuple, Times] = {}
        if len(run.samples):
            for key, samples in cells(run, columns).items():
                self.times[key] = times(samples)
                self.cpu[key] = times(samples.assign(ns=samples["cpu_ns"]))
        self.facts = {fact["scene"]: fact for fact in run.info.get("scenes") or []}
        self.rows = {tuple(row[name] for name in columns): row for row in table.to_dict("records")}

    @property
    def groups(self) -> list[Group]:
        """Kernels and precisions."""
        return list(dict.fromkeys(key[:2] for key in self.times))

    def scenes(self, group: Group) -> list[str]:
        """The scenes that were traced, in the order of the run."""
        there = {key[2] for key in self.times if key[:2] == group}
        return [name for name in self.facts if name in there]

    @property
    def running(self) -> float:
        """The share of the time for which a lone thread had a core: the middle of all samples."""
        alone = [key for key in self.times if self.lone(key)]
        shares = [self.cpu[key].ns / self.times[key].ns for key in alone]
        return float(np.median(np.concatenate(shares))) if shares else math.nan

    @property
    def free_cores(self) -> bool:
        """Whether cores were free: else threads gain nothing, and processor time tells more."""
        return self.running >= FREE

    def lone(self, key: tuple) -> bool:
        """Whether a cell is traced by one thread."""
        return True

    def over(self, group: Group, scene: str, one: tuple, other: tuple, cpu: bool = False):
        """Return how many times as long one cell takes as another, paired by rounds, or None."""
        known = self.cpu if cpu else self.times
        a, b = known.get((*group, scene, *one)), known.get((*group, scene, *other))
        return None if a is None or b is None else paired_ratio(a, b, self.seed)

    def milliseconds(self, group: Group, scene: str, cell: tuple) -> Estimate | None:
        """Return the time of a picture in ms."""
        found = self.times.get((*group, scene, *cell))
        if found is None:
            return None
        fact = self.facts[scene]
        return median(replace(found, ns=found.ns * fact["width"] * fact["height"] / 1e6), self.seed)


class Ways(_Cells):
    """A run of ``subsampling``: ways are (grid, tolerance, interpolation)."""

    full = (FULL, 0.0, NONE)

    def __init__(self, run: "Run") -> None:
        columns = ["kernel", "precision", "scene", "grid", "tolerance", "interpolation"]
        super().__init__(run, columns, run.subsampling)
        config = run.info["config"]
        self.grids, self.tolerances, self.interpolations = (
            list(config[name]) for name in ("grids", "tolerances", "interpolations")
        )

    def faster(self, group: Group, scene: str, way: tuple, cpu: bool = False) -> Estimate | None:
        """Return how many times as long the full picture takes as a subsampled one."""
        return self.over(group, scene, self.full, way, cpu)

    def row(self, group: Group, scene: str, way: tuple) -> dict | None:
        """Return what subsampling.csv says of a way."""
        return self.rows.get((*group, scene, *way))

    def mean(
        self, group: Group, way: tuple, cpu: bool = False
    ) -> tuple[Estimate | None, dict | None]:
        """Return the geometric mean over the scenes of the speed-up, and means of the rest.

        Returns
        -------
        Estimate or None
            None where a scene was not timed.
        dict or None
            Means of mean_square, above_two_steps, and traced and rays as shares; the greatest of
            greatest.
        """
        scenes = self.scenes(group)
        ratios = [self.faster(group, scene, way, cpu) for scene in scenes]
        rows = [self.row(group, scene, way) for scene in scenes]
        told = None
        if rows and all(rows):
            told = {
                name: sum(row[name] for row in rows) / len(rows)
                for name in ("mean_square", "above_two_steps")
            }
            told["traced"] = sum(traced(row) for row in rows) / len(rows)
            told["rays"] = sum(row["rays"] / row["rays_full"] for row in rows) / len(rows)
        whole = bool(ratios) and all(each is not None for each in ratios)
        return (geometric_mean(ratios).estimate if whole else None), told


class Techniques(_Cells):
    """A run of ``techniques``: cells are (technique, threads)."""

    def __init__(self, run: "Run") -> None:
        columns = ["kernel", "precision", "scene", "technique", "threads"]
        super().__init__(run, columns, run.techniques)

    def lone(self, key: tuple) -> bool:
        """Whether a cell is traced by one thread."""
        return key[4] == 1

    def faster(self, group: Group, scene: str, technique: str, cpu: bool = False):
        """Return how many times as long ordinary tracing takes as with a technique, or None."""
        return self.over(group, scene, (NONE, 1), (technique, 1), cpu)

    def threaded(self, group: Group, scene: str, threads: int, cpu: bool = False):
        """Return how many times as long one thread takes as several, or None."""
        for technique in (CACHE, NONE):
            found = self.over(group, scene, (technique, 1), (technique, threads), cpu)
            if found is not None:
                return found
        return None

    @property
    def threads(self) -> list[int]:
        """Numbers of threads above 1 that were timed."""
        return sorted({key[4] for key in self.times if key[4] > 1})

    def rays(self, group: Group, scene: str) -> dict[str, int]:
        """Return the rays of a picture by kind."""
        row = self.rows.get((*group, scene, NONE, 1)) or {}
        counts = {kind: row.get(f"rays_{kind}") for kind in RAYS}
        return {kind: 0 if absent(count) else int(count) for kind, count in counts.items()}

    def equal(self, group: Group, scene: str) -> bool | None:
        """Return whether all pictures of a scene are equal to the last bit; None of one alone."""
        digests = [row["picture"] for key, row in self.rows.items() if key[:3] == (*group, scene)]
        return len(set(digests)) == 1 if len(digests) > 1 else None


def traced(row: dict) -> float:
    """Return the share of a picture's pixels that were traced."""
    return 1 - row["interpolated"] / (row["width"] * row["height"])


def root_mean_square(mean_square: float) -> float:
    """Return the root, in steps of 8 bits (1/255)."""
    return 255 * math.sqrt(mean_square)


def psnr(mean_square: float) -> float:
    """Return the peak signal-to-noise ratio in dB, the peak 1; infinite for equal pictures."""
    return -10 * math.log10(mean_square) if mean_square else math.inf
