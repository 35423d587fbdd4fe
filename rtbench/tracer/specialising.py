"""That a tracer holds nothing of what its scene does not call for: seen in its compiled code.

A tracer is compiled twice: from its sources as they are, with constants that are False before the
blocks of absent effects, and from sources out of whose syntax these blocks were deleted. Both must
give the same intermediate code of LLVM, but for names, numbers and the order in which blocks stand.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from rtbench.compiled import cache
from rtbench.compiled.instantiate import Instance
from rtbench.tracer import module
from rtbench.tracer.canonical_code import canonical
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

    def _compile(self) -> bool:
        features = self._features()
        absent = [name for name, inside in features.constants().items() if not inside]
        precision = self.options.precision
        self.instance = module.instantiated(self.kernel, precision, features, deleted(absent))
        return self.instance.fresh


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
