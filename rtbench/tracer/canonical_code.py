"""The intermediate code of LLVM without what is arbitrary in it: names, numbers, places of blocks.

Two codes with the same canonical form are the same but for that: renaming and reordering lose
nothing. (Two codes that are the same might still have different forms, where names are all that
tells two like things apart.)
"""

from __future__ import annotations

import difflib
import re

_NAME = re.compile(r'[@%](?:"(?:[^"\\]|\\.)*"|[-\w.$]+)|#\d+|![\w.]+|\$(?:"[^"]*"|[-\w.$]+)')
_LABEL = re.compile(r'^("(?:[^"\\]|\\.)*"|[-\w.$]+):')
_NEXT = re.compile(r'label (%(?:"(?:[^"\\]|\\.)*"|[-\w.$]+))')
_INCOMING = re.compile(r'\[ ([^\[\]]*), (%(?:"(?:[^"\\]|\\.)*"|[-\w.$]+)) \]')
_MODULE = re.compile(r'\[\d+ x i8\] c"missing Environment: [^"]*"')  # it names the module
# What names the module or numbers what is said of the code, and is no code.
_ASIDE = ("source_filename", "; ", "!", "target ", "attributes #")
_ENTRY = "%.first"


def canonical(text: str) -> str:
    """Return intermediate code with names, numbers and blocks in the order of their appearance.

    Two functions that differ only in how things are called, or in the order in which blocks that
    jump to each other, and the phis of a block, are written down, have the same canonical code.
    What stands behind semicolons, and facts about the code (metadata, attributes), is left out.
    """
    shared: dict[str, str] = {}
    lines: list[str] = []
    body: list[str] | None = None
    for line in text.splitlines():
        if line.startswith(_ASIDE) or not line.strip():
            continue
        line = _MODULE.sub("this module", _uncommented(line)).rstrip()
        if body is not None:
            body.append(line)
            if line == "}":
                lines += _phis_in_order(_renamed_function(_in_order(body), shared))
                body = None
        elif line.startswith("define "):
            body = [line]
        else:
            lines += _renamed([line], shared, shared)
    return "\n".join(lines) + "\n"


def _in_order(function: list[str]) -> list[str]:
    """Return a function with its blocks in the order in which a search along jumps meets them."""
    head, *rest = function[:-1]
    blocks: dict[str, list[str]] = {_ENTRY: []}
    current = blocks[_ENTRY]
    for line in rest:
        label = _LABEL.match(line)
        if label and (current or len(blocks) > 1):
            current = blocks[f"%{label[1]}"] = []
        elif label:  # the first block may have a name or none
            current = blocks[f"%{label[1]}"] = blocks.pop(_ENTRY)
        else:
            current.append(line)
    entry = next(iter(blocks))
    places: dict[str, int] = {}
    waiting = [entry]
    while waiting:
        name = waiting.pop()
        if name not in places:
            places[name] = len(places)
            waiting += reversed(_NEXT.findall("\n".join(blocks[name])))
    lines = [head]
    for name in places:
        lines.append(f"{name}:")
        lines += [_sorted_incoming(line, places) for line in blocks[name]]
    return [*lines, "}"]


def _sorted_incoming(line: str, places: dict[str, int]) -> str:
    """Return a phi with what it takes from each block in the order of the blocks."""
    if " = phi " not in line:
        return line
    # A block without a place is the first one, which need not have a name.
    pairs = sorted(_INCOMING.findall(line), key=lambda pair: places.get(pair[1], 0))
    start = line[: line.index("[ ")]
    return start + ", ".join(f"[ {value}, {block} ]" for value, block in pairs)


def _is_phi(line: str) -> bool:
    return " = phi " in line


def _renamed_function(lines: list[str], shared: dict[str, str]) -> list[str]:
    """Return a function with names in the order in which all but phis mention them.

    The order of a block's phis means nothing, and depends on the hashes of variables' names. What
    only phis mention gets its name from those that are named already.
    """
    local: dict[str, str] = {}
    _renamed([line for line in lines if not _is_phi(line)], shared, local)
    waiting = [(line.split()[0], line) for line in lines if _is_phi(line)]
    while waiting:
        known = [phi for phi in waiting if phi[0] in local] or waiting[:1]
        first = min(known, key=lambda phi: int(local.get(phi[0], "%0")[1:]))
        waiting.remove(first)
        _renamed([first[1]], shared, local)
    return _renamed(lines, shared, local)


def _phis_in_order(lines: list[str]) -> list[str]:
    """Return a function with the phis of each block in the order of their names."""
    sorted_lines: list[str] = []
    phis: list[str] = []
    for line in lines:
        if _is_phi(line):
            phis.append(line)
            continue
        sorted_lines += sorted(phis, key=lambda phi: int(phi.split()[0][1:]))
        phis = []
        sorted_lines.append(line)
    return sorted_lines


def _renamed(lines: list[str], shared: dict[str, str], local: dict[str, str]) -> list[str]:
    def renamed(found: re.Match) -> str:
        word = found.group()
        if word[0] in "#!":
            return word[0]
        names = local if word[0] == "%" else shared
        return names.setdefault(word, f"{word[0]}{len(names)}")

    return [_NAME.sub(renamed, line) for line in lines]


def _uncommented(line: str) -> str:
    """Return a line without what stands behind a semicolon outside quotes."""
    quoted = False
    for place, sign in enumerate(line):
        if sign == '"':
            quoted = not quoted
        elif sign == ";" and not quoted:
            return line[:place]
    return line


def first_difference(one: str, other: str) -> str:
    """Return the first lines in which two codes differ; empty if they do not."""
    pairs = difflib.unified_diff(one.splitlines(), other.splitlines(), lineterm="", n=2)
    return "\n".join(line for _, line in zip(range(24), pairs, strict=False))
