"""Progress on stderr: a bar with the time left, or plain lines where nobody watches."""

from __future__ import annotations

import os
import sys
import time

from rtbench.cli import stopping

WIDTH = 30
PAUSE_LIVE, PAUSE_LINES = 0.1, 10.0  # seconds between two tellings


class Progress:
    """Tells a person how a run goes.

    Parameters
    ----------
    quiet : bool
        Say nothing.
    """

    def __init__(self, quiet: bool = False) -> None:
        self._quiet = quiet
        self._live = sys.stderr.isatty()
        self._began = self._told = time.monotonic()
        self._open = False

    def say(self, text: str) -> None:
        """Say what begins now; on a terminal the next line takes its place."""
        stopping.check()
        if not self._quiet and self._live:
            self._line(f"{text} ...")

    def plan(self, text: str) -> None:
        """Say what is going to be measured, and count the time from here."""
        stopping.check()
        self._began = self._told = time.monotonic()
        if self._quiet:
            return
        self.end()
        print(text, file=sys.stderr, flush=True)
        if self._live:
            self._line(bar(0.0, 0.0))

    def progress(self, fraction: float) -> None:
        """Show how much is done and how long the rest will take."""
        stopping.check()
        now = time.monotonic()
        pause = PAUSE_LIVE if self._live else PAUSE_LINES
        if self._quiet or now - self._told < pause:
            return
        self._told = now
        text = bar(fraction, now - self._began)
        if self._live:
            self._line(text)
        else:
            print(text, file=sys.stderr, flush=True)

    def end(self) -> None:
        """Clear the line."""
        if self._open:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
            self._open = False

    def _line(self, text: str) -> None:
        # A line that wraps could not be cleared.
        text = text[: max(1, _columns() - 1)]
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)
        self._open = True


def bar(fraction: float, elapsed: float) -> str:
    """Return the bar: what is done, the time that it took, the time that the rest will take.

    >>> bar(0.5, 75)
    'measuring [###############...............]  50 %, 1:15 gone, 1:15 left'
    """
    done = int(WIDTH * fraction)
    text = f"measuring [{'#' * done}{'.' * (WIDTH - done)}] {100 * fraction:3.0f} %"
    if fraction <= 0:
        return text
    left = elapsed * (1 / fraction - 1)
    return f"{text}, {_clock(elapsed)} gone, {_clock(left)} left"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def _columns() -> int:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns or 80
    except OSError:
        return 80
