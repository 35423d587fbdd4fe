"""Pairs for the tests of kernels: random ones, and ones close to every border of a hit."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import truth

from rtbench.accuracy import certified
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import fill
from rtbench.compiled.loops import loop
from rtbench.kernels.contract import Kernel
from rtbench.workloads.pairs import random_pairs

DATA = {"float32": np.float32, "float64": np.float64}


@dataclass(frozen=True, eq=False)
class Group:
    """Pairs with one tmax; `right` remembers the exact answers.

    Attributes
    ----------
    triangles : (N, 3, 3) array
    origins, directions : (N, 3) arrays
    tmax : float
    """

    triangles: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    tmax: float

    @functools.cached_property
    def reference(self) -> certified.Reference:
        """t, u, v of the lines, with bounds."""
        return certified.reference(self.triangles, self.origins, self.directions)

    @functools.cache  # noqa: B019 - the groups live as long as the tests
    def right(self, domain: str) -> np.ndarray:
        """Return which pairs hit, exactly."""
        return truth.hits(self.triangles, self.origins, self.directions, domain, self.tmax)

    def inside(self, kernel: Kernel) -> np.ndarray:
        """Return which origins lie in their triangles, as the kernel brings them there."""
        return truth.inside(self.triangles, self.origins, self.axes(kernel))

    def axes(self, kernel: Kernel) -> np.ndarray | None:
        """Return along which axis a kernel projects each triangle; None: along the normal."""
        stored = self.records(kernel, "float64")[0]
        for one, other in (("u", "v"), ("i1", "i2")):
            if one in stored.dtype.names:
                return 3 - stored[one] - stored[other]
        return None

    def records(self, kernel: Kernel, precision: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the triangles and rays that a kernel reads."""
        vertices = tuple(np.ascontiguousarray(self.triangles[:, i]) for i in range(3))
        tmax = self.tmax if kernel.takes_tmax else None
        return fill(kernel, "own", precision, vertices, self.origins, self.directions, tmax=tmax)

    def answers(self, kernel: Kernel, precision: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return outcome and outputs of the compiled kernel."""
        compiled = loop(kernel, precision, "own")
        outcome, *values = run_once(compiled, kernel, precision, *self.records(kernel, precision))
        return outcome, dict(zip(kernel.outputs, values, strict=False))


def random_group(n: int, seed: int, tmax: float = np.inf) -> Group:
    """Return pairs as `rtbench.workloads.pairs.random_pairs` draws them, of float32."""
    drawn = random_pairs(n, "pcg64", seed)
    triangles = np.stack([drawn.v0, drawn.v1, drawn.v2], axis=1)
    return Group(triangles, drawn.orig, drawn.dir, tmax)


@functools.cache
def groups(precision: str) -> dict[str, Group]:
    """Return 2,000 pairs by what they are close to, of the precision of the data.

    ``random``: tmax infinite; ``random, tmax``: 0.5, which ends a third of the hits; ``edges``: the
    line passes an edge or vertex at a distance of up to some hundred roundings; ``limits``: t lies
    so close to 0 or to tmax = 1. ``points``: the origin is such a point itself, for kernels that
    test one.
    """
    data = DATA[precision]
    random = np.random.default_rng(17)
    near = 10.0 ** random.uniform(-9, -5, (1000, 3)) * random.choice([-1, 1], (1000, 3))
    if precision == "float64":
        near = near * 2.0**-29
    triangles = random.random((1000, 3, 3))
    weights = random.dirichlet((1, 1, 1), 1000)
    edges = slice(0, 500)
    weights[edges, 0] = 0
    weights[:100, 1] = 0  # at v2
    weights /= weights.sum(axis=1)[:, None]
    weights[edges] += near[edges]
    origins = random.random((1000, 3))
    points = np.einsum("ni,nij->nj", weights, triangles)
    directions = points - origins
    limits = slice(500, 1000)
    ends = np.where(random.random(500) < 0.5, 0.0, 1.0)
    origins[limits] += directions[limits] * (1 - ends + near[limits, 0])[:, None]
    drawn = [a.astype(data) for a in (triangles, origins, directions, points)]
    found = {
        "random": random_group(500, 3),
        "random, tmax": random_group(500, 4, 0.5),
        "edges": Group(*(a[edges] for a in drawn[:3]), np.inf),
        "limits": Group(*(a[limits] for a in drawn[:3]), 1.0),
        "points": Group(drawn[0][edges], drawn[3][edges], drawn[2][edges], np.inf),
    }
    for name in ("random", "random, tmax"):
        each = found[name]
        wide = (a.astype(data) for a in (each.triangles, each.origins, each.directions))
        found[name] = Group(*wide, each.tmax)
    return found
