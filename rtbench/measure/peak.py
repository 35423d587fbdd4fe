"""How much memory something takes at its peak, compiled code's arrays too."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from pathlib import Path

STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


class Peak:
    """The most memory that this process holds from now on, beyond what it holds now.

    Linux keeps the greatest size of the resident memory and lets us begin anew; elsewhere nothing
    is known. Of what was freed before and could not be given back nothing is counted again.
    """

    def __init__(self) -> None:
        self._before = None
        with suppress(OSError, AttributeError):  # of another C library
            ctypes.CDLL(None).malloc_trim(0)  # what was freed goes back to the system
        with suppress(OSError):
            CLEAR.write_text("5")
            self._before = _told("VmRSS")

    def bytes(self) -> int | None:
        """Return it in bytes, None where the system does not say."""
        now = None if self._before is None else _told("VmHWM")
        return None if now is None else max(0, now - self._before)


def _told(name: str) -> int | None:
    for line in STATUS.read_text().splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) * 1024
    return None
