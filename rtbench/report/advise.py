"""Which kernel to take: the question of Havel 2008, chapter 2 and section 6.1, asked of records.

A caller says what may be stored of a triangle, what must come back, how often rays hit and how
many rays a triangle's preparation is shared by. Of what was measured the fastest that fits is
told, together with all that the measurement cannot tell from it, and why the others fell out.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rtbench.errors import NotComparable, RtbenchError, unknown
from rtbench.report.beside_best import BETWEEN_RUNS, PREPARATION, Clocks, Ranked, rank
from rtbench.report.candidates import (
    Candidate,
    candidates,
    comparable,
    kind_of_packets,
    same_machine,
)
from rtbench.report.cells import density_text
from rtbench.report.standards import REQUIRED, Standard

if TYPE_CHECKING:
    from rtbench.records.run import Run

STORED = ("none", "normal", "precomputed")
OUTPUTS = {"t": {"t"}, "tuv": {"t", "u", "v"}}
UNSURE = 0.2
NEAR = 0.05  # hit ratios this near to each other are compared


@dataclass(frozen=True)
class Question:
    """What is wanted.

    Attributes
    ----------
    stored : str
        The most that may be known of a triangle beforehand: none, normal or precomputed.
    outputs : str
        What must come back of a hit: t, or tuv.
    hit_ratio : float
        Share of the tests that hit.
    precision : str
        float32, float64 or mixed.
    rays_per_triangle : float or None
        How many tests share the preparation of a triangle; None: preparation is free.
    triangles : int or None
        How many there are; the nearest measured number is asked.
    memory : int or None
        Bytes for all of them; needs triangles.
    packets : bool
        Whether rays come in packets.
    accuracy : str or None
        What it must be: stable, watertight or exact.

    Raises
    ------
    RtbenchError
        For a value that is not allowed.
    """

    stored: str = "precomputed"
    outputs: str = "t"
    hit_ratio: float = 0.1
    precision: str = "float32"
    rays_per_triangle: float | None = None
    triangles: int | None = None
    memory: int | None = None
    packets: bool = False
    accuracy: str | None = None

    def __post_init__(self) -> None:
        allowed = {"stored": STORED, "outputs": OUTPUTS}
        allowed["precision"] = ("float32", "float64", "mixed")
        for name, values in allowed.items():
            if getattr(self, name) not in values:
                raise RtbenchError(unknown(name, str(getattr(self, name)), values))
        if self.accuracy is not None and self.accuracy not in REQUIRED:
            raise RtbenchError(unknown("accuracy", str(self.accuracy), REQUIRED))
        if not 0 <= self.hit_ratio <= 1:
            raise RtbenchError(f"hit ratio {self.hit_ratio:g} is not allowed (allowed: 0 to 1)")
        for name in ("rays_per_triangle", "triangles", "memory"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                words = name.replace("_", " ")
                raise RtbenchError(f"{words} {value:g} is not allowed (allowed: above 0)")
        if self.memory is not None and self.triangles is None:
            raise RtbenchError(
                "memory is that of all triangles: --triangles says how many there are"
            )


@dataclass(frozen=True)
class Advice:
    """The answer.

    Attributes
    ----------
    question : Question
    runs : list of Run
        Those that were asked, newest first.
    ranking : list of Ranked
        What fits, best first.
    fell_out : list of tuple
        Candidate, reason, detail: what does not fit, by reason.
    remarks : list of str
        What makes the answer less sure, or says how it was got.
    free : list of Ranked
        What would fit if no accuracy were asked for, best first; empty if none is.
    """

    question: Question
    runs: list["Run"]
    ranking: list[Ranked]
    fell_out: list[tuple[Candidate, str, str]]
    remarks: list[str] = field(default_factory=list)
    free: list[Ranked] = field(default_factory=list)

    @property
    def level(self) -> list[Ranked]:
        """The best and all that are not told from it."""
        return [one for one in self.ranking if one.level]


def advise(runs: Sequence["Run"], question: Question, standard: Standard | None = None) -> Advice:
    """Answer a question from runs.

    Parameters
    ----------
    runs : sequence of Run
        Of one machine, with samples.
    question : Question
    standard : Standard, optional
        Who says which kernels are as accurate as the question asks.

    Returns
    -------
    Advice
        A kernel that several runs measured counts as the newest of them has it.

    Raises
    ------
    NotComparable
        If the runs are of different machines.
    RtbenchError
        If none of them can answer.
    """
    for run in runs[1:]:
        if not same_machine(runs[0].info.get("machine") or {}, run.info.get("machine") or {}):
            raise NotComparable(f"{runs[0].name} and {run.name} were made on different machines")
    if question.accuracy and standard is None:
        standard = Standard(question.accuracy, runs)
    asked = comparable(runs, question.packets, question.accuracy is not None)
    found = [one for run in asked for one in candidates(run, question.hit_ratio, question.packets)]
    if not found:
        kind = "packets" if question.packets else "single rays (soup, break_even, density)"
        names = ", ".join(run.name for run in runs)
        raise RtbenchError(f"no times of {kind} in {names}")
    sizes = sorted({one.scene for one in found})
    usual = max(sizes, key=lambda size: len({o.identity for o in found if o.scene == size}))
    wanted = question.triangles or max(usual, 1)
    scene = min(sizes, key=lambda size: abs(math.log(max(size, 1) / wanted)))
    here = [one for one in found if one.scene == scene]
    newest = {one.identity: one for one in reversed(here)}  # the newest comes last, and stays
    fell_out = [
        (one, "other number of triangles", f"measured with {one.scene:,}, not with {scene:,}")
        for one in {one.identity: one for one in reversed(found)}.values()
        if one.identity not in newest and one.precision == question.precision
    ]
    nearest = min(one.outside for one in newest.values())
    fits = []
    for one in newest.values():
        reason = _misfit(one, question, nearest, newest)
        if reason is None:
            fits.append(one)
        elif reason:
            fell_out.append((one, *reason))
    shared = here if len(asked) > 1 else []
    free: list[Ranked] = []
    if question.accuracy:
        free, _ = rank(fits, Clocks(shared), question.rays_per_triangle)
        reasons = {one: standard.misfit(one.kernel, one.precision) for one in fits}
        fell_out += [(one, f"not {question.accuracy}", why) for one, why in reasons.items() if why]
        fits = [one for one, why in reasons.items() if not why]
    ranking, apart = rank(fits, Clocks(shared), question.rays_per_triangle)
    used = [run for run in asked if any(one.run is run for one in newest.values())]
    remarks = _remarks(question, used, [*newest.values()], scene, apart, ranking)
    if question.accuracy and ranking:
        remarks.insert(0, _told_by(question.accuracy, ranking, standard))
    fell_out.sort(key=lambda entry: entry[1])
    return Advice(question, used, ranking, fell_out, remarks, free)


def _told_by(word: str, ranking: Sequence[Ranked], standard: Standard) -> str:
    """Return who says that what is ranked is as accurate as it was asked to be."""
    kernels = [one.candidate for one in ranking]
    told = [standard.source(one.kernel, one.precision) for one in kernels]
    sources = " and ".join(dict.fromkeys(told))
    return f"{word} ({' '.join(REQUIRED[word])}) by {sources}: as far as hard cases show"


def _misfit(
    one: Candidate, question: Question, nearest: float, known: dict
) -> tuple[str, str] | tuple[()] | None:
    """Return why a candidate falls out and in which detail; nothing more if it has a twin."""
    if one.precision != question.precision:
        twin = (one.kernel, question.precision, one.way)
        return (
            ()
            if twin in known
            else (f"not in {question.precision}", f"measured in {one.precision}")
        )
    if one.method.get("exact") is False:
        return "wrong answers", "rounding has no bound: roots or arccos decide"
    if one.wrong:
        return "wrong answers", f"wrong nearest triangles for {one.wrong} rays"
    if one.estimated:
        return "wrong answers", f"other triangles for {one.estimated} rays by an estimate"
    if one.stored is None:
        return "stored data", "its run does not tell what it stores"
    if STORED.index(one.stored) > STORED.index(question.stored):
        return f"stores more than {question.stored}", one.stored
    lacking = sorted(OUTPUTS[question.outputs] - set(one.method.get("outputs") or ()))
    if lacking:
        return "outputs", f"does not return {', '.join(lacking)}"
    if one.outside > nearest + NEAR:
        ratios = ", ".join(f"{point:.3g}" for point in one.points)
        return "hit ratio", f"measured only at {ratios}"
    if question.rays_per_triangle is not None and one.preparation is None:
        return "preparation", "was not timed"
    if question.memory is not None:
        if one.bytes is None:
            return "memory", "its run does not tell its bytes"
        if one.bytes * question.triangles > question.memory:
            whole = f"{one.bytes} bytes x {question.triangles:,} triangles"
            return "memory", f"{whole} = {one.bytes * question.triangles:,}"
    return None


def _remarks(
    question: Question,
    runs: Sequence["Run"],
    known: Sequence[Candidate],
    scene: int,
    apart: bool,
    ranking: Sequence[Ranked],
) -> list[str]:
    told = []
    shown = [one.candidate for one in ranking] or list(known)
    points = sorted({point for one in shown for point in one.points})
    ratios = " and ".join(f"{point:.3g}" for point in points)
    if all(one.outside > 0 for one in shown):
        told.append(f"hit ratio {question.hit_ratio:g} was not measured: the nearest is {ratios}")
    elif len(points) > 1:
        told.append(f"hit ratio {question.hit_ratio:g}: between those measured, {ratios}")
    if question.triangles is not None and question.triangles != scene:
        told.append(f"measured with {scene:,} triangles, the nearest to {question.triangles:,}")
    kinds = [
        f"{k} {density_text(v)}" for k, v in (kind_of_packets(runs[0]) if runs else {}).items()
    ]
    if kinds:
        told.append(f"the packets asked: {', '.join(kinds)}")
    if question.rays_per_triangle is None:
        told.append("preparation counts as free: no number of rays per triangle was given")
    elif any(one.candidate.preparation for one in ranking):
        told.append(f"preparation has no interval: it is taken to be sure to {PREPARATION:.0%}")
    if len({one.candidate.run.name for one in ranking}) > 1:
        told.append("times are from different runs, as measured; ratios are beside what code that")
        told[-1] += " both runs share shows of their clocks"
    if apart:
        told.append(
            "some of these runs share no code: their clocks may differ, and only what is more "
            f"than {BETWEEN_RUNS:.0%} slower counts as slower there"
        )
    if ranking and ranking[0].unsure > UNSURE:
        told.append(
            f"the best one's interval is {ranking[0].unsure:.0%} of its time wide: rtbench machine "
            "tells what disturbs; a run without --quick is surer"
        )
    told += [f"{run.name} is not finished" for run in runs if not run.finished]
    return told
