"""Who measures what when: repetitions shared out over processes and rounds, cells interleaved."""

from __future__ import annotations

import numpy as np

PROCESSES = 5
ROUNDS = 5
# In repeat order the first test of each pair is mispredicted, which costs as much as five tests:
# 400 in a row make that 1 %.
ENOUGH_REPETITIONS = 400
ENOUGH_TESTS = 20_000  # about 0.1 ms: well above the clock's resolution and the call


def shares(total: int, parts: int) -> list[int]:
    """Share a whole number out over parts, as equal as whole numbers can be.

    >>> shares(10, 4)
    [3, 3, 2, 2]
    """
    least, more = divmod(total, parts)
    return [least + 1] * more + [least] * (parts - more)


def samples_for(
    repetitions: int, pairs: int, processes: int | None = None, rounds: int | None = None
) -> tuple[int, int]:
    """Choose over how many processes and rounds the repetitions are shared out.

    Parameters
    ----------
    repetitions : int
        Of each pair, over all samples of a cell.
    pairs : int
        The number of pairs of a cell.
    processes, rounds : int, optional
        As wished; what is not given is chosen: 5 processes of 5 rounds, fewer rounds (then
        fewer processes) where a sample would have too few repetitions or tests; fewer processes
        too where so many rounds as wished need more repetitions than there are.

    Returns
    -------
    (int, int)
        Processes and rounds; their product is never more than the repetitions, so that every
        sample has at least one.
    """
    enough = max(1, -(-ENOUGH_TESTS // pairs))
    most = max(1, repetitions // (rounds or 1))
    chosen_processes = processes or min(PROCESSES, most, max(1, repetitions // enough))
    chosen_processes = min(chosen_processes, repetitions)
    wished = rounds or min(
        ROUNDS, max(1, repetitions // (chosen_processes * max(enough, ENOUGH_REPETITIONS)))
    )
    return chosen_processes, max(1, min(wished, repetitions // chosen_processes))


def order(seed: int, process: int, turn: int, cells: int) -> list[int]:
    """Return the order of the cells in one round of one process.

    The order is rotated by one from round to round, and reshuffled (from the seed) once every
    cell has been at every place.
    """
    shuffles, rotation = divmod(turn, max(cells, 1))
    shuffled = np.random.default_rng([seed, process, shuffles]).permutation(cells)
    return np.roll(shuffled, -rotation).tolist()
