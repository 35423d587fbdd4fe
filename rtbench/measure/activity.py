"""How busy the machine is: load, clock, temperature, and what else ran in a short while."""

import os
import re
import time
from collections.abc import Callable
from pathlib import Path

from rtbench.measure.procfs import (
    ROOT,
    UNKNOWN,
    cpu_list,
    memory,
    mhz_now,
    text_of,
    thousandth,
)

# Places in a line of /proc/stat.
IDLE, IOWAIT, STEAL = 3, 4, 7


def load(root: str | Path = ROOT, seconds: float = 0.3) -> dict:
    """Return how busy the machine is, watched for a short while.

    Parameters
    ----------
    root : path
        The folder that holds ``proc`` and ``sys``.
    seconds : float
        How long to watch; this process sleeps meanwhile.

    Returns
    -------
    dict
        ``loadavg`` (1, 5, 15 minutes), ``cpu_pressure`` (per cent of time that some task waited
        for a CPU, 10 s average), ``mhz_now``, ``temperature_c`` (the hottest sensor),
        ``memory_available`` (bytes), and over the watched time: ``busy`` and ``steal`` (share of
        all CPU time), ``sibling_busy`` (the busiest SMT sibling of a CPU that we may use),
        ``heavy_processes`` (number of other processes above 10 % of a CPU).
    """
    root = Path(root)
    # The clock is read first: asleep, the CPU slows down.
    clock = mhz_now(root)
    try:
        averages = [round(value, 2) for value in os.getloadavg()]
    except (AttributeError, OSError):
        averages = UNKNOWN
    pressure = re.search(r"some avg10=([\d.]+)", text_of(root / "proc/pressure/cpu"))
    return {
        "loadavg": averages,
        "cpu_pressure": float(pressure.group(1)) if pressure else UNKNOWN,
        "mhz_now": clock,
        "temperature_c": _temperature(root),
        "memory_available": memory(root, "MemAvailable"),
        **watch(root, seconds),
    }


def _temperature(root: Path) -> float | str:
    thermal = (root / "sys/class/thermal").glob("thermal_zone*/temp")
    sensors = (root / "sys/class/hwmon").glob("hwmon*/temp*_input")
    known = [
        value for path in (*thermal, *sensors) if (value := thousandth(text_of(path))) != UNKNOWN
    ]
    return max(known) if known else UNKNOWN


def watch(root: Path, seconds: float, sleep: Callable[[float], None] = time.sleep) -> dict:
    """Return what the CPUs did while this process slept.

    Parameters
    ----------
    root : path
        The folder that holds ``proc`` and ``sys``.
    seconds : float
        How long to sleep between the two looks.
    sleep : callable
        What lets the time pass.

    Returns
    -------
    dict
        ``busy, steal, sibling_busy`` (shares of CPU time) and ``heavy_processes``, as in `load`.
    """
    cpus, processes = _cpu_ticks(root), _process_ticks(root)
    sleep(seconds)
    spent = {
        cpu: [after - before for before, after in zip(cpus[cpu], ticks, strict=True)]
        for cpu, ticks in _cpu_ticks(root).items()
        if cpu in cpus and len(cpus[cpu]) == len(ticks)
    }
    total = sum(sum(ticks) for ticks in spent.values())
    if total <= 0:
        return dict.fromkeys(("busy", "steal", "sibling_busy", "heavy_processes"), UNKNOWN)
    passed = total / len(spent)
    heavy = [
        process
        for process, ticks in _process_ticks(root).items()
        if process != os.getpid() and ticks - processes.get(process, ticks) > 0.1 * passed
    ]
    return {
        "busy": round(sum(map(_busy_ticks, spent.values())) / total, 4),
        "steal": round(sum(ticks[STEAL] for ticks in spent.values()) / total, 4),
        "sibling_busy": _sibling_busy(root, spent),
        "heavy_processes": len(heavy) if processes else UNKNOWN,
    }


def _cpu_ticks(root: Path) -> dict[int, list[int]]:
    """Return the ticks of each CPU: user, nice, system, idle, iowait, irq, softirq, steal."""
    # What follows steal is time of guests, which user and nice contain already.
    lines = re.findall(r"(?m)^cpu(\d+)((?: +\d+){8})", text_of(root / "proc/stat"))
    return {int(cpu): [int(ticks) for ticks in counts.split()] for cpu, counts in lines}


def _busy_ticks(ticks: list[int]) -> int:
    return sum(ticks) - ticks[IDLE] - ticks[IOWAIT]


def _process_ticks(root: Path) -> dict[int, int]:
    """Return the CPU time of each process in ticks."""
    found = {}
    for path in (root / "proc").glob("[0-9]*/stat"):
        # The command's name, in parentheses, may hold blanks and parentheses of its own.
        fields = text_of(path).rpartition(")")[2].split()[11:13]
        if len(fields) == 2 and all(map(str.isdigit, fields)) and path.parent.name.isdigit():
            found[int(path.parent.name)] = sum(map(int, fields))
    return found


def _sibling_busy(root: Path, spent: dict[int, list[int]]) -> float | str:
    """Return the busy share of the busiest SMT sibling of a CPU that this process may use."""
    usable = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else spent
    shares, told = [0.0], False
    for cpu in usable:
        topology = root / f"sys/devices/system/cpu/cpu{cpu}/topology"
        siblings = cpu_list(text_of(topology / "thread_siblings_list"))
        told = told or bool(siblings)
        for other in siblings:
            if other != cpu and sum(spent.get(other, [])) > 0:
                shares.append(_busy_ticks(spent[other]) / sum(spent[other]))
    return round(max(shares), 4) if told else UNKNOWN
