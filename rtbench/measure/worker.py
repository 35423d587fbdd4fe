"""A worker process: loads compiled loops and data, times them when it is told to.

It reads messages (a line of JSON each) from its stdin and ends when that closes; it answers on
its stdout. ``{"cells": [...]}``, with null for another worker's, is answered by ``{"ready": true}``
once every answer has been checked; ``{"round": [[cell, repetitions], ...]}`` by a line
``[cell, ns, cpu_ns]`` a sample. Any answer that is not, bit for bit, what was expected is told as
``{"wrong": cell}``.
"""

from __future__ import annotations

import gc
import json
import signal
import sys
import time
from pathlib import Path

import numpy as np

from rtbench.compiled.instantiate import load
from rtbench.measure.machine import pin


class Cell:
    """One loop over one list of pairs.

    ``room`` holds the outputs; cells take turns in it, since one after the other is timed.
    """

    def __init__(self, told: dict, arrays: dict[str, np.ndarray], room: dict) -> None:
        self.call = load(Path(told["module"]), told["entry"]).call
        self.records = arrays[told["triangles"]], arrays[told["rays"]]
        self.pairs = arrays[told["pairs"]]
        self.order = told["order"]
        self.random = np.random.default_rng(told["seed"])
        self.expected = [arrays[name] for name in told["expected"]]
        self.outputs = [
            room.setdefault(
                (place, values.shape, values.dtype), np.empty(values.shape, values.dtype)
            )
            for place, values in enumerate(self.expected)
        ]

    def time(self, repetitions: int) -> tuple[int, int] | None:
        """Time the loop; return wall and thread nanoseconds, or None where an answer is wrong."""
        first, second = self.pairs, np.zeros(repetitions, dtype=np.uint64)
        if self.order == "shuffled":
            first, second = second[:1], self.random.permutation(np.repeat(first, repetitions))
        elif self.order != "repeat":
            first, second = second, first
        self._forget()
        cpu = time.thread_time_ns()
        begin = time.perf_counter_ns()
        self.call(*self.records, first, second, *self.outputs)
        wall = time.perf_counter_ns() - begin
        cpu = time.thread_time_ns() - cpu
        return (wall, cpu) if self._as_expected() else None

    def _forget(self) -> None:
        for values in self.outputs:
            values.view(np.uint8).fill(0xAA)

    def _as_expected(self) -> bool:
        return all(
            self._bits(got) == self._bits(wanted)
            for got, wanted in zip(self.outputs, self.expected, strict=True)
        )

    def _bits(self, values: np.ndarray) -> bytes:
        """Return what a run writes: a row a pair, or nothing where the loop has no such output."""
        return values[self.pairs].tobytes() if values.size else b""


def loaded(path: str) -> np.ndarray:
    """Return a kept array; a file does not say that its records are aligned, numba must know."""
    array = np.load(path)
    if array.dtype.names is None:
        return array
    told = array.dtype
    fields = {
        "names": list(told.names),
        "formats": [told[name] for name in told.names],
        "offsets": [told.fields[name][1] for name in told.names],
        "itemsize": told.itemsize,
    }
    return array.view(np.dtype(fields, align=True))


def tell(message: object) -> None:
    print(json.dumps(message), flush=True)


def main() -> None:
    """Serve the parent until it closes our stdin."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    cells: list[Cell | None] = []
    for line in sys.stdin:
        message = json.loads(line)
        if message.get("cpu") is not None:
            pin(message["cpu"])
        if "cells" in message:
            arrays = {name: loaded(path) for name, path in message["arrays"].items()}
            room: dict = {}
            cells = [told and Cell(told, arrays, room) for told in message["cells"]]
            wrong = [i for i, cell in enumerate(cells) if cell and cell.time(1) is None]
            gc.collect()
            gc.freeze()
            gc.disable()
            tell({"wrong": wrong[0]} if wrong else {"ready": True})
        for i, repetitions in message.get("round", ()):
            warm = cells[i].time(1)
            timed = warm and cells[i].time(repetitions)
            if timed is None:
                tell({"wrong": i})
                return
            tell([i, *timed])


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:  # the parent is gone
        sys.stderr.close()
