"""Parts of generated modules as text: functions, records, and the numbers at the top."""

from __future__ import annotations

import ast
import hashlib
import re
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType, ModuleType

import numpy as np

from rtbench.compiled import syntax
from rtbench.errors import RtbenchError
from rtbench.kernels import endings


def named(function: ast.FunctionDef, name: str) -> str:
    """Return the source of a function under another name."""
    return re.sub(r"^def \w+", f"def {name}", ast.unparse(function) + "\n", count=1)


def dtype_source(dtype: np.dtype) -> str:
    """Return the source of a record as numba takes it."""
    fields = {
        "names": list(dtype.names),
        "formats": [(dtype[name].base.str, dtype[name].shape) for name in dtype.names],
        "offsets": [dtype.fields[name][1] for name in dtype.names],
        "itemsize": dtype.itemsize,
    }
    return f"from_dtype(np.dtype({fields!r}, align=True))"


# Numbers of which each arithmetic has its own.
OF_ARITHMETIC = {
    "ROUNDOFF": "REAL(np.finfo(REAL).eps / 2)",
    "TINY": "np.finfo(REAL).smallest_normal",
    "SMALLEST": "np.finfo(REAL).smallest_subnormal",
    "LARGEST": "np.finfo(REAL).max",
}


def constant_source(value: float) -> str:
    """Return the source of a number: what is no whole number, in REAL."""
    if isinstance(value, float):
        return f"REAL({value!r})" if np.isfinite(value) else f"REAL('{value!r}')"
    return repr(value)


# Functions of which compiled code has a form of its own.
_IMPORTED = {endings.flipped: "rtbench.compiled.sign_bits"}


def imports(found: dict[str, object]) -> tuple[str, dict[str, str]]:
    """Return the line that imports what compiled code has in a form of its own, and its digest.

    Parameters
    ----------
    found : dict
        As `rtbench.compiled.syntax.outside_names` finds it.

    Returns
    -------
    str
        Empty if nothing is imported.
    dict of str to str
        A constant for the module's top that changes with what is imported.
    """
    names = {name: _IMPORTED[v] for name, v in found.items() if _is_imported(v)}
    if not names:
        return "", {}
    ((module, name),) = {(module, name) for name, module in names.items()}
    text = Path(find_spec(module).origin).read_bytes()
    return f"from {module} import {name}", {"IMPORTED": repr(hashlib.sha256(text).hexdigest()[:16])}


def _is_imported(value: object) -> bool:
    return isinstance(value, FunctionType) and value in _IMPORTED


def outside(
    what: str, found: dict[str, object], taken: set[str]
) -> tuple[dict[str, str], dict[str, ast.FunctionDef]]:
    """Split what a function reads from its module into constants and functions.

    Parameters
    ----------
    what : str
        The function, for an error.
    found : dict
        As `rtbench.compiled.syntax.outside_names` finds it.
    taken : set of str
        Names that the generated module needs for itself.

    Returns
    -------
    constants : dict of str to str
        Names and the source text of their values.
    functions : dict of str to ast.FunctionDef
        Names and syntax, callees first; without what `imports` brings.

    Raises
    ------
    RtbenchError
        For a name that is taken.
    """
    constants, functions = {}, {}
    for name, value in found.items():
        if name in taken and not isinstance(value, ModuleType):
            raise RtbenchError(
                f"{what} reads {name!r}, which the generated module needs for itself: rename it"
            )
        if _is_imported(value):
            continue
        if isinstance(value, FunctionType):
            functions[name] = syntax.parse(value)
        elif isinstance(value, ModuleType):
            constants[name] = value.__name__.replace("numpy", "np")
        else:
            constants[name] = OF_ARITHMETIC.get(name) or constant_source(value)
    return constants, functions
