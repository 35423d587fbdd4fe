"""Reading what the kernel says in /proc and /sys; what is missing is the word "unknown"."""

import os
import re
import subprocess
import sys
from pathlib import Path

UNKNOWN = "unknown"
ROOT = Path("/")


def text_of(path: Path) -> str:
    """Return a file's text without outer blanks, or "unknown"."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip() or UNKNOWN
    except (OSError, ValueError):
        return UNKNOWN


def known_or(value: str, otherwise: str) -> str:
    """Return the first of two that is known, "unknown" if neither is."""
    return value if value != UNKNOWN else otherwise or UNKNOWN


def number(text: str) -> int | str:
    """Return the whole number that a text is, or "unknown"."""
    return int(text) if re.fullmatch(r"\d+", text) else UNKNOWN


def thousandth(text: str) -> float | str:
    """Return kHz as MHz, or a thousandth of a degree as degrees; "unknown" if no number."""
    return int(text) / 1000 if re.fullmatch(r"\d+", text) else UNKNOWN


def switch(text: str, on: str, off: str) -> str:
    """Return "on" or "off" if the text is one of the characters that mean so, or "unknown"."""
    if len(text) != 1:
        return UNKNOWN
    return "on" if text in on else "off" if text in off else UNKNOWN


def cpu_list(text: str) -> list[int]:
    """Return the CPUs of a list such as "0-3,8", empty where it is none."""
    if not re.fullmatch(r"\d+(-\d+)?(,\d+(-\d+)?)*", text):
        return []
    ends = [part.partition("-")[::2] for part in text.split(",")]
    return [cpu for low, high in ends for cpu in range(int(low), int(high or low) + 1)]


def memory(root: Path, field: str) -> int | str:
    """Return a line of /proc/meminfo in bytes, or "unknown"."""
    found = re.search(rf"^{field}:\s+(\d+) kB", text_of(root / "proc/meminfo"), re.MULTILINE)
    if found:
        return int(found.group(1)) * 1024
    if sys.platform == "darwin" and field == "MemTotal":
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return UNKNOWN


def mhz_now(root: Path = ROOT) -> float | str:
    """Return the clock of the fastest CPU at this moment in MHz, or "unknown"."""
    current = [
        thousandth(text_of(path))
        for path in (root / "sys/devices/system/cpu").glob("cpu[0-9]*/cpufreq/scaling_cur_freq")
    ]
    known = [value for value in current if value != UNKNOWN]
    if not known:
        cpuinfo = text_of(root / "proc/cpuinfo")
        known = [float(mhz) for mhz in re.findall(r"(?m)^cpu MHz\s*:\s*([\d.]+)", cpuinfo)]
    return max(known) if known else UNKNOWN


def said(command: list[str], silence: str = UNKNOWN) -> str:
    """Return what a command prints, "unknown" if it cannot be run or fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.SubprocessError):
        return UNKNOWN
    return done.stdout.strip() or silence if done.returncode == 0 else UNKNOWN
