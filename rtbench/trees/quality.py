"""How good a k-d tree is: what it takes, what a ray is expected to meet in it, what rays do meet.

The expectation is the SAH's own (equations 3.5 to 3.7, over the finished tree): a line that meets
the scene's box meets a cell in it with the ratio of their surfaces. It holds exactly for lines of
which none is more likely than another, `chords`, that end nowhere; rays that end at their first hit
meet less.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled.layout import REAL_TYPE
from rtbench.kernels.contract import Kernel
from rtbench.trees import leaves
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import LEAF, KdTree
from rtbench.trees.traversal import walks

COUNTS = ("steps", "leaves", "tests")


def quality(tree: KdTree, geometry: Geometry) -> dict[str, object]:
    """Return what a tree is made of and what a ray is expected to meet in it.

    Parameters
    ----------
    tree : KdTree
    geometry : Geometry
        That it was built over.

    Returns
    -------
    dict
        Flat: ``nodes``, ``leaves``, ``empty_leaves``, ``full_leaves``, ``references`` (int),
        ``references_per_triangle``; ``depth`` (of the deepest leaf), ``mean_leaf_depth``;
        ``triangles_per_full_leaf``, ``largest_leaf``; ``bytes`` of nodes and references;
        ``sah_cost``, in the unit of the options' K_T and K_I; ``expected_steps``,
        ``expected_leaves`` (such as hold anything), ``expected_tests`` of a ray that meets the
        scene's box. Ratios of nothing are NaN; in a scene whose box has no surface every cell
        counts as met.

    Source
    ------
    MacDonald & Booth 1990; Šilhavý 2010, section 3.3.3, equation 3.6
    """
    _, held = tree.leaves
    empty = int(np.count_nonzero(held == 0))
    full = len(held) - empty
    met = _expected(tree)
    with np.errstate(invalid="ignore"):
        each, per_leaf = np.array([len(tree.refs)]) / np.array([[len(geometry)], [full]])
    options = tree.options
    return {
        "nodes": len(tree.nodes),
        "leaves": len(held),
        "empty_leaves": empty,
        "full_leaves": full,
        "references": len(tree.refs),
        "references_per_triangle": float(each[0]),
        "depth": tree.depth,
        "mean_leaf_depth": met["leaf_depths"] / len(held),
        "triangles_per_full_leaf": float(per_leaf[0]),
        "largest_leaf": int(held.max()),
        "bytes": tree.nodes.nbytes + tree.refs.nbytes,
        "sah_cost": options.traversal_cost * met["steps"]
        + options.intersection_cost * met["blocks"],
        "expected_steps": met["steps"],
        "expected_leaves": met["leaves"],
        "expected_tests": met["tests"],
    }


def leaf_sizes(tree: KdTree) -> np.ndarray:
    """Return how many leaves hold 0, 1, 2, ... triangles, (largest leaf + 1,) int64."""
    return np.bincount(tree.leaves[1])


def leaf_depths(tree: KdTree) -> np.ndarray:
    """Return how many leaves lie at depths 0, 1, 2, ..., (depth + 1,) int64."""
    found = [np.count_nonzero(is_leaf) for is_leaf, *_ in _levels(tree)]
    return np.array(found, np.int64)


def _expected(tree: KdTree) -> dict[str, float]:
    """Return sums over the tree, each cell weighted with the chance that a line meets it."""
    block = tree.options.block
    sums = dict.fromkeys(("leaf_depths", "steps", "leaves", "tests", "blocks"), 0.0)
    for depth, (is_leaf, split, chance) in enumerate(_levels(tree)):
        count, of_leaf = split[is_leaf].astype(np.float64), chance[is_leaf]
        sums["leaf_depths"] += depth * len(count)
        sums["steps"] += float(chance.sum() - of_leaf.sum())
        sums["leaves"] += float(of_leaf @ (count > 0))
        sums["tests"] += float(of_leaf @ count)
        sums["blocks"] += float(of_leaf @ np.ceil(count / block))
    return sums


def _levels(tree: KdTree):
    """Yield, for all nodes of a depth: which are leaves, their split, the chance that they are met.

    Cells are not stored: they follow from those of the level before.
    """
    nodes = np.zeros(1, np.uint32)
    low, high = (list(side[:, None]) for side in tree.box.reshape(2, 3))
    whole = float(_half_surface(low, high)[0])
    while len(nodes):
        link, split = tree.nodes["link"][nodes], tree.nodes["split"][nodes]
        axis = link & 3
        is_leaf = axis == LEAF
        chance = _half_surface(low, high) / whole if whole > 0 else np.ones(len(nodes))
        yield is_leaf, split, chance
        inner = np.flatnonzero(~is_leaf)
        axis, split, child = axis[inner], split[inner], link[inner] >> 2
        nodes = np.concatenate([child, child + 1])
        for a in range(3):
            one, other = low[a][inner], high[a][inner]
            cut = axis == a
            low[a] = np.concatenate([one, np.where(cut, split, one)])
            high[a] = np.concatenate([np.where(cut, split, other), other])


def _half_surface(low: list[np.ndarray], high: list[np.ndarray]) -> np.ndarray:
    x, y, z = (b.astype(np.float64) - a for a, b in zip(low, high, strict=True))
    return x * y + y * z + z * x


def chords(geometry: Geometry, n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Draw lines of which none is more likely than another: what the SAH takes rays to be.

    Parameters
    ----------
    geometry : Geometry
    n : int
        How many.
    seed : int

    Returns
    -------
    origins, directions : (n, 3) float64 arrays
        From one uniformly random point on a sphere about the scene's box to another, which is
        origin + direction: about half of them meet the box.

    Source
    ------
    Solomon 1978, chapter 2: chords between random points of a sphere.
    """
    random = np.random.default_rng(seed)
    ends = random.normal(size=(2, n, 3))
    ends /= np.linalg.norm(ends, axis=2, keepdims=True)
    low, high = geometry.box.astype(np.float64).reshape(2, 3)
    radius = 0.501 * np.linalg.norm(high - low)  # origins outside of the box, corners too
    start, end = geometry.base + (low + high) / 2 + radius * ends
    return start, end - start


def counted(
    kernel: Kernel,
    precision: str,
    geometry: Geometry,
    tree: KdTree,
    origins: np.ndarray,
    directions: np.ndarray,
    tmax: float | np.ndarray = np.inf,
    query: str = "nearest",
    through: bool = False,
) -> dict[str, float]:
    """Walk rays by the plain walk and return what they met.

    Parameters
    ----------
    kernel : Kernel
    precision : str
    geometry : Geometry
    tree : KdTree
    origins, directions : (N, 3) arrays
    tmax : float or (N,) array
    query : str
        ``nearest`` or ``any``.
    through : bool
        Nothing is hit, and every ray goes on to the end of the box: what the SAH assumes.

    Returns
    -------
    dict
        See `per_ray`.
    """
    read = leaves.one_by_one(kernel, precision, geometry, tree)
    if through:
        gone = np.full_like(geometry.corners, np.nan)
        nowhere = Geometry(gone, geometry.base, geometry.boxes, geometry.box, geometry.reach)
        read = leaves.one_by_one(kernel, precision, nowhere, tree)
    rays = leaves.rays(kernel, precision, origins, directions, tmax)
    n, real = len(rays), REAL_TYPE[precision]
    scene = np.concatenate([geometry.base, geometry.box, [geometry.reach]]).astype(np.float64)
    counts = np.zeros((n, 3), np.int32)
    walks.walk(kernel, precision, "stack", query, leaves.ONE_BY_ONE, True).call(
        *(read.nodes, read.refs, read.triangles, scene, rays),
        *(np.zeros(1, np.uint64), np.arange(n, dtype=np.uint64)),
        *(np.empty(n, np.int32), *(np.empty(n, real) for _ in range(3)), counts),
    )
    return per_ray(counts)


def per_ray(counts: np.ndarray) -> dict[str, float]:
    """Return what rays met on average, of those that met the scene's box.

    Parameters
    ----------
    counts : (N, 3) int array
        Steps, leaves that hold anything and tests of each ray, as walks count them.

    Returns
    -------
    dict
        ``rays`` that met the box (in a tree of one empty leaf: none), and their mean ``steps``,
        ``leaves`` and ``tests``; NaN of no ray.
    """
    met = counts[counts.any(axis=1)]
    with np.errstate(invalid="ignore"):
        means = met.sum(axis=0, dtype=np.float64) / np.array([len(met)])
    return {"rays": len(met)} | dict(zip(COUNTS, means.tolist(), strict=True))
