"""Šilhavý's statements on how long trees take to build, over the number of triangles N."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rtbench.experiments.silhavy_growth import FEWEST, judge_each, listed, slope
from rtbench.experiments.silhavy_measured import OBJECT, SPATIAL, family, missing, of_builds
from rtbench.experiments.verdicts import decided, shown, side
from rtbench.records.resampling import Estimate, Times, joined, median, paired_ratio, seed_of
from rtbench.records.run import Run
from rtbench.report.tree_growth import largest

QUADRATIC = 1.5  # an exponent of N above is no N log N
SLACK = 0.1  # of the exponent that is left when N log N is divided out


class Builds:
    """The builds of a run of the experiment ``tree_builders``, in their usual variant."""

    def __init__(self, run: Run) -> None:
        self.run = run
        config = run.info["config"]
        self._usual = {"axes": config["axes"][0], "candidates": config["candidates"][0]}
        frame = run.builds[run.builds["overlap"].isna() | (run.builds["overlap"] != "")]
        self._frame = frame.assign(family=[family(str(model)) for model in frame["model"]])
        self._overlap = config["overlaps"][0]

    @property
    def families(self) -> list[str]:
        """The models, without their sizes."""
        return list(dict.fromkeys(self._frame["family"]))

    def seconds(self, kind: str, builder: str) -> dict[int, Times]:
        """Return a builder's samples over a model, of the processor, by the number of triangles."""
        frame = self._frame
        frame = frame[(frame["family"] == kind) & (frame["builder"] == builder)]
        frame = frame[frame["overlap"] == self._overlap]
        if builder not in (OBJECT, SPATIAL):
            for name, value in self._usual.items():
                frame = frame[frame[name] == value]
        return {
            int(size): of_builds(rows["cpu_seconds"].tolist(), rows["process"].tolist())
            for size, rows in frame.groupby("triangles")
        }

    def estimates(self, kind: str, builder: str) -> dict[int, Estimate]:
        """Return the nanoseconds a build takes, by the number of triangles."""
        samples = self.seconds(kind, builder)
        return {n: median(times, seed_of(self.run.name)) for n, times in samples.items()}

    def ratios(self, kind: str, slow: str, fast: str) -> dict[int, Estimate]:
        """Return how many times as long one builder takes as another, by the triangles of both."""
        one, other = self.seconds(kind, slow), self.seconds(kind, fast)
        found = {
            n: paired_ratio(one[n], other[n], seed_of(self.run.name))
            for n in sorted(one.keys() & other.keys())
        }
        return {n: value for n, value in found.items() if value is not None}


def n_log_n(runs):
    """Judge that building grows as N log N: what is left of it does not grow."""
    builds = Builds(runs["builders"])
    plain, rest = {}, {}
    for kind in builds.families:
        points = _largest(builds.estimates(kind, "nlogn"))
        if (fit := slope(points)) is not None:
            plain[kind] = fit
            rest[kind] = slope({n: _scaled(e, 1 / (n * np.log2(n))) for n, e in points.items()})
    if not rest:
        return missing("builder nlogn in several sizes")
    return judge_each(rest, lambda each: -side(each, SLACK)), (
        f"exponent of N in the time over N log N: {listed(rest)} (confirmed below {SLACK}); in "
        f"the time itself: {listed(plain)}"
    )


def _largest(points: Mapping[int, Estimate]) -> dict[int, Estimate]:
    """Return the larger half of the sizes, all where that is too few for a line."""
    sizes = sorted(points)
    top = [sizes[k] for k in largest(sizes)]
    return {n: points[n] for n in (top if len(top) >= FEWEST else sizes)}


def _scaled(estimate: Estimate, factor: float) -> Estimate:
    draws = None if estimate.draws is None else estimate.draws * factor
    return joined(estimate.value * factor, draws, [estimate])


def quadratic(runs):
    """Judge that the first builder grows as N squared."""
    builds = Builds(runs["builders"])
    found, beside = {}, []
    for kind in builds.families:
        points = builds.estimates(kind, "n2")
        if (fit := slope(points)) is None:
            continue
        found[kind] = fit
        most = max(points)
        hours = points[most].value / 1e9 * (1e6 / most) ** fit.value / 3600
        fast = builds.ratios(kind, "n2", "nlogn").get(most)
        times = f", {shown(fast, digits=1)} times O(N log N)'s" if fast else ""
        beside.append(
            f"{kind}: {points[most].value / 1e9:.2f} s for {most:,} triangles{times}; a million "
            f"would take {hours:,.1f} h"
        )
    if not found:
        return missing("builder n2 in several sizes")
    return judge_each(found, lambda each: side(each, QUADRATIC)), (
        f"exponent of N {listed(found)} (confirmed above {QUADRATIC}); {'; '.join(beside)}"
    )


def sorted_once(runs):
    """Judge that sorting once is faster, the more so the more triangles there are."""
    builds = Builds(runs["builders"])
    sides, numbers = [], []
    for kind in builds.families:
        found = builds.ratios(kind, "nlog2n", "nlogn")
        if len(found) < 2:
            continue
        sure = [n for n, each in found.items() if each.draws is not None] or list(found)
        most, grows = max(sure), slope(found)
        sides += [side(found[most]), side(grows, 0.0)]
        numbers.append(
            f"{kind}: {shown(found[most], digits=2)} with {most:,} triangles, growing with an "
            f"exponent of N of {shown(grows, digits=2)}"
        )
    if not sides:
        return missing("builders nlogn and nlog2n in several sizes")
    return decided(sides), f"sorted in every node/once: {'; '.join(numbers)}"


def fastest_build(runs):
    """Judge that nothing is built faster than the spatial median."""
    builds = Builds(runs["builders"])
    found: dict[str, dict[str, Estimate]] = {}
    for kind in builds.families:
        for builder in (OBJECT, "nlogn", "binned"):
            ratios = builds.ratios(kind, builder, SPATIAL)
            sure = [n for n, each in ratios.items() if each.draws is not None] or list(ratios)
            if sure:
                name = f"{kind}, {max(sure):,} triangles"
                found.setdefault(builder, {})[name] = ratios[max(sure)]
    if not {OBJECT, "nlogn"} <= found.keys():
        return missing("builders of all three rules")
    # What he compares: his three rules. Bins are not his.
    sides = [side(e) for builder in (OBJECT, "nlogn") for e in found[builder].values()]
    return decided(sides), "; ".join(
        f"{builder}/spatial_median: "
        + ", ".join(f"{name} {shown(each, digits=2)}" for name, each in ratios.items())
        for builder, ratios in found.items()
    )
