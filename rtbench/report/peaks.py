"""The machine's peaks as a record: read from a file, asked for, shown as a table."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from rtbench.errors import RtbenchError
from rtbench.records import tabular
from rtbench.report.digits import interval, measured
from rtbench.report.tables import Table

REAL = {"float32": "float32", "mixed": "float64", "float64": "float64"}
_RATE = ("per_second", "ci_low", "ci_high")
_OPERATIONS = {
    "add": "additions",
    "mul": "multiplications",
    "both": "additions and multiplications",
    "div": "divisions",
    "fma": "fused multiply-adds, two operations each",
}


class Peak(NamedTuple):
    """A rate with its 95 % interval, in operations or bytes a second."""

    rate: float
    low: float
    high: float


class Level(NamedTuple):
    """A level of the memory; ``holds`` is its size in bytes, infinite for the memory itself."""

    name: str
    holds: float
    bandwidth: Peak


class Peaks:
    """What a machine can do at most.

    Parameters
    ----------
    told : mapping
        As :func:`rtbench.measure.peaks.peaks` returns it.

    Raises
    ------
    RtbenchError
        If it is not that.
    """

    def __init__(self, told: Mapping) -> None:
        self.told = dict(told)
        try:
            self.machine = str(told["machine"]["label"])
            self._arithmetic = {
                (one["form"], one["precision"], one["operation"]): _peak(one)
                for one in told["arithmetic"]
            }
            self._bits = {
                (one["form"], one["precision"]): int(one["register_bits"])
                for one in told["arithmetic"]
            }
            self.levels = sorted(
                (
                    Level(one["level"], float(one["holds_bytes"] or "inf"), _peak(one))
                    for one in told["bandwidth"]
                ),
                key=lambda level: level.holds,
            )
            for form in ("scalar", "vector"):
                for precision in ("float32", "float64"):
                    for operation in ("add", "mul", "both", "div"):
                        self.arithmetic(form, precision, operation)
            _ = self.levels[-1]
        except (KeyError, IndexError, TypeError, ValueError) as problem:
            raise RtbenchError(f"these are no peaks of rtbench: {problem!r} is missing") from None

    def arithmetic(self, form: str, precision: str, operation: str) -> Peak:
        """Return operations a second: form scalar or vector, operation add, mul, both or div."""
        return self._arithmetic[form, REAL[precision], operation]

    def has_fma(self, form: str, precision: str) -> bool:
        """Return whether the machine multiplies and adds in one operation."""
        return (form, REAL[precision], "fma") in self._arithmetic

    def register_bits(self, precision: str) -> int:
        """Return the width of the registers in which the vector peak was reached."""
        return self._bits["vector", REAL[precision]]

    def level(self, size: float) -> Level:
        """Return the smallest level that holds so many bytes."""
        return next((one for one in self.levels if size <= one.holds), self.levels[-1])


def read_peaks(path: Path) -> Peaks:
    """Read peaks that were kept, as peaks.json or as printed by ``rtbench roofline``.

    Raises
    ------
    RtbenchError
        If the file cannot be read or holds no peaks.
    """
    try:
        told = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as problem:
        raise RtbenchError(f"cannot read {path}: {tabular.reason(problem)}") from None
    except ValueError as problem:
        raise RtbenchError(f"{path} is no JSON: {problem}") from None
    if not isinstance(told, dict):
        raise RtbenchError(f"{path} holds no peaks of rtbench: not one object")
    try:
        return Peaks(told)
    except RtbenchError as problem:
        raise RtbenchError(f"{path}: {problem}") from None


def peaks_table(peaks: Peaks) -> Table:
    """Return the peaks as a table: a row a rate, in G operations or GB a second."""
    rows = []
    for one in peaks.told["arithmetic"]:
        width = f"{one['register_bits']} bit" if one["register_bits"] else "no vector registers"
        form = f"vector, {width}" if one["form"] == "vector" else "scalar"
        what = f"{_OPERATIONS.get(one['operation'], one['operation'])}, {one['precision']}, {form}"
        rows.append(_row(what, one, "Gop/s"))
    for one in peaks.told["bandwidth"]:
        size = f"{one['buffer_bytes'] / 1024:,.0f} KiB"
        rows.append(_row(f"reading {one['level']} ({size})", one, "GB/s"))
    cpu = peaks.told["machine"].get("cpu_model") or peaks.machine
    notes = [f"{cpu}; medians of {peaks.told.get('rounds')} rounds, taking turns"]
    if peaks.told.get("caches_known") is False:
        notes.append("this machine does not tell the sizes of its caches: usual ones assumed")
    notes += [f"{remark} (the peaks are higher)" for remark in peaks.told.get("remarks") or []]
    return Table(
        "peaks",
        rows,
        ["what", "peak", "interval", "unit"],
        "what this machine can do at most, on one core",
        ["what", "peak", "ci_low", "ci_high", "unit"],
        headers={"interval": "95 % interval"},
        notes=notes,
    )


def _row(what: str, one: Mapping, unit: str) -> dict:
    rate, low, high = (one[name] / 1e9 for name in _RATE)
    return {
        "what": what,
        "peak": measured(rate, low, high),
        "interval": interval(rate, low, high),
        "ci_low": low,
        "ci_high": high,
        "unit": unit,
    }


def _peak(one: Mapping) -> Peak:
    rate = Peak(*(float(one[name]) for name in _RATE))
    if not 0 < rate.low <= rate.rate <= rate.high < float("inf"):
        raise ValueError(f"a positive rate inside its interval, not {tuple(rate)}")
    return rate
