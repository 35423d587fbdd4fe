"""A user's own test of rays against triangles, as it is: any function of three arrays.

``function(triangles (N, 3, 3), origins (N, 3), directions (N, 3))`` returns hit (N,), or
(hit, t), or (hit, t, u, v); it may be compiled by numba or be plain numpy.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

from rtbench.accuracy.scoring import Answered, clipped
from rtbench.compiled.layout import DATA_TYPE
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels import registry
from rtbench.kernels.contract import Kernel

RETURNS = "hit, (hit, t) or (hit, t, u, v), each of shape (N,)"
PRECISIONS = ("float32", "float64")


def find(name: str) -> Kernel | Callable:
    """Return what a name stands for: a kernel, or a user's function.

    Parameters
    ----------
    name : str
        A kernel's name, ``FILE.py:NAME`` (a declared kernel or any function) or
        ``module:function``.

    Raises
    ------
    RtbenchError
        In one line, with what is wrong about the module or the function.
    """
    where, _, inside = name.rpartition(":")
    if not where:
        return registry.find(name)
    module = _file(Path(where)) if where.endswith(".py") else _module(where)
    own = {
        key: value
        for key, value in vars(module).items()
        if callable(value) and not isinstance(value, type) and not key.startswith("_")
    }
    kernels = [kernel.name for value in own.values() for kernel in getattr(value, "kernels", ())]
    if where.endswith(".py") and (inside in kernels or (kernels and inside not in own)):
        return registry.find(name)
    if inside in vars(module) and inside not in own:
        kind = type(vars(module)[inside]).__name__
        raise RtbenchError(f"{name!r} is no function: it is of type {kind}")
    if inside not in own:
        raise RtbenchError(unknown(f"function of {where}", inside, own))
    return own[inside]


def _file(path: Path) -> ModuleType:
    if not path.is_file():
        raise RtbenchError(f"file {str(path)!r} is not there")
    spec = importlib.util.spec_from_file_location(f"rtbench_function_file_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses, and what numba caches, look there
    return _imported(str(path), lambda: spec.loader.exec_module(module) or module)


def _module(name: str) -> ModuleType:
    if os.getcwd() not in sys.path:  # a command's script does not look where the user stands
        sys.path.insert(0, os.getcwd())
    return _imported(name, lambda: importlib.import_module(name))


def _imported(what: str, load: Callable[[], ModuleType]) -> ModuleType:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return load()
    except (Exception, SystemExit) as problem:
        raise RtbenchError(f"{what!r} cannot be imported: {_words(problem)}") from problem


def ask(
    function: Callable,
    name: str,
    precision: str,
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
) -> Answered:
    """Call a user's function once and return what it says, as of the ray 0 < t < infinity.

    Parameters
    ----------
    function : callable
    name : str
        What to call it in an error.
    precision : str
        float32 or float64: the dtype of the arrays that it gets, copies of its own.
    triangles, origins, directions : (N, 3, 3), (N, 3), (N, 3) float64 arrays

    Raises
    ------
    RtbenchError
        If it raises, or returns something else than hits, t, u, v of shape (N,).
    """
    if precision not in PRECISIONS:
        raise RtbenchError(
            f"{name} cannot be asked in {precision}: a function gets arrays of one dtype "
            f"(allowed: {', '.join(PRECISIONS)})"
        )
    data, n = DATA_TYPE[precision], len(origins)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            arrays = (np.array(a, dtype=data) for a in (triangles, origins, directions))
            returned = function(*arrays)
    except (Exception, SystemExit) as problem:
        raise RtbenchError(f"{name} fails in {precision}: {_words(problem)}") from problem
    parts = returned if isinstance(returned, tuple | list) else (returned,)
    if len(parts) not in (1, 2, 4) or isinstance(returned, list):
        got = f"{len(parts)} values" if isinstance(returned, tuple) else type(returned).__name__
        raise RtbenchError(f"{name} returns {got}: {RETURNS} is wanted")
    checked = [
        _checked(name, what, part, n)
        for what, part in zip(("hit", "t", "u", "v"), parts, strict=False)
    ]
    return clipped(checked[0].astype(bool), *checked[1:])


def _checked(name: str, what: str, part: object, n: int) -> np.ndarray:
    try:
        array = np.asarray(part)
    except (ValueError, TypeError):
        array = np.array(None)
    if array.shape != (n,):
        raise RtbenchError(f"{name} returns {what} of shape {array.shape}: ({n},) is wanted")
    if array.dtype.kind not in ("biu" if what == "hit" else "fiu"):
        wanted = "bool" if what == "hit" else "float"
        raise RtbenchError(f"{name} returns {what} of dtype {array.dtype}: {wanted} is wanted")
    return array


def _words(problem: BaseException) -> str:
    lines = str(problem).strip().splitlines()
    text = " ".join(" ".join(lines[:3]).split())
    return f"{type(problem).__name__}: {text[:200]}" if text else type(problem).__name__
