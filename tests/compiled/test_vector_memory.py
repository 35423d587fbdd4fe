"""Each intrinsic against its plain form, in one generated module."""

import inspect

import numpy as np
import pytest

from rtbench.compiled import vector_bits, vector_memory
from rtbench.compiled.instantiate import instantiate
from rtbench.compiled.vector_memory import PLAIN, digest, imports
from rtbench.trees import leaves
from rtbench.trees.nodes import NODE

WIDTH = 16
INTRINSICS = sorted(function.__name__ for function in PLAIN)
RNG = np.random.default_rng(1)


def made(entry, signature):
    return instantiate(
        entry,
        signature=signature,
        constants={"NODE": leaves.NODE_SOURCE, "WIDTH": str(WIDTH), "MEMORY": repr(digest())},
        forceinline=True,
        imports=imports(INTRINSICS) + "\nfrom rtbench.compiled.vector_functions import spread",
    ).call


BY_PLACE = """def by_place(nodes, numbers, places, bits, words, singles, doubles, whole):
    at, mask = load(places, 0, WIDTH), mask_of(bits[0], WIDTH)
    word = gather(nodes, at, mask, spread(np.uint64(7), WIDTH))
    save(words, 0, word)
    number = gather(numbers, at, mask, load(numbers, 1, WIDTH))
    save(singles, 0, number)
    scatter(singles, at, number, mask)
    save(singles, 64, compressed(number, mask))
    save(singles, 80, float_of_bits(high_half(word)))
    save(singles, 96, as_single(as_double(number)))
    save(singles, 112, as_single(load(doubles, 0, WIDTH)))
    save(doubles, 16, as_double(number))
    save(doubles, 32, as_double(load(doubles, 0, WIDTH)))
    whole[0] = how_many(mask)
    whole[1] = lowest_bit(bits[0])
    whole[2] = bits_of(mask)
    prefetch(nodes, 5, 64)
"""
OF_BITS = """def of_bits(given, found, words):
    one, other = load(given, 0, WIDTH), load(given, WIDTH, WIDTH)
    save(found, 0, bits_and(one, np.uint32(0xFF0F)))
    save(found, 16, bits_or(one, other))
    save(found, 32, shifted_right(one, np.uint32(3)))
    save(found, 48, shifted_left(one, np.uint32(3)))
    both = joined_halves(one, other)
    save(words, 0, both)
    save(found, 64, low_half(both))
    save(found, 80, high_half(both))
"""

OF_FLOATS = """def of_floats(nodes, given, found, whole):
    numbers = load(given, 0, WIDTH)
    save(found, 0, halves_swapped(numbers))
    save(found, 16, told_apart(numbers))
    save(found, 32, descending(numbers))
    save(whole, 0, truncated(numbers))
    prefetch_either(True, nodes, nodes, 5, 64)
"""


def by_name(name):
    return next(each for function, each in PLAIN.items() if function.__name__ == name)


@pytest.mark.parametrize("bits", [0b1, 0b1010110, 0xFFFF, 0x8000])
def test_lanes_by_place(bits):
    call = made(
        BY_PLACE,
        "void(NODE[::1], float32[::1], int32[::1], uint32[::1], uint64[::1], float32[::1], "
        "float64[::1], int64[::1])",
    )
    nodes = np.zeros(64, NODE)
    nodes["link"], nodes["split"] = RNG.integers(1 << 32, size=64), RNG.normal(size=64)
    numbers = RNG.normal(size=64).astype(np.float32)
    places = RNG.permutation(64)[:WIDTH].astype(np.int32)
    words, singles = np.zeros(WIDTH, np.uint64), np.zeros(128, np.float32)
    doubles, whole = RNG.normal(size=48) * 1e39, np.zeros(3, np.int64)
    doubles[3] = np.nan
    call(nodes, numbers, places, np.array([bits], np.uint32), words, singles, doubles, whole)

    mask = by_name("mask_of")(bits, WIDTH)
    word = by_name("gather")(nodes.view(np.uint64), places, mask, np.uint64(7))
    np.testing.assert_array_equal(words, word)
    number = by_name("gather")(numbers, places, mask, by_name("load")(numbers, 1, WIDTH))
    expected = np.zeros(128, np.float32)
    by_name("save")(expected, 0, number)
    by_name("scatter")(expected, places, number, mask)
    by_name("save")(expected, 64, by_name("compressed")(number, mask))
    by_name("save")(expected, 80, by_name("float_of_bits")(by_name("high_half")(word)))
    by_name("save")(expected, 96, number)
    by_name("save")(expected, 112, by_name("as_single")(doubles[:WIDTH]))
    np.testing.assert_array_equal(singles, expected)
    np.testing.assert_array_equal(doubles[16:32], by_name("as_double")(number))
    np.testing.assert_array_equal(doubles[32:], doubles[:16])
    told = by_name("how_many")(mask), by_name("lowest_bit")(bits), by_name("bits_of")(mask)
    np.testing.assert_array_equal(whole, told)
    assert told == (bin(bits).count("1"), (bits & -bits).bit_length() - 1, bits)


def test_bits_of_lanes():
    call = made(OF_BITS, "void(uint32[::1], uint32[::1], uint64[::1])")
    given = RNG.integers(1 << 32, size=32, dtype=np.uint32)
    found, words = np.zeros(112, np.uint32), np.zeros(WIDTH, np.uint64)
    call(given, found, words)
    one, other = given[:16], given[16:]
    both = by_name("joined_halves")(one, other)
    np.testing.assert_array_equal(words, both)
    np.testing.assert_array_equal(both, one + other.astype(np.uint64) * 2**32)
    for place, expected in (
        (0, by_name("bits_and")(one, np.uint32(0xFF0F))),
        (16, by_name("bits_or")(one, other)),
        (32, by_name("shifted_right")(one, np.uint32(3))),
        (48, by_name("shifted_left")(one, np.uint32(3))),
        (64, by_name("low_half")(both)),
        (80, by_name("high_half")(both)),
    ):
        np.testing.assert_array_equal(found[place : place + WIDTH], expected)


def test_of_floats():
    call = made(OF_FLOATS, "void(NODE[::1], float32[::1], float32[::1], int32[::1])")
    given = np.exp(RNG.normal(size=WIDTH)).astype(np.float32)
    given[[3, 7, 9]] = given[2]
    found, whole = np.zeros(48, np.float32), np.zeros(WIDTH, np.int32)
    call(np.zeros(64, NODE), given, found, whole)
    names = ("halves_swapped", "told_apart", "descending")
    np.testing.assert_array_equal(found, np.concatenate([by_name(each)(given) for each in names]))
    np.testing.assert_array_equal(whole, by_name("truncated")(given))
    assert len(set(found[16:32])) == WIDTH


def test_shifted_right_brings_zeros_in():
    """Also of lanes that have a sign."""
    call = made(
        "def shift(given, found):\n"
        "    save(found, 0, shifted_right(load(given, 0, WIDTH), np.int32(2)))\n"
        "    save(found, 16, signed(shifted_right(load(given.view(np.uint32), 0, WIDTH), "
        "np.uint32(2))))\n",
        "void(int32[::1], int32[::1])",
    )
    given, found = RNG.integers(-(1 << 31), 1 << 31, size=WIDTH, dtype=np.int32), np.zeros(32, "i4")
    call(given, found)
    expected = by_name("signed")(by_name("shifted_right")(given, np.uint32(2)))
    np.testing.assert_array_equal(found, np.tile(expected, 2))
    assert (found > 0).all()


def test_every_intrinsic_has_a_plain_form_and_is_tested():
    modules = vars(vector_memory) | vars(vector_bits)
    every = {name for name, each in modules.items() if hasattr(each, "_defn")}
    assert set(INTRINSICS) <= every
    # The code of a plain function is compared with; that of the intrinsic is run in one of these.
    written = BY_PLACE + OF_BITS + OF_FLOATS + inspect.getsource(test_shifted_right_brings_zeros_in)
    here = vector_memory.__name__, vector_bits.__name__
    ours = {name for name in every if modules[name].__module__ in here}
    assert ours == set(INTRINSICS)
    assert not [name for name in INTRINSICS if f"{name}(" not in written]
