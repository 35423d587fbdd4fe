"""Which kernel costs least in all, preparing included, over triangles and rays per triangle.

A kernel costs a ns a test and p ns once for each triangle that it prepares; where each triangle is
tested by n rays, that is a + p / n a test: a straight line in 1 / n for each kernel. The cheapest
kernels, from n = infinity down, are the lower envelope of these lines.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rtbench.records import derive, statistics
from rtbench.records.tabular import plain
from rtbench.report import cells

if TYPE_CHECKING:
    from rtbench.records.run import Run

_CHUNK = 250  # resamples of a preparation are no more than its draws need


class Stretch(NamedTuple):
    """From how many to how many rays per triangle a kernel costs least (infinity at the end)."""

    kernel: str
    start: float
    end: float


@dataclass(frozen=True)
class Costs:
    """The kernels of one precision and hit ratio.

    Attributes
    ----------
    precision : str or None
    density : float
        The soup's hit ratio.
    kernels : list of str
        Those measured at every size.
    sizes : ndarray of float, (S,)
        Numbers of triangles, growing.
    test, preparation : ndarray of float, (K, S)
        ns a test, and ns to prepare a triangle, 0 where nothing is stored.
    test_draws, preparation_draws : ndarray of float, (K, S, D), or None
        What resampling gives for them; None where a cell has one process alone.
    """

    precision: str | None
    density: float
    kernels: list[str]
    sizes: np.ndarray
    test: np.ndarray
    preparation: np.ndarray
    test_draws: np.ndarray | None
    preparation_draws: np.ndarray | None

    def at(self, sizes: np.ndarray) -> "Costs":
        """Return the costs at other sizes, straight lines between those measured over log T."""
        there = np.log(sizes)
        known = np.log(self.sizes)

        def between(values: np.ndarray | None) -> np.ndarray | None:
            if values is None:
                return None
            right = np.clip(np.searchsorted(known, there), 1, max(len(known) - 1, 1))
            if len(known) == 1:
                return np.repeat(values, len(sizes), axis=1)
            part = np.clip((there - known[right - 1]) / (known[right] - known[right - 1]), 0, 1)
            part = part.reshape(1, -1, *([1] * (values.ndim - 2)))
            return values[:, right - 1] * (1 - part) + values[:, right] * part

        return Costs(
            self.precision,
            self.density,
            self.kernels,
            np.asarray(sizes, float),
            between(self.test),
            between(self.preparation),
            between(self.test_draws),
            between(self.preparation_draws),
        )

    def stretches(self, place: int) -> list[Stretch]:
        """Return who costs least at a size, from few rays per triangle to infinitely many.

        Parameters
        ----------
        place : int
            Index of the size.

        Returns
        -------
        list of Stretch
            The first starts at 0 (preparing costs most), each starts where the one before ends.
        """
        a, p = self.test[:, place], self.preparation[:, place]
        # Towards n = 0 the least preparation wins, among equals the fastest.
        now = int(np.lexsort((a, p))[0])
        start, found = 0.0, []
        while True:
            # Whoever is faster takes over at n = (p - p now) / (a now - a): first, the least n.
            faster = np.flatnonzero(a < a[now])
            if not len(faster):
                return [*found, Stretch(self.kernels[now], start, float("inf"))]
            turns = (p[faster] - p[now]) / (a[now] - a[faster])
            first = np.lexsort((a[faster], turns))[0]
            if turns[first] > start:
                found.append(Stretch(self.kernels[now], start, float(turns[first])))
                start = float(turns[first])
            now = int(faster[first])

    def unresolved(self, rays: np.ndarray) -> np.ndarray | None:
        """Return where the cheapest kernel is not told from another.

        Parameters
        ----------
        rays : ndarray of float, (N,)
            Rays per triangle.

        Returns
        -------
        ndarray of bool, (S, N), or None
            True where some other kernel is cheaper in more than 2.5 % of the resamples; None
            without resamples.
        """
        if self.test_draws is None:
            return None
        found = np.zeros((len(self.sizes), len(rays)), bool)
        for column, n in enumerate(rays):
            cost = self.test + self.preparation / n
            draws = self.test_draws + self.preparation_draws / n
            best = np.argmin(cost, axis=0)
            own = draws[best, np.arange(len(self.sizes))]
            cheaper = (draws < own).mean(axis=2)
            found[:, column] = (cheaper > 0.025).any(axis=0)
        return found


def costs_of(run: "Run", resamples: bool = True) -> list[Costs]:
    """Return what every kernel of a run costs, a `Costs` a precision and hit ratio.

    Parameters
    ----------
    run : Run
        A run of the experiment ``break_even``: its summary, and ``preparation`` of its run.json.
    resamples : bool
        Whether the draws are wanted; they take a second.

    Returns
    -------
    list of Costs
        A kernel that stores something is left out where its preparation was not timed, and any
        that lacks a size.
    """
    frame = cells.times_of(run)
    rows = run.info.get("preparation") or []
    prepared = {(row["kernel"], row["precision"], row["scene"]): row for row in rows}
    methods = run.info.get("methods") or {}
    draws = _draws(run) if resamples else {}
    found = []
    for group, block in cells.groups(frame, ("precision", "density")):
        sizes = sorted(cells.values(block, "scene"))
        test, preparation, test_draws, preparation_draws, kernels = [], [], [], [], []
        for kernel in cells.kernels(block):
            mine = cells.where(block, kernel=kernel)
            times = {row["scene"]: row["ns_per_test"] for row in mine.to_dict("records")}
            stores = methods.get(kernel, {}).get("stored", "none") != "none"
            made = [prepared.get((kernel, group["precision"], size)) for size in sizes]
            if len(times) < len(sizes) or (stores and None in made):
                continue
            kernels.append(kernel)
            test.append([times[size] for size in sizes])
            preparation.append([one["ns_per_triangle"] if one else 0.0 for one in made])
            keys = [(kernel, group["precision"], group["density"], size) for size in sizes]
            test_draws.append([draws.get(key) for key in keys])
            preparation_draws.append([_prepared_draws(one) for one in made])
        if not kernels:
            continue
        known = all(one is not None for line in test_draws for one in line)
        found.append(
            Costs(
                group["precision"],
                group["density"],
                kernels,
                np.array(sizes, float),
                np.array(test, float),
                np.array(preparation, float),
                np.array(test_draws) if known else None,
                np.array(preparation_draws) if known else None,
            )
        )
    return found


def _draws(run: "Run") -> dict[tuple, np.ndarray]:
    """Return the resampled times of every cell; of one seed, so that cells are drawn together."""
    columns = ["kernel", "precision", "density", "scene", "outcome"]
    found = {}
    if run.published or not len(run.samples):
        return found
    seed = statistics.seed_of(run.name)
    for key, samples in derive.cells(run, columns).items():
        estimate = statistics.median(derive.times(samples), seed, _CHUNK)
        if estimate.draws is not None:
            found[tuple(map(plain, key[:4]))] = estimate.draws
    return found


def _prepared_draws(row: dict | None) -> np.ndarray:
    """Return resampled medians of a preparation, of its samples or its interval."""
    if row is None:
        return np.zeros(_CHUNK)
    random = np.random.default_rng(0)
    taken = np.array(row.get("samples") or [])
    if len(taken) > 1:
        return np.median(taken[random.integers(0, len(taken), (_CHUNK, len(taken)))], axis=1)
    low, high = row.get("ci_low"), row.get("ci_high")
    middle = row["ns_per_triangle"]
    if low is None or high is None:
        return np.full(_CHUNK, middle)
    return middle + random.normal(0, max(high - low, 0) / (2 * 1.96), _CHUNK)
