"""In which line of a TOML text each key stands: tomllib tells it of syntax errors alone."""

from __future__ import annotations

import bisect
import re
import tomllib

Path = tuple[str | int, ...]

_NAME = re.compile(r'"(?:\\.|[^"\\])*"|\'[^\']*\'|[A-Za-z0-9_-]+')
_BLANK = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
# Of three quotes, up to two more may stand before the closing ones.
_SCALAR = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?:"{0,2})|\'\'\'.*?\'\'\'(?:\'{0,2})'
    r'|"(?:\\.|[^"\\])*"|\'[^\']*\'|[^,\]}\n#]+',
    re.DOTALL,
)


def lines(text: str) -> dict[Path, int]:
    """Find the line of every key and of every table.

    Parameters
    ----------
    text : str
        TOML that tomllib has read: what is not valid has no defined answer.

    Returns
    -------
    dict
        From the way to a value, such as ``("objects", 2, "radius")``, to its line; the first is 1.
        Elements of arrays have theirs, tables that of their header or first key.
    """
    return _Scan(text).found


def line_of(found: dict[Path, int], path: Path) -> int:
    """Return the line of a value, or of the nearest table around it that has one."""
    while path not in found:
        path = path[:-1]
    return found[path]


class _Scan:
    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.breaks = [i for i, letter in enumerate(text) if letter == "\n"]
        self.found: dict[Path, int] = {(): 1}
        self.numbers: dict[Path, int] = {}  # tables so far, of an array of tables
        prefix: Path = ()
        self._skip()
        while self.at < len(text):
            if text[self.at] == "[":
                prefix = self._header()
            else:
                self._pair(prefix)
            self._skip()

    def _skip(self) -> None:
        self.at = _BLANK.match(self.text, self.at).end()

    def _note(self, path: Path) -> None:
        self.found.setdefault(path, bisect.bisect_left(self.breaks, self.at) + 1)

    def _names(self) -> list[str]:
        names = []
        while True:
            self._skip()
            told = _NAME.match(self.text, self.at)
            # tomllib knows what escapes in quotes mean.
            quoted = told[0][0] in "\"'"
            names.append(next(iter(tomllib.loads(f"{told[0]} = 0"))) if quoted else told[0])
            self.at = told.end()
            self._skip()
            if self.text[self.at] != ".":
                return names
            self.at += 1

    def _header(self) -> Path:
        start, brackets = self.at, 2 if self.text.startswith("[[", self.at) else 1
        self.at += brackets
        *outer, last = self._names()
        end, self.at = self.at + brackets, start
        path: Path = ()
        for name in outer:
            path = (*path, name)
            self._note(path)
            if path in self.numbers:  # a table inside the newest of an array
                path = (*path, self.numbers[path] - 1)
        path = (*path, last)
        self._note(path)
        if brackets == 2:
            number = self.numbers.get(path, 0)
            self.numbers[path] = number + 1
            path = (*path, number)
            self._note(path)
        self.at = end
        return path

    def _pair(self, path: Path) -> None:
        start = self.at
        names = self._names()
        equals, self.at = self.at, start
        for name in names:
            path = (*path, name)
            self._note(path)
        self.at = equals + 1
        self._value(path)

    def _value(self, path: Path) -> None:
        self._skip()
        opening = self.text[self.at]
        if opening not in "[{":
            self.at = _SCALAR.match(self.text, self.at).end()
            return
        self.at += 1
        number = 0
        self._skip()
        while self.text[self.at] not in "]}":
            if opening == "[":
                self._note((*path, number))
                self._value((*path, number))
            else:
                self._pair(path)
            number += 1
            self._skip()
            if self.text[self.at] == ",":
                self.at += 1
                self._skip()
        self.at += 1
