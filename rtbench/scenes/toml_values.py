"""Values of TOML tables as the scene model takes them, and where in the file each one stands."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from rtbench.errors import unknown
from rtbench.scenes.documentation import toml
from rtbench.scenes.format import FORMAT, REQUIRED, Key, keys_of
from rtbench.scenes.model import GREATEST, SceneError
from rtbench.scenes.toml_lines import Path as Way
from rtbench.scenes.toml_lines import line_of, lines

SHOWN = 40  # letters of a value in a message
ALLOWED = {
    "text": "a text in quotes",
    "texts": "an array of texts in quotes",
    "number": "a finite number",
    "whole": "a whole number",
    "switch": "true or false",
    "point": "three finite numbers",
    "angles": "three finite numbers",
    "color": "three finite numbers, or one for grey",
    "points": "an array of points, of three finite numbers each",
    "pairs": "an array of pairs of finite numbers",
    "table": "a table",
}


class LocatedError(SceneError):
    """A message that names its file and line already."""


class SceneFile:
    """A scene file: what tomllib makes of it, and the lines of its keys.

    Attributes
    ----------
    path : Path
    told : dict

    Raises
    ------
    SceneError
        In one line: a file that cannot be read, or is not TOML; its key is ``file``.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            text = path.read_text(encoding="utf-8")
            self.told = tomllib.loads(text)
        except OSError as problem:
            reason = problem.strerror or type(problem).__name__
            raise SceneError("file", f"scene {str(path)!r} cannot be read: {reason}") from None
        except UnicodeDecodeError as problem:
            raise SceneError("file", f"{path}: no text in UTF-8 ({problem.reason})") from None
        except tomllib.TOMLDecodeError as problem:
            line = re.search(r"\(at line (\d+), column \d+\)", str(problem))
            number = int(line[1]) if line else text.count("\n") + 1
            reason = str(problem).split(" (at ")[0]
            reason = " ".join(reason.split())
            raise LocatedError("file", f"{path}, line {number}: not TOML: {reason}") from None
        except RecursionError:
            raise SceneError("file", f"{path}: not TOML: brackets too deep") from None
        self.lines = lines(text)

    def error(self, way: Way, key: str, told: str) -> LocatedError:
        """Return the one line that names the file, the line of a key of a table, and the key."""
        line = line_of(self.lines, (*way, key))
        named = re.search(rf"(?<!\w){re.escape(key)}(?!\w)", told)
        return LocatedError(key, f"{self.path}, line {line}: {'' if named else f'{key}: '}{told}")

    @contextmanager
    def at(self, way: Way) -> Iterator[None]:
        """Let what is wrong inside be told with the file and the line."""
        try:
            yield
        except LocatedError:
            raise
        except SceneError as problem:
            raise self.error(way, problem.key, str(problem)) from None


def values_of(table: str, told: Any, titled: str, also: str = "") -> dict[str, Any]:
    """Check and convert what a table of a file holds.

    Parameters
    ----------
    table : str
        One of FORMAT.
    told : object
        What tomllib made of it.
    titled : str
        What it is, for people: ``sphere``.
    also : str
        A key that is wanted of it, though FORMAT has it not.

    Returns
    -------
    dict
        Of the keys that are given: numbers as float or int, points and colours as tuples, lists
        of points as (n, 3) float64 arrays, pairs as (n, 2).

    Raises
    ------
    SceneError
        In one line, with its key: unknown keys, required ones that are missing, wrong types.
    """
    if not isinstance(told, dict):
        raise SceneError(titled, f"{titled} {shown(told)} is not allowed (allowed: a table)")
    keys = keys_of(table)
    for name in told:
        if name not in keys:
            raise SceneError(name, unknown(f"{titled} key", name, keys))
    for key in keys.values():
        if key.default == REQUIRED and key.name not in told:
            example = f" (example: {toml(key.example)})" if key.example else ""
            raise SceneError(key.name, f"{key.name} is missing: {titled} needs it{example}")
    return {name: converted(keys[name], value) for name, value in told.items()}


def kind_of(told: Any, titled: str, kinds: tuple[str, ...]) -> str:
    """Return the kind that a table says it is, or raise SceneError."""
    if not isinstance(told, dict):
        raise SceneError(titled, f"{titled} {shown(told)} is not allowed (allowed: a table)")
    if "kind" not in told:
        listed = ", ".join(kinds)
        raise SceneError("kind", f"kind is missing: {titled} needs one (allowed: {listed})")
    return converted(keys_of(titled)["kind"], told["kind"], kinds)


def converted(key: Key, value: Any, allowed: tuple[str, ...] = ()) -> Any:
    """Return the value of a key as the model takes it, or raise SceneError."""
    found = _READ[key.holds](value)
    if found is None:
        raise SceneError(
            key.name, f"{key.name} {shown(value)} is not allowed (allowed: {ALLOWED[key.holds]})"
        )
    allowed = allowed or key.allowed
    if allowed and found not in allowed:
        raise SceneError(key.name, unknown(key.name, found, allowed))
    return found


def shown(value: Any) -> str:
    """Return a value as a message shows it, in one line."""
    if isinstance(value, dict):
        return "(a table)"
    told = toml(value) if isinstance(value, bool | str | list) else str(value)
    told = " ".join(told.split())
    return told if len(told) <= SHOWN else told[: SHOWN - 4] + " ..."


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    # Whole numbers of TOML may be larger than any float.
    if isinstance(value, int) and abs(value) > GREATEST:
        return None
    return float(value) if math.isfinite(value) else None


def _whole(value: Any) -> int | None:
    return value if isinstance(value, int) and _number(value) is not None else None


def _numbers(value: Any, count: int) -> tuple[float, ...] | None:
    if not isinstance(value, list) or len(value) != count:
        return None
    found = tuple(_number(each) for each in value)
    return None if None in found else found


def _rows(value: Any, count: int) -> np.ndarray | None:
    if not isinstance(value, list):
        return None
    found = [_numbers(each, count) for each in value]
    return None if None in found else np.array(found, dtype=np.float64).reshape(-1, count)


def _color(value: Any) -> tuple[float, ...] | None:
    grey = _number(value)
    return _numbers(value, 3) if grey is None else (grey, grey, grey)


def _text(value: Any) -> str | None:
    # No name of a file may hold a zero byte.
    return value if isinstance(value, str) and "\0" not in value else None


def _texts(value: Any) -> tuple[str, ...] | None:
    found = tuple(_text(each) for each in value) if isinstance(value, list) else (None,)
    return None if None in found else found


_READ = {
    "text": _text,
    "texts": _texts,
    "number": _number,
    "whole": _whole,
    "switch": lambda value: value if isinstance(value, bool) else None,
    "point": lambda value: _numbers(value, 3),
    "angles": lambda value: _numbers(value, 3),
    "color": _color,
    "points": lambda value: _rows(value, 3),
    "pairs": lambda value: _rows(value, 2),
    # Looked into where the tables themselves are read.
    "table": lambda value: value if isinstance(value, dict | list) else None,
}
assert set(_READ) == set(ALLOWED) >= {k.holds for t in FORMAT.values() for k in t.keys}
