"""Is a kernel stable, and where is it not: hard cases with exact answers, every family scored.

Nothing is timed. Float32 and mixed forms see the cases that float32 holds; float64 forms see all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtbench.accuracy.cases import Cases
from rtbench.errors import RtbenchError, unknown
from rtbench.experiments import user_function
from rtbench.experiments.bench import Bench
from rtbench.experiments.checking import Check, check_function, check_kernel, tables
from rtbench.kernels import registry
from rtbench.kernels.contract import Kernel
from rtbench.records import schema

CELL = ("kernel", "precision")
EVERY = "*"  # in a config: the methods that `own_forms` names


class Subject(NamedTuple):
    """What is to be checked: a kernel or a user's function, under a name."""

    name: str
    test: Kernel | Callable

    def check(self, precision: str, cases: Cases, lengths: Cases | None = None) -> Check:
        """Check it in one precision; see `check_kernel` and `check_function`."""
        if isinstance(self.test, Kernel):
            return check_kernel(self.test, precision, cases, lengths)
        return check_function(self.test, self.name, precision, cases, lengths)


def own_forms(kernels: Iterable[Kernel]) -> tuple[list[Kernel], list[Kernel]]:
    """Return each method in its own way to end, with u and v where it has them; and what is not.

    Returns
    -------
    forms, untestable : lists of Kernel
        The latter test a point: no ray hits or misses there.
    """
    known = {kernel.name: kernel for kernel in kernels}
    forms = [
        known.get(f"{name}_uv", kernel)
        for name, kernel in known.items()
        if name == kernel.function.__name__
    ]
    return (
        [kernel for kernel in forms if kernel.domain is not None],
        [kernel for kernel in known.values() if kernel.domain is None],
    )


def subjects(names: Iterable[str] = (), every: bool = False) -> tuple[list[Subject], list[str]]:
    """Return what names stand for, and what is to be remarked.

    Parameters
    ----------
    names : iterable of str
        Kernels, globs, ``FILE.py:NAME``, ``module:function``; none: all methods, see `own_forms`.
    every : bool
        All kernels in all forms.

    Raises
    ------
    RtbenchError
        For an unknown name, a module that cannot be imported, a kernel that tests no ray.
    """
    names, known = list(names), list(registry.all_kernels().values())
    if not names:
        kernels, points = own_forms(known)
        if every:
            kernels = [kernel for kernel in known if kernel.domain is not None]
        left = f"left out: {len(points)} forms that test a point against a triangle, no ray"
        return [Subject(kernel.name, kernel) for kernel in kernels], [left] if points else []
    found: dict[str, Subject] = {}
    for name in names:
        if ":" in name:
            test = user_function.find(name)
            found[name] = Subject(test.name if isinstance(test, Kernel) else name, test)
        else:
            found |= {
                kernel.name: Subject(kernel.name, kernel) for kernel in registry.select([name])
            }
    for subject in found.values():
        if isinstance(subject.test, Kernel) and subject.test.domain is None:
            raise RtbenchError(
                f"{subject.name} tests whether a point lies in a triangle: no ray hits or misses"
            )
    return list(found.values()), []


def cases(
    corpus: Path | None,
    families: Iterable[str],
    seed: int,
    say: Callable[[str], None] = lambda text: None,
) -> tuple[Cases, Cases | None]:
    """Return the hard cases, and those over the length of dir, of which a family or file has none.

    Parameters
    ----------
    corpus : Path or None
        A file of cases; rtbench's own if not given.
    families : iterable of str
        Only these; all if empty.
    seed : int
        Of rtbench's own cases.
    say : callable
        Is told what begins.

    Raises
    ------
    RtbenchError
        For a file that cannot be read, or a family that is not there.
    """
    lengths = None
    if corpus is not None:
        say(f"reading {corpus}")
        found = Cases.load(corpus)
    else:
        from rtbench.workloads import hard_cases

        say("making hard cases and their exact answers")
        found = hard_cases.corpus(seed)
        lengths = hard_cases.direction_lengths(seed)
    families = list(families)
    for family in families:
        if family not in found.family_names:
            raise RtbenchError(unknown("family", family, found.family_names))
    if families:
        numbers = [found.family_names.index(family) for family in families]
        found, lengths = found.take(np.isin(found.family, numbers)), None
    if not len(found):
        raise RtbenchError(f"{corpus} has no cases: nothing to be right about")
    return found, lengths


def build(bench: Bench) -> None:
    """Time nothing: make the corpus, ask every kernel, and keep what was scored."""
    from rtbench.workloads import hard_cases

    config = bench.config
    named = [name for name in config.kernels if name != EVERY]
    chosen = subjects()[0] if EVERY in config.kernels else []
    chosen += [one for one in (subjects(named)[0] if named else []) if one not in chosen]
    given, lengths = cases(None, (), config.seed, bench.say)
    bench.facts["families"] = {each.name: each.difficulty for each in hard_cases.FAMILIES}
    bench.facts["families"] |= {schema.LENGTHS: "log10 of |dir|"}
    found = [bench.tables.setdefault(name, []) for name in schema.STABILITY_TABLES]
    work = [(subject, precision) for subject in chosen for precision in config.precisions]
    for place, (subject, precision) in enumerate(work):
        bench.say(f"checking {subject.name} in {precision}")
        bench.part(place / len(work))
        row, families, points = tables(subject.check(precision, given, lengths))
        for rows, new in zip(found, ([row], families, points), strict=True):
            rows += new
