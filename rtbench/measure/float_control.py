"""How this thread's floating-point unit is set: subnormal numbers and rounding.

What the kernels claim holds where subnormal numbers are kept and results are rounded to nearest.
Both are settings of each thread that any library may change, as one linked with -ffast-math does
when it is loaded (crtfastmath.o); a new thread has those of the thread that starts it. So they are
found out by arithmetic, where it is done: in numpy, and in compiled code.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from rtbench.measure import machine
from rtbench.measure.noise import Complaint

NEAREST = "to nearest"
REALS = {np.float32: np.uint32, np.float64: np.uint64}
# What is lost beside 1, in the directions that tell the rounding modes apart.
_TERMS = ((1.0, 2.0**-70), (-1.0, -(2.0**-70)), (1.0, -(2.0**-70)))
_ROUNDING = {
    (False, False, False): NEAREST,
    (True, False, False): "upward",
    (False, True, True): "downward",
    (False, False, True): "toward zero",
}


def state() -> dict:
    """Return how this thread computes, ready for JSON.

    Returns
    -------
    dict
        ``ftz``: whether subnormal results become zero; ``daz``: whether subnormal inputs count as
        zero; ``rounding``: ``to nearest``, ``upward``, ``downward``, ``toward zero`` or
        ``unknown``.
    """
    _, sums = _asked(np.float64, np.multiply, np.add)
    return machine.float_state() | {"rounding": _rounding(sums)}


def compiled_state() -> dict:
    """Return the same of compiled code in this thread; what flushes in either precision flushes."""
    product, total = _compiled()
    told = []
    for real in REALS:
        products, sums = _asked(real, product[real], total[real])
        # As bits: a comparison would itself take a subnormal for zero.
        ftz, daz = (int(value.view(np.uint8).any()) == 0 for value in products)
        told.append({"ftz": ftz, "daz": daz, "rounding": _rounding(sums)})
    modes = {each["rounding"] for each in told}
    return {
        "ftz": any(each["ftz"] for each in told),
        "daz": any(each["daz"] for each in told),
        "rounding": modes.pop() if len(modes) == 1 else "unknown",
    }


def complaints(*states: dict) -> list[Complaint]:
    """Return what makes the kernels' claims void, of the states of `state` and `compiled_state`."""
    found = []
    why = "what kernels claim of their accuracy does not hold, exact ones included"
    flushed = [
        words
        for key, words in (("ftz", "results (FTZ)"), ("daz", "inputs (DAZ)"))
        if any(told.get(key) for told in states)
    ]
    if flushed:
        found.append(
            Complaint(
                f"subnormal {' and '.join(flushed)} count as zero in this process",
                why,
                "find the library that sets it (one linked with -ffast-math does when it is "
                "loaded) and start without it",
            )
        )
    modes = {told.get("rounding", NEAREST) for told in states} - {NEAREST}
    if modes:
        found.append(
            Complaint(
                f"results are not rounded to nearest but {', '.join(sorted(modes))}",
                why,
                "find what calls fesetround and start without it",
            )
        )
    return found


def _asked(real: type, multiply: Callable, add: Callable) -> tuple[list, list]:
    """Return half the smallest normal number and a subnormal made normal, and the sums of _TERMS.

    Returns
    -------
    products, sums : lists of (1,) arrays
    """
    # The subnormal as its bits: converting it would itself be arithmetic.
    smallest = np.ones(1, REALS[real]).view(real)
    normal, half, large = (
        np.array([x], real) for x in (np.finfo(real).smallest_normal, 0.5, 2.0**100)
    )
    terms = [np.array(pair, real).reshape(2, 1) for pair in _TERMS]
    asked = [(multiply, normal, half), (multiply, smallest, large), *((add, *t) for t in terms)]
    found = []
    for function, a, b in asked:
        found.append(np.zeros(1, real))
        function(a, b, found[-1])
    return found[:2], found[2:]


def _rounding(sums: list[np.ndarray]) -> str:
    up, down, inward = (
        bool(total[0] > 1) if start > 0 and change > 0 else bool(abs(total[0]) != 1)
        for total, (start, change) in zip(sums, _TERMS, strict=True)
    )
    return _ROUNDING.get((up, down, inward), "unknown")


def multiply(a, b, out):
    for i in range(a.shape[0]):
        out[i] = a[i] * b[i]


def add(a, b, out):
    for i in range(a.shape[0]):
        out[i] = a[i] + b[i]


@functools.cache
def _compiled() -> tuple[dict, dict]:
    from rtbench.compiled.instantiate import instantiate  # here: numba takes half a second

    made = []
    for function in (multiply, add):
        made.append({})
        for real in REALS:
            row = f"{real.__name__}[::1]"
            made[-1][real] = instantiate(
                function,
                signature=f"void({row}, {row}, {row})",
                title=f"How compiled code computes: {function.__name__}, {real.__name__}",
            ).call
    return tuple(made)
