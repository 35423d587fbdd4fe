"""What can be asked of the tree experiments, and what of it is tried with ``--quick``."""

from __future__ import annotations

import math

from rtbench.errors import RtbenchError, unknown
from rtbench.experiments.peers import PEERS
from rtbench.trees import ways
from rtbench.trees.options import AXES, BUILDERS, CANDIDATES, ENDINGS, OVERLAPS, RULES, STRUCTURES

TREES, TREE_BUILDERS = "trees", "tree_builders"
BVH = "bvh"
MEDIANS = ("object_median", "spatial_median")
RAY_SETS = {
    "primary": "from a camera",
    "shadow": "from where primary rays hit, to a light",
    "random": "without any coherence",
    "aimed": "from inside a closed model at its vertices and edges",
}
GIVEN, MEASURED = "given", "measured"
# A model with a question mark is taken where its file is there.
MODELS = (
    *("even", "scanned", "robots"),
    *("bunny?", "dragon?", "buddha?", "sponza?", "teapot_in_stadium?"),
)
LARGE = ("dragon?", "buddha?")  # left out of quick runs
QUICK_TRIANGLES = 100_000
_LISTS = {
    "structures": STRUCTURES,
    "rules": RULES,
    "endings": ENDINGS,
    "axes": AXES,
    "candidates": CANDIDATES,
    "overlaps": OVERLAPS,
    "ways": [way for way in ways.WAYS if way != "brute_force"],
    "ray_sets": RAY_SETS,
    "peers": [peer.name for peer in PEERS],
}
_EACH = {"axes": "axes", "candidates": "candidates", "ray_sets": "ray set"}
_MOST = {"width": 1 << 14, "height": 1 << 14, "naive": 1 << 30, "judged": 1 << 30}
_MOST |= {"exact": 1 << 20, "large": 1 << 30, "max_leaf": 1 << 20}


def check(config) -> None:
    """Check what only the tree experiments read.

    Raises
    ------
    RtbenchError
        In one line: what, the value, what is allowed, the nearest name.
    """
    builders = [*BUILDERS, *MEDIANS, BVH] if config.experiment == TREE_BUILDERS else [*BUILDERS]
    for name, allowed in (_LISTS | {"builders": builders}).items():
        values = getattr(config, name)
        for value in values:
            if value not in allowed:
                raise RtbenchError(unknown(_EACH.get(name, name.removesuffix("s")), value, allowed))
        if not values and name != "peers":
            raise RtbenchError(f"{name} is empty: at least one is needed")
    for name in (*_LISTS, "builders", "models", "threads"):
        values = getattr(config, name)
        twice = next((value for i, value in enumerate(values) if value in values[:i]), None)
        if twice is not None:
            raise RtbenchError(f"{name} names {twice!r} twice")
    for name, allowed in (("median_axes", AXES), ("costs", (GIVEN, MEASURED))):
        if getattr(config, name) not in allowed:
            raise RtbenchError(unknown(name, getattr(config, name), allowed))
    for name, most in _MOST.items():
        least = 1 if name in ("width", "height", "max_leaf") else 0
        value = getattr(config, name)
        if not least <= value <= most:
            raise RtbenchError(f"{name} {value} is not allowed (allowed: {least} to {most})")
    for threads in config.threads:
        if not 1 <= threads <= 256:
            raise RtbenchError(f"threads {threads} is not allowed (allowed: 1 to 256)")
    for name in ("traversal_cost", "intersection_cost"):
        value = getattr(config, name)
        if value is not None and not (math.isfinite(value) and value > 0):
            raise RtbenchError(f"{name} {value} is not allowed (allowed: above 0)")
    if "shadow" in config.ray_sets and "primary" not in config.ray_sets:
        raise RtbenchError("ray set shadow starts where primary rays hit: name primary too")


def quick(config) -> dict[str, object]:
    """Return what is changed of a tree experiment for ``--quick``."""
    return {
        "models": tuple(each for each in config.models or MODELS if not _is_large(each)),
        "sizes": tuple(size for size in config.sizes if size <= QUICK_TRIANGLES),
        "width": max(1, config.width // 2),
        "height": max(1, config.height // 2),
        "rays": max(1, config.rays // 4),
        "naive": -(-config.naive // 4),
        "exact": -(-config.exact // 4),
        "processes": 1,
        "samples": 2,
    }


def _is_large(model: str) -> bool:
    number = model.partition(":")[2]
    return model in LARGE or (number.isdecimal() and int(number) > QUICK_TRIANGLES)
