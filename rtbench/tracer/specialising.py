"""That a tracer holds nothing of what its scene does not call for: seen in its compiled code.

A tracer is compiled twice: from its sources as they are, with constants that are False before the
blocks of absent effects, and from sources out of whose syntax these blocks were deleted. Both must
give the same intermediate code of LLVM, but for names and numbers.
"""

from __future__ import annotations

import ast
import difflib
import hashlib
import importlib.util
import re
import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from rtbench.compiled import cache
from rtbench.compiled.instantiate import Instance
from rtbench.tracer import module
from rtbench.tracer.render import Renderer

COMPILED = "; compiled: "  # heads the kept code: the functions that it was made from


@dataclass(frozen=True)
class Code:
    """The intermediate code of a tracer.

    Attributes
    ----------
    text : str
        As LLVM prints it, optimised.
    functions : tuple of str
        Those of the generated module that were compiled, sorted; the others never were looked at.
    """

    text: str
    functions: tuple[str, ...]

    @property
    def canonical(self) -> str:
        """The code with names and numbers in the order of their appearance."""
        return canonical(self.text)

    @property
    def instructions(self) -> int:
        """How many instructions there are."""
        return sum(line.startswith("  ") for line in self.canonical.splitlines())

    @property
    def digest(self) -> str:
        """A digest of the canonical code."""
        return hashlib.sha256(self.canonical.encode()).hexdigest()[:16]


def deleted(absent: Iterable[str]) -> Callable[[ast.FunctionDef], ast.FunctionDef]:
    """Return what deletes the blocks behind constants that are False from a function's syntax.

    Parameters
    ----------
    absent : iterable of str
        The constants; no other name is touched.
    """
    names = frozenset(absent)

    def change(function: ast.FunctionDef) -> ast.FunctionDef:
        return ast.fix_missing_locations(_Deleting(names).visit(function))

    return change


class Deleted(Renderer):
    """A renderer whose tracer comes from sources without the blocks of what it does not hold."""

    def _instance(self) -> Instance:
        features = self._features()
        absent = [name for name, inside in features.constants().items() if not inside]
        precision = self.options.precision
        return module.instantiated(self.kernel, precision, features, deleted(absent))


class _Deleting(ast.NodeTransformer):
    """Replace names by False, and whatever follows from it."""

    def __init__(self, absent: frozenset[str]) -> None:
        self._absent = absent

    def visit_Name(self, node: ast.Name) -> ast.expr:
        absent = isinstance(node.ctx, ast.Load) and node.id in self._absent
        return ast.Constant(False) if absent else node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        known = _known(node.operand)
        if isinstance(node.op, ast.Not) and known is not None:
            return ast.Constant(not known)
        return node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        decides = isinstance(node.op, ast.Or)  # a True decides an "or", a False an "and"
        values = [value for value in node.values if _known(value) is not (not decides)]
        for place, value in enumerate(values):
            if _known(value) is decides:
                values = values[: place + 1]
                break
        if not values:
            return ast.Constant(not decides)
        if _known(values[-1]) is decides and not any(map(_calls, values)):
            return ast.Constant(decides)
        return values[0] if len(values) == 1 else ast.BoolOp(node.op, values)

    def visit_If(self, node: ast.If) -> ast.stmt | list[ast.stmt]:
        self.generic_visit(node)
        known = _known(node.test)
        if known is None:
            node.body = node.body or [ast.Pass()]
            return node
        return node.body if known else node.orelse

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        known = _known(node.test)
        if known is None:
            return node
        return node.body if known else node.orelse

    def visit_For(self, node: ast.For) -> ast.stmt:
        return self._filled(node)

    def visit_While(self, node: ast.While) -> ast.stmt:
        return self._filled(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.stmt:
        return self._filled(node)

    def _filled(self, node: ast.stmt) -> ast.stmt:
        self.generic_visit(node)
        node.body = node.body or [ast.Pass()]
        return node


def _known(node: ast.expr) -> bool | None:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, bool) else None


def _calls(node: ast.expr) -> bool:
    return any(isinstance(each, ast.Call) for each in ast.walk(node))


def code_of(instance: Instance) -> Code:
    """Return the intermediate code of a generated module's entry.

    Of code that came from its cache numba has none: then it is compiled once more, aside. It is
    kept beside the module and goes with it.
    """
    kept = instance.path.with_suffix(".ll")
    try:
        return _parted(kept.read_text(encoding="utf-8"))
    except OSError:
        pass
    if instance.fresh:
        function = instance.call
        names = vars(sys.modules[function.__module__])
    else:
        names = _compiled_aside(instance.path)
        function = names[instance.entry]
    (signature,) = function.signatures
    functions = sorted(name for name, value in names.items() if getattr(value, "signatures", None))
    text = f"{COMPILED}{' '.join(functions)}\n{function.inspect_llvm(signature)}"
    cache.write_whole(kept, text)
    return _parted(text)


def _parted(text: str) -> Code:
    head, _, body = text.partition("\n")
    return Code(body, tuple(head.removeprefix(COMPILED).split()))


def _compiled_aside(path: Path) -> dict[str, object]:
    """Return the names of a generated module, compiled again and kept nowhere."""
    text = path.read_text(encoding="utf-8").replace("cache=True", "cache=False")
    with tempfile.TemporaryDirectory(prefix="rtbench-code-") as folder:
        file = Path(folder) / path.name
        file.write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location(f"rtbench_aside_{path.stem}", file)
        made = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(made)
    return vars(made)


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

    Two functions that differ only in how things are called, or in which order blocks that jump to
    each other are written down, have the same canonical code. What stands behind semicolons, and
    facts about the code (metadata), is left out.
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
                lines += _renamed(_in_order(body), shared, {})
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
