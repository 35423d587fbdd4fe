"""Threads that fetch tiles from one queue, more at a time the quicker they are done."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

STEP = 0.02  # seconds that a call is to take: it costs some 0.0001 itself
PAUSE = 0.05  # seconds between two looks at how far the threads are


class _Queue:
    """Numbers from 0 to ``count``, handed out in runs."""

    def __init__(self, count: int, threads: int) -> None:
        self.count, self.threads = count, threads
        self.next = self.done = 0
        self.stopped = False
        self.lock = threading.Lock()

    def take(self, most: int) -> tuple[int, int]:
        """Return the next run: fewer at the end, so that no thread waits for another."""
        with self.lock:
            left = 0 if self.stopped else self.count - self.next
            run = min(most, -(-left // (2 * self.threads)) if self.threads > 1 else left)
            self.next += run
            return self.next - run, self.next


def in_turns(
    count: int,
    threads: int,
    work: Callable[[int, int], None],
    progress: Callable[[float], None] | None = None,
) -> None:
    """Do ``work(begin, end)`` for runs of the numbers from 0 to ``count``, each number once.

    Parameters
    ----------
    count : int
    threads : int
        With one, all is done in the calling thread.
    work : callable
        Releases the interpreter's lock while it works.
    progress : callable, optional
        Called in the calling thread with the fraction done. What it raises stops the work.
    """
    queue = _Queue(count, threads)
    tell = progress or (lambda fraction: None)

    def fetch() -> None:
        most = 1
        while True:
            begin, end = queue.take(most)
            if begin == end:
                return
            started = time.perf_counter()
            work(begin, end)
            took = time.perf_counter() - started
            most = max(1, min(2 * most, int((end - begin) * STEP / max(took, 1e-9))))
            with queue.lock:
                queue.done += end - begin
            if threads == 1:
                tell(queue.done / count)

    if threads == 1:
        fetch()
        return
    with ThreadPoolExecutor(threads) as pool:
        waited_for = {pool.submit(fetch) for _ in range(threads)}
        try:
            while waited_for:
                ended, waited_for = wait(waited_for, timeout=PAUSE)
                for each in ended:
                    each.result()
                tell(queue.done / count)
        except BaseException:
            queue.stopped = True
            raise
