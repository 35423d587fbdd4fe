"""Pairs of a random triangle and its own random line, as they are or at a chosen density of hits.

Which pair hits is decided without any kernel (``accuracy``), and which pairs are safe to keep at a
density in ``safety``.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rtbench.accuracy import certified
from rtbench.accuracy.exact import HIT, MISS
from rtbench.compiled import preparation
from rtbench.errors import RtbenchError
from rtbench.kernels.stored_plane import stored_plane
from rtbench.workloads import draws, safety

PORTION = 1 << 16
"""Items handled at once: their arrays fit in a cache, and no result depends on it."""

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Pairs:
    """N triangles, each with its own line.

    Attributes
    ----------
    v0, v1, v2 : (N, 3) float32 arrays
        Vertices, in [0, 1].
    orig, end : (N, 3) float32 arrays
        Two points of the line, in [0, 1].
    dir : (N, 3) float32 array
        end - orig divided by its length.
    normal : (N, 3) float32 array
        (v1 - v0) x (v2 - v0) divided by its length; NaN for a triangle without area.
    d : (N,) float32 array
        -(v0 . normal).
    i0, i1, i2 : (N,) uint32 arrays
        The axis on which the normal is greatest in magnitude (the first of equals), and the two
        others, i1 < i2.
    hit : (N,) bool array
        Whether the line orig + t dir meets the closed triangle, t < 0 included; exact.
    t, u, v : (N,) float64 arrays
        Where, by `certified.reference`; NaN on a miss.
    generator, seed, density
        What they were drawn by; density None: as drawn.
    drawn : int
        Items drawn, up to the last one that was kept.
    redrawn : dict of str to int
        Items refused, by reason (edge, parallel, margin; an item counts for the first it meets).
    surplus : int
        Items that could be kept, but of whose kind (hit or miss) there were enough.
    """

    v0: np.ndarray
    v1: np.ndarray
    v2: np.ndarray
    orig: np.ndarray
    end: np.ndarray
    dir: np.ndarray
    normal: np.ndarray
    d: np.ndarray
    i0: np.ndarray
    i1: np.ndarray
    i2: np.ndarray
    hit: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    generator: str
    seed: int
    density: float | None
    drawn: int
    redrawn: dict[str, int]
    surplus: int

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.hit)

    @cached_property
    def digest(self) -> str:
        """SHA-256 (hex) of the bytes of v0, v1, v2, orig, end, dir, normal, d, i0, i1, i2, hit.

        Each array whole, in this order, in C order and little-endian.
        """
        sha = hashlib.sha256()
        for name in ("v0", "v1", "v2", "orig", "end", "dir", "normal", "d", "i0", "i1", "i2"):
            array = getattr(self, name)
            sha.update(np.ascontiguousarray(array, array.dtype.newbyteorder("<")))
        sha.update(self.hit.view(np.uint8))
        return sha.hexdigest()

    def ahead(self) -> "Pairs":
        """Return these pairs with every hit at t > 0: the lines that hit behind turned round.

        The line, and what hits, stay as they are; the direction and the end change sides.
        """
        behind = self.hit & (self.t < 0)
        dir, end = self.dir.copy(), self.end.copy()
        dir[behind] = -dir[behind]
        end[behind] = self.orig[behind] + (self.orig[behind] - end[behind])
        return replace(self, dir=dir, end=end, t=np.where(behind, -self.t, self.t))

    def on_planes(self) -> "Pairs":
        """Return these pairs with each origin moved along its line into the triangle's plane.

        What hits is what was hit, by far more than the rounding of the point; t is 0.
        """
        v0, v1, v2, orig, dir = (
            a.astype(np.float64) for a in (self.v0, self.v1, self.v2, self.orig, self.dir)
        )
        normal = np.cross(v1 - v0, v2 - v0)
        t = np.einsum("ij,ij->i", normal, v0 - orig) / np.einsum("ij,ij->i", normal, dir)
        point = (orig + t[:, None] * dir).astype(np.float32)
        return replace(self, orig=point, end=point + self.dir, t=np.where(self.hit, 0.0, self.t))


def random_pairs(
    n: int, generator: str = "pcg64", seed: int = 1, progress: Progress | None = None
) -> Pairs:
    """Return the first n pairs that a generator draws; nothing is redrawn.

    ``msvc`` from state 24660781 gives a million pairs on which moller1 (float32, no contraction)
    returns its codes exactly as often as table 4.5 of Blecha 2007 says. That state was found by
    searching all 2^31; some state matches by luck with a probability of about 0.6 to 2 %, and it
    is not proven to be the author's. Table 4.7 comes from other data.

    Parameters
    ----------
    n : int
        How many, at least 1.
    generator, seed
        As for `draws.items`.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Pairs
        In the order in which they were drawn.

    Raises
    ------
    RtbenchError
        If n, the generator or the seed is not allowed.
    """
    _check_count(n)
    draw = draws.items(generator, seed)
    kept = np.empty((5, n, 3), np.float32)
    hit = np.empty(n, bool)
    for start in range(0, n, PORTION):
        part = slice(start, min(start + PORTION, n))
        portion = draw(part.stop - start)
        kept[:, part] = draws.points(portion)
        hit[part] = certified.line_hits(*safety.lines(portion))
        _report(progress, part.stop / n)
    return _finish(
        kept,
        hit,
        generator=generator,
        seed=int(seed),
        density=None,
        drawn=n,
        redrawn=dict.fromkeys(safety.REASONS, 0),
        surplus=0,
    )


def pairs_at_density(
    n: int,
    density: float,
    generator: str = "pcg64",
    seed: int = 1,
    progress: Progress | None = None,
) -> Pairs:
    """Return n pairs of which exactly round(density n) hit, in shuffled order.

    A pair is kept only if its answer is safe: every component of the three edges has a magnitude
    of at least 1e-3, the cosine between direction and normal is more than 1e-5, and each of u, v,
    w = 1 - u - v is at least 1e-4 from 0 and from 1. All three are decided exactly.

    Parameters
    ----------
    n : int
        How many, at least 1.
    density : float
        Fraction of hits, 0 to 1. Halves of a pair are rounded to the even number.
    generator, seed
        As for `draws.items`. The seed also decides the order.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Pairs
        The first hits and the first misses that were drawn and could be kept, shuffled.

    Raises
    ------
    RtbenchError
        If an argument is not allowed, n pairs cannot have the density, or the generator does not
        give enough pairs of a kind.
    """
    _check_count(n)
    hits = hits_at_density(n, density)
    draw = draws.items(generator, seed)
    # A stream of its own, so that the order has nothing to do with the coordinates.
    place = np.random.Generator(np.random.PCG64([int(seed), 1])).permutation(n)
    empty = {HIT: place[:hits], MISS: place[hits:]}
    kept = np.empty((5, n, 3), np.float32)
    redrawn = dict.fromkeys(safety.REASONS, 0)
    drawn = surplus = 0
    # About 9 items are drawn for a hit; a generator that gives so few would never end.
    limit = 100 * n + 10_000
    while any(map(len, empty.values())):
        if drawn >= limit:
            missing = " and ".join(
                f"{len(places)} {kind}"
                for kind, places in zip(("hits", "misses"), empty.values(), strict=True)
                if len(places)
            )
            raise RtbenchError(
                f"generator {generator!r} with seed {seed} gave too few pairs: {missing} still "
                f"missing after {drawn} items (allowed: {limit} items for {n} pairs)"
            )
        portion = draw(min(PORTION, max(1024, 16 * n)))
        classes = safety.classify(portion)
        used = 0
        for kind, places in empty.items():
            if len(places):
                found = np.flatnonzero(classes == kind)[: len(places)]
                kept[:, places[: len(found)]] = draws.points(portion[found])
                empty[kind] = places[len(found) :]
                used = max(used, len(portion) if len(empty[kind]) else found[-1] + 1)
        drawn += int(used)
        for reason, kind in safety.REASONS.items():
            redrawn[reason] += int(np.count_nonzero(classes[:used] == kind))
        _report(progress, 1 - sum(map(len, empty.values())) / n)
    surplus = drawn - n - sum(redrawn.values())
    hit = np.zeros(n, bool)
    hit[place[:hits]] = True
    return _finish(
        kept,
        hit,
        generator=generator,
        seed=int(seed),
        density=float(density),
        drawn=drawn,
        redrawn=redrawn,
        surplus=surplus,
    )


def hits_at_density(n: int, density: float) -> int:
    """Return how many of n pairs hit at a density.

    Parameters
    ----------
    n : int
        How many pairs, at least 1.
    density : float
        0 to 1.

    Returns
    -------
    int
        round(density n).

    Raises
    ------
    RtbenchError
        If the density is outside 0 to 1 or not a number, or lies between 0 and 1 where n pairs
        only come to none or all.
    """
    if not 0 <= density <= 1:
        raise RtbenchError(f"density {density} is not allowed (allowed: 0 to 1)")
    hits = round(density * n)
    if hits in (0, n) and 0 < density < 1:
        inner = 1 / n if hits == 0 else (n - 1) / n
        near = [0.0 if hits == 0 else 1.0, inner] if n > 1 else [0.0, 1.0]
        raise RtbenchError(
            f"density {density} cannot be reached with {n} pairs: {hits} of them would hit "
            f"(nearest: {' and '.join(f'{x:.6g}' for x in sorted(near))})"
        )
    return hits


def _check_count(n: int) -> None:
    if n < 1:
        raise RtbenchError(f"number of pairs {n} is not allowed (allowed: 1 or more)")


def _report(progress: Progress | None, fraction: float) -> None:
    if progress is not None:
        progress(fraction)


def _finish(kept: np.ndarray, hit: np.ndarray, **told: object) -> Pairs:
    """Return the pairs of (5, n, 3) points, with all that is stored beside them."""
    n = len(hit)
    orig, end, v0, v1, v2 = kept
    dir = np.empty((n, 3), np.float32)
    stored = {"normal": np.empty((n, 3), np.float32), "d": np.empty(n, np.float32)}
    stored |= {name: np.empty(n, np.uint32) for name in ("i0", "i1", "i2")}
    t, u, v = (np.full(n, np.nan) for _ in range(3))
    for start in range(0, n, PORTION):
        part = slice(start, start + PORTION)
        triangles, origins, dir[part] = safety.lines(draws.items_of(kept[:, part]))
        corners = tuple(triangles[:, k] for k in range(3))
        plane = preparation.prepared(stored_plane, corners, *[np.float32] * 3)
        for name, out in stored.items():
            out[part] = plane[name]
        hits = np.flatnonzero(hit[part])
        found = certified.reference(triangles[hits], origins[hits], dir[part][hits])
        for out, values in zip((t, u, v), found[:3], strict=True):
            out[part][hits] = values
    points = {"v0": v0, "v1": v1, "v2": v2, "orig": orig, "end": end}
    return Pairs(**points, dir=dir, **stored, hit=hit, t=t, u=u, v=v, **told)
