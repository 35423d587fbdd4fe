"""Which kernels there are: those of this folder, and those of a file that a user names.

Beside them each method of pieces can be asked for other outputs: ``NAME_hit``, ``NAME_point`` and
``NAME_normal`` are made when they are asked for, and not listed.
"""

from __future__ import annotations

import dataclasses
import difflib
import fnmatch
import functools
import importlib.util
import pkgutil
import re
from pathlib import Path

import rtbench.kernels
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import OUTPUTS, Kernel
from rtbench.kernels.pieces import gives_normal

EMPTY = "empty"  # the loop without a kernel has this name in every record


@functools.cache
def all_kernels() -> dict[str, Kernel]:
    """Return every kernel of the package by name, in the order of the files and within them."""
    found: dict[str, Kernel] = {}
    for module in pkgutil.iter_modules(rtbench.kernels.__path__):
        found.update(_declared(importlib.import_module(f"rtbench.kernels.{module.name}")))
    return found


def derived(kernel: Kernel) -> dict[str, Kernel]:
    """Return the forms of a kernel with other outputs, by name; none of a whole listing.

    ``NAME_hit`` returns the outcome alone, ``NAME_point`` the point O + t D, and ``NAME_normal``,
    where the method's pieces give one, a normal of the triangle, of any length.

    Parameters
    ----------
    kernel : Kernel
        A form that returns t alone; others have none.
    """
    if kernel.ending is None or kernel.outputs != OUTPUTS["t"]:
        return {}
    told = {"hit": "whether it hits alone"}
    if kernel.ending.takes_tmax:
        told["point"] = "with the point"
        if gives_normal(kernel.function):
            told["normal"] = "with the normal"
    return {
        f"{kernel.name}_{output}": dataclasses.replace(
            kernel,
            name=f"{kernel.name}_{output}",
            title=f"{kernel.title}, {what}",
            outputs=OUTPUTS[output],
        )
        for output, what in told.items()
    }


@functools.cache
def _all_derived() -> dict[str, Kernel]:
    return {name: form for each in all_kernels().values() for name, form in derived(each).items()}


def find(name: str) -> Kernel:
    """Return the kernel of that name, or of ``FILE.py:NAME``; see `derived` for other outputs.

    Raises
    ------
    RtbenchError
        With the nearest valid name, or with what is wrong about the file.
    """
    if ".py:" in name:
        path, _, inside = name.rpartition(":")
        return _from_file(Path(path), inside)
    if name in all_kernels():
        return all_kernels()[name]
    if name in _all_derived():
        return _all_derived()[name]
    near = difflib.get_close_matches(name.lower(), [*all_kernels(), *_all_derived()], 1, 0.5)
    if near and near[0] in _all_derived():  # their names would only lengthen the list
        raise RtbenchError(f"unknown kernel {name!r}; did you mean {near[0]!r}?")
    raise RtbenchError(unknown("kernel", name, all_kernels()))


def select(patterns: list[str] | tuple[str, ...]) -> list[Kernel]:
    """Return the kernels that names, globs and ``FILE.py:NAME`` select, each once, in order.

    Raises
    ------
    RtbenchError
        Where a name is unknown or a glob matches nothing.
    """
    chosen: dict[str, Kernel] = {}
    for pattern in patterns:
        if re.search(r"[*?\[]", pattern) and ".py:" not in pattern:
            names = fnmatch.filter(all_kernels(), pattern)
            if not names:
                raise RtbenchError(unknown("kernel pattern", pattern, all_kernels()))
            found = [all_kernels()[name] for name in names]
        else:
            found = [find(pattern)]
        for kernel in found:
            if chosen.setdefault(kernel.name, kernel) is not kernel:
                raise RtbenchError(f"two kernels are named {kernel.name!r}: rename one of them")
    return list(chosen.values())


@functools.cache
def _from_file(path: Path, name: str) -> Kernel:
    if not path.is_file():
        raise RtbenchError(f"kernel file {str(path)!r} is not there")
    spec = importlib.util.spec_from_file_location(f"rtbench_kernel_file_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as problem:
        raise RtbenchError(
            f"kernel file {str(path)!r} cannot be imported: {type(problem).__name__}: "
            + " ".join(str(problem).split())
        ) from problem
    declared = _declared(module)
    if not declared:
        raise RtbenchError(
            f"kernel file {str(path)!r} declares no kernel: "
            "put @kernel(...) of rtbench.kernels.contract above the function"
        )
    forms = declared | {
        form: made for each in declared.values() for form, made in derived(each).items()
    }
    if name not in forms:
        raise RtbenchError(unknown(f"kernel of {path.name}", name, declared))
    if name in all_kernels() or name == EMPTY:
        raise RtbenchError(f"kernel {name!r} of {path.name} has the name of a built-in one")
    return forms[name]


def _declared(module) -> dict[str, Kernel]:
    """Return what the functions defined in this very module declare."""
    return {
        kernel.name: kernel
        for value in list(vars(module).values())
        if getattr(value, "__module__", None) == module.__name__
        for kernel in getattr(value, "kernels", ())
    }
