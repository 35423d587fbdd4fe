"""The words of a file in the Neutral File Format, each with its line."""

from __future__ import annotations

import math

from rtbench.scenes.model import SceneError

ENTITIES = ("v", "b", "l", "f", "c", "s", "p", "pp")
VIEW = {"from": 3, "at": 3, "up": 3, "angle": 1, "hither": 1, "resolution": 2}
"""What a view consists of, with how many numbers."""


def is_number(word: str | None) -> bool:
    """Tell whether a word is a number, finite or not."""
    try:
        float(word or "")
    except ValueError:
        return False
    return True


class LineError(SceneError):
    """A message about one line."""

    def __init__(self, key: str, told: str, line: int) -> None:
        super().__init__(key, told)
        self.line = line


class Words:
    """The words of a text, one after the other: where lines end means nothing in NFF."""

    def __init__(self, text: str) -> None:
        self.words: list[str] = []
        self.lines: list[int] = []
        for number, line in enumerate(text.splitlines(), 1):
            words = line.partition("#")[0].split()
            self.words += words
            self.lines += [number] * len(words)
        self.at = 0

    @property
    def next(self) -> str | None:
        """The next word, which stays; None at the end."""
        return self.words[self.at] if self.at < len(self.words) else None

    @property
    def line(self) -> int:
        """In which the last word stood that was taken."""
        return self.lines[self.at - 1]

    def take(self) -> str:
        """Take a word."""
        self.at += 1
        return self.words[self.at - 1]

    def numbers(self, count: int, what: str) -> list[float]:
        """Take as many numbers."""
        words = self.words[self.at : self.at + count]
        try:
            found = [float(word) for word in words]
        except ValueError:
            found = []
        if len(found) < count or not all(map(math.isfinite, found)):
            self._refuse(words, count, what)
        self.at += count
        return found

    def whole(self, what: str) -> int:
        """Take a number that is whole."""
        (found,) = self.numbers(1, what)
        if found != int(found):
            raise SceneError(what, f"{what} {found:g} is not allowed (allowed: whole numbers)")
        return int(found)

    def _refuse(self, words: list[str], count: int, what: str) -> None:
        for i, word in enumerate(words):
            line = self.lines[self.at + i]
            if word in ENTITIES or word in VIEW:
                words = words[:i]
                break
            if not is_number(word):
                raise LineError(what, f"{what}: {word!r} is not a number", line)
            if not math.isfinite(float(word)):
                raise LineError(what, f"{what}: {word!r} is not a finite number", line)
        numbers = "1 number" if count == 1 else f"{count} numbers"
        raise SceneError(what, f"{what} needs {numbers}, {len(words)} found")
