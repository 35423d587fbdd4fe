"""What a form of a kernel gets wrong: of a million typical tests, and of hard cases.

Typical tests have exact answers, ties among them count for nobody; errors of t are told over
the first hits, each by rational arithmetic. Nothing is timed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rtbench.accuracy import errors, oracle
from rtbench.accuracy.cases import EITHER, MUST_HIT, MUST_MISS, Cases
from rtbench.accuracy.scoring import Answered, Scored, by_family, clipped, roundoff, seen_in, tally
from rtbench.accuracy.verdict import verdict
from rtbench.compiled.filters import undecided
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import fill, record_types
from rtbench.compiled.loops import loop
from rtbench.compiled.packing import Packing
from rtbench.experiments.typical_cells import WIDTH, ask_packets
from rtbench.kernels.contract import HIT, Kernel
from rtbench.kernels.exact_signs import certain_sign
from rtbench.workloads.typical import Tests

CORPUS = "corpus"
MEASURED = 10_000  # hits of which t has an exact value
LOOKED_AT = 4_000  # tests that a filter left, of which is asked what float64 says
EXACT = "adaptive exact"  # the method behind whose filter another one stands


class Form(NamedTuple):
    """A kernel in an arithmetic: one by one with some flags, or in packets with an estimate."""

    kernel: Kernel
    precision: str
    flags: str = "strict"
    reciprocal: str = "division"

    @property
    def key(self) -> dict[str, str]:
        """The columns that tell it."""
        return {"kernel": self.kernel.name} | dict(zip(self._fields[1:], self[1:], strict=True))


@dataclass(frozen=True, eq=False)
class Truth:
    """Typical tests with what is exact of them.

    Attributes
    ----------
    tests : Tests
    expect : (N,) int8 array
        `rtbench.accuracy.oracle.expectations`.
    measured : (M,) int array
        Hits of which t is known exactly.
    t : (M,) float64 array and what rounding left, as `errors.Values` of (M, 3)
    condition : (M, 3) float64 array
    """

    tests: Tests
    expect: np.ndarray
    measured: np.ndarray
    t: errors.Values
    condition: np.ndarray

    @classmethod
    def of(cls, tests: Tests, progress: Callable[[float], None] | None = None) -> Truth:
        """Ask the oracle."""
        expect = oracle.expectations(*tests[1:], progress)
        measured = np.flatnonzero(expect == MUST_HIT)[:MEASURED]
        some = tests.take(measured)[1:]
        exact = errors.exact_values(*some)
        return cls(tests, expect, measured, exact, errors.conditions(*some, exact.value))


class Records:
    """Records of some rays and triangles, those last asked for kept: kernels share them."""

    def __init__(self, triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> None:
        self.arrays = triangles, origins, directions
        self._corners = tuple(np.ascontiguousarray(triangles[:, k]) for k in range(3))
        self._kept: dict[tuple, tuple[np.ndarray, np.ndarray]] = {}

    def of(self, kernel: Kernel, precision: str, layout: str) -> tuple[np.ndarray, np.ndarray]:
        """Return a kernel's records."""
        key = precision, kernel.prepare, *map(str, record_types(kernel, layout, precision))
        if key not in self._kept:
            kept = [known for known in self._kept if known[:2] == (precision, None)]
            self._kept = {known: self._kept[known] for known in kept}  # one million are 100 MB
            with np.errstate(all="ignore"):
                self._kept[key] = fill(kernel, layout, precision, self._corners, *self.arrays[1:])
        return self._kept[key]


def ask(form: Form, records: Records, layout: str) -> Answered:
    """Return what a form says of rays and triangles."""
    kernel, precision, flags, reciprocal = form
    if reciprocal == "estimate":
        outcome, *values = _in_packets(kernel, precision, *records.arrays)
    else:
        instance = loop(kernel, precision, layout, flags=flags)
        found = records.of(kernel, precision, layout)
        outcome, *values = run_once(instance, kernel, precision, *found)
    known = dict(zip(kernel.outputs, values, strict=False))
    return clipped(outcome == HIT, *(known.get(name) for name in ("t", "u", "v")))


def _in_packets(kernel, precision, triangles, origins, directions) -> Iterator[np.ndarray]:
    count = len(origins)
    more = -count % WIDTH
    padded = [np.concatenate([a, a[:1].repeat(more, axis=0)]) for a in (triangles, origins)]
    padded.append(np.concatenate([directions, directions[:1].repeat(more, axis=0)]))
    with np.errstate(all="ignore"):
        outputs, *_ = ask_packets(
            kernel, precision, Packing("pairs", WIDTH, reciprocal="estimate"), *padded
        )
    return (each.reshape(-1)[:count] for each in outputs)


def judge_typical(form: Form, truth: Truth, records: Records, layout: str) -> dict[str, object]:
    """Return the row of accuracy.csv of a form over typical tests."""
    answered = ask(form, records, layout)
    hit, expect = answered.hit, truth.expect
    missed, extra = (expect == MUST_HIT) & ~hit, (expect == MUST_MISS) & hit
    row = form.key | {"workload": truth.tests.name, "tests": len(hit), "hits": int(hit.sum())}
    row |= {"decided": int(np.count_nonzero(expect != EITHER))}
    row |= {"missed": int(missed.sum()), "extra": int(extra.sum())}
    row["wrong"] = row["missed"] + row["extra"]
    if answered.t is not None:
        row |= _errors_of_t(answered, truth, form.precision)
    return row | _left(form, records, layout)


def _errors_of_t(answered: Answered, truth: Truth, precision: str) -> dict[str, float]:
    found = answered.hit[truth.measured]
    t = np.repeat(answered.t[truth.measured, None], 3, axis=1)  # as three columns are wanted
    absolute = errors.absolute_errors(t, truth.t)[found]
    exact = truth.t.value[found]
    over = errors.over_condition(absolute, exact, truth.condition[found], roundoff(precision))
    if not len(over):
        return {}
    with np.errstate(all="ignore"):
        relative = absolute[:, 0] / np.abs(exact[:, 0])
    return {
        "p99_t": float(np.quantile(over[:, 0], 0.99)),
        "relative_t": float(np.quantile(relative, 0.99)),
    }


def judge_corpus(form: Form, cases: Cases, layout: str) -> dict[str, object]:
    """Return the row of accuracy.csv of a form over hard cases."""
    seen = seen_in(cases, form.precision)
    records = Records(seen.triangles, seen.org, seen.dir)
    answered = ask(form, records, layout)
    scored = Scored(seen, answered, form.precision)
    families = by_family(scored)
    core, whole = tally(scored), tally(scored, np.ones(len(seen), dtype=bool))
    row = form.key | {"workload": CORPUS, "tests": core["cases"], "decided": core["decided"]}
    row |= {"hits": int(answered.hit.sum()), "wrong": core["wrong"]}
    row |= {name: core[name] for name in ("unstable", "leaks", "groups", "doubles")}
    row |= {"invalid_accepted": whole["accepted"], "wrong_outside_core": whole["wrong"]}
    row["wrong_outside_core"] -= core["wrong"]
    row |= {"p99_t": core["p99_t"], "relative_t": core["relative_t"]}
    row |= {name: int(holds) for name, holds in verdict(scored, families).holds.items()}
    return row | _left(form, records, layout)


def _left(form: Form, records: Records, layout: str) -> dict[str, int]:
    """Return how many tests the filter leaves, and how many of these float64 does not decide."""
    kernel, precision, flags, reciprocal = form
    if kernel.fallback is None or (flags, reciprocal) != ("strict", "division"):
        return {}
    found = undecided(kernel, precision, *records.of(kernel, precision, layout), layout)
    told = {"undecided": int(found.sum())}
    rows = np.flatnonzero(found)
    if kernel.method != EXACT or len(rows) > LOOKED_AT:
        return told
    data = np.float64 if precision == "float64" else np.float32
    triangles, origins, directions = (
        a[rows].astype(data).astype(np.float64) for a in records.arrays
    )
    with np.errstate(all="ignore"):
        left = [
            _float64_leaves(*corners, o, d)
            for corners, o, d in zip(triangles, origins, directions, strict=True)
        ]
    return told | {"undecided64": int(sum(left))}


def _float64_leaves(v0, v1, v2, orig, dir) -> bool:
    """Tell whether a float64 filter leaves a side of the ray, or that of the plane, open."""
    if not all(np.isfinite(x).all() for x in (v0, v1, v2, orig, dir)):
        return False  # a miss without any sign
    a, b, c = v0 - orig, v1 - orig, v2 - orig
    signs = [certain_sign(dir, p, q) for p, q in ((b, c), (c, a), (a, b))]
    if 1 in signs and -1 in signs:
        return False
    return 0 in signs or certain_sign(a, b, c) == 0
