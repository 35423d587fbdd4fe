"""The random numbers of the C library that Microsoft's compilers of 2007 came with.

state = state * 214013 + 2531011 mod 2^32, and rand() = (state >> 16) & 0x7fff after each step. The
lower 31 bits of the state decide the output, so that the sequence repeats after 2^31 numbers.
"""

from functools import cache

import numpy as np

MULTIPLIER = 214013
INCREMENT = 2531011
RAND_MAX = 0x7FFF

BLOCK = 1 << 14


@cache
def _jumps() -> tuple[np.ndarray, np.ndarray]:
    """Return a^k and c (a^(k-1) + ... + 1) mod 2^32 for k = 1 ... BLOCK: state_k = a_k s + c_k."""
    factors, terms = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.uint32)
    factor, term = 1, 0
    for k in range(BLOCK):
        factor = factor * MULTIPLIER % 2**32
        term = (term * MULTIPLIER + INCREMENT) % 2**32
        factors[k], terms[k] = factor, term
    return factors, terms


def rand(state: int, n: int) -> tuple[np.ndarray, int]:
    """Return the next n numbers of rand().

    Parameters
    ----------
    state : int
        The state before the first number, 0 to 2^32 - 1; ``srand(seed)`` makes it the seed.
    n : int
        How many.

    Returns
    -------
    numbers : (n,) uint32 array
        0 to 32767.
    state : int
        The state after the last number.
    """
    factors, terms = _jumps()
    numbers = np.empty(n, np.uint32)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        states = factors[:count] * np.uint32(state) + terms[:count]
        numbers[start : start + count] = (states >> np.uint32(16)) & np.uint32(RAND_MAX)
        state = int(states[-1])
    return numbers, state
