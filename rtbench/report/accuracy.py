"""Time against wrong answers: the points of a run of ``accuracy``, and which of them are worth it.

A point is a form of a kernel: its arithmetic, one by one or in packets, what the compiler may do,
how it divides. Of two points the one that takes less time and is wrong no more often is the better;
those that no point is better than are the front. Where two times are not resolved from each other
nothing is said to be better, and the front says so.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rtbench.records import derive
from rtbench.records.statistics import (
    Estimate,
    Times,
    holm,
    median,
    p_value,
    paired_ratio,
    seed_of,
)
from rtbench.records.tabular import plain

if TYPE_CHECKING:
    from rtbench.records.run import Run

SCALAR, PAIRS, RAYS = "scalar", "pairs", "rays"
FORMS = {SCALAR: "one by one", PAIRS: "packets of 16"}
RANDOM, LEAF, FAR, CORPUS, MESH = "random", "leaf", "far", "corpus", "mesh"
PRECISIONS = {"float32": "f32", "float64": "f64", "mixed": "mixed"}
MILLION = 1e6
STRICT, DIVISION = "strict", "division"
# On the front; on it but for a time that is not resolved; no better than another one; behind.
ON_FRONT, LEVEL, UNSURE, BEHIND = "front", "level", "unsure", "behind"


class Point(NamedTuple):
    """A form of a kernel."""

    kernel: str
    precision: str = "float32"
    form: str = SCALAR
    flags: str = STRICT
    reciprocal: str = DIVISION

    @property
    def name(self) -> str:
        """What it is called beside others of the same form."""
        words = [self.kernel.removesuffix("_uv"), PRECISIONS.get(self.precision, self.precision)]
        words += [f"+{self.flags}"] if self.flags != STRICT else []
        words += ["1/x estimated"] if self.reciprocal != DIVISION else []
        return " ".join(words)

    @property
    def answers(self) -> tuple[str, str, str, str]:
        """What of it decides its answers: packets say what the scalar form says."""
        return self.kernel, self.precision, self.flags, self.reciprocal


@dataclass(frozen=True)
class Measure:
    """A count of wrong answers, or an error, of which less is better.

    Attributes
    ----------
    name, label : str
        The label with its unit.
    workload : str
        Whose rows of accuracy.csv it is taken from.
    timed : str
        The workload whose times stand against it.
    of : callable
        From such a row to a number; None where there is none.
    """

    name: str
    label: str
    workload: str
    timed: str
    of: Callable[[dict], float | None]


def _share(count: str, whole: str, unit: float) -> Callable[[dict], float | None]:
    def share(row: dict) -> float | None:
        some, every = row.get(count), row.get(whole)
        return None if some is None or not every else unit * some / every

    return share


MEASURES = (
    Measure(
        "wrong_corpus",
        "wrong of hard cases (%)",
        CORPUS,
        RANDOM,
        _share("wrong", "decided", 100.0),
    ),
    Measure(
        "leaks",
        "leaks of closed fans and meshes (%)",
        CORPUS,
        RANDOM,
        _share("leaks", "groups", 100.0),
    ),
    Measure(
        "wrong_random",
        "wrong of random tests (ppm)",
        RANDOM,
        RANDOM,
        _share("wrong", "decided", MILLION),
    ),
    Measure("wrong_leaf", "wrong in a leaf (ppm)", LEAF, LEAF, _share("wrong", "decided", MILLION)),
    Measure(
        "relative_t",
        "99 % error of t (part of t)",
        CORPUS,
        RANDOM,
        lambda row: row.get("relative_t"),
    ),
)


@dataclass(frozen=True)
class Placed:
    """A point beside all others of its form.

    Attributes
    ----------
    point : Point
    time : Estimate
        ns a test.
    value : float
        The measure.
    standing : str
        ON_FRONT; LEVEL: slower by its median than one as right, but not resolved; UNSURE: on the
        front, but not resolved to be faster than one that is less wrong; BEHIND.
    beside : Point or None
        Which one it is not resolved from.
    """

    point: Point
    time: Estimate
    value: float
    standing: str = BEHIND
    beside: Point | None = None


class Accuracy:
    """The points of a run of the experiment ``accuracy``.

    Parameters
    ----------
    run : Run
        With samples; one that was cut off has the points whose cells have some.
    """

    def __init__(self, run: "Run") -> None:
        self.run = run
        self.seed = seed_of(run.name)
        self._times: dict[tuple[str, Point], Times] = {}
        columns = [*run.cell, "outcome"]
        for key, samples in derive.cells(run, columns).items():
            cell = dict(zip(columns, key, strict=True))
            point = Point(*(cell[name] for name in Point._fields))
            self._times[cell["workload"], point] = derive.times(samples)
        self._rows = {}
        for row in run.accuracy.to_dict("records"):
            known = {name: plain(value) for name, value in row.items()}
            answers = tuple(known[n] for n in ("kernel", "precision", "flags", "reciprocal"))
            self._rows[known["workload"], answers] = known

    def points(self, workload: str = RANDOM, form: str | None = None) -> list[Point]:
        """Return the points that were timed over a workload, in one form or in all."""
        return [
            point
            for where, point in self._times
            if where == workload and form in (None, point.form)
        ]

    def has(self, point: Point, workload: str = RANDOM) -> bool:
        """Tell whether a point was timed."""
        return (workload, point) in self._times

    def row(self, point: Point, workload: str) -> dict:
        """Return the row of accuracy.csv of a point, empty if there is none."""
        return self._rows.get((workload, point.answers), {})

    def time(self, point: Point, workload: str = RANDOM) -> Estimate:
        """Return ns a test."""
        return median(self._times[workload, point], self.seed)

    def ratio(self, a: Point, b: Point, workload: str = RANDOM) -> Estimate | None:
        """Return how many times as long a takes as b, paired by round; None if that is unknown."""
        if not (self.has(a, workload) and self.has(b, workload)):
            return None
        return paired_ratio(self._times[workload, a], self._times[workload, b], self.seed)

    def front(self, measure: Measure, form: str, points: Sequence[Point] = ()) -> list[Placed]:
        """Return the points of a form by time, each placed beside the others.

        Parameters
        ----------
        measure : Measure
        form : str
            scalar or pairs.
        points : sequence of Point
            Only these; all of the form if empty.

        Returns
        -------
        list of Placed
            What is resolved is judged at once (Holm 1979).
        """
        asked = points or self.points(measure.timed, form)
        found = []
        for point in asked:
            value = measure.of(self.row(point, measure.workload))
            if value is not None:
                found.append(Placed(point, self.time(point, measure.timed), value))
        found.sort(key=lambda each: (each.time.value, each.value))
        better = [_better(each, found) for each in found]
        right = [
            None if best else _next(each, found) for each, best in zip(found, better, strict=True)
        ]
        rivals = [one or other for one, other in zip(better, right, strict=True)]
        ratios = [
            rival and self.ratio(each.point, rival.point, measure.timed)
            for each, rival in zip(found, rivals, strict=True)
        ]
        sure = holm([None if each is None else p_value(each) for each in ratios])
        placed = []
        for each, best, rival, resolved in zip(found, better, rivals, sure, strict=True):
            if best is None:
                standing = ON_FRONT if resolved or rival is None else UNSURE
            else:
                equal = not resolved and best.value == each.value
                standing = LEVEL if equal else BEHIND
            told = rival.point if standing in (LEVEL, UNSURE) else None
            placed.append(Placed(each.point, each.time, each.value, standing, told))
        return placed


def _better(one: Placed, others: Sequence[Placed]) -> Placed | None:
    """Return the fastest that is faster, or as fast and less wrong, and wrong no more often."""
    found = [
        other
        for other in others
        if (other.time.value, other.value) < (one.time.value, one.value)
        and other.value <= one.value
    ]
    return min(found, key=lambda other: other.time.value, default=None)


def _next(one: Placed, others: Sequence[Placed]) -> Placed | None:
    """Return the fastest of those that are less wrong: the next one on the front."""
    found = [other for other in others if other.value < one.value]
    return min(found, key=lambda other: (other.time.value, other.value), default=None)
