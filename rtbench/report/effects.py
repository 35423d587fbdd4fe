"""What a run of the experiment effects says: times, ratios to the own tracer, steps."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rtbench.records.derive import cells, times
from rtbench.records.statistics import (
    Estimate,
    GeometricMean,
    Times,
    geometric_mean,
    median,
    paired_ratio,
    seed_of,
)

if TYPE_CHECKING:
    from rtbench.records.run import Run

SPECIALISED, DELETED = "specialised", "deleted"
# What has more compiled in than the scene calls for.
MORE = ("optical", "inner_loop", "everything")
TITLES = {
    SPECIALISED: "what the scene calls for",
    "optical": "all optical effects",
    "inner_loop": "all kinds, motion",
    "everything": "everything",
    DELETED: "blocks deleted",
}


@dataclass(frozen=True)
class Step:
    """What a scene costs once an effect is there.

    Attributes
    ----------
    name : str
        plain, or the effect.
    time : Estimate
        Nanoseconds a pixel.
    more : Estimate or None
        Times the step before, paired; None of the first.
    tracer : str
    """

    name: str
    time: Estimate
    more: Estimate | None
    tracer: str


class Effects:
    """The cells of a run, by kernel, precision, scene and tracer; in the processor's time."""

    def __init__(self, run: "Run") -> None:
        self.run = run
        self.seed = seed_of(run.name)
        self.times: dict[tuple, Times] = {}
        columns = ["kernel", "precision", "scene", "tracer"]
        if len(run.samples):
            for key, samples in cells(run, columns).items():
                # The processor's time: one thread traces, and others run beside it.
                self.times[key] = times(samples.assign(ns=samples["cpu_ns"]))
        self.facts = {fact["scene"]: fact for fact in run.info.get("scenes") or []}
        self.rows = {
            tuple(row[name] for name in columns): row for row in run.effects.to_dict("records")
        }

    @property
    def groups(self) -> list[tuple[str, str]]:
        """Kernels and precisions."""
        return list(dict.fromkeys(key[:2] for key in self.times))

    def scenes(self, group: tuple[str, str]) -> list[str]:
        """The scenes that were traced, in the order of the run."""
        there = {key[2] for key in self.times if key[:2] == group}
        return [name for name in self.facts if name in there]

    def median(self, group: tuple[str, str], scene: str, tracer: str) -> Estimate | None:
        """Return nanoseconds a pixel."""
        found = self.times.get((*group, scene, tracer))
        return None if found is None else median(found, self.seed)

    def ratio(self, group: tuple[str, str], scene: str, tracer: str) -> Estimate | None:
        """Return a tracer's time over that of the scene's own, paired by rounds."""
        found = self.times.get((*group, scene, tracer))
        own = self.times.get((*group, scene, SPECIALISED))
        return None if found is None or own is None else paired_ratio(found, own, self.seed)

    def mean(self, group: tuple[str, str], tracer: str) -> GeometricMean | None:
        """Return the geometric mean over the scenes of a tracer's ratios."""
        ratios = [self.ratio(group, scene, tracer) for scene in self.scenes(group)]
        ratios = [each for each in ratios if each is not None]
        return geometric_mean(ratios) if ratios else None

    def steps(self, group: tuple[str, str], scene: str) -> list[Step]:
        """Return the steps of a scene that were timed; the last is the scene's own tracer."""
        found: list[Step] = []
        before = None
        names = (self.facts.get(scene) or {}).get("steps") or []
        for place, name in enumerate(names):
            tracer = SPECIALISED if place == len(names) - 1 else name
            here = self.times.get((*group, scene, tracer))
            if here is None:
                return []
            more = None if before is None else paired_ratio(here, before, self.seed)
            found.append(Step(name.removeprefix("+"), median(here, self.seed), more, tracer))
            before = here
        return found

    def row(self, group: tuple[str, str], scene: str, tracer: str) -> dict | None:
        """Return what effects.csv says of a tracer."""
        return self.rows.get((*group, scene, tracer))
