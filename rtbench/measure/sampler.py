"""The clock."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def stopwatch(call: Callable[[], T]) -> tuple[T, float]:
    """Return what a call returns, and the seconds it took."""
    begin = time.perf_counter_ns()
    result = call()
    return result, (time.perf_counter_ns() - begin) / 1e9


def timed(call: Callable[[], T], threads: int = 1) -> tuple[T, int, int]:
    """Return what a call returns, the wall and the processor nanoseconds it took.

    The processor's are this thread's alone, or with more threads those of the whole process.
    """
    clock = time.thread_time_ns if threads == 1 else time.process_time_ns
    cpu = clock()
    begin = time.perf_counter_ns()
    result = call()
    wall = time.perf_counter_ns() - begin
    return result, wall, clock() - cpu
