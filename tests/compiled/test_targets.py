"""Targets: the compiler does what they say, in processes of their own."""

import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest

from rtbench.compiled import elsewhere, targets
from rtbench.compiled.elsewhere import Process, instantiate_for
from rtbench.compiled.instantiate import load
from rtbench.compiled.machine_code import instructions
from rtbench.compiled.targets import TARGETS, environment
from rtbench.errors import RtbenchError

SUM_OF_PRODUCTS = """def sum_of_products(a, x, y):
    for i in range(x.shape[0]):
        y[i] = a * x[i] + y[i]
"""
SIGNATURE = "void(float32, float32[::1], float32[::1])"
OTHERS = [name for name in TARGETS if name != "native"]
# One rounding makes 2^-24 of what two make 0: (1 + 2^-12)^2 = 1 + 2^-11 + 2^-24.
ROUNDED = np.float32(1 + 2**-12)


@pytest.fixture(autouse=True, scope="module")
def no_process_is_left():
    yield
    elsewhere.close()


def made(target, flags="strict"):
    if targets.missing(target):
        pytest.skip(f"this processor does not run {target}")
    return instantiate_for(target, SUM_OF_PRODUCTS, signature=SIGNATURE, flags=flags)


def result_of(instance):
    x = np.full(100, ROUNDED)
    y = np.full(100, -(1 + 2**-11), np.float32)
    instance.call(ROUNDED, x, y)
    return y


def registers(instance):
    code = "\n".join(instructions(instance.assembly))
    return {name for name in ("xmm", "ymm", "zmm") if f"%{name}" in code}


@pytest.mark.parametrize(
    ("target", "widest"),
    [("x86-64", "xmm"), ("avx2", "ymm"), ("avx512-256", "ymm"), ("avx512-512", "zmm")],
)
def test_vectors_are_as_wide_as_the_target_says(target, widest):
    assert max(registers(made(target))) == widest


def test_the_older_the_target_the_fewer_instructions_it_knows():
    def words(target):
        return {line.split()[0] for line in instructions(made(target).assembly) if " " in line}

    assert not any(word.startswith("v") for word in words("x86-64"))  # AVX encodings do
    assert any(word.startswith("vmulps") for word in words("avx2"))


@pytest.mark.parametrize("target", TARGETS)
def test_strict_rounds_every_product_and_every_sum(target):
    strict = made(target)
    assert not re.search("fn?m(add|sub)", strict.assembly)
    assert result_of(strict).tolist() == [0.0] * 100


@pytest.mark.parametrize("target", ["avx2", "avx512-256", "avx512-512"])
@pytest.mark.parametrize("flags", ["contract", "fast"])
def test_contraction_fuses_where_the_processor_can(target, flags):
    fused = made(target, flags)
    assert "vfmadd" in fused.assembly
    assert result_of(fused).tolist() == [2.0**-24] * 100
    assert fused.path != made(target).path


def test_contraction_changes_nothing_where_the_processor_cannot_fuse():
    assert made("x86-64", "contract").code_digest == made("x86-64").code_digest


@pytest.mark.parametrize("target", OTHERS)
def test_the_code_stays_out_of_this_process(target):
    instance = made(target)
    result_of(instance)
    assert not [name for name in sys.modules if instance.path.stem in name]
    assert instance.environment == environment(target)
    with pytest.raises(RtbenchError, match="was made for x86-64"):
        load(instance.path, instance.entry)


def test_native_is_this_process():
    instance = made("native")
    assert instance.environment == ()
    assert [name for name in sys.modules if instance.path.stem in name]


def test_targets_are_files_of_their_own():
    names = [name for name in TARGETS if not targets.missing(name)]
    assert len({made(name).path for name in names}) == len(names)


@pytest.fixture
def another():
    process = Process(environment("x86-64" if "x86-64" in targets.runnable() else "native"))
    yield process
    process.close()


def test_a_second_process_compiles_nothing(another):
    instance = made("x86-64")
    told = another.ask("compile", SUM_OF_PRODUCTS, signature=SIGNATURE)
    assert told == (str(instance.path), "sum_of_products", False)


def test_records_arrive_as_they_are_and_only_what_was_written_comes_back(another):
    record = "np.dtype([('v', np.float32, 3), ('wide', np.float64)], align=True)"
    source = """def sums(records, out, other):
    for i in range(records.shape[0]):
        for k in range(3):
            out[i, k] = np.float32(records[i].v[k] + records[i].wide)
    return 7
"""
    path, entry, _ = another.ask(
        "compile",
        source,
        signature="int64(RECORD[::1], float32[:, ::1], float32[::1])",
        constants={"RECORD": f"from_dtype({record})"},
    )
    record = np.dtype([("v", np.float32, 3), ("wide", np.float64)], align=True)
    records = np.zeros(2, record)
    records["v"], records["wide"] = [[1, 2, 3], [4, 5, 6]], 0.5
    out, other = np.zeros((2, 3), np.float32), np.zeros(4, np.float32)
    result, written = another.ask("call", path, entry, records, out, other)
    assert result == 7 and list(written) == [1]
    assert written[1].tolist() == [[1.5, 2.5, 3.5], [4.5, 5.5, 6.5]]


def test_closed_processes_start_again():
    instance = made("x86-64")
    elsewhere.close()
    assert not elsewhere._running
    assert result_of(instance).tolist() == [0.0] * 100


def test_where_the_cache_cannot_be_written_code_outlives_the_process_that_made_it():
    code = """
from rtbench.compiled import cache, elsewhere, targets
target = "x86-64" if "x86-64" in targets.runnable() else "native"
source = "def f(x):\\n    return x + 1\\n"
made = elsewhere.instantiate_for(target, source, signature="int64(int64)")
elsewhere.close()
print(made.path.is_file(), made.call(1), made.path.is_relative_to(cache.folder()))
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"RTBENCH_CACHE_DIR": "/dev/null/no folder"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["True", "2", "True"]
    assert done.stderr.count("cannot be written") == 1


def test_what_does_not_compile_is_told_in_one_line(another):
    with pytest.raises(RtbenchError, match=r"^[^\n]*nothing[^\n]*$"):
        another.ask("compile", "def f(x):\n    return x.nothing\n", signature="int64(int64)")
    assert another.ask("compile", "def f(x):\n    return x\n", signature="int64(int64)")


def test_a_process_that_is_killed_is_told_in_one_line(another):
    os.kill(another._process.pid, signal.SIGKILL)
    with pytest.raises(RtbenchError, match=r"^a compiling process ended by signal 9$"):
        another.ask("compile", SUM_OF_PRODUCTS, signature=SIGNATURE)


def test_the_process_ends_with_its_parent():
    process = subprocess.run(
        [sys.executable, "-P", "-m", "rtbench.compiled.elsewhere"],
        input=b"",
        capture_output=True,
        timeout=60,
    )
    assert (process.returncode, process.stdout, process.stderr) == (0, b"", b"")


@pytest.mark.parametrize("target", ["avx512-256", "avx512-512"])
def test_a_target_that_cannot_run_here_is_refused(target, monkeypatch):
    """As on a Haswell of 2013, which has AVX2 and no more; nothing is started for it."""
    haswell = dict.fromkeys(TARGETS["avx2"].needs, True) | {"avx512f": False}
    monkeypatch.setattr(targets, "_host_features", lambda: haswell)
    monkeypatch.setattr(elsewhere, "_process", lambda needed: pytest.fail("started"))
    assert targets.runnable() == ["native", "x86-64", "avx2"]
    with pytest.raises(RtbenchError, match=r"lacks avx512f, avx512bw.*avx2") as raised:
        instantiate_for(target, SUM_OF_PRODUCTS, signature=SIGNATURE)
    assert "\n" not in str(raised.value)


def test_on_another_architecture_only_native_runs(monkeypatch):
    monkeypatch.setattr(targets, "_host_features", lambda: {"neon": True})
    assert targets.runnable() == ["native"]


def test_an_unknown_target_is_told_with_the_nearest():
    with pytest.raises(RtbenchError, match=r"target 'avx-2'.*did you mean 'avx2'"):
        environment("avx-2")
