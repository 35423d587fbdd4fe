"""Which ways to walk a tree has, which is best for what, and the options that suit its leaves."""

from __future__ import annotations

import numpy as np

from rtbench.compiled.instantiate import Instance
from rtbench.errors import RtbenchError, unknown
from rtbench.kernels.contract import Kernel
from rtbench.trees import leaves
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import KdTree, one_leaf
from rtbench.trees.options import Options
from rtbench.trees.traversal import walks

PACKET = 16
# Way: what it is, and which structure and form of leaves it walks (None: what the kernel allows).
WAYS = {
    "lanes": ("32 rays in lanes, each on a way of its own", "kd", leaves.IN_BLOCKS),
    "packets": ("16 neighbouring rays together", "kd", leaves.IN_BLOCKS),
    "blocks": ("one ray, leaves in blocks of 8 triangles", "kd", leaves.IN_BLOCKS),
    "stack": ("one ray, triangle after triangle: the plain form", "kd", leaves.ONE_BY_ONE),
    "recursive": ("Šilhavý's algorithm 2", "kd", leaves.ONE_BY_ONE),
    "mailboxes": ("the plain form, no triangle twice", "kd", leaves.ONE_BY_ONE),
    "wide": ("one ray, 8 boxes at a time", "bvh", None),
    "brute_force": ("no tree: every triangle", None, None),
}
# Blocks want larger leaves, and a step costs as much as eight tests at once; measured on scanned
# and architectural models.
FOR_FORM = {
    leaves.ONE_BY_ONE: {"block": 1, "max_leaf": 1},
    leaves.IN_BLOCKS: {"block": leaves.WIDTH, "max_leaf": leaves.WIDTH, "traversal_cost": 1.0},
}


def options(form: str, **given: object) -> Options:
    """Return options for leaves of a form: given ones, and such as suit the form."""
    return Options(**(FOR_FORM[form] | given))


def form(way: str, of_kernel: str) -> str:
    """Return how a way's leaves are tested with a kernel of this form."""
    return WAYS[way][2] or of_kernel


def allowed(options: Options, of_kernel: str) -> list[str]:
    """Return the ways that a tree of these options has."""
    return [
        way
        for way, (_, structure, needed) in WAYS.items()
        if structure in (None, options.structure)
        and (needed != leaves.IN_BLOCKS or of_kernel == leaves.IN_BLOCKS)
    ]


def default(options: Options, of_kernel: str) -> str:
    """Return the way for rays of which nothing is known."""
    return allowed(options, of_kernel)[0] if options.structure != "kd" else _default(of_kernel)


def _default(of_kernel: str) -> str:
    return "lanes" if of_kernel == leaves.IN_BLOCKS else "stack"


def chosen(options: Options, of_kernel: str, rays: np.ndarray) -> str:
    """Return the way for these rays: packets where most neighbours run together."""
    way = default(options, of_kernel)
    return "packets" if way == "lanes" and run_together(rays) else way


def run_together(rays: np.ndarray) -> bool:
    """Tell whether of most packets of neighbouring rays directions differ by a few per cent."""
    whole = len(rays) // PACKET
    if not whole:
        return False
    sample = np.linspace(0, whole - 1, min(whole, 256)).astype(np.int64)
    places = sample[:, None] * PACKET + np.arange(PACKET)
    with np.errstate(all="ignore"):
        directions = rays["dir"][places].astype(np.float64)
        directions /= np.linalg.norm(directions, axis=2, keepdims=True)
        spread = np.ptp(directions, axis=1).max(axis=1)
    return bool(np.mean(spread < 0.05) > 0.5)


def walk(
    kernel: Kernel, precision: str, way: str, query: str, of_kernel: str, counted: bool = False
) -> Instance:
    """Return the compiled walk of a way: see `rtbench.trees.traversal.walks.walk`."""
    if way not in WAYS:
        raise RtbenchError(unknown("way", way, WAYS))
    if way == "wide":
        from rtbench.trees.bvh import wide

        return wide.walk(kernel, precision, query, of_kernel, counted)
    if way == "lanes":
        from rtbench.trees.traversal import lanes

        return lanes.walk(kernel, precision, query, counted)
    if way == "packets":
        from rtbench.trees.traversal import packets

        return packets.walk(kernel, precision, query, counted)
    plain = "stack" if way == "blocks" else way
    return walks.walk(kernel, precision, plain, query, form(way, of_kernel), counted)


def leaves_of(
    kernel: Kernel, precision: str, geometry: Geometry, built: object, way: str
) -> leaves.Leaves:
    """Return a k-d tree's or a BVH's nodes and leaves as a way of walking reads them."""
    in_form = form(way, leaves.form_of(kernel, precision))
    if way == "brute_force":
        built = one_leaf(len(geometry), geometry.box, built.options)
    if not isinstance(built, KdTree):
        from rtbench.trees.bvh import nodes

        return nodes.leaves_of(kernel, precision, geometry, built, in_form)
    made = leaves.blocks if in_form == leaves.IN_BLOCKS else leaves.one_by_one
    return made(kernel, precision, geometry, built)


def quality(built: object, geometry: Geometry) -> dict:
    """Return what is to be said of a k-d tree or a BVH."""
    if isinstance(built, KdTree):
        from rtbench.trees import quality
    else:
        from rtbench.trees.bvh import quality
    return quality.quality(built, geometry)
