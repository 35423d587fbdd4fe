"""Vectors of W numbers as a type of numba's: what a lane loop would become, said outright.

An operation on a `Lanes` is one LLVM instruction on a vector of W numbers, which the processor does
in one, two or four of its own; a number beside it counts for all lanes. So a kernel computes in
lanes what it computes in numbers, with the same operations in the same order, and nothing depends
on whether the compiler finds a loop worth vectorising: LLVM leaves loops of 4 and 8 alone, and
none with a running minimum in it.

numba has no such type; what is used here to add one is its documented interface for extensions
(numba.extending) and its typing templates for operators. As in the kernels' own code no flag lets
LLVM change an operation.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence

from llvmlite import ir
from numba.core import types
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import lower_builtin, models, register_model

I32 = ir.IntType(32)


class Lanes(types.Type):
    """W numbers of one type, or W booleans (a mask)."""

    def __init__(self, number: types.Type, width: int) -> None:
        self.number, self.width = number, width
        super().__init__(f"Lanes({number} x {width})")

    @property
    def mask(self) -> Lanes:
        """The type of a comparison's result."""
        return Lanes(types.boolean, self.width)

    @property
    def vector(self) -> ir.VectorType:
        """What it is to LLVM."""
        if self.number is types.boolean:
            element = ir.IntType(1)
        elif isinstance(self.number, types.Float):
            element = ir.FloatType() if self.number.bitwidth == 32 else ir.DoubleType()
        else:
            element = ir.IntType(self.number.bitwidth)
        return ir.VectorType(element, self.width)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, fe_type.vector)


def joined(*given: types.Type) -> Lanes | None:
    """Return the type of lanes that these are, numbers of the same type among them; or None."""
    lanes = next((each for each in given if isinstance(each, Lanes)), None)
    if lanes is None:
        return None
    fits = all(types.unliteral(each) in (lanes, lanes.number) for each in given)
    return lanes if fits else None


def all_lanes(builder, lanes: Lanes, given: types.Type, value: ir.Value) -> ir.Value:
    """Return a value as a vector: a number in every lane."""
    if isinstance(given, Lanes):
        return value
    if types.unliteral(given) is types.boolean and value.type != ir.IntType(1):
        value = builder.trunc(value, ir.IntType(1))
    first = builder.insert_element(ir.Constant(lanes.vector, ir.Undefined), value, I32(0))
    return shuffled(builder, first, [0] * lanes.width)


def shuffled(
    builder, one: ir.Value, places: Sequence[int], other: ir.Value | None = None
) -> ir.Value:
    """Return these lanes of a vector, or of two, one after the other."""
    mask = ir.Constant(ir.VectorType(I32, len(places)), list(places))
    return builder.shuffle_vector(one, one if other is None else other, mask)


def _operator(function, emit, *, arity: int, of: str, gives: str = "same") -> None:
    """Teach numba one operator: ``emit(builder, lanes, *vectors)`` gives LLVM's value."""

    class Template(AbstractTemplate):
        def generic(self, args, kws):
            lanes = joined(*args) if len(args) == arity and not kws else None
            if lanes is None or (lanes.number is types.boolean) != (of == "masks"):
                return None
            return signature(lanes.mask if gives == "mask" else lanes, *args)

    infer_global(function)(Template)

    def lower(context, builder, sig, args):
        lanes = joined(*sig.args)
        vectors = [all_lanes(builder, lanes, *each) for each in zip(sig.args, args, strict=True)]
        return emit(builder, lanes, *vectors)

    forms = [(Lanes,)] if arity == 1 else [(Lanes, Lanes), (Lanes, types.Any), (types.Any, Lanes)]
    for form in forms:
        lower_builtin(function, *form)(lower)


def is_float(lanes: Lanes) -> bool:
    return isinstance(lanes.number, types.Float)


def _arithmetic(name: str):
    def emit(builder, lanes, a, b):
        return getattr(builder, f"f{name}" if is_float(lanes) else name)(a, b)

    return emit


def _comparison(sign: str):
    def emit(builder, lanes, a, b):
        if not is_float(lanes):
            return builder.icmp_signed(sign, a, b)
        # As in C: every comparison with NaN is false, but != is true.
        compare = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        return compare(sign, a, b)

    return emit


def _magnitude(builder, lanes, a):
    suffix = "f32" if lanes.number.bitwidth == 32 else "f64"
    kind = ir.FunctionType(lanes.vector, [lanes.vector])
    return builder.call(llvms_own(builder, f"llvm.fabs.v{lanes.width}{suffix}", kind), [a])


def llvms_own(builder, name: str, kind: ir.FunctionType) -> ir.Function:
    """Return one of LLVM's own functions."""
    return builder.module.globals.get(name) or ir.Function(builder.module, kind, name)


for _function, _name in (
    (operator.add, "add"),
    (operator.sub, "sub"),
    (operator.mul, "mul"),
    (operator.truediv, "div"),
):
    _operator(_function, _arithmetic(_name), arity=2, of="numbers")
for _function, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _operator(_function, _comparison(_sign), arity=2, of="numbers", gives="mask")
_operator(operator.and_, lambda builder, _, a, b: builder.and_(a, b), arity=2, of="masks")
_operator(operator.or_, lambda builder, _, a, b: builder.or_(a, b), arity=2, of="masks")
_operator(operator.neg, lambda builder, _, a: builder.fneg(a), arity=1, of="numbers")
_operator(abs, _magnitude, arity=1, of="numbers")
