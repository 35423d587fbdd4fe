"""What a thesis states, decided by a number.

A statement is confirmed or refuted where the 95 % interval of its number lies on one side of the
bound, and not resolved where it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rtbench.records.resampling import Estimate

CONFIRMED, REFUTED, NOT_RESOLVED = "confirmed", "refuted", "not resolved"


@dataclass(frozen=True)
class Statement:
    """What the thesis says, the tables it takes to judge it, and the judge.

    ``judge(runs)`` is given what was measured by table and returns a verdict and the number behind
    it.
    """

    section: str
    text: str
    tables: tuple[str, ...]
    judge: Callable[[Mapping[str, object]], tuple[str, str]]


def rows(statements: Sequence[Statement], measured: Mapping[str, object]) -> list[dict]:
    """Judge the statements whose tables are all there.

    Returns
    -------
    list of dict
        ``section, statement, verdict, number``.
    """
    found = []
    for statement in statements:
        if all(table in measured for table in statement.tables):
            verdict, number = statement.judge(measured)
            found.append(
                {
                    "section": statement.section,
                    "statement": statement.text,
                    "verdict": verdict,
                    "number": number,
                }
            )
    return found


def side(estimate: Estimate, bound: float = 1.0) -> int:
    """Return +1 or -1 where the interval lies above or below the bound, 0 where it does not."""
    low, high = estimate.interval() or (-np.inf, np.inf)
    return int(low > bound) - int(high < bound)


def within(estimate: Estimate, low: float, high: float) -> int:
    """Return +1 where the interval lies between the bounds, -1 where outside, 0 where neither."""
    ends = estimate.interval() or (-np.inf, np.inf)
    if low <= ends[0] and ends[1] <= high:
        return 1
    return -1 if ends[1] < low or ends[0] > high else 0


def shown(estimate: Estimate, unit: str = "", scale: float = 1.0, digits: int = 3) -> str:
    """Return a number with its interval as text."""
    text = f"{estimate.value * scale:.{digits}f}{unit}"
    if (ends := estimate.interval()) is None:
        return f"{text} (no interval)"
    return f"{text} [{ends[0] * scale:.{digits}f}, {ends[1] * scale:.{digits}f}]"


def decided(sides: Sequence[int]) -> str:
    """Confirmed if every number is resolved as said (+1), refuted if one is resolved against."""
    if -1 in sides:
        return REFUTED
    return CONFIRMED if all(side == 1 for side in sides) else NOT_RESOLVED
