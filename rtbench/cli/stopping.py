"""Ctrl-C and SIGTERM: both stop in the same way, and a stop is never lost.

Some imported code swallows a KeyboardInterrupt that happens to come while it runs. So the wish to
stop is remembered, and whoever reports progress asks for it again.
"""

from __future__ import annotations

import signal

_asked = False


def install() -> None:
    """Let SIGINT and SIGTERM raise KeyboardInterrupt."""
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)


def check() -> None:
    """Raise KeyboardInterrupt if a stop was asked for and nothing came of it."""
    if _asked:
        raise KeyboardInterrupt


def _stop(number: int, frame: object) -> None:
    global _asked
    _asked = True
    raise KeyboardInterrupt
