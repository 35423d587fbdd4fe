"""Which versions of what runs and compiles the kernels are at work here."""

import platform
from importlib import metadata
from pathlib import Path

from rtbench.measure.procfs import UNKNOWN, said

PACKAGES = ("numba", "llvmlite", "numpy", "rtbench")


def software() -> dict:
    """Return the versions of what runs and compiles the kernels; numba is not imported.

    Returns
    -------
    dict
        ``python, implementation, numba, llvmlite, llvm, numpy, rtbench, commit, dirty``; the last
        two are "unknown" unless rtbench runs from its own git checkout.
    """
    versions = {name: _version(name) for name in PACKAGES}
    return {
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        **versions,
        "llvm": _llvm(),
        **checkout(Path(__file__).resolve().parents[2]),
    }


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return UNKNOWN


def _llvm() -> str:
    try:
        from llvmlite import binding
    except (ImportError, OSError):
        return UNKNOWN
    return ".".join(map(str, binding.llvm_version_info))


def checkout(folder: Path) -> dict:
    """Return the commit of a checkout whose top is this folder, and whether it was changed."""
    # A virtual environment may lie inside a checkout of something else: that commit is not ours.
    if not (folder / ".git").exists():
        return {"commit": UNKNOWN, "dirty": UNKNOWN}
    git = ["git", "-C", str(folder)]
    commit = said([*git, "rev-parse", "--verify", "HEAD"])
    changed = said([*git, "status", "--porcelain", "--", "rtbench", "pyproject.toml"], "")
    return {"commit": commit, "dirty": changed if changed == UNKNOWN else changed != ""}
