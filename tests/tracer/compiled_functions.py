"""The plain functions of a module, compiled as the tracer compiles them, over arrays.

What kinds of numbers a function takes and returns is written in letters, such as ``"uur > r"``:
r a float, u a uint64, i an int64, b a truth value, p float32 numbers whatever the precision.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from types import ModuleType

import numpy as np

from rtbench.compiled import syntax
from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.compiled.sources import named

PRECISIONS = ("float32", "float64")
TAKEN = {"r": "reals[{}, k]", "u": "wholes[{}, k]", "i": "np.int64(wholes[{}, k])", "p": "pixels"}
TYPES = {"r": None, "u": np.uint64, "i": np.int64, "b": np.bool_}
NO_PIXELS = np.zeros(1, np.float32)


def entry_source(functions: tuple[Callable, ...], kinds: dict[str, str]) -> str:
    """Return the source of one entry that runs whichever function it is told to run."""
    lines = ["def many(which, reals, wholes, pixels, out, out_wholes):"]
    for number, function in enumerate(f for f in functions if f.__name__ in kinds):
        takes, gives = kinds[function.__name__].split(" > ")
        counts = {"reals": 0, "wholes": 0}
        arguments = []
        for letter in takes:
            rows = "reals" if letter == "r" else "wholes"
            arguments.append(TAKEN[letter].format(counts[rows]))
            counts[rows] += letter != "p"
        names = ", ".join(f"a{number}_{j}" for j in range(len(gives)))
        lines.append(f"    if which == {number}:")
        lines.append("        for k in range(out.shape[1]):")
        lines.append(f"            {names} = {function.__name__}({', '.join(arguments)})")
        for j, letter in enumerate(gives):
            if letter == "r":
                lines.append(f"            out[{j}, k] = a{number}_{j}")
            else:
                lines.append(f"            out_wholes[{j}, k] = np.uint64(a{number}_{j})")
    return "\n".join(lines) + "\n"


@functools.cache
def _entry(module: ModuleType, told: tuple[tuple[str, str], ...], precision: str) -> Callable:
    own = module.constants(precision) if hasattr(module, "constants") else {}
    whole = "uint64[:, ::1]"
    real = f"{precision}[:, ::1]"
    instance = instantiate(
        entry_source(module.CALLEES, dict(told)),
        signature=f"void(int64, {real}, {whole}, float32[::1], {real}, {whole})",
        callees=tuple(named(syntax.typed(syntax.parse(f)), f.__name__) for f in module.CALLEES),
        constants={"REAL": f"np.{precision}"} | own,
        title=f"{module.__name__} in {precision}, for its tests",
    )
    if precision == "float32":
        _must_stay_single(instance, module.CALLEES)
    return instance.call


def _must_stay_single(instance: Instance, functions: tuple[Callable, ...]) -> None:
    """Fail where anything, compiled just now in float32, is computed in float64."""
    if not instance.fresh:
        return
    for function in functions:
        compiled = instance.call.py_func.__globals__[function.__name__]
        for signature in compiled.nopython_signatures:
            assert "float64" not in str(signature), f"{function.__name__} has {signature}"
    assert not re.search("cvtss2sd|cvtsd2ss", instance.assembly), "floats change their type"


class Compiled:
    """The functions of a module as attributes; each takes arrays and returns one, or a tuple.

    Parameters
    ----------
    module : module
        Its ``CALLEES`` are compiled, its ``constants(precision)`` are put at the top.
    kinds : dict of str to str
        The letters of each function to be called.
    precision : str
    """

    def __init__(self, module: ModuleType, kinds: dict[str, str], precision: str) -> None:
        self.real = np.dtype(precision).type
        self._entry = _entry(module, tuple(kinds.items()), precision)
        order = [f.__name__ for f in module.CALLEES if f.__name__ in kinds]
        for number, name in enumerate(order):
            takes, gives = kinds[name].split(" > ")
            setattr(self, name, functools.partial(self._call, number, takes, gives))

    def _call(self, number: int, takes: str, gives: str, *given):
        assert len(given) == len(takes)
        pairs = list(zip(takes, given, strict=True))
        pixels = next((x for letter, x in pairs if letter == "p"), NO_PIXELS)
        scalars = [(letter, np.asarray(x)) for letter, x in pairs if letter != "p"]
        shape = np.broadcast_shapes(*(x.shape for _, x in scalars))
        n = int(np.prod(shape))

        def rows(letters: str, dtype: type) -> np.ndarray:
            found = [
                np.broadcast_to(x, shape).ravel().astype(TYPES[letter] or dtype).view(dtype)
                for letter, x in scalars
                if letter in letters
            ]
            return np.array(found, dtype).reshape(len(found), n)

        out = np.full((len(gives), n), np.nan, self.real)
        out_wholes = np.zeros((len(gives), n), np.uint64)
        reals, wholes = rows("r", self.real), rows("ui", np.uint64)
        self._entry(number, reals, wholes, pixels, out, out_wholes)
        results = tuple(
            (out[j] if letter == "r" else out_wholes[j].astype(TYPES[letter])).reshape(shape)
            for j, letter in enumerate(gives)
        )
        return results if len(results) > 1 else results[0]


def plain(function: Callable, *given) -> list:
    """Return what a plain function of the sources returns for each of some arrays' elements."""
    arrays = np.broadcast_arrays(*given)
    with np.errstate(over="ignore"):
        found = [function(*each) for each in zip(*(x.ravel() for x in arrays), strict=True)]
    if not isinstance(found[0], tuple):
        return np.array(found).reshape(arrays[0].shape)
    return tuple(np.array(x).reshape(arrays[0].shape) for x in zip(*found, strict=True))
