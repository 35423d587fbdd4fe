"""How far t, u, v of the nearest hits lie from the exact ones (Havel 2008, section 5.5).

Every ray of a soup meets all triangles, as in chapter 5. Where a method chooses the triangle that
is exactly the nearest, its t, u, v are compared with three references:

``exact``
    Rational arithmetic on the very numbers that the method was given.
``moller_trumbore``
    Havel's own: Möller-Trumbore in double precision on the same numbers. It hides the errors of
    Möller-Trumbore itself, which in double precision are as large as anybody's.
``unrounded``
    Rational arithmetic on what float32 data were before they were rounded to float32. Neither of
    the two others sees the errors of the data.

The soup is float32; before it was rounded it had further digits, drawn at random, and with those
digits it is what the methods get in double precision: data of 24 bits would flatter them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from rtbench.accuracy import errors
from rtbench.accuracy.errors import QUANTITIES, Values
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import DATA_TYPE, fill
from rtbench.errors import RtbenchError
from rtbench.experiments import rays
from rtbench.experiments.bench import Bench
from rtbench.kernels import registry
from rtbench.kernels.contract import Kernel
from rtbench.records import schema
from rtbench.workloads.rounding import ROUNDOFF
from rtbench.workloads.soup import Soup, decided

CELL = ("kernel", "precision", "prepared")
SMALLEST = 1e-3  # Havel's: of a smaller t, u or v a relative error says nothing
REFERENCE = "moller_trumbore_uv"
ENDINGS = ("_uv", "_last_uv")


@dataclass(frozen=True, eq=False)
class Subject:
    """The soups in one data type, and what is exact of each ray and its nearest triangle.

    Attributes
    ----------
    soups : tuple of Soup
    hits : tuple of (H_i,) int arrays
        The rays of each soup that hit something; N = H_0 + H_1 + ... pairs.
    units : (N,) int array
        A number for each triangle of each soup.
    condition : (N, 3) float64 array
    references : dict of str to Values
        N pairs each.
    """

    soups: tuple[Soup, ...]
    hits: tuple[np.ndarray, ...]
    units: np.ndarray
    condition: np.ndarray
    references: dict[str, Values]


@dataclass(frozen=True, eq=False)
class Answers:
    """What a kernel says of a subject: the triangle of every ray, and t, u, v of the N pairs."""

    nearest: tuple[np.ndarray, ...]
    values: np.ndarray
    agrees: np.ndarray


def build(bench: Bench) -> None:
    """Time nothing: draw the soups, ask every kernel, and keep errors and choices."""
    config, kernels = bench.config, chosen(bench)
    soups = [rays.draw(bench, ratio) for ratio in config.densities]
    wide = [widened(soup, config.seed) for soup in soups]
    wanted = {precision: DATA_TYPE[precision] for precision in config.precisions}
    subjects = {data: _subject(bench, data, soups, wide) for data in dict.fromkeys(wanted.values())}
    bench.tables[schema.ERRORS] = found = []
    bench.tables[schema.CHOICES] = choices = []
    for precision, data in wanted.items():
        rows, measures, used, nearest = [], [], [], []
        for kernel in kernels:
            bench.say(f"errors of {kernel.name} in {precision}")
            for prepared in _ways(kernel, precision, config.prepared):
                answers = ask(bench, kernel, precision, subjects[data], prepared or "own")
                cell = {"kernel": kernel.name, "precision": precision, "prepared": prepared}
                nearest.append(answers.nearest)
                choices += _choices(cell, subjects[data], config.densities, answers, precision)
                for row, measure, which in _measures(subjects[data], answers, precision):
                    rows.append(cell | row)
                    measures.append(measure)
                    used.append(which)
        choices += _disagreements(precision, subjects[data], config.densities, nearest)
        means = errors.mean_errors(
            np.array(measures), np.array(used), subjects[data].units, config.seed
        )
        ends = zip(*(column.tolist() for column in means), strict=True)
        for row, (mean, low, high) in zip(rows, ends, strict=True):
            found.append(row | {"mean": mean, "ci_low": low, "ci_high": high})


def chosen(bench: Bench) -> list[Kernel]:
    """Return the kernels: what is named, and of a pattern's each method in its two endings.

    Those are the method's own order of tests with the division first, and the same with the
    division last.

    Raises
    ------
    RtbenchError
        If a kernel named returns no u and v, or no kernel is left.
    """
    patterns = [p for p in bench.config.kernels if re.search(r"[*?\[]", p) and ".py:" not in p]
    named = registry.select([p for p in bench.config.kernels if p not in patterns])
    for kernel in named:
        if kernel.outputs != QUANTITIES:
            raise RtbenchError(
                f"kernel {kernel.name!r} does not return t, u and v (perhaps {kernel.name}_uv does)"
            )
    kept = [
        kernel
        for kernel in bench.kernels
        if kernel in named
        or (
            kernel.ending is not None
            and kernel.takes_tmax
            and kernel.outputs == QUANTITIES
            and kernel.name in [kernel.function.__name__ + ending for ending in ENDINGS]
        )
    ]
    if not kept:
        raise RtbenchError(
            f"no method matches {', '.join(patterns)}: of a pattern only METHOD_uv and "
            "METHOD_last_uv are taken; name any other kernel in full"
        )
    return kept


def widened(soup: Soup, seed: int) -> Soup:
    """Return a soup in float64 that rounds to this float32 one: further digits at random."""
    random = np.random.default_rng([seed, 5])

    def more_digits(values: np.ndarray) -> np.ndarray:
        exact = values.astype(np.float64)
        part = random.uniform(-0.5, 0.5, values.shape) * np.spacing(np.abs(values))
        wide = exact + part
        # Below a power of two float32 numbers lie twice as close.
        outward = exact + np.copysign(part, exact)
        return np.where(wide.astype(np.float32) == values, wide, outward)

    corners, origins, directions = map(more_digits, (soup.triangles, soup.orig, soup.dir))
    return decided(corners, origins, directions, soup.name, soup.spread, soup.seed)


def _subject(bench: Bench, data: type, soups: list[Soup], wide: list[Soup]) -> Subject:
    own = wide if data is np.float64 else soups
    bench.say(f"exact t, u, v in {np.dtype(data).name}")
    hits = tuple(np.flatnonzero(soup.nearest >= 0) for soup in own)
    starts = np.cumsum([0, *(len(soup.v0) for soup in own)])
    units = [soup.nearest[hit] + s for soup, hit, s in zip(own, hits, starts, strict=False)]
    pairs = _pairs(own, own, hits)
    references = {"exact": errors.exact_values(*pairs)}
    condition = errors.conditions(*pairs, references["exact"].value)
    subject = Subject(tuple(own), hits, np.concatenate(units), condition, references)
    kernel = registry.find(REFERENCE)
    values = ask(bench, kernel, "float64", subject).values
    references["moller_trumbore"] = Values(values, np.zeros_like(values))
    if data is not np.float64:
        references["unrounded"] = errors.exact_values(*_pairs(wide, own, hits))
    return subject


def _pairs(numbers: list[Soup], choice: list[Soup], hits: tuple) -> tuple[np.ndarray, ...]:
    """Return triangles, origins, directions of the rays ``hits`` and their nearest triangles."""
    parts = [
        (soup.triangles[other.nearest[hit]], soup.orig[hit], soup.dir[hit])
        for soup, other, hit in zip(numbers, choice, hits, strict=True)
    ]
    return tuple(np.concatenate(arrays) for arrays in zip(*parts, strict=True))


def ask(
    bench: Bench, kernel: Kernel, precision: str, subject: Subject, prepared: str = "own"
) -> Answers:
    """Return what a kernel says; t, u, v in float64, NaN where it chose another triangle."""
    instance = bench.instance(kernel, precision, kind=rays.NEAREST)
    nearest, values = [], []
    for soup, hit in zip(subject.soups, subject.hits, strict=True):
        records = fill(
            kernel,
            bench.config.layout,
            precision,
            (soup.v0, soup.v1, soup.v2),
            soup.orig,
            soup.dir,
            tmax=np.inf,
            prepared=prepared,
        )
        triangle, *outputs = run_once(instance, kernel, precision, *records)
        own = np.stack(outputs, axis=1)[hit].astype(np.float64)
        own[triangle[hit] != soup.nearest[hit]] = np.nan
        nearest.append(triangle)
        values.append(own)
    found = np.concatenate(values)
    return Answers(tuple(nearest), found, np.isfinite(found).all(axis=1))


def _ways(kernel: Kernel, precision: str, prepared: tuple[str, ...]) -> tuple[str | None, ...]:
    """Return the ways to prepare that differ; None for a kernel that prepares nothing."""
    if kernel.prepare is None:
        return (None,)
    return ("own",) if precision != "float32" else prepared


def _measures(subject: Subject, answers: Answers, precision: str):
    """Yield a row, relative errors (N,) and which of them count, for each quantity, reference."""
    exact = subject.references["exact"].value
    for reference, values in subject.references.items():
        size = np.abs(values.value)
        absolute = errors.absolute_errors(answers.values, values)
        scaled = errors.over_condition(absolute, exact, subject.condition, ROUNDOFF[precision])
        counts = answers.agrees[:, None] & (size > SMALLEST)
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = absolute / size
        for k, quantity in enumerate(QUANTITIES):
            used = counts[:, k]
            row = {"quantity": quantity, "reference": reference, "hits": int(used.sum())}
            if used.any():
                row |= _tails("", relative[used, k]) | _tails("over_condition_", scaled[used, k])
            yield row, relative[:, k], used


def _tails(prefix: str, values: np.ndarray) -> dict[str, float]:
    middle, far = np.quantile(values, [0.5, 0.99])
    found = {"median": float(middle), "p99": float(far), "max": float(values.max())}
    return {prefix + name: value for name, value in found.items()}


def _choices(cell: dict, subject: Subject, ratios: tuple, answers: Answers, precision: str):
    """Yield how many rays of each soup got another triangle than the exact nearest."""
    for ratio, soup, nearest in zip(ratios, subject.soups, answers.nearest, strict=True):
        other = np.flatnonzero(nearest != soup.nearest)
        unsafe = soup.unsafe(other, nearest[other], precision)
        unsafe |= soup.unsafe(other, soup.nearest[other], precision)
        told = {"rays": len(nearest), "differ": len(other), "within_rounding": int(unsafe.sum())}
        yield cell | {"density": ratio} | told


def _disagreements(precision: str, subject: Subject, ratios: tuple, nearest: list):
    """Yield for how many rays of each soup some two kernels choose different triangles."""
    for ratio, soup, found in zip(ratios, subject.soups, zip(*nearest, strict=True), strict=True):
        found = np.array(found)
        rows = np.flatnonzero((found != found[0]).any(axis=0))
        unsafe = np.ones(len(rows), bool)
        for one in (*found, soup.nearest):
            other = one[rows] != soup.nearest[rows]
            # A kernel is within rounding if what it chose, or what it should have, is unsafe.
            fine = soup.unsafe(rows, one[rows], precision)
            fine |= soup.unsafe(rows, soup.nearest[rows], precision)
            unsafe &= fine | ~other
        told = {
            "rays": len(soup.nearest),
            "differ": len(rows),
            "within_rounding": int(unsafe.sum()),
        }
        yield {"precision": precision, "density": ratio} | told
