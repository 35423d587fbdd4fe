"""How often the nearest hit in a mesh is wrong, by exact arithmetic over a sample of rays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtbench.accuracy import oracle
from rtbench.accuracy.cases import EITHER, MUST_HIT

if TYPE_CHECKING:
    from rtbench.experiments.tree_scene import Scene

PAD = 1e-9  # of the largest coordinate, by which boxes are made larger: far above any rounding
OFF = 1e-4  # of t: more than rounding, of rays that do not graze


def judge(scene: Scene, kernel: str, precision: str, rays: str, most: int) -> dict:
    """Return how many answers of a group are wrong, of a sample of rays.

    Wrong is a hit where exact arithmetic has none, a miss where it has one, and a t that is off by
    more than a part in 10,000; of two triangles that meet where the ray passes either will do. Rays
    for which a tie decides whether anything is hit may say either.

    Returns
    -------
    dict
        ``exact_wrong``, ``exact_judged``.
    """
    from rtbench.experiments.tree_scene import sample

    known = scene.answers[kernel, precision, rays]
    rows = sample(len(known[0]), most)
    truths = _truths(scene, rays, rows)
    told = ((int(known[0][row]), float(known[1][row]), truths[row]) for row in rows.tolist())
    wrong = sum(_is_wrong(*each) for each in told)
    return {"exact_wrong": wrong, "exact_judged": len(rows)}


def _is_wrong(triangle: int, t: float, touched: list[tuple[bool, float]]) -> bool:
    """Return whether a ray's answer is wrong; ``touched``: (must be hit, exact t) of triangles."""
    must = [exact for certain, exact in touched if certain]
    if triangle < 0:
        return bool(must)
    there = any(abs(t - exact) <= OFF * abs(exact) for _, exact in touched)
    return not there or (bool(must) and t > min(must) * (1 + OFF))


def _truths(scene: Scene, rays: str, rows: np.ndarray) -> dict[int, list]:
    """Return of each ray the triangles that it hits or may hit, kept with the scene."""
    kept = scene.__dict__.setdefault("truths", {}).setdefault(rays, {})
    origins, directions, _ = scene.sets[rays]
    low, high = (f(scene.triangles, axis=1).astype(np.float64) for f in (np.min, np.max))
    pad = PAD * max(np.abs(scene.vertices).max(), np.abs(origins).max())
    for row in rows.tolist():
        if row in kept:
            continue
        near = _meets(low - pad, high + pad, origins[row], directions[row])
        corners = scene.triangles[near].astype(np.float64)
        ray = (np.broadcast_to(a[row], (len(near), 3)) for a in (origins, directions))
        expect = oracle.expectations(corners, *ray) if len(near) else np.zeros(0, np.int8)
        touched = []
        for k in np.flatnonzero((expect == MUST_HIT) | (expect == EITHER)):
            one = corners[k : k + 1]
            told = oracle.answers(
                *(one[:, c] for c in range(3)), origins[row][None], directions[row][None]
            )
            touched.append((bool(expect[k] == MUST_HIT), float(told.t[0])))
        kept[row] = touched
    return kept


def _meets(low: np.ndarray, high: np.ndarray, origin: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return the boxes that a ray meets."""
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (low - origin) / way, (high - origin) / way
    still = way == 0
    within = ((low <= origin) & (origin <= high))[:, still].all(axis=1)
    near = np.minimum(one, other)[:, ~still].max(axis=1)
    far = np.maximum(one, other)[:, ~still].min(axis=1)
    slack = 1e-9 * np.abs(far)
    return np.flatnonzero(within & (near <= far + slack) & (far >= -slack))
