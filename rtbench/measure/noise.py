"""Whether this machine is quiet enough to measure on, and what would make it quieter."""

import time
from collections.abc import Iterable
from dataclasses import dataclass

UNKNOWN = "unknown"
# A clock that is read twice without anything between is read again within less than this.
GAP_NS = 1000


@dataclass(frozen=True)
class Complaint:
    """One thing about the machine that disturbs measuring.

    Attributes
    ----------
    what : str
        What was found, with its number.
    why : str
        What it does to a measurement.
    cure : str
        The command, option or step that ends it.
    serious : bool
        False for a remark that alone does not make the machine unfit.
    """

    what: str
    why: str
    cure: str
    serious: bool = True


def complaints(
    fingerprint: dict, load: dict, jitter: dict | None = None, resolution: int | None = None
) -> list[Complaint]:
    """Return what disturbs measuring on this machine, the settings first, then what runs on it.

    Parameters
    ----------
    fingerprint, load : dict
        From `machine.fingerprint` and `machine.load`; "unknown" is no reason to complain.
    jitter : dict or None
        From `jitter`; None is not judged.
    resolution : int or None
        From `timer_resolution`, ns; None is not judged.

    Returns
    -------
    list of Complaint
    """
    return [
        *_clock_settings(fingerprint),
        *_clock_now(fingerprint, load),
        *_virtual(fingerprint, load),
        *_neighbours(fingerprint, load),
        *_memory(fingerprint, load),
        *_layout(fingerprint),
        *_timer(resolution),
        *_gaps(jitter),
    ]


def quiet_enough(found: Iterable[Complaint]) -> bool:
    """Return whether nothing serious was found."""
    return not any(complaint.serious for complaint in found)


def timer_resolution(readings: int = 20_000) -> int:
    """Return the smallest difference above zero between two readings of the clock, in ns."""
    clock = time.perf_counter_ns
    smallest = None
    last = clock()
    while readings > 0 or smallest is None:
        now = clock()
        if now > last and (smallest is None or now - last < smallest):
            smallest = now - last
        last = now
        readings -= 1
    return smallest


def jitter(seconds: float = 0.3) -> dict:
    """Spin on the clock and return how much time was taken away from the loop.

    Parameters
    ----------
    seconds : float
        How long to spin.

    Returns
    -------
    dict
        ``lost``: the share of time in gaps above 1 us; ``largest_ns``: the longest gap;
        ``gaps``: {"1us", "10us", "100us", "1ms": number of gaps from this length to the next}.
    """
    clock = time.perf_counter_ns
    found = []
    start = last = clock()
    end = start + int(seconds * 1e9)
    while last < end:
        now = clock()
        if now - last > GAP_NS:
            found.append(now - last)
        last = now
    return gap_summary(found, last - start)


def gap_summary(gaps: list[int], total: int) -> dict:
    """Return what `jitter` returns, of the gaps above 1 us among ``total``, both in ns."""
    limits = {"1us": 1_000, "10us": 10_000, "100us": 100_000, "1ms": 1_000_000}
    counts = dict.fromkeys(limits, 0)
    for gap in gaps:
        counts[[name for name, limit in limits.items() if gap >= limit][-1]] += 1
    return {
        "lost": round(sum(gaps) / total, 5) if total else 0.0,
        "largest_ns": max(gaps, default=0),
        "gaps": counts,
    }


def _above(value: object, limit: float) -> bool:
    """Return whether a value is known and above the limit."""
    return isinstance(value, int | float) and value > limit


def _clock_settings(fingerprint: dict) -> Iterable[Complaint]:
    governor = fingerprint.get("governor", UNKNOWN)
    if governor not in ("performance", UNKNOWN):
        yield Complaint(
            f"the CPU frequency governor is {governor!r}",
            "the clock follows the load, so the first samples are slower than the rest",
            "sudo cpupower frequency-set --governor performance",
        )
    if fingerprint.get("turbo") == "on":
        intel = fingerprint.get("cpu_vendor") == "GenuineIntel"
        yield Complaint(
            "turbo is on",
            "the clock depends on temperature and on what the other cores do",
            "echo 1 | sudo tee /sys/devices/system/cpu/intel_pstate/no_turbo"
            if intel
            else "echo 0 | sudo tee /sys/devices/system/cpu/cpufreq/boost",
        )
    quota = fingerprint.get("cpu_quota")
    if isinstance(quota, int | float):
        yield Complaint(
            f"the control group may use the time of {quota:g} CPUs",
            "a process that has used it up is stopped for the rest of the period",
            "start the container with --cpuset-cpus instead of --cpus",
            serious=quota < 1,
        )


def _clock_now(fingerprint: dict, load: dict) -> Iterable[Complaint]:
    highest, now = fingerprint.get("mhz_max"), load.get("mhz_now")
    if _above(highest, 0) and _above(now, 0) and now < 0.7 * highest:
        yield Complaint(
            f"the clock is at {now:.0f} of {highest:.0f} MHz",
            "the CPU is throttled or saves power",
            "sudo cpupower frequency-set --governor performance; sudo turbostat shows throttling",
        )


def _virtual(fingerprint: dict, load: dict) -> Iterable[Complaint]:
    steal = load.get("steal")
    if _above(steal, 0.005):
        yield Complaint(
            f"the hypervisor took {100 * steal:.1f} % of the CPU time",
            "other guests run on the same cores",
            "measure on a machine of your own, or later: vmstat 1 (column st) shows when",
        )
    elif fingerprint.get("virtual") is True:
        yield Complaint(
            "this is a virtual machine",
            "the clock's frequency and what neighbours do cannot be seen from inside",
            "take more rounds and processes, repeat at another time of day, or use real hardware",
            serious=False,
        )


def _neighbours(fingerprint: dict, load: dict) -> Iterable[Complaint]:
    averages, usable = load.get("loadavg"), fingerprint.get("cores_usable")
    stop = "ps -eo pid,pcpu,comm --sort=-pcpu | head, then end or wait for the first ones"
    if _above(usable, 0) and isinstance(averages, list) and averages[0] > 0.5 * usable:
        yield Complaint(
            f"the load of the last minute is {averages[0]:.2f} on {usable} usable CPUs",
            "others compete for cores, caches and memory",
            stop,
        )
    heavy = load.get("heavy_processes")
    if _above(heavy, 0):
        yield Complaint(
            f"{heavy} other process{'es use' if heavy > 1 else ' uses'} more than 10 % of a CPU",
            "others compete for cores, caches and memory",
            stop,
        )
    pressure = load.get("cpu_pressure")
    if _above(pressure, 5):
        yield Complaint(
            f"some task had to wait for a CPU in {pressure:.0f} % of the last 10 s",
            "a measuring process may be put aside in the middle of a sample",
            stop,
        )
    sibling = load.get("sibling_busy")
    if fingerprint.get("smt") != "off" and _above(sibling, 0.05):
        yield Complaint(
            f"an SMT sibling is busy {100 * sibling:.0f} % of the time",
            "two threads share one core's arithmetic units and first-level cache",
            "echo off | sudo tee /sys/devices/system/cpu/smt/control, or --cpu on an idle core",
        )


def _memory(fingerprint: dict, load: dict) -> Iterable[Complaint]:
    free, total = load.get("memory_available"), fingerprint.get("memory_bytes")
    if _above(total, 0) and not _above(free, min(0.1 * total, 2**29)) and free != UNKNOWN:
        yield Complaint(
            f"{(free or 0) / 2**20:.0f} of {total / 2**20:.0f} MiB memory are available",
            "pages may be written to disk while a sample is taken",
            "ps -eo pid,rss,comm --sort=-rss | head, then end the first ones",
        )


def _layout(fingerprint: dict) -> Iterable[Complaint]:
    if fingerprint.get("aslr") == "on":
        yield Complaint(
            "addresses are random (ASLR)",
            "each process places code and data elsewhere, which shifts its times by some per cent; "
            "several processes average over this",
            "setarch --addr-no-randomize rtbench run ... to hold them fixed",
            serious=False,
        )


def _timer(resolution: int | None) -> Iterable[Complaint]:
    if _above(resolution, GAP_NS):
        yield Complaint(
            f"the clock advances in steps of {resolution} ns",
            "short samples are rounded",
            "echo tsc | sudo tee /sys/devices/system/clocksource/clocksource0/current_clocksource",
        )


def _gaps(jitter: dict | None) -> Iterable[Complaint]:
    lost = (jitter or {}).get("lost")
    if _above(lost, 0.01):
        yield Complaint(
            f"{100 * lost:.1f} % of the time went to others while a loop only read the clock "
            f"(the longest gap {jitter['largest_ns'] / 1e6:.2f} ms)",
            "interrupts or other processes cut into the samples",
            "boot with isolcpus=N nohz_full=N rcu_nocbs=N and measure with --cpu N",
        )
