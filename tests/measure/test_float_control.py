"""Flushing and rounding: seen wherever they are switched, in numpy, compiled code and threads."""

import ctypes
import importlib.util
import json
import platform
import subprocess
import sys
import threading
from contextlib import contextmanager

import pytest

from rtbench.experiments import run
from rtbench.experiments.config import Config
from rtbench.measure import float_control
from rtbench.measure.float_control import NEAREST, compiled_state, complaints, state

MXCSR, FTZ, DAZ = 7, 0x8000, 0x0040  # word of glibc's fenv_t on x86-64, and its bits
MODES = {NEAREST: 0, "downward": 0x400, "upward": 0x800, "toward zero": 0xC00}  # its fenv.h
USUAL = {"ftz": False, "daz": False, "rounding": NEAREST}

here = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="glibc's fenv_t on x86-64"
)


def set_control(bits, mask=FTZ | DAZ):
    libm = ctypes.CDLL("libm.so.6")
    words = (ctypes.c_uint32 * 8)()
    libm.fegetenv(words)
    words[MXCSR] = words[MXCSR] & ~mask | bits
    libm.fesetenv(words)


@contextmanager
def flushing(bits):
    set_control(bits)
    try:
        yield
    finally:
        set_control(0)


@pytest.fixture(autouse=True)
def as_usual():
    compiled_state()  # nothing is compiled while a test has changed how this thread computes
    assert state() == compiled_state() == USUAL
    yield
    assert state() == compiled_state() == USUAL


@here
@pytest.mark.parametrize("bits", [0, FTZ, DAZ, FTZ | DAZ])
def test_flushing_is_seen_in_numpy_and_in_compiled_code(bits):
    with flushing(bits):
        found = [state(), compiled_state()]
    right = {"ftz": bool(bits & FTZ), "daz": bool(bits & DAZ), "rounding": NEAREST}
    assert found == [right, right]


@here
@pytest.mark.parametrize("mode", MODES)
def test_rounding_is_seen_in_numpy_and_in_compiled_code(mode):
    libm = ctypes.CDLL("libm.so.6")
    assert libm.fesetround(MODES[mode]) == 0
    try:
        found = [state(), compiled_state()]
    finally:
        libm.fesetround(0)
    assert found == [USUAL | {"rounding": mode}] * 2


@here
def test_it_is_a_setting_of_each_thread():
    found = {}

    def ask(name, bits=None):
        if bits is not None:
            set_control(bits)
        found[name] = compiled_state()

    def in_thread(*what):
        thread = threading.Thread(target=ask, args=what)
        thread.start()
        thread.join()

    in_thread("changed", FTZ)
    ask("this")
    with flushing(FTZ | DAZ):
        in_thread("begun while it flushed")
    assert found["changed"] == USUAL | {"ftz": True}
    assert found["this"] == USUAL
    assert found["begun while it flushed"] == USUAL | {"ftz": True, "daz": True}


@here
def test_a_process_that_flushes_is_told_to_be_unfit():
    code = (
        "import ctypes, sys\n"
        "libm, words = ctypes.CDLL('libm.so.6'), (ctypes.c_uint32 * 8)()\n"
        "libm.fegetenv(words)\n"
        f"words[{MXCSR}] |= {FTZ}\n"
        "libm.fesetenv(words)\n"
        "from rtbench.cli import main\n"
        "sys.argv = ['rtbench', 'machine', '--format', 'json']\n"
        "main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    found = json.loads(done.stdout)
    assert found["float_state"] == USUAL | {"ftz": True}
    assert not found["quiet_enough"]
    assert "subnormal results (FTZ) count as zero in this process" in [
        one["what"] for one in found["complaints"]
    ]


def test_what_is_complained_of():
    assert complaints(USUAL, USUAL) == [] and complaints() == []
    both, (odd,) = (
        complaints(USUAL | {"ftz": True}, USUAL | {"daz": True}),
        complaints(USUAL, USUAL | {"rounding": "upward"}),
    )
    assert [one.what for one in both] == [
        "subnormal results (FTZ) and inputs (DAZ) count as zero in this process"
    ]
    assert odd.what == "results are not rounded to nearest but upward"
    assert odd.serious and both[0].serious and "-ffast-math" in both[0].cure


class Nobody:
    def say(self, text):
        pass

    plan = progress = say


def test_a_run_keeps_the_state_and_remarks_upon_it(tmp_path, monkeypatch):
    config = Config(experiment="operations", kernels=("moller1",))
    quiet = run.start(config, Nobody(), tmp_path, "usual").info
    assert quiet["float_state"] == USUAL | {"compiled": USUAL}
    assert not any("subnormal" in remark for remark in quiet["remarks"])
    monkeypatch.setattr(float_control, "compiled_state", lambda: USUAL | {"daz": True})
    told = run.start(config, Nobody(), tmp_path, "flushing").info
    assert told["float_state"]["compiled"]["daz"] and not told["float_state"]["daz"]
    (remark,) = [remark for remark in told["remarks"] if "subnormal" in remark]
    assert remark.startswith("disturbed: subnormal inputs (DAZ) count as zero in this process; ")


@pytest.mark.parametrize("library", ["numba", "scipy.spatial", "trimesh", "embreex"])
def test_libraries_leave_it_as_it_is(library):
    if importlib.util.find_spec(library.split(".")[0]) is None:
        pytest.skip(f"{library} is not installed")
    used = (
        ""
        if library != "embreex"
        else (
            "from rtbench.experiments import peers\n"
            "from rtbench.workloads.solids import cube\n"
            "m = cube()\n"
            "rays = m.vertices * 0, m.vertices\n"
            "assert peers.nearest(peers.find('embree'), m.vertices, m.faces, *rays).hit.all()\n"
        )
    )
    code = (
        f"import {library}\n{used}"
        "from rtbench.measure.float_control import state; import json; print(json.dumps(state()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == USUAL
