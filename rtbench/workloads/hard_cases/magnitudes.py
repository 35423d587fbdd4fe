"""The same clear hits and misses with directions of every length: what an absolute epsilon does."""

from __future__ import annotations

import numpy as np

from rtbench.accuracy.cases import Cases
from rtbench.workloads.hard_cases.assembling import answered
from rtbench.workloads.hard_cases.families import Family
from rtbench.workloads.hard_cases.geometry import FLOAT32, Format, Geometry, Random, alone
from rtbench.workloads.hard_cases.scales import ordinary

POWERS = range(-20, 21)
FAMILY = "direction_lengths"


def direction_lengths(seed: int = 1, pairs: int = 60) -> Cases:
    """Return ordinary rays and triangles, none near an edge, with |dir| from 1e-20 to 1e20.

    Parameters
    ----------
    seed : int
        At least 0.
    pairs : int
        Of each length; the same ones but for the length.

    Returns
    -------
    Cases
        float32 numbers; the difficulty is log10 of |dir|, pairs in the same order for each.
    """
    family = Family(FAMILY, "log10 of |dir|", "length of direction", _draw)
    random = np.random.default_rng([int(seed), len(POWERS)])
    return answered({family: family.draw(random, FLOAT32, pairs)})


def _draw(random: Random, form: Format, n: int) -> Geometry:
    triangles, origins, directions = ordinary(random, form, n)
    powers = np.repeat(np.array(POWERS, np.float64), n)
    times = (len(POWERS), 1)
    scaled = form.round(10 ** powers[:, None] * np.tile(directions, times))
    return alone(np.tile(triangles, (*times, 1)), np.tile(origins, times), scaled, powers)
