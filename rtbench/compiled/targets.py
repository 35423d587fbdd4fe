"""What code is compiled for: the axis that Havel had in GCC 3, GCC 4 and MSVC is here LLVM's.

A target is a processor's level and the width of the vectors that the compiler prefers on it.
numba takes both from the environment, once, when it starts: code for another target than this
process's own is compiled and run by another process, see :mod:`rtbench.compiled.elsewhere`.

Source: Havel 2008, chapter 5 (his compilers); System V ABI, AMD64 supplement, table 3.1 (the levels
x86-64-v2 to v4).
"""

from __future__ import annotations

from dataclasses import dataclass

from rtbench.errors import RtbenchError, unknown

# As LLVM names them; "cmov", "fxsr" and the like come with every processor of 64 bits.
_V1 = ("64bit", "sse2")
_V2 = ("sse3", "ssse3", "sse4.1", "sse4.2", "cx16", "popcnt", "sahf")
_V3 = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave")
_V4 = ("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl")


@dataclass(frozen=True)
class Target:
    """A target.

    Attributes
    ----------
    title : str
        What it is, in a line.
    cpu : str or None
        LLVM's name of the processor; None: whatever this process compiles for.
    features : str
        What is switched on or off beside it. Never empty: numba takes an empty value for none of
        its own in one place and for the features of this machine in another.
    needs : tuple of str
        Features, as LLVM names them, without which the code does not run.
    """

    title: str
    cpu: str | None = None
    features: str = ""
    needs: tuple[str, ...] = ()


TARGETS = {
    "native": Target("this processor, as LLVM sees it"),
    "x86-64": Target("any x86-64: SSE2, 128-bit vectors", "x86-64", "+sse2", _V1),
    "avx2": Target("x86-64-v3: AVX2, 256-bit vectors", "x86-64-v3", "+avx2", _V1 + _V2 + _V3),
    "avx512-256": Target(
        "x86-64-v4: AVX-512, 256-bit vectors preferred",
        "x86-64-v4",
        "+prefer-256-bit",
        _V1 + _V2 + _V3 + _V4,
    ),
    "avx512-512": Target(
        "x86-64-v4: AVX-512, 512-bit vectors",
        "x86-64-v4",
        "-prefer-256-bit",
        _V1 + _V2 + _V3 + _V4,
    ),
}


def environment(name: str) -> tuple[tuple[str, str], ...]:
    """Return what must be set in the environment before numba starts.

    Parameters
    ----------
    name : str
        One of ``TARGETS``.

    Returns
    -------
    tuple of (str, str)
        Variables and their values; empty for ``native``.

    Raises
    ------
    RtbenchError
        For an unknown name, and for a target that this processor cannot run.
    """
    target = _find(name)
    lacking = missing(name)
    if lacking:
        raise RtbenchError(
            f"target {name!r} cannot run here: this processor lacks {', '.join(lacking)} "
            f"(it runs: {', '.join(runnable())})"
        )
    if target.cpu is None:
        return ()
    return (("NUMBA_CPU_NAME", target.cpu), ("NUMBA_CPU_FEATURES", target.features))


def missing(name: str) -> list[str]:
    """Return what this processor lacks of what a target needs, as LLVM names it.

    Raises
    ------
    RtbenchError
        For an unknown name.
    """
    has = _host_features()
    return [feature for feature in _find(name).needs if not has.get(feature)]


def runnable() -> list[str]:
    """Return the targets that this processor can run."""
    return [name for name in TARGETS if not missing(name)]


def _find(name: str) -> Target:
    if name not in TARGETS:
        raise RtbenchError(unknown("target", name, TARGETS))
    return TARGETS[name]


def _host_features() -> dict[str, bool]:
    import llvmlite.binding as llvm

    try:
        return llvm.get_host_cpu_features()
    except RuntimeError:  # LLVM does not know how to ask this processor
        return {}
