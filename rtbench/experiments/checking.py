"""One kernel, or function, in one precision against hard cases: what it gets wrong, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtbench.accuracy import edges
from rtbench.accuracy.cases import Cases
from rtbench.accuracy.causes import Causes, causes
from rtbench.accuracy.edges import EdgeRule
from rtbench.accuracy.scoring import (
    Answered,
    Scored,
    by_family,
    clipped,
    curve,
    seen_in,
    tally,
)
from rtbench.accuracy.verdict import CRITERIA, Verdict, broken, verdict
from rtbench.compiled import syntax
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import fill
from rtbench.compiled.loops import loop
from rtbench.experiments import user_function
from rtbench.kernels.contract import HIT, Kernel
from rtbench.records import schema

TOLD = ("wrong", "unstable", "leaks", "groups", "doubles")
ERRORS = ("c_star", "p99_t", "p99_u", "p99_v")


@dataclass(frozen=True, eq=False)
class Check:
    """What a check found of one kernel, or function, in one precision.

    Attributes
    ----------
    name, precision : str
    claims : tuple of str
        What it is held to.
    scored : Scored
    families : list of dict
        As `scoring.by_family` gives them.
    verdict : Verdict
    edges : EdgeRule
    causes : Causes or None
    lengths : list of dict
        The curve over log10 |dir|; empty where none was asked for.
    reads_epsilon : bool
        Whether it compares with the absolute EPSILON.
    """

    name: str
    precision: str
    claims: tuple[str, ...]
    scored: Scored
    families: list[dict[str, object]]
    verdict: Verdict
    edges: EdgeRule
    causes: Causes | None
    lengths: list[dict[str, object]]
    reads_epsilon: bool = False

    @property
    def broken(self) -> tuple[str, ...]:
        """What it claims and does not keep."""
        return broken(self.claims, self.verdict)

    def row(self) -> dict[str, object]:
        """Return the summary: columns of schema.STABILITY_COLUMNS, absent ones left out."""
        core, everything = (
            tally(self.scored),
            tally(self.scored, np.ones(len(self.scored.cases), dtype=bool)),
        )
        row = {"kernel": self.name, "precision": self.precision}
        row |= {key: core[key] for key in TOLD}
        row |= {"invalid_accepted": everything["accepted"], "permutation": core["permutation"]}
        row |= {key: core[key] for key in ERRORS}
        row |= {name: int(holds) for name, holds in self.verdict.holds.items()}
        row |= {
            "edges": self.edges.word,
            "decided": core["decided"],
            "wrong_outside_core": everything["wrong"] - core["wrong"],
            "nonfinite": everything["strange"],
            "claims": " ".join(self.claims),
            "why": self.why(),
        }
        if self.causes:
            row |= {
                "wrong_by_method": self.causes.method,
                "wrong_by_stored_data": self.causes.stored,
                "wrong_by_arithmetic": self.causes.arithmetic,
                "leaks_by_method": self.causes.leaks_of_method,
            }
        return row

    def why(self) -> str:
        """Return in one line what does not hold, of the first where it is worst, and the cause."""
        failed = [name for name in CRITERIA[:6] if name in self.verdict.reasons]
        if not failed:
            return ""
        words = f"fails {' '.join(failed)}: {self.verdict.reasons[failed[0]]}"
        return ": ".join(part for part in (words, self.blame()) if part)

    def blame(self) -> str:
        """Return what the code and its exact form say about the cause, or nothing."""
        found = []
        if self.reads_epsilon and self.scored.unstable.any():
            found.append("its EPSILON is absolute")
        if self.causes and self.causes.method:
            found.append(f"{self.causes.method} answers are wrong in exact arithmetic too")
        if self.causes and self.causes.stored:
            found.append(f"{self.causes.stored} come from rounding what it stores")
        if self.causes and self.causes.leaks_of_method:
            found.append(f"{self.causes.leaks_of_method} leaks are the method's own")
        return ", ".join(found)


def check_kernel(
    kernel: Kernel, precision: str, cases: Cases, lengths: Cases | None = None
) -> Check:
    """Check one kernel in one precision.

    Parameters
    ----------
    kernel : Kernel
        One with a domain: a line kernel is judged as a ray kernel that clips.
    precision : str
        One of ``kernel.precisions``.
    cases : Cases
    lengths : Cases, optional
        Easy cases over log10 |dir|.

    Returns
    -------
    Check
    """
    return _check(
        kernel.name,
        precision,
        cases,
        lengths,
        lambda *pairs: ask_kernel(kernel, precision, *pairs),
        kernel,
    )


def check_function(
    function: Callable, name: str, precision: str, cases: Cases, lengths: Cases | None = None
) -> Check:
    """Check a user's function, called once, in one precision; see `user_function`."""
    return _check(
        name,
        precision,
        cases,
        lengths,
        lambda *pairs: user_function.ask(function, name, precision, *pairs),
    )


def ask_kernel(
    kernel: Kernel,
    precision: str,
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
) -> Answered:
    """Return what a kernel says of rays and triangles, (N, 3, 3) and (N, 3) arrays."""
    corners = tuple(np.ascontiguousarray(triangles[:, k]) for k in range(3))
    with np.errstate(all="ignore"):
        records = fill(kernel, "own", precision, corners, origins, directions)
    outcome, *values = run_once(loop(kernel, precision, "own"), kernel, precision, *records)
    found = dict(zip(kernel.outputs, values, strict=False))
    return clipped(outcome == HIT, *(found.get(name) for name in ("t", "u", "v")))


def _check(name, precision, cases, lengths, ask, kernel=None) -> Check:
    seen = seen_in(cases, precision)
    others = seen_in(lengths, precision) if lengths is not None else None
    parts = [seen, *([others] if others is not None else [])]
    triangles, origins, directions = edges.pairs()
    answered = ask(
        np.concatenate([*(part.triangles for part in parts), triangles]),
        np.concatenate([*(part.org for part in parts), origins]),
        np.concatenate([*(part.dir for part in parts), directions]),
    )
    scored = Scored(seen, answered.part(slice(len(seen))), precision)
    families = by_family(scored)
    over_length = []
    if others is not None:
        other = Scored(others, answered.part(slice(len(seen), len(seen) + len(others))), precision)
        over_length = curve(other, np.ones(len(others), dtype=bool), most=100)
    return Check(
        name,
        precision,
        kernel.claims if kernel else (),
        scored,
        families,
        verdict(scored, families),
        edges.edge_rule(kernel, answered.hit[-len(triangles) :]),
        causes(kernel, scored) if kernel else None,
        over_length,
        kernel is not None and "EPSILON" in syntax.outside_names(kernel),
    )


def tables(check: Check) -> tuple[dict, list[dict], list[dict]]:
    """Return a check as rows of stability.csv, families.csv and curves.csv."""
    cell = {"kernel": check.name, "precision": check.precision}
    points = [
        {"family": row["family"], **point}
        for row in check.families
        for point in curve(check.scored, check.scored.of((row["family"],)))
    ]
    points += [{"family": schema.LENGTHS, **point} for point in check.lengths]
    return (
        check.row(),
        [cell | row for row in check.families],
        [cell | point for point in points],
    )
