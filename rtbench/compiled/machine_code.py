"""The machine code of a compiled loop, picked out of the assembly of its whole module."""

from __future__ import annotations

import hashlib
import re

# What numba puts around the function: wrappers for Python and C callers, and its runtime.
_AROUND = re.compile(r"_*ZN7cpython|_*ZN08NumbaEnv|cfunc\.|NRT_|\.const\.")
_LABEL = re.compile(r'"?([^\s":][^":]*)"?:')
_MANGLED = re.compile(r"_+ZN?\w[\w.$]*")


def instructions(assembly: str) -> list[str]:
    """Return the functions that are measured, and the constants they load.

    Parameters
    ----------
    assembly : str
        Of a module with one entry, as numba tells it.

    Returns
    -------
    list of str
        Lines: labels and instructions, no directives but the constants' values, no wrapper, no
        comment. Mangled names, which carry a digest of the module and a counter, are ``NAME``.
    """
    kept: list[str] = []
    inside = False
    for line in assembly.splitlines():
        text = line.split("#")[0].strip() if line.lstrip().startswith("#") else line.strip()
        label = _LABEL.fullmatch(text)
        if label and "CPI" in label[1]:
            inside = True
        elif label and "func_end" in label[1]:
            inside = False
        elif label and not label[1].startswith((".L", "L", "ltmp")):
            inside = re.match(r"_*Z", label[1]) is not None and not _AROUND.match(label[1])
        if inside and text and (label or _is_code(text)):
            kept.append(_MANGLED.sub("NAME", text))
    return kept


def _is_code(text: str) -> bool:
    data = (".long", ".quad", ".short", ".byte", ".zero", ".xword", ".word", ".ascii")
    return not text.startswith(".") or text.startswith(data)


def digest(assembly: str) -> str:
    """Return a digest of the measured functions, equal where they run the same instructions."""
    return hashlib.sha256("\n".join(instructions(assembly)).encode()).hexdigest()[:16]


def widens(assembly: str) -> bool:
    """Tell whether the measured functions turn a float32 into a float64 anywhere."""
    return any(re.search(r"cvtss2sd|fcvt\s+d\d+, s\d+", line) for line in instructions(assembly))
