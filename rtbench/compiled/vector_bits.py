"""Masks as bits, bits as numbers, numbers of another type: what walks in lanes compute with.

numba's intrinsics, see `rtbench.compiled.vector_functions`. Beside each stands, in PLAIN, what it
does, said of arrays: a lane is an element.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from rtbench.compiled.vectors import I32, Lanes, all_lanes, is_float, llvms_own, shuffled

I64 = ir.IntType(64)
PLAIN = {}


def plain(of):
    """Say what an intrinsic does by a function of arrays."""

    def declare(function):
        PLAIN[of] = function
        return function

    return declare


def suffix(lanes: Lanes) -> str:
    kind = "f" if is_float(lanes) else "i"
    return f"v{lanes.width}{kind}{lanes.number.bitwidth}"


@intrinsic
def compressed(typingctx, lanes, mask):
    """Return the lanes in which a mask holds, in their order, at the front; the rest is 0."""

    def emit(context, builder, sig, args):
        kind = ir.FunctionType(lanes.vector, [lanes.vector, lanes.mask.vector, lanes.vector])
        name = f"llvm.experimental.vector.compress.{suffix(lanes)}"
        zeros = ir.Constant(lanes.vector, None)
        return builder.call(llvms_own(builder, name, kind), [*args, zeros])

    return lanes(lanes, lanes.mask), emit


@plain(compressed)
def _compressed(lanes, mask):
    return np.pad(lanes[mask], (0, int((~mask).sum())))


@intrinsic
def bits_of(typingctx, mask):
    """Return a mask as a uint32, lane k in bit k."""

    def emit(context, builder, sig, args):
        bits = builder.bitcast(args[0], ir.IntType(mask.width))
        return builder.zext(bits, I32) if mask.width < 32 else bits

    return types.uint32(mask), emit


@plain(bits_of)
def _bits_of(mask):
    return np.uint32(sum(1 << k for k in np.flatnonzero(mask)))


@intrinsic(prefer_literal=True)
def mask_of(typingctx, bits, width):
    """Return the mask of W lanes whose bits these are, lane k's bit k."""
    lanes = Lanes(types.boolean, width.literal_value)

    def emit(context, builder, sig, args):
        return builder.bitcast(builder.trunc(args[0], ir.IntType(lanes.width)), lanes.vector)

    return lanes(types.uint32, width), emit


@plain(mask_of)
def _mask_of(bits, width):
    return (int(bits) >> np.arange(width)) & 1 == 1


@intrinsic
def how_many(typingctx, mask):
    """Return in how many lanes a mask holds."""

    def emit(context, builder, sig, args):
        bits = builder.bitcast(args[0], ir.IntType(mask.width))
        return builder.zext(builder.ctpop(bits), I32)

    return types.int32(mask), emit


@plain(how_many)
def _how_many(mask):
    return int(mask.sum())


@intrinsic
def lowest_bit(typingctx, bits):
    """Return the place of the lowest bit of a uint32 that is set; one must be."""

    def emit(context, builder, sig, args):
        return builder.zext(builder.cttz(args[0], ir.IntType(1)(1)), I64)

    return types.int64(types.uint32), emit


@plain(lowest_bit)
def _lowest_bit(bits):
    return (int(bits) & -int(bits)).bit_length() - 1


def _halves(lanes: Lanes) -> Lanes:
    if lanes.number.bitwidth != 64:
        raise TypingError(f"{lanes} have no halves of 32 bits")
    return Lanes(types.uint32, lanes.width)


@intrinsic
def low_half(typingctx, lanes):
    """Return the lower 32 bits of uint64 lanes, uint32."""
    half = _halves(lanes)
    return half(lanes), lambda context, builder, sig, args: builder.trunc(args[0], half.vector)


@plain(low_half)
def _low_half(lanes):
    return lanes.astype(np.uint32)


@intrinsic
def high_half(typingctx, lanes):
    """Return the upper 32 bits of uint64 lanes, uint32."""
    half = _halves(lanes)

    def emit(context, builder, sig, args):
        return builder.trunc(builder.lshr(args[0], lanes.vector([32] * lanes.width)), half.vector)

    return half(lanes), emit


@plain(high_half)
def _high_half(lanes):
    return (lanes >> np.uint64(32)).astype(np.uint32)


def _same_bits(lanes, number):
    other = Lanes(number, lanes.width)

    def emit(context, builder, sig, args):
        return builder.bitcast(args[0], other.vector)

    return other(lanes), emit


@intrinsic
def float_of_bits(typingctx, lanes):
    """Return float32 lanes of these bits, uint32 or int32."""
    return _same_bits(lanes, types.float32)


@plain(float_of_bits)
def _float_of_bits(lanes):
    return lanes.view(np.float32)


@intrinsic
def signed(typingctx, lanes):
    """Return uint32 lanes as int32 of the same bits."""
    return _same_bits(lanes, types.int32)


@plain(signed)
def _signed(lanes):
    return lanes.view(np.int32)


def _with_number(lanes, operation):
    """Return the code of an operation of LLVM's on lanes of whole numbers and a number."""

    def emit(context, builder, sig, args):
        return getattr(builder, operation)(
            args[0], all_lanes(builder, lanes, lanes.number, args[1])
        )

    return lanes(lanes, lanes.number), emit


@intrinsic
def bits_and(typingctx, lanes, number):
    """Return each lane of whole numbers and a number, bit by bit."""
    return _with_number(lanes, "and_")


@plain(bits_and)
def _bits_and(lanes, number):
    return lanes & number


@intrinsic
def shifted_right(typingctx, lanes, number):
    """Return each lane of whole numbers shifted right by a number of bits, zeros coming in."""
    return _with_number(lanes, "lshr")


@plain(shifted_right)
def _shifted_right(lanes, number):
    return lanes.view(f"u{lanes.itemsize}") >> number


@intrinsic
def bits_or(typingctx, one, other):
    """Return lanes of whole numbers, bit by bit set where either is."""
    sig = one(one, other)
    return sig, lambda context, builder, sig, args: builder.or_(*args)


@plain(bits_or)
def _bits_or(one, other):
    return one | other


@intrinsic
def shifted_left(typingctx, lanes, number):
    """Return each lane of whole numbers shifted left by a number of bits."""
    return _with_number(lanes, "shl")


@plain(shifted_left)
def _shifted_left(lanes, number):
    return lanes << number


@intrinsic
def joined_halves(typingctx, low, high):
    """Return uint64 lanes of two halves of 32 bits, whole numbers or float32."""
    both = Lanes(types.uint64, low.width)

    def emit(context, builder, sig, args):
        half = ir.VectorType(I32, low.width)
        one, other = (builder.zext(builder.bitcast(each, half), both.vector) for each in args)
        return builder.or_(one, builder.shl(other, both.vector([32] * low.width)))

    return both(low, high), emit


@plain(joined_halves)
def _joined_halves(low, high):
    return np.stack([low.view(np.uint32), high.view(np.uint32)], axis=1).view(np.uint64)[:, 0]


@intrinsic
def as_double(typingctx, x):
    """Return lanes, or a number, in float64."""
    return _converted(x, types.float64)


@plain(as_double)
def _as_double(lanes):
    return lanes.astype(np.float64)


@intrinsic
def as_single(typingctx, x):
    """Return lanes, or a number, in float32."""
    return _converted(x, types.float32)


@plain(as_single)
def _as_single(lanes):
    with np.errstate(over="ignore"):
        return lanes.astype(np.float32)


def _converted(x, number):
    alone = not isinstance(x, Lanes)
    given = types.unliteral(x) if alone else x.number
    result = number if alone else Lanes(number, x.width)

    def emit(context, builder, sig, args):
        if alone:
            return context.cast(builder, args[0], given, number)
        if given.bitwidth == number.bitwidth:
            return args[0]
        convert = builder.fpext if given.bitwidth < number.bitwidth else builder.fptrunc
        return convert(args[0], result.vector)

    if not isinstance(given, types.Float):
        raise TypingError(f"{x} is not of floating-point numbers")
    return result(given if alone else x), emit


@intrinsic
def halves_swapped(typingctx, lanes):
    """Return lanes, the upper half before the lower."""
    half = lanes.width // 2
    places = [*range(half, lanes.width), *range(half)]
    return lanes(lanes), lambda context, builder, sig, args: shuffled(builder, args[0], places)


@plain(halves_swapped)
def _halves_swapped(lanes):
    return np.roll(lanes, len(lanes) // 2)


@intrinsic
def truncated(typingctx, lanes):
    """Return float lanes, which int32 must hold, as int32, rounded toward 0."""
    whole = Lanes(types.int32, lanes.width)
    return whole(lanes), lambda context, builder, sig, args: builder.fptosi(args[0], whole.vector)


@plain(truncated)
def _truncated(lanes):
    return np.trunc(lanes).astype(np.int32)


@intrinsic
def told_apart(typingctx, lanes):
    """Return positive float32 lanes that are no longer equal: the last bits are the lane's number.

    W is a power of 2.
    """

    def emit(context, builder, sig, args):
        bits = ir.VectorType(I32, lanes.width)
        kept = builder.and_(
            builder.bitcast(args[0], bits),
            ir.Constant(bits, [-lanes.width & 0xFFFFFFFF] * lanes.width),
        )
        own = builder.or_(kept, ir.Constant(bits, list(range(lanes.width))))
        return builder.bitcast(own, lanes.vector)

    return lanes(lanes), emit


@plain(told_apart)
def _told_apart(lanes):
    kept = lanes.view(np.uint32) & np.uint32(-len(lanes) & 0xFFFFFFFF)
    return (kept | np.arange(len(lanes), dtype=np.uint32)).view(np.float32)


@intrinsic
def descending(typingctx, lanes):
    """Return the lanes in descending order, without a NaN among them; W is a power of 2.

    Source
    ------
    Batcher 1968: a bitonic network, which has no branches.
    """

    def emit(context, builder, sig, args):
        vector, width = args[0], lanes.width
        run = 2
        while run <= width:
            step = run // 2
            while step:
                other = shuffled(builder, vector, [k ^ step for k in range(width)])
                less = (
                    builder.fcmp_ordered("<", vector, other)
                    if is_float(lanes)
                    else builder.icmp_signed("<", vector, other)
                )
                low = builder.select(less, vector, other)
                high = builder.select(less, other, vector)
                # The greater comes first, but in every second run, which ascends to be merged.
                first = [((k & step) == 0) == ((k & run) == 0) for k in range(width)]
                places = [k if one else width + k for k, one in enumerate(first)]
                vector = shuffled(builder, high, places, low)
                step //= 2
            run *= 2
        return vector

    return lanes(lanes), emit


@plain(descending)
def _descending(lanes):
    return np.sort(lanes)[::-1]
