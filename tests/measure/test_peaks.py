"""The loops do what they say, in the registers that they say; the rates are what was timed."""

import json
import platform
import re

import numpy as np
import pytest

from rtbench.compiled.machine_code import instructions
from rtbench.measure import machine, microbenchmarks
from rtbench.measure.peaks import CHAINS, Loop, median_interval, peaks

X86 = platform.machine().lower() in ("x86_64", "amd64")
FLAGS = machine.fingerprint()["cpu_flags"]
CHAIN = CHAINS[32 if "avx512f" in FLAGS else 16]
CASES = [
    (operation, precision, form)
    for operation in ("add", "mul", "both", "div")
    for precision in ("float32", "float64")
    for form in ("scalar", "vector")
]


def ran(operation, precision, form, start, term, factor, repetitions):
    """Return the values after some repetitions, a row a chain, and the operations of each."""
    made = microbenchmarks.arithmetic(operation, precision, form, CHAIN)
    real = np.dtype(precision).type
    values = np.full(made.values, start, dtype=real)
    made.instance.call(values, real(term), real(factor), repetitions)
    return values.reshape(CHAIN, -1), made.steps * repetitions, made


@pytest.mark.parametrize(("operation", "precision", "form"), CASES)
def test_every_operation_is_done(operation, precision, form):
    values, count, made = ran(operation, precision, form, 1, 1, 2, 2)
    wanted = {"add": 1.0 + count, "mul": 2.0**count, "div": 2.0**-count}
    if operation == "both":
        assert np.all(values[::2] == wanted["add"]) and np.all(values[1::2] == wanted["mul"])
    else:
        assert np.all(values == wanted[operation])
    assert made.flops * 2 == values.size * count  # in two repetitions


@pytest.mark.skipif(not X86 or "fma" not in FLAGS, reason="reads the assembly of x86-64 with FMA")
@pytest.mark.parametrize("form", ["scalar", "vector"])
def test_a_product_and_a_sum_are_one_instruction_and_two_operations(form):
    values, count, made = ran("fma", "float32", form, 1, 1, 1, 2)
    assert np.all(values == 1 + count)
    values, count, made = ran("fma", "float32", form, 1, 0, 2, 2)
    assert np.all(values == 2.0**count)
    assert made.flops * 2 == 2 * values.size * count
    mnemonics = [line.split()[0] for line in instructions(made.instance.assembly)]
    kind = "ps" if form == "vector" else "ss"
    fused = [name for name in mnemonics if re.match(rf"vfmadd\d+{kind}$", name)]
    assert fused and len(fused) % (CHAIN * made.steps) == 0
    assert not any(re.match(r"v?(add|mul)[sp]s$", name) for name in mnemonics)


@pytest.mark.skipif(not X86, reason="reads the assembly of x86-64")
@pytest.mark.parametrize(("operation", "precision", "form"), CASES)
def test_the_machine_code_holds_these_operations_and_no_others(operation, precision, form):
    made = microbenchmarks.arithmetic(operation, precision, form, CHAIN)
    lines = instructions(made.instance.assembly)
    kind = ("p" if form == "vector" else "s") + ("s" if precision == "float32" else "d")
    found = [re.match(r"v?(add|mul|div|fn?m\w+?)([ps][sd])\s", line) for line in lines]
    done = [(match[1], match[2]) for match in found if match]
    names = {"add", "mul"} if operation == "both" else {operation}
    assert set(done) == {(name, kind) for name in names}
    # All of a round stands there, be it once or unrolled.
    assert len(done) % (CHAIN * made.steps) == 0
    assert all(sum(name == one for one, _ in done) * len(names) == len(done) for name in names)
    arithmetic = [line for line, match in zip(lines, found, strict=True) if match]
    bits = microbenchmarks.register_bits(made.instance.assembly)
    if form == "scalar":
        assert bits == 0
    else:
        registers = {word for line in arithmetic for word in re.findall(r"[xyz]mm", line)}
        assert registers == {{128: "xmm", 256: "ymm", 512: "zmm"}[bits]}
        assert bits >= (256 if "avx" in FLAGS else 128)


def test_reading_takes_every_word_in_every_repetition():
    random = np.random.default_rng(5)
    values = random.integers(0, 2**63, 5_000, dtype=np.uint64)
    first = second = 0
    for _ in range(3):
        first ^= int(np.bitwise_xor.reduce(values[:2_500]))
        second ^= int(np.bitwise_xor.reduce(values[2_500:]))
        first = (first + second) % 2**64
    assert microbenchmarks.reading()(values, 3) == first


@pytest.mark.skipif(not X86, reason="reads the assembly of x86-64")
def test_reading_loads_whole_vector_registers():
    lines = instructions(microbenchmarks.reading_instance().assembly)
    loads = [line for line in lines if re.match(r"v?(pxor|mov[du]q[ua]|movup)\w*\s.*\(", line)]
    widest = "zmm" if any("zmm" in line for line in lines) else "ymm"
    if "avx2" in FLAGS:
        assert sum(widest in line for line in loads) >= 2


def test_a_buffer_begins_on_a_page_and_is_backed():
    values = microbenchmarks.buffer(4096)
    assert values.ctypes.data % 4096 == 0 and values.nbytes == 4096
    assert len(np.unique(values)) == len(values)


# David & Nagaraja, table of the distribution-free intervals of the median: ranks, from 1.
@pytest.mark.parametrize(
    ("n", "low", "high"), [(6, 1, 6), (8, 1, 8), (9, 2, 8), (12, 3, 10), (15, 4, 12), (25, 8, 18)]
)
def test_interval_of_the_median(n, low, high):
    values = list(range(1, n + 1))
    np.random.default_rng(n).shuffle(values)
    assert median_interval(values) == (low, high)


def test_rates_are_amounts_over_time(monkeypatch):
    # A clock that says 2 ms for each repetition.
    told = []
    monkeypatch.setattr("rtbench.measure.peaks.stopwatch", lambda call: (call(), 2e-3 * told[-1]))
    loop = Loop({"operation": "add"}, told.append, amount=6e6)
    loop.calibrate(0.1)
    assert loop.repetitions == 50
    for _ in range(3):
        loop.sample()
    assert loop.told() == {
        "operation": "add",
        "per_second": pytest.approx(3e9),
        "ci_low": pytest.approx(3e9),
        "ci_high": pytest.approx(3e9),
    }


def test_peaks_are_of_every_form_and_level(monkeypatch):
    known = machine.fingerprint() | {
        "caches": [
            {"level": 1, "type": "data", "size_bytes": 32 << 10, "shared_by": 1},
            {"level": 1, "type": "instruction", "size_bytes": 8 << 10, "shared_by": 1},
            {"level": 2, "type": "unified", "size_bytes": 512 << 10, "shared_by": 1},
            {"level": 3, "type": "unified", "size_bytes": "unknown", "shared_by": 1},
        ]
    }
    monkeypatch.setattr(machine, "fingerprint", lambda: known)
    done, said = [], []
    told = peaks(rounds=3, seconds=1e-4, say=said.append, progress=done.append)
    assert json.loads(json.dumps(told)) == told
    assert done == [1 / 3, 2 / 3, 1.0] and said
    forms = {(one["operation"], one["precision"], one["form"]) for one in told["arithmetic"]}
    assert forms >= set(CASES)
    levels = {one["level"]: (one["holds_bytes"], one["buffer_bytes"]) for one in told["bandwidth"]}
    assert list(levels) == ["L1", "L2", "memory"]
    assert levels["L1"] == (32 << 10, 16 << 10)
    assert levels["L2"] == (512 << 10, 256 << 10)
    assert levels["memory"][0] is None and levels["memory"][1] >= 8 << 20
    for one in told["arithmetic"] + told["bandwidth"]:
        assert 0 < one["ci_low"] <= one["per_second"] <= one["ci_high"]


def test_unknown_caches_are_said_to_be_so(monkeypatch):
    known = machine.fingerprint() | {"caches": "unknown"}
    monkeypatch.setattr(machine, "fingerprint", lambda: known)
    told = peaks(rounds=1, seconds=1e-5)
    assert told["caches_known"] is False
    assert [one["level"] for one in told["bandwidth"]] == ["L1", "L2", "L3", "memory"]
