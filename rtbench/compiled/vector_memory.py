"""Lanes to and from memory: what walks through trees need.

As in `rtbench.compiled.vector_bits`, what each does of arrays stands beside it, in PLAIN.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Iterable

import numpy as np
from llvmlite import ir
from llvmlite.ir.instructions import GEPInstr
from numba.core import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

from rtbench.compiled import vector_bits
from rtbench.compiled.vector_bits import I64, PLAIN, plain, suffix
from rtbench.compiled.vectors import I32, Lanes, llvms_own


def digest() -> str:
    """Return a digest of this module and of vector_bits, for what imports them."""
    texts = [inspect.getsource(each) for each in (vector_bits, sys.modules[__name__])]
    return hashlib.sha256("".join(texts).encode()).hexdigest()[:16]


def imports(names: Iterable[str]) -> str:
    """Return the lines with which a generated module imports these intrinsics."""
    found = {each.__name__: each.__module__ for each in PLAIN}
    modules = dict.fromkeys(found[name] for name in names)
    return "\n".join(
        f"from {module} import {', '.join(name for name in names if found[name] == module)}"
        for module in modules
    )


def _number(array) -> types.Type:
    """Return the type of an array's elements in lanes: of records of 4 or 8 bytes, their bits."""
    if isinstance(array.dtype, types.Record):
        found = {4: types.uint32, 8: types.uint64}.get(array.dtype.size)
        if found is None:
            raise TypingError(f"records of {array.dtype.size} bytes do not fit in a lane")
        return found
    return array.dtype


def _element(number: types.Type) -> ir.Type:
    return Lanes(number, 1).vector.element


def _data(context, builder, array, value, number):
    """Return a pointer to an array's first element."""
    data = context.make_array(array)(context, builder, value).data
    return builder.bitcast(data, _element(number).as_pointer())


def _pointers(builder, data, index, number, width):
    """Return the addresses of elements, a vector of pointers."""
    each = GEPInstr(builder.block, data, [index], False, "", source_etype=_element(number))
    each.type = ir.VectorType(ir.PointerType(), width)
    builder._insert(each)
    return each


@intrinsic
def gather(typingctx, array, index, mask, otherwise):
    """Return the elements of an array that each lane asks for; where the mask is off, otherwise.

    Records of 4 or 8 bytes are returned as their bits, uint32 or uint64. ``index``: int32, >= 0.
    """
    lanes = Lanes(_number(array), index.width)

    def emit(context, builder, sig, args):
        data = _data(context, builder, array, args[0], lanes.number)
        places = _pointers(builder, data, args[1], lanes.number, lanes.width)
        kind = ir.FunctionType(
            lanes.vector, [places.type, I32, lanes.mask.vector, lanes.vector], False
        )
        function = llvms_own(builder, f"llvm.masked.gather.{suffix(lanes)}.v{lanes.width}p0", kind)
        align = I32(lanes.number.bitwidth // 8)
        return builder.call(function, [places, align, args[2], args[3]])

    return lanes(array, index, lanes.mask, lanes), emit


@plain(gather)
def _gather(array, index, mask, otherwise):
    return np.where(mask, array[index], otherwise)


@intrinsic
def scatter(typingctx, array, index, lanes, mask):
    """Write lanes to the elements that each asks for where the mask holds; no two to the same."""

    def emit(context, builder, sig, args):
        data = _data(context, builder, array, args[0], lanes.number)
        places = _pointers(builder, data, args[1], lanes.number, lanes.width)
        kind = ir.FunctionType(
            ir.VoidType(), [lanes.vector, places.type, I32, lanes.mask.vector], False
        )
        name = f"llvm.masked.scatter.{suffix(lanes)}.v{lanes.width}p0"
        align = I32(lanes.number.bitwidth // 8)
        builder.call(llvms_own(builder, name, kind), [args[2], places, align, args[3]])
        return context.get_dummy_value()

    return types.void(array, index, lanes, lanes.mask), emit


@plain(scatter)
def _scatter(array, index, lanes, mask):
    array[index[mask]] = lanes[mask]


@intrinsic(prefer_literal=True)
def load(typingctx, array, start, width):
    """Return W neighbours from element ``start`` of an array on."""
    lanes = Lanes(array.dtype, width.literal_value)

    def emit(context, builder, sig, args):
        data = _data(context, builder, array, args[0], lanes.number)
        place = builder.gep(data, [args[1]], source_etype=_element(lanes.number))
        vector = builder.bitcast(place, lanes.vector.as_pointer())
        return builder.load(vector, align=lanes.number.bitwidth // 8)

    return lanes(array, types.intp, width), emit


@plain(load)
def _load(array, start, width):
    return array[start : start + width]


@intrinsic
def save(typingctx, array, start, lanes):
    """Write lanes to W neighbours from element ``start`` of an array on."""

    def emit(context, builder, sig, args):
        data = _data(context, builder, array, args[0], lanes.number)
        place = builder.gep(data, [args[1]], source_etype=_element(lanes.number))
        vector = builder.bitcast(place, lanes.vector.as_pointer())
        builder.store(args[2], vector, align=lanes.number.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), emit


@plain(save)
def _save(array, start, lanes):
    array[start : start + len(lanes)] = lanes


@intrinsic
def prefetch(typingctx, array, index, offset):
    """Ask for the cache line ``offset`` bytes behind the start of an array's element."""

    def emit(context, builder, sig, args):
        data = context.make_array(array)(context, builder, args[0]).data
        size = context.get_abi_sizeof(context.get_data_type(array.dtype))
        if isinstance(array.dtype, types.Record):
            size = array.dtype.size
        data = builder.bitcast(data, ir.IntType(8).as_pointer())
        behind = builder.add(builder.mul(args[1], I64(size)), args[2])
        place = builder.gep(data, [behind], source_etype=ir.IntType(8))
        kind = ir.FunctionType(ir.VoidType(), [ir.PointerType(), I32, I32, I32])
        builder.call(llvms_own(builder, "llvm.prefetch.p0", kind), [place, I32(0), I32(3), I32(1)])
        return context.get_dummy_value()

    return types.void(array, types.int64, types.int64), emit


@plain(prefetch)
def _prefetch(array, index, offset):
    """Nothing of it is seen."""


@intrinsic
def prefetch_either(typingctx, test, one, other, index, offset):
    """Do `prefetch` of an element of the one array where a test holds, else of the other."""

    def emit(context, builder, sig, args):
        places = []
        for array, value in zip(sig.args[1:3], args[1:3], strict=True):
            data = context.make_array(array)(context, builder, value).data
            behind = builder.mul(args[3], I64(array.dtype.size))
            data = builder.bitcast(data, ir.IntType(8).as_pointer())
            places.append(builder.gep(data, [behind], source_etype=ir.IntType(8)))
        place = builder.select(args[0], *places)
        place = builder.gep(place, [args[4]], source_etype=ir.IntType(8))
        kind = ir.FunctionType(ir.VoidType(), [ir.PointerType(), I32, I32, I32])
        builder.call(llvms_own(builder, "llvm.prefetch.p0", kind), [place, I32(0), I32(3), I32(1)])
        return context.get_dummy_value()

    return types.void(types.boolean, one, other, types.int64, types.int64), emit


@plain(prefetch_either)
def _prefetch_either(test, one, other, index, offset):
    """Nothing of it is seen."""
