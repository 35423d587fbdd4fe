"""What this machine is: processor, caches, clock, memory, system, software, and its load now.

Nothing here raises because a file is missing: what cannot be found out is the word "unknown".
"""

import os
import platform
import re
import sys
from pathlib import Path

from rtbench.errors import RtbenchError
from rtbench.measure.activity import load
from rtbench.measure.procfs import (
    ROOT,
    UNKNOWN,
    cpu_list,
    known_or,
    memory,
    number,
    said,
    switch,
    text_of,
    thousandth,
)
from rtbench.measure.versions import software

__all__ = ["fingerprint", "float_state", "label", "load", "pin", "software"]

# The instruction sets that decide what a compiler may emit for a kernel.
FLAGS = [
    *("sse2", "sse4_1", "sse4_2", "avx", "f16c", "fma", "fma4", "bmi1", "bmi2", "avx2"),
    *("avx_vnni", "avx512f", "avx512dq", "avx512bw", "avx512vl", "avx10"),
    *("neon", "asimd", "sve", "sve2"),
]
VENDORS = {"GenuineIntel": "intel", "AuthenticAMD": "amd", "HygonGenuine": "hygon"}
# Words of a model name that tell nothing: "Intel(R) Core(TM) i7-8700K CPU @ 3.70GHz".
EMPTY_WORDS = re.compile(
    r"\((r|tm)\)|@.*|\bwith\b.*|\b(\w+-core|cpu|processor|genuine|gen|\d+th)\b", re.IGNORECASE
)


def fingerprint(root: str | Path = ROOT) -> dict:
    """Return what stays the same on this machine from run to run, ready for JSON.

    Parameters
    ----------
    root : path
        The folder that holds ``proc`` and ``sys``.

    Returns
    -------
    dict
        Flat; clocks in MHz, sizes in bytes, the word "unknown" where nothing can be found out.
        No host or user name. What changes from moment to moment (the clock) is in `load`.
    """
    root = Path(root)
    cpu = _cpu(root)
    cpufreq = root / "sys/devices/system/cpu/cpu0/cpufreq"
    logical = len(cpu_list(text_of(root / "sys/devices/system/cpu/online")))
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else UNKNOWN
    return {
        "label": _label(cpu["cpu_model"], cpu["cpu_vendor"]),
        **cpu,
        "caches": _caches(root),
        "cores_physical": _physical_cores(root),
        "cores_logical": logical or os.cpu_count() or UNKNOWN,
        "cores_usable": usable,
        "cpu_quota": _quota(root),
        "smt": switch(text_of(root / "sys/devices/system/cpu/smt/active"), on="1", off="0"),
        "mhz_min": thousandth(text_of(cpufreq / "cpuinfo_min_freq")),
        "mhz_max": thousandth(text_of(cpufreq / "cpuinfo_max_freq")),
        "governor": text_of(cpufreq / "scaling_governor"),
        "turbo": _turbo(root),
        "clocksource": text_of(
            root / "sys/devices/system/clocksource/clocksource0/current_clocksource"
        ),
        "memory_bytes": memory(root, "MemTotal"),
        "os": _system(root),
        "kernel": known_or(text_of(root / "proc/sys/kernel/osrelease"), platform.release()),
        "architecture": platform.machine() or UNKNOWN,
        **_virtual(root),
        "aslr": switch(text_of(root / "proc/sys/kernel/randomize_va_space"), on="12", off="0"),
    }


def label(root: str | Path = ROOT) -> str:
    """Return a short name of the processor for folder names: [a-z0-9-], no host name."""
    cpu = _cpu(Path(root))
    return _label(cpu["cpu_model"], cpu["cpu_vendor"])


def float_state() -> dict:
    """Return whether this thread flushes subnormal results (ftz) and inputs (daz) to zero.

    Returns
    -------
    dict
        ``ftz`` and ``daz``, bool; found out by arithmetic, looked at as bits, since a comparison
        would itself take a subnormal for zero.
    """
    import numpy as np

    smallest_normal = np.array([0x00800000], np.uint32).view(np.float32)
    subnormal = np.array([1], np.uint32).view(np.float32)
    half = smallest_normal * np.float32(0.5)
    grown = subnormal * np.float32(2.0**100)
    return {
        "ftz": int(half.view(np.uint32)[0]) == 0,
        "daz": int(grown.view(np.uint32)[0]) == 0,
    }


def check_cpu(cpu: int) -> None:
    """Tell whether this process could be pinned to a CPU.

    Parameters
    ----------
    cpu : int
        The number of a logical CPU.

    Raises
    ------
    RtbenchError
        Where the system cannot pin, or the number is not among those allowed.
    """
    if not hasattr(os, "sched_setaffinity"):
        raise RtbenchError(f"--cpu {cpu}: cannot pin to a CPU on {sys.platform}, only on Linux")
    allowed = sorted(os.sched_getaffinity(0))
    if cpu not in allowed:
        raise RtbenchError(
            f"--cpu {cpu}: no such CPU here (allowed: {', '.join(map(str, allowed))})"
        )


def pin(cpu: int) -> None:
    """Let this process run on one CPU only.

    Parameters
    ----------
    cpu : int
        The number of a logical CPU that this process may use.

    Raises
    ------
    RtbenchError
        Where the system cannot pin, or the number is not among those allowed.
    """
    check_cpu(cpu)
    try:
        os.sched_setaffinity(0, {cpu})
    except OSError as error:
        raise RtbenchError(f"--cpu {cpu}: the system refused: {error.strerror}") from None


def _cpu(root: Path) -> dict:
    first = text_of(root / "proc/cpuinfo").split("\n\n")[0]
    fields = dict(re.findall(r"(?m)^([^:\n]+?)[ \t]*:[ \t]*(.*?)[ \t]*$", first))
    present = set((fields.get("flags") or fields.get("Features") or "").split())
    return {
        "cpu_model": fields.get("model name") or _model_elsewhere(),
        "cpu_vendor": fields.get("vendor_id") or fields.get("CPU implementer") or UNKNOWN,
        "cpu_family": number(fields.get("cpu family", "")),
        "cpu_model_number": number(fields.get("model", "")),
        "cpu_stepping": number(fields.get("stepping", "")),
        "cpu_flags": [flag for flag in FLAGS if flag in present] if present else UNKNOWN,
    }


def _model_elsewhere() -> str:
    """Return the processor's model where there is no /proc/cpuinfo, or it names none."""
    if sys.platform == "darwin":
        return said(["sysctl", "-n", "machdep.cpu.brand_string"])
    if sys.platform == "win32":
        return platform.processor() or UNKNOWN
    return UNKNOWN


def _label(model: str, vendor: str) -> str:
    name = EMPTY_WORDS.sub(" ", model) if model != UNKNOWN else platform.machine()
    words = re.findall(r"[a-z0-9]+", name.lower())
    maker = VENDORS.get(vendor)
    if maker and words and maker not in words:
        words.insert(0, maker)
    return "-".join(words)[:40].strip("-") or UNKNOWN


def _caches(root: Path) -> list[dict] | str:
    found = []
    for index in sorted((root / "sys/devices/system/cpu/cpu0/cache").glob("index*")):
        size = re.fullmatch(r"(\d+)([KMG]?)", text_of(index / "size"))
        scale = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30}
        found.append(
            {
                "level": number(text_of(index / "level")),
                "type": text_of(index / "type").lower(),
                "size_bytes": int(size.group(1)) * scale[size.group(2)] if size else UNKNOWN,
                "shared_by": len(cpu_list(text_of(index / "shared_cpu_list"))) or UNKNOWN,
            }
        )
    return found or UNKNOWN


def _physical_cores(root: Path) -> int | str:
    cores = {
        (text_of(folder / "physical_package_id"), text_of(folder / "core_id"))
        for folder in (root / "sys/devices/system/cpu").glob("cpu[0-9]*/topology")
    }
    return len([core for core in cores if UNKNOWN not in core]) or UNKNOWN


def _quota(root: Path) -> float | str:
    """Return how many CPUs' time the control group may use, "none" for no limit."""
    limit = re.fullmatch(r"(max|\d+) ([1-9]\d*)", text_of(root / "sys/fs/cgroup/cpu.max"))
    if not limit:
        return UNKNOWN
    return "none" if limit[1] == "max" else int(limit[1]) / int(limit[2])


def _turbo(root: Path) -> str:
    cpu = root / "sys/devices/system/cpu"
    intel = switch(text_of(cpu / "intel_pstate/no_turbo"), on="0", off="1")
    return known_or(intel, switch(text_of(cpu / "cpufreq/boost"), on="1", off="0"))


def _system(root: Path) -> str:
    name = re.search(r'^PRETTY_NAME="?([^"\n]*)', text_of(root / "etc/os-release"), re.MULTILINE)
    return name.group(1) if name else platform.system() or UNKNOWN


def _virtual(root: Path) -> dict:
    cpuinfo = text_of(root / "proc/cpuinfo")
    flags = re.search(r"^flags\s*:(.*)$", cpuinfo, re.MULTILINE)
    virtual = "hypervisor" in flags.group(1).split() if flags else UNKNOWN
    vendor = text_of(root / "sys/class/dmi/id/sys_vendor")
    name = known_or(text_of(root / "sys/hypervisor/type"), vendor)
    return {"virtual": virtual, "hypervisor": name if virtual is True else UNKNOWN}
