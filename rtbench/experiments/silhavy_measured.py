"""Runs of trees as the statements of Šilhavý 2010 want them: rule against rule, over models."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np

from rtbench.experiments.verdicts import CONFIRMED, NOT_RESOLVED, REFUTED, shown
from rtbench.records.resampling import (
    RESAMPLES,
    Estimate,
    Times,
    joined,
    paired_ratio,
    seed_of,
)
from rtbench.records.run import Run
from rtbench.records.tabular import plain
from rtbench.report.tree_cells import RULES, Built, Timed
from rtbench.report.trees import Trees

SAH, OBJECT, SPATIAL = "sah", "object_median", "spatial_median"
# Of the models: triangles of one size spread evenly; surfaces that are "fairly even" (5.1); scenes
# that are nearly empty beside something dense, or halls with detail.
EVEN = ("even",)
SURFACES = ("scanned", "bunny", "dragon", "buddha")
UNEVEN = ("robots", "teapot_in_stadium", "sponza")


class Rules:
    """A run of the experiment ``trees``: the plain walk by its first kernel, rule by rule."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.trees = Trees(run)
        self.seed = seed_of(run.name)

    @property
    def models(self) -> list[str]:
        """The models, in the config's order."""
        return self.trees.models

    @cached_property
    def _plain(self) -> list[Timed]:
        """Cells of k-d trees by the first kernel, precision and way."""
        ours = [one for one in self.trees.timed if one.ours and one.key[0] == "kd"]
        if not ours:
            return []
        first = ours[0]
        return [o for o in ours if (o.form, o.cell["way"]) == (first.form, first.cell["way"])]

    def cells(self, model: str) -> list[Timed]:
        """Return the cells of a model."""
        return [one for one in self._plain if one.cell["model"] == model]

    def ray_sets(self, model: str) -> list[str]:
        """Return the ray sets of a model, primary ones first."""
        there = {one.cell["rays"] for one in self.cells(model)}
        return [rays for rays in self.trees.ray_sets(model) if rays in there]

    def best(self, model: str, rule: str, rays: str) -> Timed | None:
        """Return a rule's cell in the tree whose ending serves it best; no variant of the SAH."""
        there = [
            one
            for one in self.cells(model)
            if one.key[1] == rule and one.cell["rays"] == rays and " " not in one.key[2]
        ]
        return min(there, key=lambda one: self.trees.median(one).value, default=None)

    def slower(self, model: str, slow: str, fast: str) -> Estimate | None:
        """Return how many times as long a ray takes by one rule as by another, over ray sets."""
        pairs = [
            (self.best(model, slow, rays), self.best(model, fast, rays))
            for rays in self.ray_sets(model)
        ]
        return middle(self.trees.ratio(*pair) for pair in pairs if None not in pair)

    def each_slower(
        self, slow: str, fast: str, models: Sequence[str] | None = None
    ) -> dict[str, Estimate]:
        """Return `slower` of every model that has both rules, or of these."""
        wanted = self.models if models is None else [m for m in self.models if family(m) in models]
        found = {model: self.slower(model, slow, fast) for model in wanted}
        return {model: value for model, value in found.items() if value is not None}

    def naive(self, model: str, rule: str = SAH) -> Estimate | None:
        """Return how many times as long the naive way takes as a rule's trees."""
        for rays in self.ray_sets(model):
            one = self.best(model, rule, rays)
            naive = self.trees.naive(one) if one is not None else None
            if naive is not None:
                return self.trees.ratio(naive, one)
        return None

    def variants(self, model: str) -> dict[tuple[str, str], dict[str, Timed]]:
        """Return the SAH's cells by axes and candidates, then by rays, alike but for these."""
        groups: dict[tuple, dict[tuple[str, str], dict[str, Timed]]] = {}
        for one in self.cells(model):
            tree = self.trees.tree(one)
            if one.key[1] != SAH or tree is None:
                continue
            axes, candidates, overlap = (
                str(plain(tree.facts.get(name))) for name in ("axes", "candidates", "overlap")
            )
            alike = groups.setdefault((one.key[3], overlap, one.key[2].split(" ")[0]), {})
            alike.setdefault((axes, candidates), {}).setdefault(one.cell["rays"], one)
        return max(groups.values(), key=len, default={})  # variants are built with one ending

    def built(self, model: str, rule: str) -> list[Built]:
        """Return the k-d trees of a rule over a model, no variants of the SAH, one by one."""
        return [
            tree
            for tree in self.trees.built(model)
            if tree.key[0] == "kd"
            and tree.key[1] == rule
            and " " not in tree.key[2]
            and tree.block in (None, 1)
        ]

    def build_ratio(self, one: Timed, other: Timed) -> Estimate | None:
        """Return how many times as long building one cell's tree takes as another's."""
        trees = self.trees.tree(one), self.trees.tree(other)
        if None in trees:
            return None
        return paired_ratio(*(of_builds(tree.seconds) for tree in trees), self.seed)


def family(model: str) -> str:
    """Return a model's name without its size."""
    return model.partition(":")[0]


def of_builds(seconds: Sequence[float], process: Sequence[int] | None = None) -> Times:
    """Return seconds as samples: one a process, or the rounds of the processes that are given."""
    process = np.arange(len(seconds)) if process is None else np.asarray(process, np.int64)
    turn = np.array([np.count_nonzero(process[:k] == process[k]) for k in range(len(process))])
    return Times(np.asarray(seconds, float) * 1e9, process, turn.astype(np.int64))


def middle(estimates: Iterable[Estimate | None]) -> Estimate | None:
    """Return the geometric mean of ratios that were drawn together, None of none."""
    there = [each for each in estimates if each is not None]
    if not there:
        return None
    draws = None
    if all(each.draws is not None for each in there):
        draws = np.exp(np.mean([np.log(each.draws) for each in there], axis=0))
    value = float(np.exp(np.mean([np.log(each.value) for each in there])))
    return joined(value, draws, there)


def over(found: Mapping[str, Estimate], seed: int = 0, geometric: bool = True) -> Estimate:
    """Return the mean of several models' estimates, the models being the unit of replication.

    Parameters
    ----------
    found : mapping of str to Estimate
        At least one; a single one is returned as it is.
    seed : int
    geometric : bool
        Of ratios; else arithmetic.

    Returns
    -------
    Estimate
        A resample draws models with replacement, and of each a resampled value: the interval tells
        what other models of these kinds may show, not only how well these were measured.
    """
    values = list(found.values())
    if len(values) == 1:
        return values[0]
    there, back = (np.log, np.exp) if geometric else (np.asarray, np.asarray)
    each = np.stack(
        [there(np.full(RESAMPLES, v.value) if v.draws is None else v.draws) for v in values]
    )
    chosen = np.random.default_rng([seed, 2010]).integers(0, len(values), (RESAMPLES, len(values)))
    draws = back(each[chosen, np.arange(RESAMPLES)[:, None]].mean(axis=1))
    value = float(back(np.mean([there(v.value) for v in values])))
    return Estimate(value, draws, len(values), len(values) - 1.0)


def counted(value: float) -> Estimate:
    """Return a count, which is the same every time: its interval is the number itself."""
    return Estimate(float(value), np.full(RESAMPLES, float(value)), 5, 4.0)


def brief(estimate: Estimate, unit: str = "", scale: float = 1.0, digits: int = 2) -> str:
    """Return a number as text, with its interval where there is one that has a width."""
    ends = estimate.interval()
    if ends is None or ends[0] == ends[1]:
        return f"{estimate.value * scale:.{digits}f}{unit}"
    return shown(estimate, unit, scale, digits)


def each_shown(found: Mapping[str, Estimate], **how: object) -> str:
    """Return models' estimates as text."""
    return ", ".join(f"{model} {brief(value, **how)}" for model, value in found.items())


def verdict_of(sign: int) -> str:
    """Return the verdict of one number: +1 as said, -1 against it, 0 neither."""
    return {1: CONFIRMED, -1: REFUTED, 0: NOT_RESOLVED}[sign]


def missing(what: str) -> tuple[str, str]:
    """Return a verdict where the number that would decide was not measured."""
    return NOT_RESOLVED, f"not measured: {what}"


def words(rule: str) -> str:
    """Return a rule's name."""
    return RULES[rule]
