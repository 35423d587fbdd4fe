"""Loops that do nothing but one thing, as fast as compiled code can: the machine's peaks.

Each works on many independent chains, so that no operation waits for the one before it and the
throughput is seen, not the latency. The scalar loop carries its chains through the loop, which
LLVM does not turn into vector code without leave to reorder; the vector loop takes its chains
from an array, which it does.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.compiled.machine_code import instructions

OPERATIONS = ("add", "mul", "both", "div", "fma")
FORMS = ("scalar", "vector")
PRECISIONS = ("float32", "float64")
# Operations of each chain between its load and its store: the more, the less these two matter.
STEPS = {"scalar": 8, "vector": 32}
LINE = 64  # bytes
PAGE = 4096
# Bytes of a chain's row; one line more than a power of two, or rows would share few cache sets.
ROW = 1024 + LINE

_STEP = {
    "add": "{p} = {p} + term",
    "mul": "{p} = {p} * factor",
    "div": "{p} = {p} / factor",
    "fma": "{p} = {p} * factor + term",
}
_X86 = re.compile(r"v?(?:add|mul|div|fn?m(?:add|sub)\d*)p[sd]\s")
_ARM = re.compile(r"f(?:add|mul|div|mla|madd)\s+v\d+\.")
_REGISTERS = {"zmm": 512, "ymm": 256, "xmm": 128}


@dataclass(frozen=True)
class Arithmetic:
    """A loop of arithmetic.

    Attributes
    ----------
    instance : Instance
        ``call(values, term, factor, repetitions)`` applies the operation ``steps`` times in each
        repetition to each of the values.
    values : int
        Length of the array.
    steps : int
        Operations a value and repetition.
    flops : int
        Floating-point operations a repetition; a fused multiply-add is two.
    """

    instance: Instance
    values: int
    steps: int
    flops: int


def arithmetic(operation: str, precision: str, form: str, chains: int) -> Arithmetic:
    """Return a compiled loop of one operation.

    Parameters
    ----------
    operation : str
        add, mul, both (half of the chains add, half multiply), div, fma.
    precision : str
        float32 or float64.
    form : str
        scalar, or vector: written so that the compiler may use vector registers.
    chains : int
        Independent chains; they and two constants should fit into the registers.

    Returns
    -------
    Arithmetic
    """
    row = ROW // np.dtype(precision).itemsize if form == "vector" else 1
    steps = STEPS[form]
    instance = instantiate(
        _source(operation, form, chains, steps, row),
        signature=f"void({precision}[::1], {precision}, {precision}, int64)",
        title=f"{operation} in {precision}, {form}: {chains} chains of {steps} operations",
        flags="contract" if operation == "fma" else "strict",
    )
    flops = chains * row * steps * (2 if operation == "fma" else 1)
    return Arithmetic(instance, chains * row, steps, flops)


def _source(operation: str, form: str, chains: int, steps: int, row: int) -> str:
    chain = [f"p{number}" for number in range(chains)]
    each = [
        _STEP[("add", "mul")[number % 2] if operation == "both" else operation].format(p=p)
        for number, p in enumerate(chain)
    ]
    place = "i + {}" if form == "vector" else "{}"
    at = [f"values[{place.format(number * row)}]" for number in range(chains)]
    load = [f"{p} = {where}" for p, where in zip(chain, at, strict=True)]
    store = [f"{where} = {p}" for p, where in zip(chain, at, strict=True)]
    head = [f"def {form}_{operation}(values, term, factor, repetitions):"]
    again = ["    for _ in range(repetitions):"]
    if form == "scalar":
        lines = [*head, *_indented(load, 1), *again, *_indented(each * steps, 2)]
        return "\n".join([*lines, *_indented(store, 1), ""])
    inner = _indented([f"for i in range({row}):"], 2)
    body = _indented([*load, *each * steps, *store], 3)
    return "\n".join([*head, *again, *inner, *body, ""])


def _indented(lines: list[str], depth: int) -> list[str]:
    return ["    " * depth + line for line in lines]


def read_twice(values, repetitions):
    # Two streams of whole numbers, whose order is free: vector loads and nothing that waits.
    half = values.shape[0] // 2
    first = np.uint64(0)
    second = np.uint64(0)
    for _ in range(repetitions):
        for i in range(half):
            first ^= values[i]
            second ^= values[i + half]
        # Else reading an even number of times would give zero, and might be left out.
        first += second
    return first


def reading() -> Callable[[np.ndarray, int], int]:
    """Return a compiled loop that reads an array (uint64, (N,)) a number of times."""
    return reading_instance().call


def reading_instance() -> Instance:
    """Return the loop of `reading` as an instance, with its assembly."""
    return instantiate(
        read_twice,
        signature="uint64(uint64[::1], int64)",
        title="reading: every byte of an array, again and again",
    )


def buffer(size: int) -> np.ndarray:
    """Return an array of a number of bytes that begins on a page: no load crosses a line.

    Parameters
    ----------
    size : int
        Bytes, a multiple of 8.

    Returns
    -------
    array of uint64, shape (size // 8,)
        Written once, so that it has memory of its own.
    """
    room = np.empty(size + PAGE, dtype=np.uint8)
    offset = -room.ctypes.data % PAGE
    found = room[offset : offset + size].view(np.uint64)
    found[:] = np.arange(len(found), dtype=np.uint64)
    return found


def register_bits(assembly: str) -> int:
    """Return the width of the widest registers in which a loop computes.

    Parameters
    ----------
    assembly : str
        Of an instance.

    Returns
    -------
    int
        Bits; 0 where its arithmetic is scalar.
    """
    widest = 0
    for line in instructions(assembly):
        if _X86.match(line):
            widest = max(widest, *(bits for name, bits in _REGISTERS.items() if name in line))
        elif _ARM.match(line):
            widest = max(widest, 128)
    return widest
