"""What stands in a piece of syntax: all of it, or its names; times faster than `ast.walk`."""

from __future__ import annotations

import ast
import functools


def nodes(node: ast.AST) -> list[ast.AST]:
    """Return a piece of syntax and all in it but operators and contexts."""
    found = [node]
    for each in found:  # grows as it goes
        for part in _parts(each.__class__):
            inside = getattr(each, part, None)
            if inside.__class__ is list:
                found += inside
            elif inside is not None:
                found.append(inside)
    return found


@functools.cache
def _parts(kind: type) -> tuple[str, ...]:
    """Return the fields of a kind of syntax in which syntax may stand."""
    leaves = {"ctx", "op", "ops", "id", "attr", "arg", "kind", "type_comment", "name", "names"}
    return () if kind in _LEAVES else tuple(part for part in kind._fields if part not in leaves)


_LEAVES = (ast.Name, ast.Constant, str, int)


def names(node: ast.AST) -> tuple[set[str], set[str]]:
    """Return the names that a piece of syntax reads, and those that it stores."""
    found: tuple[set[str], set[str]] = set(), set()
    for each in nodes(node):
        if each.__class__ is ast.Name:
            found[each.ctx.__class__ is ast.Store].add(each.id)
    return found
