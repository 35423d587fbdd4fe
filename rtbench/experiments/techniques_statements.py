"""What section 2.3.1 of Šilhavý 2010 states, each decided by a number of this machine.

A ratio is paired by rounds within each scene; over scenes it is their geometric mean. Its interval
tells how well these scenes were measured: they are too few to stand for others. Where no core was
free the processor's time decides.
"""

from __future__ import annotations

from rtbench.experiments.silhavy_measured import (
    counted,
    each_shown,
    middle,
    missing,
    verdict_of,
)
from rtbench.experiments.verdicts import Statement, rows, shown, side
from rtbench.records.resampling import Estimate
from rtbench.records.run import Run
from rtbench.report.techniques import CACHE, FIRST_HIT, Techniques

FEW = 100  # primitives of a very simple scene
MANY = 10_000  # triangles of a complex one
SMALL_PART = 0.25  # of the rays
LITTLE = 1.1  # times as fast is little
KEY = "techniques"


def judged(run: Run) -> list[dict]:
    """Judge what is stated of the shadow cache and of first hits.

    Parameters
    ----------
    run : Run
        Of the experiment ``techniques``; its first kernel and precision count.

    Returns
    -------
    list of dict
        ``section, statement, verdict, number``; empty without samples.
    """
    techniques = Techniques(run)
    return rows(STATEMENTS, {KEY: techniques}) if techniques.groups else []


class _Scenes:
    """The scenes of a run, of its first kernel and precision, by what they are."""

    def __init__(self, techniques: Techniques) -> None:
        self.techniques = techniques
        self.group = techniques.groups[0]
        self.names = techniques.scenes(self.group)

    def fact(self, scene: str, name: str) -> int:
        return self.techniques.facts[scene][name]

    def with_area(self) -> list[str]:
        return [each for each in self.names if self.fact(each, "area_lights")]

    def complex(self) -> list[str]:
        return [each for each in self.names if self.fact(each, "primitives") >= MANY]

    def simple(self) -> list[str]:
        area = self.with_area()
        few = [each for each in self.names if self.fact(each, "primitives") <= FEW]
        return [each for each in few if each not in area]

    def secondary(self) -> list[str]:
        """Those whose surfaces mirror or let light through."""
        told = {each: self.techniques.rays(self.group, each) for each in self.names}
        return [each for each, rays in told.items() if rays["reflection"] + rays["refraction"]]

    @property
    def time(self) -> str:
        """Which time decides, in a word."""
        return "time" if self.techniques.free_cores else "processor time"

    def faster(self, scenes: list[str], technique: str) -> dict[str, Estimate]:
        busy = not self.techniques.free_cores
        found = {s: self.techniques.faster(self.group, s, technique, cpu=busy) for s in scenes}
        return {scene: value for scene, value in found.items() if value is not None}


def _pays(which: str, technique: str, wanted: int):
    """Return a judge of whether a technique saves time in scenes (+1), or costs it (-1)."""

    def judge(runs):
        scenes = _Scenes(runs[KEY])
        found = scenes.faster(getattr(scenes, which)(), technique)
        if not found:
            return missing("none of the scenes is such a one")
        mean = middle(found.values())
        return verdict_of(wanted * side(mean)), (
            f"{scenes.time} without/with it {shown(mean)}: {each_shown(found)}; above 1 it saves "
            "time"
        )

    return judge


def _share(runs):
    """Judge that primary rays are a small part where there are mirrors or glass."""
    scenes = _Scenes(runs[KEY])
    shares = {}
    for each in scenes.secondary():
        rays = runs[KEY].rays(scenes.group, each)
        shares[each] = counted(rays["primary"] / sum(rays.values()))
    if not shares:
        return missing("a scene with mirrors or glass")
    sides = [-side(each, SMALL_PART) for each in shares.values()]
    return verdict_of(min(sides)), (
        f"primary rays of all: {each_shown(shares, unit=' %', scale=100, digits=0)}; a small part "
        f"is below {SMALL_PART:.0%}"
    )


def _little(runs):
    """Judge that first hits save little where there are mirrors or glass."""
    scenes = _Scenes(runs[KEY])
    found = scenes.faster(scenes.secondary(), FIRST_HIT)
    if not found:
        return missing("first hits in a scene with mirrors or glass")
    mean = middle(found.values())
    return verdict_of(-side(mean, LITTLE)), (
        f"{scenes.time} without/with it {shown(mean)}: {each_shown(found)}; little is below "
        f"{LITTLE}"
    )


STATEMENTS = (
    Statement(
        "2.3.1",
        "a shadow cache helps in very simple scenes (p. 16)",
        (KEY,),
        _pays("simple", CACHE, 1),
    ),
    Statement(
        "2.3.1",
        "a shadow cache is only more work with area lights (p. 16)",
        (KEY,),
        _pays("with_area", CACHE, -1),
    ),
    Statement(
        "2.3.1",
        "a shadow cache is only more work where triangles are many and small (p. 16)",
        (KEY,),
        _pays("complex", CACHE, -1),
    ),
    Statement(
        "2.3.1",
        "primary rays are a small part of all where there are secondary ones (p. 16)",
        (KEY,),
        _share,
    ),
    Statement(
        "2.3.1",
        "so first-hit optimisation saves little there (p. 16)",
        (KEY,),
        _little,
    ),
    Statement(
        "2.3.1",
        "for complex scenes ordinary tracing is better than first-hit optimisation (p. 16)",
        (KEY,),
        _pays("complex", FIRST_HIT, -1),
    ),
)
