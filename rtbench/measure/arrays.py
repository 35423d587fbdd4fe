"""Arrays that the parent writes once and every worker reads: a temporary folder of .npy files."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError

try:
    import fcntl
except ImportError:  # not a POSIX system: what a killed run left is not noticed there
    fcntl = None

PREFIX = "rtbench-data-"
LOCK = "lock"


class Arrays:
    """Arrays on disk for the workers, each under a name, gone with the session.

    A process killed by SIGKILL leaves its folder behind; the next session removes it. Its owner
    holds a lock while it lives, so that nobody's folder in use is taken for one left behind.
    """

    def __init__(self) -> None:
        _remove_left_behind()
        self._folder = tempfile.TemporaryDirectory(prefix=PREFIX)
        self._lock = os.open(Path(self._folder.name) / LOCK, os.O_CREAT | os.O_WRONLY, 0o600)
        if fcntl is not None:
            fcntl.flock(self._lock, fcntl.LOCK_EX)
        self.paths: dict[str, str] = {}

    def add(self, name: str, array: np.ndarray) -> str:
        """Keep an array under a name; return the name. A name already there is kept as it is.

        Raises
        ------
        RtbenchError
            If the temporary folder cannot hold it.
        """
        if name not in self.paths:
            path = Path(self._folder.name) / f"{len(self.paths)}.npy"
            try:
                np.save(path, array)
            except OSError as problem:  # numpy's own message of a full disk names no file
                raise RtbenchError(
                    f"cannot write {array.nbytes} bytes of pairs to {path.parent} "
                    f"({problem.strerror or problem}): set TMPDIR to a folder with more room"
                ) from None
            self.paths[name] = str(path)
        return name

    def close(self) -> None:
        """Remove them."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None
        self._folder.cleanup()


def _remove_left_behind() -> None:
    """Remove the folders of processes that were killed."""
    if fcntl is None:
        return
    for lock in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{LOCK}"):
        try:
            if time.time() - lock.stat().st_mtime < 60:  # its owner may be about to lock it
                continue
            file = os.open(lock, os.O_WRONLY)
        except OSError:  # another user's, or gone already
            continue
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(lock.parent, ignore_errors=True)
        except OSError:
            pass
        finally:
            os.close(file)
