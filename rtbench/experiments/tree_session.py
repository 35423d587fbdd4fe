"""The parent of the tree workers: asks, compiles on all cores, says how far it is."""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable

from rtbench.errors import CheckFailed, NotComparable, RtbenchError, WrongAnswers
from rtbench.measure.session import Worker

MODULE = "rtbench.experiments.tree_worker"
_ERRORS = {
    kind.exit_code: kind for kind in (RtbenchError, CheckFailed, NotComparable, WrongAnswers)
}
GLANCE = 0.2  # s between two looks at those who compile


class Asked:
    """A worker that is asked one thing at a time.

    Parameters
    ----------
    cpu : int or None
        To be pinned to.
    kernels : sequence of str
        Names, and FILE.py:NAME, that it must know.
    """

    def __init__(self, cpu: int | None, kernels: tuple[str, ...], module: str = MODULE) -> None:
        self._worker = Worker(module=module)
        self.ask("start", cpu=cpu, kernels=list(kernels))

    def ask(self, do: str, **told: object) -> dict:
        """Return its answer.

        Raises
        ------
        RtbenchError
            What it raised, of the same exit code.
        WorkerDied
            If it has ended.
        """
        self._worker.tell({"do": do} | told)
        answer = self._worker.hear()
        if "error" in answer:
            raise _ERRORS.get(answer["code"], RtbenchError)(answer["error"])
        return answer

    def close(self) -> None:
        """End it."""
        self._worker.close()


def compile_all(
    wanted: list[dict],
    kernels: tuple[str, ...],
    say: Callable[[str], None],
    module: str = MODULE,
) -> None:
    """Compile what is wanted, in as many processes as there are cores, into the cache.

    Parameters
    ----------
    wanted : list of dict
        Messages to `rtbench.experiments.tree_worker.Place`, with their ``do``.
    kernels : sequence of str
    say : callable
        Is given how far it is, now and then; what it raises ends all of it.
    """
    jobs: queue.SimpleQueue = queue.SimpleQueue()
    for each in wanted:
        jobs.put(each)
    done: list[dict] = []
    problems: list[Exception] = []
    workers: list[Asked] = []

    def work() -> None:
        try:
            worker = Asked(None, kernels, module)
            workers.append(worker)
            while not problems:
                job = jobs.get_nowait()
                worker.ask(**job)
                done.append(job)
        except queue.Empty:
            pass
        except Exception as problem:  # told by who waits
            problems.append(problem)

    count = max(1, min(len(wanted), len(os.sched_getaffinity(0))))
    threads = [threading.Thread(target=work, daemon=True) for _ in range(count)]
    began = time.monotonic()
    try:
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            gone = time.monotonic() - began
            left = f", about {gone * (len(wanted) / len(done) - 1):.0f} s left" if done else ""
            say(f"compiling {len(done)} of {len(wanted)}{left}")
            for thread in threads:
                thread.join(GLANCE / count)
    except BaseException:
        problems.append(KeyboardInterrupt())
        raise
    finally:
        for worker in workers:
            worker.close()
    if problems:
        raise problems[0]


class Share:
    """How much is done, by expected seconds, which are corrected by those that were measured.

    Parameters
    ----------
    expected : dict
        Seconds of each part, by any key, of one pass.
    passes : int
        How often all of them are done.
    tell : callable
        Is given the fraction.
    """

    def __init__(self, expected: dict, passes: int, tell: Callable[[float], None]) -> None:
        self._expected = dict(expected)
        self._left = dict.fromkeys(expected, passes)
        self._spent = 0.0
        self._tell = tell
        self._since = time.monotonic()

    @property
    def seconds(self) -> float:
        """What is left, as expected now."""
        return sum(n * self._expected[key] for key, n in self._left.items())

    def done(self, key: object) -> None:
        """Note that a part has been done, since the last one was."""
        now = time.monotonic()
        took, self._since = now - self._since, now
        self._expected[key] = took
        self._left[key] -= 1
        self._spent += took
        self._tell(self._spent / (self._spent + self.seconds))

    def still(self) -> None:
        """Tell the same again, so that a watcher may interrupt."""
        gone = self._spent + time.monotonic() - self._since
        whole = max(self._spent + self.seconds, gone)
        self._tell(min(0.999, gone / whole) if whole else 0.0)
