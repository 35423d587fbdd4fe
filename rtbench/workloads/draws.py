"""Items of fifteen random coordinates, from a seeded generator, as the thesis's program drew them.

An item is orig, end, v0, v1, v2, each x, y, z, in [0, 1] and float32.
"""

import numbers
from collections.abc import Callable

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.workloads import msvc

GENERATORS = ("pcg64", "msvc")

COORDINATES = 15
ORIG, END, V0, V1, V2 = (slice(3 * k, 3 * k + 3) for k in range(5))
TRIANGLE = slice(6, 15)


def items(generator: str, seed: int) -> Callable[[int], np.ndarray]:
    """Return a function that draws the next items of a generator.

    Parameters
    ----------
    generator : str
        ``pcg64``: numpy's PCG64 with this seed, coordinates k / 2^24 in [0, 1).
        ``msvc``: the C library of 2007, coordinates rand() / 32767 in [0, 1].
    seed : int
        Not negative; for ``msvc`` the state before the first number, at most 2^32 - 1.

    Returns
    -------
    callable
        ``draw(n)`` returns the next n items, an (n, 15) float32 array. How the items are asked
        for in portions makes no difference to them.

    Raises
    ------
    RtbenchError
        For an unknown generator or a seed that it cannot take.
    """
    if generator not in GENERATORS:
        raise RtbenchError(unknown("generator", str(generator), GENERATORS))
    largest = 2**32 - 1 if generator == "msvc" else None
    if not isinstance(seed, numbers.Integral) or seed < 0 or (largest and seed > largest):
        allowed = f"0 to {largest}" if largest else "0 or greater"
        raise RtbenchError(f"seed {seed!r} is not allowed for {generator} (allowed: {allowed})")
    if generator == "pcg64":
        source = np.random.Generator(np.random.PCG64(int(seed)))
        return lambda n: source.random((n, COORDINATES), dtype=np.float32)

    state = int(seed)

    def draw(n: int) -> np.ndarray:
        nonlocal state
        drawn, state = msvc.rand(state, n * COORDINATES)
        coordinates = drawn.astype(np.float32)
        coordinates /= np.float32(msvc.RAND_MAX)
        return coordinates.reshape(n, COORDINATES)

    return draw


def draw(generator: str, seed: int, n: int) -> np.ndarray:
    """Draw the first n items of a generator.

    Parameters
    ----------
    generator, seed
        As for `items`.
    n : int
        How many.

    Returns
    -------
    (n, 15) float32 array
        orig, end, v0, v1, v2 of each item, in the order in which they were drawn.

    Raises
    ------
    RtbenchError
        As `items`.
    """
    return items(generator, seed)(n)


def points(items: np.ndarray) -> np.ndarray:
    """Return (N, 15) items as (5, N, 3) points: orig, end, v0, v1, v2; a view."""
    return items.reshape(-1, 5, 3).transpose(1, 0, 2)


def items_of(points: np.ndarray) -> np.ndarray:
    """Return (5, N, 3) points as (N, 15) items."""
    return points.transpose(1, 0, 2).reshape(-1, COORDINATES)
