"""All families together, with their exact answers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtbench.accuracy import oracle
from rtbench.accuracy.cases import CLASS_NAMES, Cases
from rtbench.errors import RtbenchError, unknown
from rtbench.workloads.hard_cases.families import FAMILIES, Family
from rtbench.workloads.hard_cases.geometry import FORMATS, Geometry, joined

VERSION = 1
"""Raised when families are to be drawn anew; part of every seed."""

Progress = Callable[[float], None]


def drawn(family: str, seed: int = 1) -> Geometry:
    """Return one family's rays and triangles, without answers.

    Parameters
    ----------
    family : str
        A name of FAMILIES.
    seed : int
        At least 0. A family's cases depend on it, VERSION and the family's number alone; another
        machine's sines and powers may differ in the last bit, and so may some coordinates.

    Returns
    -------
    Geometry
        First those that were drawn in float32, then those in float64.

    Raises
    ------
    RtbenchError
        For an unknown family or a negative seed.
    """
    names = [each.name for each in FAMILIES]
    if family not in names:
        raise RtbenchError(unknown("family", family, names))
    if seed < 0:
        raise RtbenchError(f"seed {seed} is not allowed (allowed: 0 or more)")
    number = names.index(family)
    random = np.random.default_rng([int(seed), VERSION, number])
    found = FAMILIES[number]
    return joined(
        [found.draw(random, form, n) for form, n in zip(FORMATS, found.sizes, strict=True)]
    )


def corpus(seed: int = 1, progress: Progress | None = None) -> Cases:
    """Return all hard cases with their exact answers.

    Parameters
    ----------
    seed : int
        At least 0.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Cases
        About 20,000, family by family; two thirds of them are float32 numbers.

    Raises
    ------
    RtbenchError
        If the seed is negative.
    """
    if seed < 0:
        raise RtbenchError(f"seed {seed} is not allowed (allowed: 0 or more)")
    return answered({each: drawn(each.name, seed) for each in FAMILIES}, progress)


def answered(parts: dict[Family, Geometry], progress: Progress | None = None) -> Cases:
    """Return cases of several families with their exact answers.

    Parameters
    ----------
    parts : dict of Family to Geometry
        Numbered in this order.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Cases
    """
    whole = joined(list(parts.values()))
    rows = *(whole.triangles[:, k] for k in range(3)), whole.origins, whole.directions

    found = oracle.answers(*rows, progress=progress)
    sizes = [len(part.triangles) for part in parts.values()]
    return Cases(
        **dict(zip(("v0", "v1", "v2", "org", "dir"), rows, strict=True)),
        family=np.repeat(np.arange(len(parts)), sizes),
        family_names=tuple(family.name for family in parts),
        difficulty=whole.difficulty,
        f32_ok=_in_float32(*rows),
        **found._asdict(),
        class_names=CLASS_NAMES,
        group=whole.group,
        group_rule=np.array([family.rule for family in parts], np.int8),
        name=whole.name,
        source=whole.source,
    )


def _in_float32(*rows: np.ndarray) -> np.ndarray:
    """Tell which cases float32 holds."""
    numbers = np.concatenate(rows, axis=1)
    with np.errstate(over="ignore"):
        short = numbers.astype(np.float32).astype(np.float64)
    return ((short == numbers) | (np.isnan(numbers) & np.isnan(short))).all(axis=1)


def describe(cases: Cases) -> list[dict]:
    """Return what is in a corpus, also one that somebody else made.

    Parameters
    ----------
    cases : Cases

    Returns
    -------
    list of dict
        A row a family: family, cases, float32 (cases), groups, rule, easiest and hardest
        (difficulty), difficulty (what it means; None where it is not known), hard, and the number
        of cases of each class.
    """
    known = {family.name: family for family in FAMILIES}
    rows = []
    for number, name in enumerate(cases.family_names):
        own = cases.family == number
        group, difficulty = cases.group[own], cases.difficulty[own]
        counts = np.bincount(cases.cls[own], minlength=len(cases.class_names))
        rows.append(
            {
                "family": name,
                "cases": int(own.sum()),
                "float32": int(cases.f32_ok[own].sum()),
                "groups": len(np.unique(group[group >= 0])),
                "rule": int(cases.group_rule[number]),
                "easiest": float(difficulty.min()) if own.any() else None,
                "hardest": float(difficulty.max()) if own.any() else None,
                "difficulty": known[name].difficulty if name in known else None,
                "hard": known[name].hard if name in known else None,
                **dict(zip(cases.class_names, map(int, counts), strict=True)),
            }
        )
    return rows
