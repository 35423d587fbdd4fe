"""A method's pieces woven into an ending: one plain function, readable as if written by hand.

Where the ending reads a piece (DENOMINATOR, T, B, C, A, AREA), the statements that it needs and
that are not there yet are put before, in their own order; so an early exit skips what comes later.
"""

from __future__ import annotations

import ast
import inspect

from rtbench.compiled.nodes import names, nodes
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import OUTPUTS
from rtbench.kernels.endings import Ending
from rtbench.kernels.pieces import pieces as pieces_given
from rtbench.kernels.reached import reached

INSTEAD = (OUTPUTS["point"], OUTPUTS["normal"])
"""What a kernel may return in place of t, u, v."""
PIECES = ("DENOMINATOR", "T", "B", "C", "A", "AREA", "NORMAL_X", "NORMAL_Y", "NORMAL_Z", "REACHED")


def woven(
    pieces: ast.FunctionDef,
    text: ast.FunctionDef,
    ending: Ending,
    instead: tuple[str, ...] | None = None,
) -> ast.FunctionDef:
    """Return the function that an ending makes of a method's pieces.

    Parameters
    ----------
    pieces, text : ast.FunctionDef
        The syntax of the method's function and of ``ending.text``; they are changed.
    ending : Ending
    instead : tuple of str, optional
        One of INSTEAD.

    Returns
    -------
    ast.FunctionDef
        Takes what the ending takes, returns the outcome and t, u, v, or the outcome and the point
        or normal instead. It may hold a node twice.

    Raises
    ------
    RtbenchError
        If the pieces are not assignments and one ``return pieces(...)``, or a piece is missing.
    """
    given = _given(pieces)
    facts = {
        "POINT": any(argument.arg == "along" for argument in pieces.args.args),
        "SECOND": "AREA" in given,
        "THREE": "A" in given,
    }
    text = _Decided(facts).visit(text)
    if instead:
        _name_t(text)
        for node in [n for n in nodes(text) if isinstance(n, ast.Return)]:
            node.value.elts = _instead(instead, node.value.elts)
    more: list[ast.stmt] = []
    if ending.reads_vertices:
        *more, last = ast.parse(inspect.getsource(reached)).body[0].body[1:]
        given["REACHED"] = last.value
    taken = set.union(*names(text), *(part for line in more for part in names(line)))
    own = {name for statement in pieces.body for name in _stores(statement)}
    renamed = {name: ast.Name(f"{name}_numerator", ast.Load()) for name in own & taken}
    lines = pieces.body[:-1]
    if renamed:
        lines = [_Replaced(renamed).visit(statement) for statement in lines]
        given = {name: _Replaced(renamed).visit(node) for name, node in given.items()}
    lines = [*lines, *more]
    text.body = _folded(_Woven(pieces.name, ending, lines, given).statements(text.body))
    return text


class _Woven:
    """Puts the lines of the pieces between those of the ending, each where it is first needed."""

    def __init__(
        self,
        method: str,
        ending: Ending,
        lines: list[ast.stmt],
        given: dict[str, ast.expr],
    ) -> None:
        self._method = method
        self._parameters = {"along": ending.along, "scale": ending.scale}
        self._lines = lines
        self._line_reads, self._line_stores = zip(*map(names, lines), strict=True)
        self._given = given
        # What stands for a piece: its own name where it has one, so that it is computed once.
        self._named: dict[str, ast.expr] = {
            name: node for name, node in given.items() if isinstance(node, ast.Name)
        }
        self._there: set[int] = set()
        self._body: list[ast.stmt] = []

    def statements(self, ending: list[ast.stmt]) -> list[ast.stmt]:
        for statement in ending:
            for name in sorted(_reads(statement), key=_place):
                self._bring_piece(name)
            self._body.append(_Replaced(self._named).visit(statement))
        return self._body

    def _bring_piece(self, name: str) -> None:
        if name not in PIECES:
            return
        if name not in self._given:
            raise RtbenchError(f"method {self._method!r} gives no {name.lower()}")
        self._bring(_reads(self._given[name]))
        if name not in self._named:
            self._named[name] = ast.Name(f"{name.lower()}_piece", ast.Load())
            self._append(
                ast.Assign(
                    [ast.Name(self._named[name].id, ast.Store())], self._given[name], lineno=1
                )
            )

    def _bring(self, names: set[str]) -> None:
        """Add the lines that define these names, and what those read, as far as not there."""
        wanted, needed = set(names), []
        for place in reversed(range(len(self._lines))):
            if self._line_stores[place] & wanted:
                needed.append(place)
                wanted |= self._line_reads[place]
        for parameter in sorted(wanted & self._parameters.keys()):
            self._bring_piece(self._parameters[parameter])
        for place in sorted(set(needed) - self._there):
            self._there.add(place)
            self._append(self._lines[place])

    def _append(self, line: ast.stmt) -> None:
        if not _reads(line) & self._parameters.keys():
            self._body.append(line)
            return
        stand_ins = {
            name: self._named.get(value, ast.Name(value, ast.Load()))
            for name, value in self._parameters.items()
        }
        self._body.append(_Replaced(stand_ins).visit(line))


def _given(pieces: ast.FunctionDef) -> dict[str, ast.expr]:
    """Return the expression of each piece that the function's last line gives."""
    *lines, last = pieces.body
    called = getattr(last, "value", None)
    assigned = [name for line in lines for name in _stores(line)]
    good = (
        all(isinstance(line, ast.Assign) for line in lines)
        and len(assigned) == len(set(assigned))
        and isinstance(last, ast.Return)
        and isinstance(called, ast.Call)
        and ast.unparse(called.func) == "pieces"
    )
    if not good:
        raise RtbenchError(
            f"method {pieces.name!r} must be assignments, each name once, and end "
            "in return pieces(...)"
        )
    words = {word.arg: word.value for word in called.keywords}
    bound = inspect.signature(pieces_given).bind(*called.args, **words).arguments
    if "normal" in bound:
        normal = bound.pop("normal")
        bound |= dict(zip(("normal_x", "normal_y", "normal_z"), normal.elts, strict=True))
    return {name.upper(): node for name, node in bound.items()}


def _name_t(text: ast.FunctionDef) -> None:
    """Give the t that an ending returns last a name, so that a point needs it once."""
    last = text.body[-1].value.elts
    if not isinstance(last[1], ast.Name):
        text.body.insert(-1, ast.Assign([ast.Name("t_found", ast.Store())], last[1], lineno=1))
        last[1] = ast.Name("t_found", ast.Load())


def _instead(outputs: tuple[str, ...], values: list[ast.expr]) -> list[ast.expr]:
    """Return what is returned in place of t, u, v: the point O + t D, or the method's normal."""
    outcome, t = values[0], ast.unparse(values[1])
    if t == "NO_T":
        texts = ["NO_T"] * 3
    elif outputs == OUTPUTS["normal"]:
        texts = ["NORMAL_X", "NORMAL_Y", "NORMAL_Z"]
    else:
        texts = [f"ray.orig[{axis}] + ray.dir[{axis}] * {t}" for axis in range(3)]
    return [outcome, *(ast.parse(each, mode="eval").body for each in texts)]


def _stores(node: ast.AST) -> set[str]:
    return names(node)[1]


def _reads(node: ast.AST) -> set[str]:
    return names(node)[0]


def _place(name: str) -> int:
    return PIECES.index(name) if name in PIECES else -1


class _Transformer(ast.NodeTransformer):
    """Changes expressions of local names; fields of tri and ray, which hold none, are passed by."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        return node

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        return node if isinstance(node.value, ast.Attribute) else self.generic_visit(node)


class _Decided(_Transformer):
    """Resolve what an ending asks of the method: POINT, SECOND, THREE."""

    def __init__(self, facts: dict[str, bool]) -> None:
        self._facts = facts

    def _known(self, test: ast.expr) -> bool | None:
        if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
            known = self._known(test.operand)
            return None if known is None else not known
        return self._facts.get(test.id) if isinstance(test, ast.Name) else None

    def visit_If(self, node: ast.If) -> ast.stmt | list[ast.stmt]:
        known = self._known(node.test)
        self.generic_visit(node)
        return node if known is None else (node.body if known else node.orelse)

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        known = self._known(node.test)
        self.generic_visit(node)
        return node if known is None else (node.body if known else node.orelse)


class _Replaced(_Transformer):
    """Put expressions in the place of names; a name that is assigned gets the new name."""

    def __init__(self, instead: dict[str, ast.expr]) -> None:
        self._instead = instead

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id not in self._instead:
            return node
        new = self._instead[node.id]
        return ast.Name(new.id, node.ctx) if isinstance(new, ast.Name) else new


class _Folded(_Transformer):
    """Drop factors of ONE and what is multiplied by ZERO: exact, whatever the other side is.

    (But for NaN and infinity times ZERO, which only `endings.inside` has, of a direction that it
    does not use.)
    """

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        left, right = _constant(node.left), _constant(node.right)
        if isinstance(node.op, ast.Mult):
            if "ZERO" in (left, right):
                return ast.Name("ZERO", ast.Load())
            if "ONE" in (left, right):
                return node.right if left == "ONE" else node.left
        if isinstance(node.op, ast.Add) and "ZERO" in (left, right):
            return node.right if left == "ZERO" else node.left
        return node


def _constant(node: ast.expr) -> str | None:
    return node.id if isinstance(node, ast.Name) and node.id in ("ONE", "ZERO") else None


def _folded(body: list[ast.stmt]) -> list[ast.stmt]:
    """Return statements without factors of ONE and without second names for the same thing."""
    same: dict[str, ast.expr] = {}
    computed: dict[str, ast.expr] = {}
    kept = []
    for statement in body:
        statement = _Folded().visit(_Replaced(same).visit(statement) if same else statement)
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            name, value = statement.targets[0].id, statement.value
            if not isinstance(value, ast.Name):
                value = computed.setdefault(ast.dump(value), ast.Name(name, ast.Load()))
            if value.id != name:
                same[name] = value
                continue
        kept.append(statement)
    return kept
