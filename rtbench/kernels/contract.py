"""The kernel contract: one plain function a method, from which every form is made.

A kernel reads fields of ``tri`` and ``ray`` as the published listings do
(``tri.v0[0]``, ``ray.dir[tri.i1]``), uses the names ZERO, ONE, EPSILON instead
of literals, and returns its outcome code (0 is a hit) followed by its outputs.
One that also takes ``tmax`` refuses by distance itself: it hits where 0 < t < tmax.
One that cannot always decide is a filter: it returns UNDECIDED, and its ``fallback`` decides.
From this source come float32, float64, mixed and exact arithmetic, operation
counts, stages, records and packets: see ``rtbench/compiled``.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field

# Stand-ins that keep a kernel runnable as plain Python. Each compiled form
# replaces them by the same numbers in its own precision, the exact form by rationals.
ZERO = 0.0
ONE = 1.0
EPSILON = 0.000001  # Blecha 2007, 4.5: "EPSILON = 0.000001", absolute, as printed
# Of the arithmetic: half the distance from 1 to the next number, the least normal and the least of
# all positive numbers, the greatest. Exactly: 0, 0, 0, infinity.
ROUNDOFF = 2.0**-53
TINY = 2.0**-1022
SMALLEST = 2.0**-1074
LARGEST = (2.0 - 2.0**-52) * 2.0**1023
NO_T = math.nan  # an output of a test that did not hit

HIT = 0
UNDECIDED = -1  # the filter cannot tell: its fallback is asked

ARGUMENTS = ("tri", "ray")
TMAX = "tmax"

STORED = {
    "none": "the three vertices alone",
    "normal": "the vertices and the triangle's normal or plane",
    "precomputed": "numbers made for the test, in place of the vertices",
}
# What a kernel can be asked for; hit is the outcome code alone.
OUTPUTS = {
    "hit": (),
    "t": ("t",),
    "uv": ("t", "u", "v"),
    "point": ("x", "y", "z"),
    "normal": ("nx", "ny", "nz"),
}

CLAIMS = {
    "S1": "wrong only where a perturbation of a few roundings changes the answer",
    "S2": "no ray passes between triangles that share an edge or a vertex",
    "S3": "NaN, infinity and a zero direction are misses",
    "S4": "the numbers of a hit are finite",
    "S5": "t, u and v as good as the condition of the problem",
    "S6": "the same answer for every order of the vertices",
    "R1": "the same near the ends of the floating-point range",
    "X1": "always the exact answer",
    "X2": "of triangles that share an edge or a vertex exactly one is hit",
}

DOMAINS = {
    "line": "the whole line: a hit may have t < 0",
    "ray": "the half line t > 0",
    "segment": "from the origin to the end point",
}


@dataclass(frozen=True)
class Kernel:
    """A ray/triangle test and what is said of it.

    Attributes
    ----------
    name : str
        The name on the command line, ``[a-z0-9_]+``.
    function : callable
        ``function(tri, ray) -> (outcome, *outputs)``, plain Python.
    title, method : str
        A line for people, and the method of which this is a variant.
    domain : str
        ``line``, ``ray`` or ``segment``.
    outcomes : tuple of str
        Labels of the outcome codes, in order of the codes; code 0 is the hit.
    outputs : tuple of str
        What follows the outcome code: ``("t",)`` or ``("t", "u", "v")``. The function may
        return more than these; then the rest, and what only the rest needs, is left out.
    source : str
        Author, year, section.
    prepare : callable or None
        ``prepare(tri)`` of a triangle with v0, v1, v2: plain Python like the kernels, which ends
        in ``return {"field": ...}``, the fields stored beside the vertices: a number, a tuple of
        numbers, or an axis (a whole number). See ``rtbench/compiled/preparation.py``.
    exact : bool
        Whether rational arithmetic decides the test (no roots, no arccos).
    stored : str
        What is known of a triangle beforehand, one of STORED.
    fallback : callable or None
        ``fallback(v0, v1, v2, orig, dir, tmax) -> (outcome, t, u, v)``, asked where the function
        returns UNDECIDED: plain Python over tuples of three, which may branch and loop.
    claims : tuple of str
        What it is held to, keys of CLAIMS, in float32 and in float64.
    ending : Ending or None
        How a method of pieces ends (`rtbench.kernels.endings`); None for a whole listing.
    """

    name: str
    function: Callable
    title: str
    method: str
    domain: str | None
    outcomes: tuple[str, ...]
    outputs: tuple[str, ...]
    source: str
    prepare: Callable | None = None
    exact: bool = True
    precisions: tuple[str, ...] = field(default=("float32", "float64", "mixed"))
    stored: str = "none"
    ending: object = None
    fallback: Callable | None = None
    claims: tuple[str, ...] = ()

    @property
    def takes_tmax(self) -> bool:
        """Whether it refuses by distance itself."""
        return self.ending.takes_tmax if self.ending else _takes_tmax(self.function)

    @property
    def divided_last(self) -> bool:
        """Whether t may be rounded after it was compared with tmax, so that a tie may pass."""
        divided_first = self.ending and self.ending.division == "first"
        return self.takes_tmax and not (divided_first and not self.fallback)


def _takes_tmax(function: Callable) -> bool:
    return list(inspect.signature(function).parameters) == [*ARGUMENTS, TMAX]


def kernel(
    *,
    title: str,
    method: str,
    domain: str,
    outcomes: tuple[str, ...],
    outputs: tuple[str, ...] = ("t",),
    source: str,
    prepare: Callable | None = None,
    exact: bool = True,
    stored: str | None = None,
    fallback: Callable | None = None,
    claims: tuple[str, ...] = (),
) -> Callable[[Callable], Callable]:
    """Declare the function below to be a kernel named as the function.

    A function that also returns u and v makes two kernels: ``NAME`` returns t alone (what
    only u and v need is left out of it) and ``NAME_uv`` returns all three.

    Parameters
    ----------
    title, method, domain, outcomes, outputs, source, prepare, exact, stored, fallback, claims
        As in :class:`Kernel`; what is prepared beside the vertices counts as ``normal`` unless
        said otherwise.

    Returns
    -------
    callable
        A decorator that returns the function unchanged, its ``kernels`` attribute set.

    Raises
    ------
    ValueError
        If a declaration is not one the rest of rtbench can honour.
    """
    if domain not in DOMAINS:
        raise ValueError(f"domain {domain!r}: allowed are {', '.join(DOMAINS)}")
    if outputs not in (("t",), ("t", "u", "v")):
        raise ValueError(f"outputs {outputs!r}: allowed are ('t',) and ('t', 'u', 'v')")
    if not 2 <= len(outcomes) <= 100:
        raise ValueError(f"outcomes {outcomes!r}: a hit and at least one way to miss")
    if stored not in (None, *STORED):
        raise ValueError(f"stored {stored!r}: allowed are {', '.join(STORED)}")
    if not set(claims) <= set(CLAIMS):
        raise ValueError(f"claims {claims!r}: allowed are {', '.join(CLAIMS)}")

    def declare(function: Callable) -> Callable:
        name = function.__name__
        if list(inspect.signature(function).parameters) not in ([*ARGUMENTS], [*ARGUMENTS, TMAX]):
            raise ValueError(f"kernel {name!r} must take (tri, ray) or (tri, ray, tmax)")
        if fallback and not _takes_tmax(function):
            raise ValueError(f"kernel {name!r} has a fallback: it must take (tri, ray, tmax)")
        if _takes_tmax(function) and domain != "ray":
            raise ValueError(f"kernel {name!r} takes tmax: its domain is ray, not {domain!r}")
        check_name(name)
        function.kernels = tuple(
            Kernel(
                name + suffix,
                function,
                title + what,
                method,
                domain,
                outcomes,
                returned,
                source,
                prepare,
                exact,
                stored=stored or ("normal" if prepare else "none"),
                fallback=fallback,
                claims=claims,
            )
            for suffix, what, returned in (
                ("", "", ("t",)),
                ("_uv", ", with u and v", ("t", "u", "v")),
            )[: len(outputs) // 2 + 1]
        )
        return function

    return declare


def check_name(name: str) -> None:
    """Raise ValueError for a name that cannot be a kernel's."""
    if not re.fullmatch(r"[a-z0-9_]+", name):
        raise ValueError(f"kernel name {name!r}: only a-z, 0-9 and _ are allowed")
