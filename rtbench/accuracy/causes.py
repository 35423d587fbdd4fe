"""Why an answer is wrong: the method, the numbers that it stores, or its arithmetic.

The same kernel is asked in rational numbers. Where it is wrong then too, the method is; where it is
right on exact numbers and wrong on the prepared numbers as they were rounded and stored, these are;
all other wrong answers come from rounding during the test.
"""

from __future__ import annotations

import math
from fractions import Fraction
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from rtbench.accuracy.scoring import ODD, ONCE, Scored
from rtbench.compiled.exact import UNDEFINED, Undefined, exact_form, exact_records
from rtbench.compiled.layout import fill
from rtbench.kernels.contract import HIT, TMAX, Kernel


class Causes(NamedTuple):
    """How many wrong answers, and leaks, of the core families have which cause.

    Attributes
    ----------
    method, stored, arithmetic : int
        They add up to the wrong answers.
    leaks_of_method : int
        Groups that leak and also leak in rational numbers.
    """

    method: int
    stored: int
    arithmetic: int
    leaks_of_method: int


def causes(kernel: Kernel, scored: Scored) -> Causes | None:
    """Return why the wrong answers of the core families are wrong; None without an exact form."""
    if not kernel.exact:
        return None
    cases = scored.cases
    rows = np.flatnonzero(scored.wrong & scored.core & _finite(scored))
    must = cases.expect[rows] == 1
    pairs = cases.triangles[rows], cases.org[rows], cases.dir[rows]
    of_method = exact_hits(kernel, *pairs) != must
    of_stored = np.zeros(len(rows), dtype=bool)
    if kernel.prepare is not None:
        of_stored = (stored_hits(kernel, scored.precision, *pairs) != must) & ~of_method
    found = int(of_method.sum()), int(of_stored.sum())
    total = int(np.count_nonzero(scored.wrong & scored.core))
    return Causes(*found, total - sum(found), _leaks_of_method(kernel, scored))


def _finite(scored: Scored) -> np.ndarray:
    numbers = [
        scored.cases.v0,
        scored.cases.v1,
        scored.cases.v2,
        scored.cases.org,
        scored.cases.dir,
    ]
    return np.isfinite(np.concatenate(numbers, axis=1)).all(axis=1)


def _leaks_of_method(kernel: Kernel, scored: Scored) -> int:
    groups, cases = scored.groups, scored.cases
    counted = (groups.rule == ONCE) | (groups.rule == ODD)
    leaking = groups.first[groups.leak & counted & scored.core[groups.first]]
    rows = np.flatnonzero(np.isin(cases.group, cases.group[leaking]) & _finite(scored))
    hit = exact_hits(kernel, cases.triangles[rows], cases.org[rows], cases.dir[rows])
    closed = np.unique(cases.group[rows][hit])
    return len(leaking) - len(closed)


def exact_hits(
    kernel: Kernel, triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> np.ndarray:
    """Return what a kernel answers in rational numbers, for the rays t > 0.

    Parameters
    ----------
    kernel : Kernel
        One that has an exact form.
    triangles : (N, 3, 3) float array
        Finite.
    origins, directions : (N, 3) float arrays
        Finite; a segment's end is their sum.

    Returns
    -------
    (N,) bool array
    """
    corners = tuple(triangles[:, k] for k in range(3))
    return _hits(kernel, *exact_records(kernel, corners, origins, directions))


def stored_hits(
    kernel: Kernel,
    precision: str,
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
) -> np.ndarray:
    """Return what a kernel answers in rational numbers on what it stores, as that was rounded.

    Parameters
    ----------
    kernel : Kernel
        One that has an exact form.
    precision : str
        In which the prepared numbers are computed and kept.
    triangles, origins, directions
        As for `exact_hits`.

    Returns
    -------
    (N,) bool array
    """
    corners = tuple(triangles[:, k] for k in range(3))
    with np.errstate(all="ignore"):
        records = fill(kernel, "own", precision, corners, origins, directions)
    return _hits(kernel, *(_rationals(part) for part in records))


def _hits(kernel: Kernel, triangles: list, rays: list) -> np.ndarray:
    function = exact_form(kernel)
    found = np.zeros(len(rays), dtype=bool)
    for i, (triangle, ray) in enumerate(zip(triangles, rays, strict=True)):
        outcome, *outputs = function(triangle, ray)
        found[i] = outcome == HIT and (not outputs or bool(outputs[0] > 0))
    return found


def _rationals(records: np.ndarray) -> list[SimpleNamespace]:
    """Return records with each number as the rational that it is."""
    rows = []
    for record in records:
        fields = {name: _rational(record[name]) for name in records.dtype.names}
        if TMAX in fields:
            fields[TMAX] = math.inf
        rows.append(SimpleNamespace(**fields))
    return rows


def _rational(value: object) -> Fraction | int | Undefined | list:
    if np.ndim(value):
        return [_rational(part) for part in value]
    if isinstance(value, np.integer):
        return int(value)
    return Fraction(float(value)) if np.isfinite(value) else UNDEFINED
