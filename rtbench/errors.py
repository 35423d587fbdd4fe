"""What can go wrong, each with the exit code that the command line ends with."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

MANY, FEW = 40, 6  # names that a line can hold, and that are told where it cannot


class RtbenchError(Exception):
    """Bad input, told in one line; exit code 2."""

    exit_code = 2


class CheckFailed(RtbenchError):
    """A check did not hold, or ``--fail-above`` was exceeded; exit code 1."""

    exit_code = 1


class NotComparable(RtbenchError):
    """Records that cannot be read or compared; exit code 3."""

    exit_code = 3


class WrongAnswers(RtbenchError):
    """A kernel gave a wrong answer; exit code 4."""

    exit_code = 4


def unknown(what: str, value: str, allowed: Iterable[str]) -> str:
    """Return the one-line message for a name that is not among the allowed ones.

    Parameters
    ----------
    what : str
        The kind of thing, e.g. ``"kernel"``.
    value : str
        The name that was given.
    allowed : iterable of str
        The valid names.

    Returns
    -------
    str
        What, the value, the nearest valid name where one is near, and all that are allowed, or,
        of very many, the next nearest.
    """
    names = sorted(allowed)
    near = difflib.get_close_matches(value.lower(), names, n=FEW, cutoff=0.5)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    if len(names) > MANY:
        listed = ", ".join(near[1:] or names[:FEW])
        return f"unknown {what} {value!r}{hint} ({len(names)} are allowed, among them {listed})"
    return f"unknown {what} {value!r}{hint} (allowed: {', '.join(names)})"
