"""The TOML format of scenes in words: every table and key, for people."""

from __future__ import annotations

import textwrap

from rtbench.scenes.format import FORMAT, HOLDS, REQUIRED, Key

TEXT, LINE = 50, 100  # where the meaning of a key begins, and the longest line

EXAMPLE = """\
# A red ball on a checkered floor.
name = "ball"
background = [0.6, 0.7, 0.9]

[camera]
position = [0, 1.5, 6]
target = [0, 1, 0]
width = 400
height = 300

[materials.red]
diffuse = [0.8, 0.1, 0.1]
specular = 0.5
exponent = 50

[materials.floor]
diffuse = 0.7
texture = {kind = "checker", size = 1, other = 0.3}

[[lights]]
kind = "point"
position = [3, 6, 4]

[[objects]]
kind = "sphere"
material = "red"
center = [0, 1, 0]
radius = 1

[[objects]]
kind = "plane"
material = "floor"
point = [0, 0, 0]
normal = [0, 1, 0]
"""
"""A whole scene, small."""


def toml(value: object) -> str:
    """Return a value as TOML writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(toml(each) for each in value) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def documented() -> str:
    """Return every table and key: what it holds, its default or an example, its unit, its meaning.

    Returns
    -------
    str
        Lines of up to 100 letters.
    """
    told = ["A scene is a TOML file. What values hold:", ""]
    told += [f"  {name:8} {text}" for name, text in HOLDS.items()]
    for table in FORMAT.values():
        told += ["", *textwrap.wrap(f"{table.heading or '(top)'}   {table.text}", LINE)]
        told += [line for key in table.keys for line in _key(key)]
    told += ["", "A whole scene:", ""]
    told += ["  " + line for line in EXAMPLE.splitlines()]
    return "\n".join(line.rstrip() for line in told) + "\n"


def _key(key: Key) -> list[str]:
    if key.holds == "table":
        value = REQUIRED if key.default == REQUIRED else ""
    elif key.default == REQUIRED:
        value = REQUIRED if key.allowed else f"{REQUIRED}, e.g. {toml(key.example)}"
    else:
        value = "" if key.default is None else f"{toml(key.default)} {key.unit}".strip()
    allowed = " | ".join(toml(name) for name in key.allowed)
    text = "; ".join(part for part in (allowed, key.text) if part)
    front = f"  {key.name:18}{key.holds:8}{value}".ljust(TEXT - 1) + " "
    lines = textwrap.wrap(text, LINE - TEXT) or [""]
    if len(front) > TEXT:
        return [front, *(" " * TEXT + line for line in lines)]
    return [front + lines[0], *(" " * TEXT + line for line in lines[1:])]
