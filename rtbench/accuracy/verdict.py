"""Is a kernel stable (S1 to S6), range-safe (R1), exact (X1, X2)? And if not, where does it fail?

S1 asks that no wrong answer in the core families is unstable; R1 asks the same of the families
subnormal and overflow, whose numbers lie near the ends of the floating-point range. S2, S5, S6 and
X2 are about the core families, S3 about infinities, NaN and zero directions, S4 and X1 about all.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from rtbench.accuracy.scoring import (
    OUTSIDE_CORE,
    QUANTITIES,
    RANGE_FAMILIES,
    Scored,
)
from rtbench.kernels.contract import CLAIMS

CRITERIA = tuple(CLAIMS)
LARGEST_ERROR = 64.0  # S5: roundoffs of condition and value, at the 99th percentile


class Verdict(NamedTuple):
    """What holds, and of what does not hold where it fails worst, in words.

    Attributes
    ----------
    holds : dict of str to bool
        By the names of CRITERIA.
    reasons : dict of str to str
        Of those that do not hold.
    """

    holds: dict[str, bool]
    reasons: dict[str, str]


def verdict(scored: Scored, families: list[dict[str, object]]) -> Verdict:
    """Return what holds of a kernel in one precision.

    Parameters
    ----------
    scored : Scored
    families : list of dict
        As `scoring.by_family` gives them.

    Returns
    -------
    Verdict
        S5 does not hold of a test that returns no t: nothing shows it.
    """
    core = [row for row in families if row["family"] not in OUTSIDE_CORE]
    reasons = {
        "S1": _unstable(core),
        "S2": _most(core, "leaks", "leak", "leaks"),
        "S3": _most(families, "accepted", "invalid input accepted", "invalid inputs accepted"),
        "S4": _most(families, "strange", "hit with NaN or inf", "hits with NaN or inf"),
        "S5": _inaccurate(scored, core),
        "S6": _most(core, "permutation", "change with vertex order", "changes with vertex order"),
        "R1": _unstable([row for row in families if row["family"] in RANGE_FAMILIES]),
        "X1": _most(families, "wrong", "wrong answer", "wrong answers"),
        "X2": _not_once(core),
    }
    return Verdict(
        {name: not reasons[name] for name in CRITERIA},
        {name: reason for name, reason in reasons.items() if reason},
    )


def broken(claims: Iterable[str], found: Verdict) -> tuple[str, ...]:
    """Return the criteria that a kernel claims and that do not hold."""
    return tuple(name for name in claims if not found.holds[name])


def worst_family(families: list[dict[str, object]], key: str) -> dict[str, object] | None:
    """Return the family with the greatest count or number; None where all are none or zero."""
    there = [row for row in families if row[key]]
    return max(there, key=lambda row: row[key]) if there else None


def _unstable(families: list[dict[str, object]]) -> str:
    unstable = [row for row in families if row["unstable"]]
    if not unstable:
        return ""
    count = sum(row["unstable"] for row in unstable)
    worst = worst_family(unstable, "c_star")
    return (
        f"{count} unstable {'answer' if count == 1 else 'answers'}, worst in {worst['family']} "
        f"(C* {worst['c_star']:.2g})"
    )


def _most(families: list[dict[str, object]], key: str, one: str, many: str) -> str:
    worst = worst_family(families, key)
    if worst is None:
        return ""
    count = sum(row[key] for row in families)
    share = "" if worst[key] == count else f"{worst[key]} of them "
    return f"{count} {one if count == 1 else many}, {share}in {worst['family']}"


def _inaccurate(scored: Scored, families: list[dict[str, object]]) -> str:
    if all(getattr(scored.answered, name) is None for name in QUANTITIES):
        return "it returns no t, u or v"
    told = []
    for name in QUANTITIES:
        worst = worst_family(families, f"p99_{name}")
        if worst and worst[f"p99_{name}"] > LARGEST_ERROR:
            told.append(f"{name} {worst[f'p99_{name}']:.3g} in {worst['family']}")
    return f"99 % errors in roundoffs: {', '.join(told)}" if told else ""


def _not_once(families: list[dict[str, object]]) -> str:
    leaks = sum(row["leaks"] for row in families)
    doubles = sum(row["doubles"] for row in families)
    if not leaks + doubles:
        return ""
    groups = sum(row["groups"] for row in families)
    return f"of {groups} groups {leaks} are hit too seldom and {doubles} too often"
