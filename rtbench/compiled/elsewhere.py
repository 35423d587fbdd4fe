"""Compiling and answering in another process: one for each target, since numba has but one.

It reads pickles ``(what, arguments, named)`` from its stdin, what being compile or call, and
answers each on its stdout by ``(True, answer)`` or ``(False, one line)``; it ends when its stdin
closes. Code for another target never enters the parent: it might not even run there.
"""

from __future__ import annotations

import atexit
import functools
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path

import numpy as np

from rtbench.compiled import cache, targets
from rtbench.compiled.instantiate import (
    Instance,
    instantiate,
    is_compiled,
    load,
    source_of,
    written,
)
from rtbench.errors import RtbenchError


def instantiate_for(
    target: str,
    entry: Callable | str,
    *,
    callees: tuple[Callable | str, ...] = (),
    **arguments: str | bool | Mapping[str, str],
) -> Instance:
    """Compile a function for a target, in the process that can, or load it from the cache.

    Parameters
    ----------
    target : str
        One of :data:`rtbench.compiled.targets.TARGETS`.
    entry, callees, **arguments
        As :func:`rtbench.compiled.instantiate.instantiate` takes them.

    Returns
    -------
    Instance
        Another target's ``call`` runs over there: arrays are sent, and what it wrote into them
        is written into the caller's. It is for answers, not for timing, which loads ``path``
        in a process of the same ``environment``.

    Raises
    ------
    RtbenchError
        For an unknown target, one that this processor cannot run, and what does not compile.
    """
    needed = targets.environment(target)
    if not needed:
        return instantiate(entry, callees=callees, **arguments)
    sources = [each if isinstance(each, str) else source_of(each) for each in (*callees, entry)]
    path, name, fresh = _process(needed).ask(
        "compile", sources[-1], callees=tuple(sources[:-1]), **arguments
    )
    call = functools.partial(_call, needed, path, name)
    return Instance(call, Path(path), name, fresh, needed)


def compile_ahead(
    wanted: Sequence[tuple[str, Mapping[str, object]]],
    processes: int,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Compile what is not compiled yet by several processes side by side: it is loaded later.

    Parameters
    ----------
    wanted : sequence of (str, dict)
        An entry's source and the further arguments of `instantiate`, all of them text.
    processes : int
        At most; with one, or where only one is to be compiled, nothing is done.
    progress : callable, optional
        Called in the calling thread with the fraction done.

    Raises
    ------
    RtbenchError
        For what does not compile.
    """
    missing = {}
    for entry, arguments in wanted:
        path, _ = written(entry, **arguments)
        if not is_compiled(path):
            missing[path] = entry, arguments
    count = min(processes, len(missing))
    if count < 2:
        return
    waiting, free = list(missing.values()), [Process(()) for _ in range(count)]

    def compile_one(entry: str, arguments: Mapping[str, object]) -> None:
        process = free.pop()
        process.ask("compile", entry, **arguments)
        free.append(process)

    everyone = list(free)
    try:
        with ThreadPoolExecutor(count) as pool:
            asked = [pool.submit(compile_one, *each) for each in waiting]
            try:
                for done, each in enumerate(as_completed(asked), 1):
                    each.result()
                    if progress is not None:
                        progress(done / len(asked))
            except BaseException:
                for each in asked:
                    each.cancel()
                for process in everyone:
                    process.close()
                raise
    finally:
        for process in everyone:
            process.close()


class Process:
    """A process that compiles and runs code with another environment."""

    def __init__(self, environment: tuple[tuple[str, str], ...]) -> None:
        place = cache.folder()
        # A temporary one, where the user's cannot be written, is to be its too: it lives longer.
        root = place.parent if place.name == cache._version() else place
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "rtbench.compiled.elsewhere"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | dict(environment) | {"RTBENCH_CACHE_DIR": str(root)},
        )

    def ask(self, what: str, *arguments: object, **named: object) -> object:
        """Return what it answers; raise RtbenchError for what it could not do."""
        try:
            pickle.dump((what, arguments, named), self._process.stdin, protocol=5)
            self._process.stdin.flush()
            done, answer = pickle.load(self._process.stdout)
        except (BrokenPipeError, EOFError):
            code = self._process.wait()
            how = f"signal {-code}" if code < 0 else f"exit code {code}"
            raise RtbenchError(f"a compiling process ended by {how}") from None
        if not done:
            raise RtbenchError(answer)
        return answer

    def close(self) -> None:
        """End it."""
        with suppress(OSError):
            self._process.stdin.close()
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()


_running: dict[tuple[tuple[str, str], ...], Process] = {}


def close() -> None:
    """End all processes: none need live while others measure. A later call starts them again."""
    while _running:
        _running.popitem()[1].close()


atexit.register(close)


def _process(environment: tuple[tuple[str, str], ...]) -> Process:
    if environment not in _running:
        _running[environment] = Process(environment)
    return _running[environment]


def _call(
    environment: tuple[tuple[str, str], ...], path: str, entry: str, *arguments: object
) -> object:
    result, written = _process(environment).ask("call", path, entry, *arguments)
    for place, values in written.items():
        arguments[place][...] = values
    return result


def _compiled(entry: str, **arguments: object) -> tuple[str, str, bool]:
    made = instantiate(entry, **arguments)
    return str(made.path), made.entry, made.fresh


def _called(path: str, entry: str, *arguments: object) -> tuple[object, dict[int, np.ndarray]]:
    """Return what an entry returns, and those of its array arguments that it changed."""
    before = [each.tobytes() if isinstance(each, np.ndarray) else None for each in arguments]
    result = load(Path(path), entry).call(*arguments)
    written = {
        place: each
        for place, each in enumerate(arguments)
        if before[place] is not None and each.tobytes() != before[place]
    }
    return result, written


def main() -> None:
    """Serve the parent until it closes our stdin."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    answers = sys.stdout.buffer
    sys.stdout = sys.stderr
    does = {"compile": _compiled, "call": _called}
    while True:
        try:
            what, arguments, named = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            told = True, does[what](*arguments, **named)
        except Exception as problem:  # the parent tells it: here nobody reads
            lines = [line for line in str(problem).splitlines() if line.strip()]
            said = [line for line in lines if not line.startswith("Failed in")] or lines
            told = False, said[0] if said else type(problem).__name__
        pickle.dump(told, answers, protocol=5)
        answers.flush()


if __name__ == "__main__":
    with suppress(BrokenPipeError):  # the parent is gone
        main()
