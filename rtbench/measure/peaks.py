"""What this machine can do at most: arithmetic and reading, measured here and now.

Nothing is looked up: under a hypervisor, or beside other work, a processor has less than its
data sheet says, and kernels are measured on the same machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rtbench.measure import machine, microbenchmarks, noise
from rtbench.measure.procfs import UNKNOWN
from rtbench.measure.sampler import stopwatch

ROUNDS = 15
SECONDS = 0.004  # of a sample: long beside the clock's ticks, short beside a scheduler's turn
# Where a machine does not tell its caches: sizes that most have at least.
USUAL_CACHES = {1: 32 << 10, 2: 256 << 10, 3: 4 << 20}
MEMORY_BUFFER = 64 << 20, 1 << 30  # the least and the most bytes that are read from memory
# Vector registers: 32 with AVX-512 and on ARM, else 16. What they cannot hold is spilt.
CHAINS = {16: 12, 32: 16}


@dataclass
class Loop:
    """What is timed: ``call(repetitions)`` does ``amount`` operations or bytes in each."""

    facts: dict
    call: Callable[[int], object]
    amount: float
    repetitions: int = 1
    rates: list[float] = field(default_factory=list)

    def calibrate(self, seconds: float) -> None:
        """Choose the repetitions so that a sample takes about so long."""
        self.call(1)
        _, taken = stopwatch(lambda: self.call(self.repetitions))
        while taken < seconds / 4:
            self.repetitions *= 2 if taken <= 0 else max(2, min(1000, int(seconds / taken / 2)))
            _, taken = stopwatch(lambda: self.call(self.repetitions))
        self.repetitions = max(1, round(self.repetitions * seconds / taken))

    def sample(self) -> None:
        """Time it once more."""
        _, taken = stopwatch(lambda: self.call(self.repetitions))
        self.rates.append(self.amount * self.repetitions / max(taken, 1e-9))

    def told(self) -> dict:
        """Return its facts with the median rate and its interval."""
        low, high = median_interval(self.rates)
        rate = {"per_second": float(np.median(self.rates)), "ci_low": low, "ci_high": high}
        return self.facts | rate


def peaks(
    rounds: int = ROUNDS,
    seconds: float = SECONDS,
    say: Callable[[str], None] = lambda text: None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> dict:
    """Measure the machine's peaks, all of them in each of several rounds.

    Parameters
    ----------
    rounds : int
        Samples of each.
    seconds : float
        Of a sample.
    say, progress : callable
        Are given what is being prepared, and the fraction of the rounds that is done.

    Returns
    -------
    dict
        Ready for JSON: ``machine`` (label, cpu_model), ``rounds``, ``caches_known`` (bool),
        ``remarks`` (what disturbed the machine: its peaks are higher then),
        ``arithmetic`` (a dict a peak: operation, precision, form, register_bits, and per_second,
        ci_low, ci_high in floating-point operations a second), ``bandwidth`` (a dict a level of
        the memory: level, holds_bytes or None, buffer_bytes, and per_second, ci_low, ci_high in
        bytes a second). Rates are medians with 95 % intervals.
    """
    known = machine.fingerprint()
    # The load average is left out: it remembers what ended before.
    now = machine.load() | {"loadavg": UNKNOWN}
    disturbed = [each for each in noise.complaints(known, now) if each.serious]
    loops = [*_arithmetic(known, say), *_bandwidths(known, say)]
    for loop in loops:
        loop.calibrate(seconds)
    for number in range(rounds):
        for loop in loops:  # taking turns: a disturbance falls on all of them
            loop.sample()
        progress((number + 1) / rounds)
    told = [loop.told() for loop in loops]
    return {
        "machine": {name: known[name] for name in ("label", "cpu_model")},
        "rounds": rounds,
        "caches_known": known["caches"] != UNKNOWN,
        "remarks": [f"disturbed: {each.what}; cure: {each.cure}" for each in disturbed],
        "arithmetic": [one for one in told if "operation" in one],
        "bandwidth": [one for one in told if "level" in one],
    }


def _arithmetic(known: dict, say: Callable[[str], None]) -> list[Loop]:
    flags = known["cpu_flags"]
    many = "avx512f" in flags or known["architecture"] in ("aarch64", "arm64")
    loops = []
    for form in microbenchmarks.FORMS:
        for precision in microbenchmarks.PRECISIONS:
            for operation in microbenchmarks.OPERATIONS:
                if operation == "fma" and "fma" not in flags and "asimd" not in flags:
                    continue
                say(f"compiling the peak of {operation} in {precision}, {form}")
                made = microbenchmarks.arithmetic(
                    operation, precision, form, CHAINS[32 if many else 16]
                )
                bits = microbenchmarks.register_bits(made.instance.assembly)
                loops.append(
                    Loop(
                        {
                            "operation": operation,
                            "precision": precision,
                            "form": form,
                            "register_bits": bits,
                        },
                        _on_values(made, np.dtype(precision).type),
                        made.flops,
                    )
                )
    return loops


def _on_values(made: microbenchmarks.Arithmetic, real: type) -> Callable[[int], object]:
    # Near 1 and not 1: no chain overflows, becomes subnormal, or divides by a power of two, which
    # some dividers do sooner.
    values = np.ones(made.values, dtype=real)
    term, factor = real(1e-3), real(1 + 2e-7)

    def call(repetitions: int) -> None:
        values[:] = 1
        made.instance.call(values, term, factor, repetitions)

    return call


def _bandwidths(known: dict, say: Callable[[str], None]) -> list[Loop]:
    say("preparing to read")
    read = microbenchmarks.reading()
    found = []
    for level, holds, size in _levels(known, machine.load().get("memory_available")):
        values = microbenchmarks.buffer(size)
        facts = {"level": level, "holds_bytes": holds, "buffer_bytes": size}
        found.append(Loop(facts, lambda times, values=values: read(values, times), size))
    return found


def _levels(known: dict, available: int | str | None) -> list[tuple[str, int | None, int]]:
    """Return name, capacity and bytes to be read of each level: half of a cache, far over all."""
    sizes = {}
    for cache in known["caches"] if known["caches"] != UNKNOWN else []:
        size, level = cache["size_bytes"], cache["level"]
        if cache["type"] != "instruction" and isinstance(size, int) and isinstance(level, int):
            sizes[level] = size
    sizes = sizes or USUAL_CACHES
    found = [(f"L{level}", size, size // 2 // 16 * 16) for level, size in sorted(sizes.items())]
    least, most = MEMORY_BUFFER
    size = min(max(8 * max(sizes.values()), least), most)
    if isinstance(available, int):
        size = min(size, available // 4)
    return [*found, ("memory", None, size // 16 * 16)]


def median_interval(values: list[float], level: float = 0.95) -> tuple[float, float]:
    """Return an interval of the median that assumes nothing of the distribution.

    Parameters
    ----------
    values : list of float
        Independent samples.
    level : float
        The least probability that the interval holds the median; with fewer than six samples
        not even their whole range reaches 0.95.

    Returns
    -------
    low, high : float
        Two of the values.

    Source: the sign test; David & Nagaraja 2003, Order Statistics, section 7.1.
    """
    ordered = sorted(values)
    n = len(ordered)
    below, place = 0.0, 0
    for k in range(n // 2):
        below += math.comb(n, k) / 2**n
        if 2 * below > 1 - level:
            break
        place = k
    return float(ordered[place]), float(ordered[n - 1 - place])
