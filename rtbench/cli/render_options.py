"""What can be asked of a picture: values from text, and questions that contradict each other; and
the format of a scene in words."""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

import click

from rtbench.errors import RtbenchError, unknown

MOST_THREADS = 1024


def _print_format(context: click.Context, option: click.Parameter, asked: bool) -> None:
    if asked and not context.resilient_parsing:
        from rtbench.scenes.documentation import documented

        click.echo(documented(), nl=False)
        context.exit()


help_scene = click.option(
    "--help-scene",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_format,
    help="Show the format of scenes, every table and key, and exit.",
)


def size_of(text: str) -> tuple[int, int]:
    """Return width and height of ``WxH``, in pixels."""
    found = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text.strip().lower())
    size = tuple(map(int, found.groups())) if found else (0, 0)
    if not all(1 <= side <= 16384 for side in size):
        raise RtbenchError(
            f"size {text!r} is not allowed (allowed: WxH, 1 to 16384 pixels each, as 640x480)"
        )
    return size


def grid_of(text: str) -> tuple[int, int]:
    """Return the pixels of a cell, across and down, of ``X,Y`` or ``N``."""
    found = re.fullmatch(r"(\d{1,6})(?:,(\d{1,6}))?", text.strip())
    if not found:
        raise RtbenchError(
            f"subsampling {text!r} is not allowed (allowed: X,Y or N, the pixels of a cell, as 4,4)"
        )
    across, down = found.groups()
    return int(across), int(down or across)


def counts_of(text: str) -> tuple[int, ...]:
    """Return the numbers of a list between commas."""
    parts = [part.strip() for part in text.split(",")]
    if not all(re.fullmatch(r"\d{1,9}", part) for part in parts):
        raise RtbenchError(
            f"objects {text!r} is not allowed (allowed: numbers between commas, as 10,100,1000)"
        )
    return tuple(dict.fromkeys(map(int, parts)))


def threads_of(threads: int | None) -> int:
    """Return how many threads: as asked, else as many as this process has processors."""
    if threads is None:
        usable = getattr(os, "sched_getaffinity", None)
        return len(usable(0)) if usable else os.cpu_count() or 1
    if not 1 <= threads <= MOST_THREADS:
        raise RtbenchError(f"threads {threads} is not allowed (allowed: 1 to {MOST_THREADS})")
    return threads


def structure_of(
    structure: str | None = None, rule: str = "sah", builder: str | None = None
) -> str:
    """Return the structure: a k-d tree where a rule or a builder asks for one, else a BVH."""
    asks = f"--builder {builder}" if builder else f"--rule {rule}" if rule != "sah" else None
    if structure == "bvh" and asks:
        raise RtbenchError(f"a BVH has one builder, by the SAH: no {asks} (allowed: with kd)")
    return structure or ("kd" if asks else "bvh")


def must_agree(asked: dict) -> None:
    """Raise RtbenchError where options contradict each other.

    Parameters
    ----------
    asked : dict
        Option to value, as the command line gives them.
    """
    both = [name for name in asked["without"] if name in asked["force"]]
    if both:
        raise RtbenchError(f"{both[0]} is named by --without and by --force: choose one")
    if asked["orbit"]:
        _none_of(asked, ("out", "heat", "stats", "ledger"), "--orbit writes no picture: no")
    else:
        _none_of(asked, ("frames", "objects"), "only --orbit takes")
        if len(asked["kernel"]) > 1:
            raise RtbenchError("a picture is traced with one --kernel; --orbit takes several")
    if asked["subsampling"] is None:
        _none_of(asked, ("tolerance", "interpolation"), "without --subsampling there is no")


def _none_of(asked: dict, names: tuple[str, ...], why: str) -> None:
    for name in names:
        if asked[name] not in (None, False):
            raise RtbenchError(f"{why} --{name}")


def must_be_writable(files: list[tuple[str, Path, tuple[str, ...]]]) -> None:
    """Raise RtbenchError unless files of these names can be put in place.

    Found out before the work is done, by a file beside each that is gone at once.

    Parameters
    ----------
    files : list of (str, Path, tuple of str)
        The option, the file that it names, and the suffixes that it may have.
    """
    seen: dict[Path, str] = {}
    for option, path, suffixes in files:
        name = f"{option} {str(path)!r}"
        if path.suffix not in suffixes:
            raise RtbenchError(f"{name}: {unknown('suffix', path.suffix, suffixes)}")
        other = seen.setdefault(path.resolve(), option)
        if other != option:
            raise RtbenchError(f"{other} and {option} name the same file {str(path)!r}")
        if path.exists() and not path.is_file():
            raise RtbenchError(f"{name} is there already and is no file")
        try:
            with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name[:100]}."):
                pass
        except OSError as problem:
            reason = (problem.strerror or str(problem)).lower()
            raise RtbenchError(f"cannot write {name}: {reason}") from None
