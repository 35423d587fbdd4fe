"""The folder of generated modules: where it is, who may use it, what is thrown away."""

from __future__ import annotations

import atexit
import functools
import importlib.metadata
import os
import re
import shutil
import stat
import sys
import tempfile
import time
from pathlib import Path

from rtbench.errors import RtbenchError

UNUSED_DAYS = 30
MADE_FOR = ("rtbench", "numba", "llvmlite", "numpy")


@functools.cache
def folder() -> Path:
    """Return the folder of this version's generated modules, made if need be.

    A folder inside ``$RTBENCH_CACHE_DIR``, else inside the user's cache folder; mode 0700, since
    code is imported from it. Where it cannot be written, a private temporary folder with one
    remark, gone when the process ends. Folders of other versions, and entries unused for 30 days,
    are removed.

    Raises
    ------
    RtbenchError
        If a folder belongs to another user.
    """
    root = Path(os.environ.get("RTBENCH_CACHE_DIR") or _user_cache() / "rtbench").absolute()
    place = root / _version()
    try:
        for each in (root, place):
            each.mkdir(parents=True, exist_ok=True, mode=0o700)
            _refuse_others(each)
        if hasattr(os, "getuid") and stat.S_IMODE(place.stat().st_mode) & 0o077:
            place.chmod(0o700)
        with tempfile.TemporaryFile(dir=place):
            pass
    except OSError as problem:
        place = Path(tempfile.mkdtemp(prefix="rtbench-"))
        atexit.register(shutil.rmtree, place, ignore_errors=True)
        print(
            f"rtbench: cache folder {str(root)!r} cannot be written ({problem.strerror}): "
            f"compiling into {str(place)!r}; set RTBENCH_CACHE_DIR to keep what is compiled",
            file=sys.stderr,
        )
        return place
    _throw_away(root, place)
    return place


def _user_cache() -> Path:
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home())
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _refuse_others(place: Path) -> None:
    if hasattr(os, "getuid") and place.stat().st_uid != os.getuid():
        raise RtbenchError(
            f"cache folder {str(place)!r} belongs to another user, and code is imported from it: "
            "set RTBENCH_CACHE_DIR to a folder of your own"
        )


def _version() -> str:
    versions = [f"{package}-{importlib.metadata.version(package)}" for package in MADE_FOR]
    return "_".join([*versions, sys.implementation.cache_tag])


def _throw_away(root: Path, place: Path) -> None:
    """Remove other versions' folders and files of this one that nobody used for 30 days."""
    # The folder may be one that holds other things too: only what is named as ours is removed.
    ours = re.compile("_".join(rf"{package}-[^_]+" for package in MADE_FOR) + "_.+")
    for other in root.iterdir():
        if other != place and ours.fullmatch(other.name) and other.is_dir():
            shutil.rmtree(other, ignore_errors=True)
    oldest = time.time() - UNUSED_DAYS * 86400
    for module in place.glob("*.py"):
        try:
            if module.stat().st_mtime < oldest:
                remove(module)
        except FileNotFoundError:  # another rtbench was quicker
            continue


def remove(module: Path) -> None:
    """Remove a generated module and everything compiled from it."""
    for file in [
        *module.parent.glob(f"{module.stem}.*"),
        *(module.parent / "__pycache__").glob(f"{module.stem}.*"),
    ]:
        file.unlink(missing_ok=True)


def write_whole(path: Path, text: str) -> None:
    """Write a file so that nobody ever sees half of it."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
