"""rtbench: what intersecting rays with triangles costs, and what accuracy costs in time."""

import importlib

_PUBLIC = {
    "Tree": "rtbench.trees.tree",
    "Hits": "rtbench.compiled.intersect",
    "intersect": "rtbench.compiled.intersect",
    "list_kernels": "rtbench.compiled.catalogue",
    "load_mesh": "rtbench.workloads.meshes",
}

__all__ = ["Hits", "Tree", "intersect", "list_kernels", "load_mesh"]


def __getattr__(name: str):
    """Import a public name where it is first used: importing rtbench itself costs nothing."""
    if name in _PUBLIC:
        return getattr(importlib.import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'rtbench' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
