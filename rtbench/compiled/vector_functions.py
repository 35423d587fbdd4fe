"""What a kernel in lanes calls beside operators: rows of records, choices, minima, estimates.

numba's intrinsics: the code of each is what ``emit`` builds. It is kept by the types of the
arguments, so a width stays in them as a literal.
"""

from __future__ import annotations

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numba.core import config, types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from rtbench.compiled.vectors import I32, Lanes, all_lanes, is_float, joined, llvms_own, shuffled


def _address(context, builder, array, value, index, kind):
    """Return a pointer to the first number of row ``index`` of an array inside a record."""
    data = context.make_array(array)(context, builder, value).data
    row = builder.zext if not getattr(kind, "signed", False) else builder.sext
    place = row(index, ir.IntType(64)) if index.type.width < 64 else index
    inner = int(np.prod(array.shape[1:], dtype=int))
    return builder.gep(data, [builder.mul(place, ir.IntType(64)(inner))])


@intrinsic(prefer_literal=True)
def row(typingctx, array, index, start, width):
    """Return W neighbours, from ``start`` on, in row ``index`` of an array inside a record."""
    lanes = Lanes(array.dtype, width.literal_value)
    sig = lanes(array, types.unliteral(index), types.intp, width)

    def emit(context, builder, sig, args):
        place = _address(context, builder, array, args[0], args[1], sig.args[1])
        place = builder.gep(place, [args[2]])
        vector = builder.bitcast(place, lanes.vector.as_pointer())
        return builder.load(vector, align=array.dtype.bitwidth // 8)

    return sig, emit


@intrinsic(prefer_literal=True)
def column(typingctx, array, index, step, width):
    """Return number ``index`` of an array in each of W records that lie ``step`` bytes apart."""
    lanes = Lanes(array.dtype, width.literal_value)
    sig = lanes(array, types.unliteral(index), step, width)

    def emit(context, builder, sig, args):
        place = _address(context, builder, array, args[0], args[1], sig.args[1])
        vector, size = ir.Constant(lanes.vector, ir.Undefined), array.dtype.bitwidth // 8
        for lane in range(lanes.width):
            at = builder.gep(place, [ir.IntType(64)(lane * step.literal_value // size)])
            vector = builder.insert_element(vector, builder.load(at), I32(lane))
        return vector

    return sig, emit


@intrinsic(prefer_literal=True)
def spread(typingctx, number, width):
    """Return W lanes that all hold the number."""
    lanes = Lanes(types.unliteral(number), width.literal_value)

    def emit(context, builder, sig, args):
        return all_lanes(builder, lanes, lanes.number, args[0])

    return lanes(lanes.number, width), emit


@intrinsic
def choose(typingctx, test, one, other):
    """Return, lane by lane, ``one`` where the test holds and ``other`` elsewhere."""
    number = types.unliteral(one)
    if joined(one, other) is not None:
        lanes = joined(one, other)
    elif number != types.unliteral(other):
        raise TypingError(f"cannot choose between {one} and {other}")
    elif isinstance(test, Lanes):
        lanes = Lanes(number, test.width)
    else:  # nothing of it differs from lane to lane
        return number(test, number, number), lambda context, builder, sig, args: builder.select(
            *args
        )

    def emit(context, builder, sig, args):
        kinds = lanes.mask, lanes, lanes
        vectors = [all_lanes(builder, *each) for each in zip(kinds, sig.args, args, strict=True)]
        return builder.select(*vectors)

    return lanes(*(types.unliteral(each) for each in (test, one, other))), emit


def _of_two(typingctx, one, other, sign):
    """Return the code of: the first of two numbers unless the other compares so with it."""
    lanes = joined(one, other)
    if lanes is None and types.unliteral(one) != types.unliteral(other):
        raise TypingError(f"cannot choose between {one} and {other}")

    def emit(context, builder, sig, args):
        if lanes is not None:
            args = [all_lanes(builder, lanes, *each) for each in zip(sig.args, args, strict=True)]
        return builder.select(builder.fcmp_ordered(sign, args[1], args[0]), args[1], args[0])

    return (lanes or types.unliteral(one))(types.unliteral(one), types.unliteral(other)), emit


@intrinsic
def lesser(typingctx, one, other):
    """Return, lane by lane, what min does of two numbers: the first unless the other is less."""
    return _of_two(typingctx, one, other, "<")


@intrinsic
def greater(typingctx, one, other):
    """Return, lane by lane, what max does of two numbers: the first unless the other is greater."""
    return _of_two(typingctx, one, other, ">")


@intrinsic
def flipped(typingctx, x, sign):
    """Return x, its sign bit changed where that of ``sign`` is set, as `sign_bits.flipped`."""
    lanes = joined(x, sign)
    if lanes is None and types.unliteral(x) != types.unliteral(sign):
        raise TypingError(f"cannot flip {x} by {sign}")
    number = lanes.number if lanes else x

    def emit(context, builder, sig, args):
        if lanes is not None:
            args = [all_lanes(builder, lanes, *each) for each in zip(sig.args, args, strict=True)]
        kind = ir.IntType(number.bitwidth)
        highest = kind(1 << (number.bitwidth - 1))
        if lanes is not None:
            kind = ir.VectorType(kind, lanes.width)
            highest = ir.Constant(kind, [highest] * lanes.width)
        bits, other = (builder.bitcast(each, kind) for each in args)
        return builder.bitcast(builder.xor(bits, builder.and_(other, highest)), args[0].type)

    return (lanes or x)(x, sign), emit


@intrinsic
def opposite(typingctx, mask):
    """Return a mask, or a boolean, that holds where the given one does not."""
    return mask(mask), lambda context, builder, sig, args: builder.not_(args[0])


@intrinsic
def any_lane(typingctx, mask):
    """Return whether a mask holds in any lane."""
    if not isinstance(mask, Lanes):
        return mask(mask), lambda context, builder, sig, args: args[0]

    def emit(context, builder, sig, args):
        bits = builder.bitcast(args[0], ir.IntType(mask.width))
        return builder.icmp_unsigned("!=", bits, bits.type(0))

    return types.boolean(mask), emit


@intrinsic
def first_lane(typingctx, mask):
    """Return the lowest lane in which a mask holds; one must."""

    def emit(context, builder, sig, args):
        bits = builder.zext(builder.bitcast(args[0], ir.IntType(mask.width)), I32)
        return builder.cttz(bits, ir.IntType(1)(1))

    return types.int32(mask), emit


@intrinsic
def lane(typingctx, lanes, place):
    """Return the number in one lane."""

    def emit(context, builder, sig, args):
        return builder.extract_element(args[0], args[1])

    return lanes.number(lanes, types.int32), emit


@intrinsic
def one_of(typingctx, x, place):
    """Return what one lane has: of a number, which all lanes share, itself."""
    if not isinstance(x, Lanes):
        return x(x, place), lambda context, builder, sig, args: args[0]

    def emit(context, builder, sig, args):
        return builder.extract_element(args[0], args[1])

    return x.number(x, types.int64), emit


@intrinsic
def replaced(typingctx, lanes, place, number):
    """Return lanes with another number in one of them."""

    def emit(context, builder, sig, args):
        return builder.insert_element(args[0], args[2], args[1])

    return lanes(lanes, types.int64, lanes.number), emit


@intrinsic
def store(typingctx, array, k, lanes):
    """Write lanes to row ``k`` of an array of rows of W."""

    def emit(context, builder, sig, args):
        data = context.make_array(array)(context, builder, args[0]).data
        at = builder.gep(data, [builder.mul(args[1], ir.IntType(64)(lanes.width))])
        vector = builder.bitcast(at, lanes.vector.as_pointer())
        builder.store(args[2], vector, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.uintp, lanes), emit


# What LLVM calls the estimates of x86, by how many lanes they take, and the features they need.
ESTIMATES = {
    16: ("llvm.x86.avx512.rcp14.ps.512", "avx512f", ("x86-64-v4",)),
    8: ("llvm.x86.avx.rcp.ps.256", "avx", ("x86-64-v3", "x86-64-v4")),
    4: ("llvm.x86.sse.rcp.ps", "sse", ("x86-64", "x86-64-v2", "x86-64-v3", "x86-64-v4")),
}


@intrinsic
def reciprocal(typingctx, x):
    """Return 1 / x by the processor's estimate and one Newton step: about 23 of the 24 bits.

    Of 0 it is NaN, not infinity, of which every comparison is false. For float32 on x86.

    Source
    ------
    Havel 2008, section 4.2.1.4, Text 5.
    """
    if not isinstance(x, Lanes):  # one division for all lanes needs no estimate
        return x(x), lambda context, builder, sig, args: builder.fdiv(
            ir.Constant(args[0].type, 1.0), args[0]
        )
    most = _widest_estimate()
    if x.number != types.float32 or not most:
        raise TypingError(f"there is no estimate of the reciprocal of {x} here")

    def emit(context, builder, sig, args):
        vector, piece = args[0], min(most, x.width)
        parts = [
            _estimate(builder, shuffled(builder, vector, range(begin, begin + piece)))
            for begin in range(0, x.width, piece)
        ]
        while len(parts) > 1:
            parts = [
                shuffled(builder, one, range(2 * one.type.count), other)
                for one, other in zip(parts[::2], parts[1::2], strict=True)
            ]
        first = parts[0]
        rest = builder.fmul(builder.fmul(first, vector), first)
        return builder.fsub(builder.fadd(first, first), rest)

    return x(x), emit


def _widest_estimate() -> int:
    """Return for how many lanes at a time the target has an estimate; 0 where it has none."""
    features = config.CPU_FEATURES or llvm.get_host_cpu_features().flatten()
    for width, (_, feature, names) in ESTIMATES.items():
        if f"+{feature}" in features.split(",") or config.CPU_NAME in names:
            return width
    return 0


def _estimate(builder, vector: ir.Value) -> ir.Value:
    """Return the estimate of a vector that the processor takes whole."""
    name, arguments = ESTIMATES[vector.type.count][0], [vector]
    if vector.type.count == 16:  # where the mask is off, the second vector: nowhere
        arguments += [ir.Constant(vector.type, ir.Undefined), ir.IntType(16)(-1)]
    kind = ir.FunctionType(vector.type, [each.type for each in arguments])
    return builder.call(llvms_own(builder, name, kind), arguments)


@intrinsic
def next_up(typingctx, x):
    """Return the next greater number of each positive one; infinity stays."""

    def emit(context, builder, sig, args):
        bits = ir.VectorType(ir.IntType(x.number.bitwidth), x.width)
        stepped = builder.add(
            builder.bitcast(args[0], bits), ir.Constant(bits, [bits.element(1)] * x.width)
        )
        infinity = ir.Constant(x.vector, [ir.Constant(x.vector.element, float("inf"))] * x.width)
        finite = builder.fcmp_ordered("<", args[0], infinity)
        return builder.select(finite, builder.bitcast(stepped, x.vector), args[0])

    return x(x), emit


@intrinsic
def least(typingctx, lanes):
    """Return the least number of all lanes; without a NaN among them."""

    def emit(context, builder, sig, args):
        vector, width = args[0], lanes.width
        while width > 1:  # the upper half against the lower
            width //= 2
            both = range(width), range(width, 2 * width)
            halves = [shuffled(builder, vector, places) for places in both]
            less = (
                builder.fcmp_ordered("<", *halves)
                if is_float(lanes)
                else builder.icmp_signed("<", *halves)
            )
            vector = builder.select(less, *halves)
        return builder.extract_element(vector, I32(0))

    return lanes.number(lanes), emit
