"""POV-Ray and tachyon as against_povray.py runs them: one thread, no window, statistics parsed."""

import os
import re
import subprocess
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

FIGURE = r"([\d.]+)"


@dataclass
class Run:
    """One run of another ray tracer; seconds.

    Attributes
    ----------
    trace : float
        Tracing alone, as the program itself tells it, by the clock.
    cpu : float
        Of the processor: in tachyon, which does not tell it, of the process less what it says it
        took for reading, preparing and writing.
    process : float
        From starting the process to its end: reading, building and writing included.
    rays : dict of str to int
        What it says it traced.
    pixels : (H, W, 3) array
        As written, from 0 to 1 (float64).
    """

    trace: float
    cpu: float
    process: float
    rays: dict[str, int] = field(default_factory=dict)
    pixels: np.ndarray | None = None


def povray(text: str, size: int, flat: bool = False) -> Run:
    """Render a scene; ``flat``: each thing in its pigment's colour, without light (+Q0)."""
    with tempfile.TemporaryDirectory() as folder:
        scene, made = Path(folder) / "scene.pov", Path(folder) / "made.ppm"
        scene.write_text(text)
        command = ["povray", f"+I{scene}", f"+O{made}", f"+W{size}", f"+H{size}", "+WT1"]
        command += ["-D", "-A", "-V", "-GD", *(["+FP", "+Q0"] if flat else ["+FP16"])]
        told, process, _ = finished(command)
        pixels = portable(made)
    traced = told[told.index("Trace Time") :]
    return Run(
        figure(rf"Trace Time: .*\({FIGURE} seconds\)", traced),
        figure(rf"using 1 thread\(s\) with {FIGURE} CPU-seconds", traced),
        process,
        {
            "rays": int(figure(rf"Rays: +{FIGURE}", told)),
            "shadow tests": int(figure(rf"Shadow Ray Tests: +{FIGURE}", told)),
            "reflected": int(figure(rf"Reflected Rays: +{FIGURE}", told)),
            "refracted": int(figure(rf"Refracted Rays: +{FIGURE}", told)),
        },
        pixels,
    )


def tachyon(text: str, size: int, depth: int, flat: bool = False) -> Run:
    """Render an NFF scene; ``flat``: what is hit white, the rest black.

    Its depth counts the primary ray as the first. Highlights: the NFF reader sets none.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene, made = Path(folder) / "scene.nff", Path(folder) / "made.ppm"
        scene.write_text(text)
        command = ["tachyon", str(scene), "-o", str(made), "-format", "PPM"]
        command += ["-res", str(size), str(size), "-numthreads", "1", "+V"]
        command += ["-raydepth", str(depth + 1), "-lowestshade" if flat else "-fullshade"]
        told, process, cpu = finished(command)
        return Run(figure(rf"Ray Tracing Time: +{FIGURE}", told), cpu, process, {}, portable(made))


def finished(command: list[str]) -> tuple[str, float, float]:
    """Run a program; return what it said, and its seconds by the clock and of the processors."""
    with tempfile.TemporaryFile("w+") as said:
        begin = time.perf_counter()
        started = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(started.pid, 0)
        process = time.perf_counter() - begin
        started.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        told = said.read()
    if started.returncode:
        raise SystemExit(f"{' '.join(command)} failed:\n{told[-2000:]}")
    return told, process, used.ru_utime + used.ru_stime


def figure(pattern: str, told: str) -> float:
    """Return the figure that a program told, 0 where it is silent about it."""
    found = re.search(pattern, told)
    return float(found[1]) if found else 0.0


def portable(path: Path) -> np.ndarray:
    """Read a binary PPM file of 8 or 16 bits as numbers from 0 to 1, without any curve."""
    data = path.read_bytes()
    head = re.match(rb"P6\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)\s", data)
    width, height, most = map(int, head.groups())
    kind = ">u2" if most > 255 else "u1"
    return np.frombuffer(data[head.end() :], kind).reshape(height, width, 3) / most
