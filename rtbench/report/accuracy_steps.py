"""The price of each step of accuracy: one form of a kernel beside another that differs in it alone.

Which forms are compared stands here, once, for tables, sentences and charts.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from rtbench.records.statistics import (
    FASTER,
    SLOWER,
    Estimate,
    verdict,
)
from rtbench.report.accuracy import (
    CORPUS,
    FAR,
    LEAF,
    PAIRS,
    RANDOM,
    SCALAR,
    Accuracy,
    Point,
)

MT, STABLE, SAFE, EXACT = (
    *("moller_trumbore_uv", "moller_trumbore_stable_uv", "watertight_safe_uv"),
    "adaptive_exact_uv",
)
WHOLE, STABLE_WHOLE = "moller_trumbore_whole_uv", "moller_trumbore_stable_whole_uv"


class Step(NamedTuple):
    """A step of accuracy.

    Attributes
    ----------
    name : str
    words : str
        What is done, as the subject of a sentence.
    start, end : Point
        One by one.
    packets : tuple of (Point, Point) or None
        The same in packets, where other forms are the natural ones; the same kernels if None.
    leave : bool
        A step away from accuracy: what the compiler is given leave for.
    """

    name: str
    words: str
    start: Point
    end: Point
    packets: tuple[Point, Point] | None = None
    leave: bool = False

    def pair(self, form: str) -> tuple[Point, Point]:
        """Return from what to what it goes in a form."""
        if form == PAIRS and self.packets:
            return tuple(point._replace(form=PAIRS) for point in self.packets)
        return self.start._replace(form=form), self.end._replace(form=form)


def _in_packets(start: str, end: str, precision: str = "float32") -> tuple[Point, Point]:
    return Point(start), Point(end, precision)


_NONE, _RELATIVE, _ABSOLUTE = (
    Point(f"epsilon_{name}_uv") for name in ("none", "relative", "absolute")
)
_ESTIMATE = Point(WHOLE, reciprocal="estimate"), Point(WHOLE)

STEPS = (
    Step(
        "no epsilon",
        "a determinant compared with 0 instead of an absolute EPSILON",
        _ABSOLUTE,
        _NONE,
    ),
    Step("relative epsilon", "a relative EPSILON instead of 0", _NONE, _RELATIVE),
    Step("division", "a division instead of an estimated reciprocal", *_ESTIMATE, _ESTIMATE),
    Step("stable t", "a stable t", Point(MT), Point(STABLE), _in_packets(WHOLE, STABLE_WHOLE)),
    Step("mixed", "arithmetic in float64 on float32 data", Point(MT), Point(MT, "mixed")),
    Step(
        "float64",
        "float64 for data and arithmetic",
        Point(MT),
        Point(MT, "float64"),
        _in_packets(WHOLE, WHOLE, "float64"),
    ),
    Step(
        "half-open",
        "a half-open rule for edges",
        Point(STABLE),
        Point("half_open_uv"),
        _in_packets(STABLE_WHOLE, "half_open_uv"),
    ),
    Step(
        "watertight",
        "the watertight test as published",
        Point(MT),
        Point("watertight_uv"),
        _in_packets(WHOLE, "watertight_uv"),
    ),
    Step(
        "watertight_safe",
        "the watertight test made safe, with a stable t",
        Point(STABLE),
        Point(SAFE),
        _in_packets(STABLE_WHOLE, SAFE),
    ),
    Step("exact", "an exact answer", Point(STABLE), Point(EXACT), _in_packets(STABLE_WHOLE, EXACT)),
    Step(
        "exact from watertight_safe",
        "an exact answer instead of a watertight one",
        Point(SAFE),
        Point(EXACT),
    ),
    *(
        Step(
            f"{word}: {kernel.removesuffix('_uv')}",
            f"leave to {what} in {kernel.removesuffix('_uv')}",
            Point(kernel),
            Point(kernel, flags=flags),
            leave=True,
        )
        for flags, word, what in (
            ("contract", "contraction", "fuse products and sums"),
            ("fast", "fastmath", "compute as if there were no NaN and no rounding"),
        )
        for kernel in (MT, STABLE, "watertight_uv", SAFE, EXACT)
    ),
)


@dataclass(frozen=True)
class Price:
    """What a step costs in one form over one workload.

    Attributes
    ----------
    step : Step
    form, workload : str
    start, end : Point
    ratio : Estimate
        How many times as long the end takes.
    verdict : str
        slower, faster, no difference resolved, or no interval.
    """

    step: Step
    form: str
    workload: str
    start: Point
    end: Point
    ratio: Estimate
    verdict: str

    @property
    def percent(self) -> tuple[float, float | None, float | None]:
        """What it costs, and the ends of its interval, in per cent."""
        low, high = self.ratio.interval() or (None, None)
        return tuple(None if x is None else 100 * (x - 1) for x in (self.ratio.value, low, high))


def prices(accuracy: Accuracy) -> list[Price]:
    """Return the price of every step that a run has both ends of.

    Parameters
    ----------
    accuracy : Accuracy

    Returns
    -------
    list of Price
        Step by step, scalar before packets, random before leaf. Each answers a question of its
        own, by its own 95 % interval.
    """
    return [
        Price(*told, ratio, verdict(ratio, _apart(ratio))) for *told, ratio in _ratios(accuracy)
    ]


def _apart(ratio: Estimate) -> bool:
    """Tell whether the interval of a ratio leaves 1 out."""
    low, high = ratio.interval() or (1.0, 1.0)
    return not low <= 1.0 <= high


def _ratios(accuracy: Accuracy) -> Iterator[tuple]:
    for step in STEPS:
        for form in (SCALAR, PAIRS):
            for workload in (RANDOM, LEAF):
                start, end = step.pair(form)
                ratio = accuracy.ratio(end, start, workload)
                if ratio is not None:
                    yield step, form, workload, start, end, ratio


def gains(accuracy: Accuracy, start: Point, end: Point) -> dict[str, tuple[float, float]]:
    """Return what a step changes: before and after, where both are known.

    Returns
    -------
    dict
        ``wrong`` of hard cases (%), ``leaks`` of hard cases (groups), ``ppm`` of all typical
        tests; the 99 % error of t of hard cases: ``relative_t``, and ``p99_t`` in roundoffs where
        both have the same.
    """
    found = {}
    before, after = (accuracy.row(point, CORPUS) for point in (start, end))
    for name, of in (
        ("wrong", lambda row: 100 * row["wrong"] / row["decided"] if row.get("decided") else None),
        ("leaks", lambda row: row.get("leaks")),
        ("p99_t", lambda row: row.get("p99_t")),
        ("relative_t", lambda row: row.get("relative_t")),
    ):
        if name == "p99_t" and start.precision != end.precision:
            continue
        if before and after:
            found[name] = of(before), of(after)
    ppm = [_ppm(accuracy, point) for point in (start, end)]
    found["ppm"] = tuple(ppm)
    return {name: pair for name, pair in found.items() if None not in pair}


def _ppm(accuracy: Accuracy, point: Point) -> float | None:
    rows = [accuracy.row(point, name) for name in (RANDOM, LEAF, FAR)]
    decided = sum(row.get("decided") or 0 for row in rows)
    return 1e6 * sum(row.get("wrong") or 0 for row in rows) / decided if decided else None


def cost_word(price: Price) -> str:
    """Return costs, saves, or nothing where no difference is resolved."""
    return {SLOWER: "costs", FASTER: "saves"}.get(price.verdict, "")
