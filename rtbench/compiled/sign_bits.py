"""What a compiled kernel does to a number's sign bit: one instruction where plain Python branches.

`rtbench.kernels.endings.flipped` as a choice costs a comparison, a mask and a masked move, which
made a moved division look dear; Havel 2008, Text 9, takes the bits for integers likewise.
"""

from __future__ import annotations

from llvmlite import ir
from numba.extending import intrinsic


@intrinsic
def flipped(typingctx, x, sign):
    """Return x, its sign bit changed where that of ``sign`` is set."""

    def emit(context, builder, signature, arguments):
        value, other = arguments
        width = 32 if isinstance(value.type, ir.FloatType) else 64
        bits = ir.IntType(width)
        flip = builder.and_(builder.bitcast(other, bits), bits(1 << (width - 1)))
        return builder.bitcast(builder.xor(builder.bitcast(value, bits), flip), value.type)

    return x(x, sign), emit
