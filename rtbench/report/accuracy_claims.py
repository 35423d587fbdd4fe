"""What is claimed of the exact kernel in packets, and whether a run bears it out."""

from dataclasses import dataclass

from rtbench.records.statistics import Estimate
from rtbench.report.accuracy import CORPUS, FAR, LEAF, PAIRS, RANDOM, Accuracy, Point
from rtbench.report.accuracy_steps import EXACT, WHOLE


@dataclass(frozen=True)
class Statement:
    """A claim, whether the run bears it out, and the number that decides."""

    claim: str
    verdict: str
    number: str


LEAST_SHARE = 0.6
CONFIRMED, REFUTED, OPEN = "confirmed", "refuted", "not resolved"


def stable_kernels(accuracy: Accuracy, form: str, precision: str = "float32") -> list[Point]:
    """Return the points of a form with a stable t: by how they end, or by the hard cases (S5)."""
    return [
        point
        for point in accuracy.points(RANDOM, form)
        if (point.precision, point.flags, point.reciprocal) == (precision, "strict", "division")
        and point.kernel != EXACT
        and ("_stable" in point.kernel or accuracy.row(point, CORPUS).get("S5"))
    ]


def compare(ratio: Estimate, least: float) -> str:
    """Return whether a ratio is at least so much, by its interval."""
    low, high = ratio.interval() or (ratio.value, ratio.value)
    return CONFIRMED if low >= least else REFUTED if high < least else OPEN


def statements(accuracy: Accuracy) -> list[Statement]:
    """Return what is claimed of the exact kernel in packets, each with its verdict."""
    exact, found = Point(EXACT, form=PAIRS), []
    if not accuracy.has(exact):
        return found
    stable = stable_kernels(accuracy, PAIRS)
    if stable:
        best = min(stable, key=lambda point: accuracy.time(point).value)
        share = accuracy.ratio(best, exact)
        found.append(
            Statement(
                f"exact float32 packets reach {LEAST_SHARE} of the fastest with a stable t",
                compare(share, LEAST_SHARE),
                f"{_number(share)} of {best.name}",
            )
        )
    wide = Point(WHOLE, "float64", PAIRS)
    if accuracy.has(wide):
        share = accuracy.ratio(wide, exact)
        found.append(
            Statement(
                "exact float32 packets are faster than Möller-Trumbore in float64",
                compare(share, 1.0),
                f"{_number(share)} times as fast as {wide.name}",
            )
        )
    rows = [accuracy.row(exact, name) for name in (RANDOM, LEAF, FAR, CORPUS)]
    rows = [row for row in rows if row]
    if rows:
        wrong, asked = (sum(row.get(name) or 0 for row in rows) for name in ("wrong", "decided"))
        wrong += sum(row.get("wrong_outside_core") or 0 for row in rows)
        found.append(
            Statement(
                "exact float32 answers are never wrong",
                REFUTED if wrong else CONFIRMED,
                f"{wrong} wrong of {asked:,} answers",
            )
        )
    return found


def _number(ratio: Estimate) -> str:
    ends = ratio.interval()
    return f"{ratio.value:.2f}" + (f" [{ends[0]:.2f}, {ends[1]:.2f}]" if ends else "")
