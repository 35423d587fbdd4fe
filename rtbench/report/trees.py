"""A run of the experiment ``trees`` as tables and charts read it: trees, times, what rays meet."""

from functools import cached_property
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from rtbench.records import derive, statistics
from rtbench.records.statistics import Estimate, Times
from rtbench.records.tabular import plain
from rtbench.report import cells
from rtbench.report.digits import absent
from rtbench.report.tree_cells import (
    ENDINGS,
    NAIVE,
    PEER,
    RAYS,
    RULES,
    Built,
    Timed,
    build_seconds,
    clocks,
    is_peer,
    key_of,
)

if TYPE_CHECKING:
    from rtbench.records.run import Run


class Trees:
    """What a run of the experiment ``trees`` has measured.

    Parameters
    ----------
    run : Run
        Finished or not.
    """

    def __init__(self, run: "Run") -> None:
        self.run = run
        self.seed = statistics.seed_of(run.name)
        self._medians: dict[int, Estimate] = {}
        self._ratios: dict[tuple[int, int], Estimate | None] = {}
        self._built: dict[str, list[Built]] = {}

    @cached_property
    def timed(self) -> list[Timed]:
        """Every cell, in the order of the run's config; trees before peers before the naive way."""
        found = []
        columns = [*self.run.cell, "outcome"]
        for key, samples in (
            derive.cells(self.run, columns).items() if len(self.run.samples) else ()
        ):
            cell = dict(zip(columns, key, strict=True))
            cell.pop("outcome")
            times = derive.times(samples)
            cpu_ns = samples["cpu_ns"].to_numpy(float, na_value=np.nan)
            cpu = Times(
                np.maximum(cpu_ns, 0.5) / samples["tests"].to_numpy(float),
                times.process,
                times.round,
            )
            rays = int(samples["tests"].iloc[0] // max(samples["repetitions"].iloc[0], 1))
            found.append(Timed(cell, times, cpu, int(samples["triangles"].iloc[0]), rays))
        return sorted(found, key=self._place)

    def _place(self, timed: Timed) -> tuple:
        way = timed.cell["way"]
        last = 2 if way == NAIVE else 1 if way == PEER else 0
        precision, rays = str(timed.cell["precision"]), str(timed.cell["rays"])
        return (
            self._rank("model", timed.cell["model"]),
            [*RAYS, rays].index(rays),
            last,
            *self._tree_place(timed.key),
            self._rank("kernel", timed.cell["kernel"]),
            [*cells.PRECISIONS, precision].index(precision),
            self._rank("way", timed.cell["way"]),
        )

    def _tree_place(self, key: tuple) -> tuple:
        structure, rule, builder, ending = key
        return (
            structure != "kd",
            [*RULES, rule].index(rule),
            self._rank("builder", builder.split(" ")[0]),
            builder,
            [*ENDINGS, ending].index(ending),
        )

    def _rank(self, column: str, value: object) -> int:
        told = (self.run.info.get("config") or {}).get(f"{column}s") or []
        # A model may be a path, and one that need not be there has a question mark.
        told = [
            PurePath(name.removesuffix("?")).stem if "/" in name else name.removesuffix("?")
            for name in told
        ]
        return told.index(value) if value in told else len(told)

    @cached_property
    def models(self) -> list[str]:
        """The models, as the config names them, then as they appear."""
        there = cells.values(self.run.trees, "model")
        there += [one.cell["model"] for one in self.timed]
        return sorted(dict.fromkeys(there), key=lambda name: self._rank("model", name))

    @cached_property
    def families(self) -> dict[str, list[str]]:
        """Families of models that are there in at least three sizes; the names by size."""
        found: dict[str, list[str]] = {}
        for model in self.models:
            found.setdefault(model.partition(":")[0], []).append(model)
        return {
            family: sorted(names, key=self.triangles)
            for family, names in found.items()
            if len(names) > 2
        }

    @cached_property
    def alone(self) -> list[str]:
        """The models that are no sizes of a family."""
        sized = {name for names in self.families.values() for name in names}
        return [name for name in self.models if name not in sized]

    def only_kernels(self, model: str) -> bool:
        """Tell whether kernels differ, and no rules do: then kernels are the question."""
        ours = [one for one in self.of(model) if one.ours]
        rules = {one.key for one in ours if one.key[0] == "kd"}
        return len(rules) <= 1 and len({one.form for one in ours}) > 1

    def triangles(self, model: str) -> int:
        """Return how many triangles a model has; 0 where nothing tells."""
        rows = cells.where(self.run.trees, model=model)["triangles"].tolist()
        rows += [one.triangles for one in self.timed if one.cell["model"] == model]
        return int(rows[0]) if rows else 0

    def facts(self, model: str) -> dict:
        """Return what run.json tells of a model."""
        told = self.run.info.get("models") or []
        return next((one for one in told if one.get("model") == model), {})

    def built(self, model: str) -> list[Built]:
        """Return the trees of a model that were built, peers' too, in a reader's order."""
        if model not in self._built:
            self._built[model] = self._all_built(model)
        return self._built[model]

    def _all_built(self, model: str) -> list[Built]:
        found: dict[tuple, list[dict]] = {}
        for row in cells.where(self.run.trees, model=model).to_dict("records"):
            row = {name: plain(value) for name, value in row.items()}
            found.setdefault((key_of(row), row.get("block")), []).append(row)
        trees = [
            Built(key, block, rows[0], np.array([build_seconds(key, row) for row in rows], float))
            for (key, block), rows in found.items()
        ]
        # A peer's own structure bears its name and has no nodes.
        return sorted(
            trees,
            key=lambda tree: (is_peer(tree), *self._tree_place(tree.key), tree.block or 0),
        )

    def of(self, model: str, rays: str | None = None) -> list[Timed]:
        """Return the cells of a model, of one ray set if named."""
        return [
            one
            for one in self.timed
            if one.cell["model"] == model and rays in (None, one.cell["rays"])
        ]

    def ray_sets(self, model: str | None = None) -> list[str]:
        """Return the ray sets that were timed, primary ones first."""
        there = {one.cell["rays"] for one in self.timed if model in (None, one.cell["model"])}
        return sorted(there, key=lambda name: ([*RAYS, name].index(name), name))

    def median(self, timed: Timed) -> Estimate:
        """Return the nanoseconds a ray of a cell: of the processor, where it is one thread's."""
        if id(timed) not in self._medians:
            times = timed.cpu if timed.by_cpu else timed.times
            self._medians[id(timed)] = statistics.median(times, self.seed)
        return self._medians[id(timed)]

    def ratio(self, one: Timed, other: Timed) -> Estimate | None:
        """Return how many times as long one takes as the other, paired by process and round.

        By the processor's time, which others on the machine disturb less; by the clock where one of
        both has more threads.
        """
        key = id(one), id(other)
        if key not in self._ratios:
            pair = clocks(one, other)
            self._ratios[key] = statistics.paired_ratio(*pair, self.seed)
        return self._ratios[key]

    def naive(self, timed: Timed) -> Timed | None:
        """Return the naive way's cell of the same model, kernel, precision and rays."""
        wanted = {n: timed.cell[n] for n in ("model", "kernel", "precision", "rays")}
        return next(
            (
                one
                for one in self.timed
                if one.cell["way"] == NAIVE and wanted.items() <= one.cell.items()
            ),
            None,
        )

    def visits(self, timed: Timed) -> dict:
        """Return what rays meet in a cell's tree, as counted: a row of visits.csv, or nothing."""
        rows = [
            row
            for row in self._visits
            if row["model"] == timed.cell["model"]
            and row["rays"] == timed.cell["rays"]
            and key_of(row) == timed.key
            and not absent(row["steps"])
            and timed.block in (None, row.get("block"))
        ]
        return rows[0] if rows else {}

    @cached_property
    def _visits(self) -> list[dict]:
        return [
            {name: plain(value) for name, value in row.items()}
            for row in self.run.visits.to_dict("records")
        ]

    def wrong(self, timed: Timed) -> dict:
        """Return how often a kernel is wrong in a model's trees, by brute force and exactly."""
        whole: dict = {}
        for row in self._visits:
            same = row["model"] == timed.cell["model"] and row["rays"] == timed.cell["rays"]
            if same and (row["kernel"], row["precision"]) == timed.form:
                for name in ("wrong", "rays_judged", "exact_wrong", "exact_judged"):
                    if not absent(row.get(name)):
                        whole[name] = max(whole.get(name, 0), int(row[name]))
        return whole

    def tree(self, timed: Timed) -> Built | None:
        """Return the tree that a cell walks."""
        there = [one for one in self.built(timed.cell["model"]) if one.key == timed.key]
        fitting = [one for one in there if timed.block in (None, one.block)]
        return (fitting or there or [None])[0]

    def peer_built(self, timed: Timed) -> Built | None:
        """Return what a peer built of a model."""
        there = self.built(timed.cell["model"])
        return next((one for one in there if one.key[0] == timed.cell["kernel"]), None)


def level_with_best(trees: Trees, timed: list[Timed]) -> tuple[Timed | None, list[Timed]]:
    """Return the fastest of some cells, and those that cannot be told from it (Holm over all)."""
    if not timed:
        return None, []
    times = {str(place): each for place, each in enumerate(clocks(*timed))}
    best, level = statistics.not_separable(times, trees.seed)
    # One process says nothing of how processes differ: then nothing at all can be told apart.
    return timed[int(best)], [timed[int(place)] for place in level]
