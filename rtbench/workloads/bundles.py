"""Packets of rays that spread over a chosen angle, aimed at the triangles of a soup.

A packet begins as one ray drawn as the soup's rays are, its axis. Lanes are turned away from it
about the soup's centre, which keeps each lane a ray drawn as the soup's rays are: the hit ratio
stays that of the set, whatever the angle.

- general: origin and direction are turned;
- parallel: the direction stays, only the origin's place across it is turned (seen from the centre,
  the targets of a packet spread over the angle);
- common: the origin stays, the direction is turned. Such rays soon leave the soup, so the origin is
  drawn towards it by a reach below 1, as much as keeps the hit ratio.

At angle 0 all lanes are the same ray: the limit of packets that never break up.
"""

import math
import numbers
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.workloads.nearest import nearest
from rtbench.workloads.scattered import draw_rays, stream
from rtbench.workloads.soup import Soup, decided

KINDS = ("general", "common", "parallel")

WIDEST = 90
"""Greatest opening angle, degrees."""
CLOSEST = 0.2
"""Distance of a common origin from the centre at reach 0: about where wide packets hit most."""
TRIALS = 2048, 256
"""Rays and triangles by which a reach is found."""
STEPS = 7
"""Halvings by which a reach is found."""


@dataclass(frozen=True, eq=False)
class Bundles:
    """P packets of W rays, each packet to be tested against all triangles of a soup.

    Attributes
    ----------
    kind : str
        general, common or parallel.
    packets, width : int
        P and W.
    angle : float
        The opening angle asked for, degrees: the greatest between two directions of a packet
        (parallel: between the places of two targets, seen from the soup's centre).
    reach : float
        How far from the centre common origins lie, against the soup's; 1 for other kinds.
    seed : int
        What they were drawn by.
    soup : Soup
        The triangles, with the P W rays as its rays, lane after lane: nearest triangles, hit ratio
        and so on are those of the packets' rays.
    """

    kind: str
    packets: int
    width: int
    angle: float
    reach: float
    seed: int
    soup: Soup

    @property
    def orig(self) -> np.ndarray:
        """Origins, (P, W, 3) float32; a view."""
        return self.soup.orig.reshape(self.packets, self.width, 3)

    @property
    def dir(self) -> np.ndarray:
        """Directions of length 1, (P, W, 3) float32; a view."""
        return self.soup.dir.reshape(self.packets, self.width, 3)

    @property
    def hit_ratio(self) -> float:
        """Share of all pairs of a ray and a triangle that hit; measured, exact."""
        return self.soup.hit_ratio

    @property
    def digest(self) -> str:
        """As `Soup.digest`, of the packets' rays."""
        return self.soup.digest


def bundles(
    kind: str,
    aim: Soup,
    packets: int = 64,
    width: int = 16,
    angle: float = 10.0,
    seed: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Bundles:
    """Return packets of rays aimed at a soup's triangles.

    Parameters
    ----------
    kind : str
        One of KINDS.
    aim : Soup
        Whose triangles; the hit ratio of its set is kept as far as the kind allows.
    packets, width : int
        How many packets, and rays in each, at least 1. The first two rays of a packet lie on
        opposite sides of its cone, the others anywhere in it, uniform in solid angle.
    angle : float
        Opening angle of a packet, 0 to 90 degrees.
    seed : int
        Not negative. The same packets, wider or narrower, for every angle.
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    Bundles

    Raises
    ------
    RtbenchError
        If an argument is not allowed.

    Source
    ------
    Havel 2008, 4.2.2.2 and 5.1.3, names the three kinds; the construction is ours.
    """
    if kind not in KINDS:
        raise RtbenchError(unknown("kind of packets", str(kind), KINDS))
    for what, n in (("packets", packets), ("rays in a packet", width)):
        if n < 1:
            raise RtbenchError(f"number of {what} {n} is not allowed (allowed: 1 or more)")
    if not 0 <= angle <= WIDEST:
        raise RtbenchError(f"angle {angle} is not allowed (allowed: 0 to {WIDEST} degrees)")
    if not isinstance(seed, numbers.Integral) or seed < 0:
        raise RtbenchError(f"seed {seed!r} is not allowed (allowed: 0 or greater)")
    reach = _reach(aim, width, angle) if kind == "common" and angle else 1.0
    orig, dir = _rays(kind, aim.spread, packets, width, angle, reach, seed)
    soup = decided(aim.triangles, orig, dir, aim.name, aim.spread, aim.seed, progress)
    return Bundles(kind, packets, width, float(angle), reach, int(seed), soup)


def _rays(
    kind: str, spread: float, packets: int, width: int, angle: float, reach: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return origins and directions, (P W, 3) float32."""
    drawn = draw_rays(stream(seed, 4), packets, spread)
    target, axis, distance = (np.repeat(each.astype(np.float64), width, axis=0) for each in drawn)
    axis /= _length(axis)
    sideways, cosine, sine = _turns(axis, packets, width, angle, seed)

    def turned(vectors: np.ndarray) -> np.ndarray:
        along, across = _dot(vectors, axis), _dot(vectors, sideways)
        return (
            vectors
            + ((cosine - 1) * along - sine * across) * axis
            + (sine * along + (cosine - 1) * across) * sideways
        )

    before = distance[:, None] * axis
    if kind == "general":
        orig, dir = turned(target - before), turned(axis)
    elif kind == "parallel":
        orig, dir = turned(target) - before, axis
    else:
        nearer = reach * (target - before) - (1 - reach) * CLOSEST * axis
        orig, dir = nearer, turned(axis)
    return orig.astype(np.float32), dir.astype(np.float32)


def _turns(
    axis: np.ndarray, packets: int, width: int, angle: float, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return of each lane the unit vector across the axis that it turns to, and cosine and sine."""
    drawn = stream(seed, 5)((packets * width, 4)).astype(np.float64)
    towards = drawn[:, :3] - _dot(drawn[:, :3], axis) * axis
    # 1 - cosine is uniform; rounded to float32, so that it is the same whatever sine the C library
    # computes, and multiplied out below, so that small angles keep their digits.
    most = float(np.float32(2 * math.sin(math.radians(angle) / 4) ** 2))
    versine = most * (drawn[:, 3] + 1) / 2
    versine[0::width] = most
    if width > 1:
        versine[1::width] = most
        towards[1::width] = -towards[0::width]
    sine = np.sqrt(versine * (2 - versine))
    return towards / _length(towards), (1 - versine)[:, None], sine[:, None]


def _reach(aim: Soup, width: int, angle: float) -> float:
    """Return the greatest reach at which common origins keep the hit ratio of angle 0."""
    rays, count = TRIALS
    corners = aim.triangles[:count]
    packets = -(-rays // width)

    def hits(angle: float, reach: float) -> int:
        orig, dir = _rays("common", aim.spread, packets, width, angle, reach, aim.seed)
        return nearest(corners, orig, dir).hits

    wanted, low, high = hits(0.0, 1.0), 0.0, 1.0
    for _ in range(STEPS):
        middle = (low + high) / 2
        if hits(angle, middle) < wanted:
            high = middle
        else:
            low = middle
    return low


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the dot products of (N, 3) arrays as (N, 1), summed from left to right."""
    product = a * b
    return (product[:, 0] + product[:, 1] + product[:, 2])[:, None]


def _length(a: np.ndarray) -> np.ndarray:
    return np.sqrt(_dot(a, a))
