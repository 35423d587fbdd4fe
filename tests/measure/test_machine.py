"""What is read from a machine: a made-up one, whose every file the test has written itself."""

import ctypes
import json
import os
import platform
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.measure import activity, machine, versions

I7 = """processor\t: 0
vendor_id\t: GenuineIntel
cpu family\t: 6
model\t\t: 158
model name\t: Intel(R) Core(TM) i7-8700K CPU @ 3.70GHz
stepping\t: 10
cpu MHz\t\t: 4300.125
flags\t\t: fpu sse2 sse4_2 avx avx2 fma hypervisor

processor\t: 1
model name\t: another one
cpu MHz\t\t: 800.000
"""


def write(root, files):
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")


@pytest.fixture
def i7(tmp_path):
    cpu = "sys/devices/system/cpu"
    files = {
        "proc/cpuinfo": I7,
        "proc/meminfo": "MemTotal:       16000000 kB\nMemAvailable:    8000000 kB",
        "proc/sys/kernel/osrelease": "6.1.0-test",
        "proc/sys/kernel/randomize_va_space": "2",
        "proc/pressure/cpu": "some avg10=12.50 avg60=0.19 avg300=0.05 total=914290",
        "etc/os-release": 'NAME="x"\nPRETTY_NAME="Testing Linux 1"',
        f"{cpu}/online": "0-1,4-7",
        f"{cpu}/smt/active": "1",
        f"{cpu}/intel_pstate/no_turbo": "0",
        f"{cpu}/cpu0/cpufreq/cpuinfo_min_freq": "800000",
        f"{cpu}/cpu0/cpufreq/cpuinfo_max_freq": "4700000",
        f"{cpu}/cpu0/cpufreq/scaling_governor": "powersave",
        f"{cpu}/cpu0/cache/index0/level": "1",
        f"{cpu}/cpu0/cache/index0/type": "Data",
        f"{cpu}/cpu0/cache/index0/size": "32K",
        f"{cpu}/cpu0/cache/index0/shared_cpu_list": "0,4",
        f"{cpu}/cpu0/cache/index1/level": "3",
        f"{cpu}/cpu0/cache/index1/type": "Unified",
        f"{cpu}/cpu0/cache/index1/size": "12M",
        f"{cpu}/cpu0/cache/index1/shared_cpu_list": "0-1,4-7",
        "sys/fs/cgroup/cpu.max": "150000 100000",
        "sys/class/dmi/id/sys_vendor": "QEMU",
        "sys/class/thermal/thermal_zone0/temp": "41000",
        "sys/class/hwmon/hwmon3/temp1_input": "56500",
    }
    for number, (package, core) in enumerate([(0, 0), (0, 1), (0, 0), (1, 0)]):
        files[f"{cpu}/cpu{number}/topology/physical_package_id"] = str(package)
        files[f"{cpu}/cpu{number}/topology/core_id"] = str(core)
    write(tmp_path, files)
    return tmp_path


def test_fingerprint_reads_every_file(i7):
    found = machine.fingerprint(i7)
    expected = {
        "label": "intel-core-i7-8700k",
        "cpu_model": "Intel(R) Core(TM) i7-8700K CPU @ 3.70GHz",
        "cpu_vendor": "GenuineIntel",
        "cpu_family": 6,
        "cpu_model_number": 158,
        "cpu_stepping": 10,
        "cpu_flags": ["sse2", "sse4_2", "avx", "fma", "avx2"],
        "cores_physical": 3,
        "cores_logical": 6,
        "cpu_quota": 1.5,
        "smt": "on",
        "mhz_min": 800.0,
        "mhz_max": 4700.0,
        "governor": "powersave",
        "turbo": "on",
        "memory_bytes": 16_384_000_000,
        "os": "Testing Linux 1",
        "kernel": "6.1.0-test",
        "virtual": True,
        "hypervisor": "QEMU",
        "aslr": "on",
    }
    assert {key: found[key] for key in expected} == expected
    assert found["caches"] == [
        {"level": 1, "type": "data", "size_bytes": 32768, "shared_by": 2},
        {"level": 3, "type": "unified", "size_bytes": 12 * 2**20, "shared_by": 6},
    ]


def test_load_reads_every_file(i7):
    found = machine.load(i7, seconds=0)
    assert found["cpu_pressure"] == 12.5
    assert found["mhz_now"] == 4300.125
    assert found["temperature_c"] == 56.5
    assert found["memory_available"] == 8_192_000_000


@pytest.mark.parametrize(
    ("files", "key", "value"),
    [
        ({"sys/devices/system/cpu/cpufreq/boost": "1"}, "turbo", "on"),
        ({"sys/devices/system/cpu/cpufreq/boost": "0"}, "turbo", "off"),
        ({"sys/devices/system/cpu/intel_pstate/no_turbo": "1"}, "turbo", "off"),
        ({"sys/devices/system/cpu/smt/active": "0"}, "smt", "off"),
        ({"sys/fs/cgroup/cpu.max": "max 100000"}, "cpu_quota", "none"),
        ({"proc/sys/kernel/randomize_va_space": "0"}, "aslr", "off"),
        ({"proc/cpuinfo": "flags : sse2 avx"}, "virtual", False),
    ],
)
def test_settings_are_told_apart(tmp_path, files, key, value):
    write(tmp_path, files)
    assert machine.fingerprint(tmp_path)[key] == value


def test_the_clock_now_is_the_kernel_s_own_where_it_tells(i7):
    write(i7, {"sys/devices/system/cpu/cpu3/cpufreq/scaling_cur_freq": "3100500"})
    assert machine.load(i7, seconds=0)["mhz_now"] == 3100.5


def test_the_fingerprint_does_not_change_from_moment_to_moment():
    assert machine.fingerprint() == machine.fingerprint()


@pytest.mark.parametrize("system", ["linux", "darwin", "win32"])
def test_nothing_raises_where_nothing_can_be_read(tmp_path, monkeypatch, system):
    monkeypatch.setattr(sys, "platform", system)
    for name in ("sched_getaffinity", "sched_setaffinity", "getloadavg", "sysconf"):
        if system == "win32" and hasattr(os, name):
            monkeypatch.delattr(os, name)
    found = {**machine.fingerprint(tmp_path), **machine.load(tmp_path, seconds=0)}
    json.dumps(found)
    for key in (
        "cpu_vendor",
        "caches",
        "governor",
        "turbo",
        "virtual",
        "aslr",
        "busy",
        "steal",
        "heavy_processes",
        "sibling_busy",
        "mhz_now",
        "cpu_pressure",
        "temperature_c",
    ):
        assert found[key] == "unknown", key
    assert re.fullmatch("[a-z0-9-]+", found["label"])


def test_damaged_files_are_unknown(tmp_path):
    names = [
        "proc/cpuinfo",
        "proc/meminfo",
        "proc/stat",
        "proc/pressure/cpu",
        "etc/os-release",
        "proc/sys/kernel/randomize_va_space",
        "sys/fs/cgroup/cpu.max",
        "proc/77/stat",
        "sys/devices/system/cpu/online",
        "sys/devices/system/cpu/cpu0/cache/index0/size",
        "sys/devices/system/cpu/cpu0/cpufreq/cpuinfo_max_freq",
        "sys/class/thermal/thermal_zone0/temp",
    ]
    for text in (
        b"",
        b"\xff\xfe nonsense: \x00 1-",
        b"cpu0 1 2\nmodel name\t: \n0-x,,",
        b"two words",
        b"1 0",
    ):
        write(tmp_path, {"proc/78/stat": "78 (a) " + "x " * 20})
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_bytes(text)
        found = {**machine.fingerprint(tmp_path), **machine.load(tmp_path, seconds=0)}
        json.dumps(found)
        for key in ("cpu_model", "mhz_max", "temperature_c", "memory_bytes", "cpu_quota"):
            assert found[key] == "unknown", (key, text)
        assert found["caches"][0]["size_bytes"] == "unknown"


@pytest.mark.parametrize(
    ("model", "vendor", "label"),
    [
        ("AMD EPYC", "AuthenticAMD", "amd-epyc"),
        ("AMD Ryzen 7 5800X 8-Core Processor", "AuthenticAMD", "amd-ryzen-7-5800x"),
        (
            "AMD Ryzen 7 PRO 7840U w/ Radeon 780M Graphics",
            "AuthenticAMD",
            "amd-ryzen-7-pro-7840u-w-radeon-780m-grap",
        ),
        ("AMD Ryzen 5 2400G with Radeon Vega Graphics", "AuthenticAMD", "amd-ryzen-5-2400g"),
        (
            "Intel(R) Xeon(R) Platinum 8375C CPU @ 2.90GHz",
            "GenuineIntel",
            "intel-xeon-platinum-8375c",
        ),
        ("13th Gen Intel(R) Core(TM) i9-13900K", "GenuineIntel", "intel-core-i9-13900k"),
        ("Pentium III (Coppermine)", "GenuineIntel", "intel-pentium-iii-coppermine"),
    ],
)
def test_label_is_short_and_names_the_processor(tmp_path, model, vendor, label):
    write(tmp_path, {"proc/cpuinfo": f"vendor_id\t: {vendor}\nmodel name\t: {model}"})
    assert machine.label(tmp_path) == label
    assert machine.fingerprint(tmp_path)["label"] == label


def test_the_host_name_is_not_told():
    told = json.dumps(machine.fingerprint()).lower()
    assert re.search(rf"\b{re.escape(platform.node().lower())}\b", told) is None


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="nproc is Linux's")
@pytest.mark.skipif(not shutil.which("nproc"), reason="no nproc")
def test_usable_cores_are_those_nproc_counts():
    environment = {key: value for key, value in os.environ.items() if "OMP" not in key}
    done = subprocess.run(["nproc"], capture_output=True, text=True, env=environment)
    assert machine.fingerprint()["cores_usable"] == int(done.stdout)


def test_watch_counts_what_ran_between_two_looks(tmp_path):
    cpu = "sys/devices/system/cpu"
    usable = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
    mine, sibling = usable[0], 1000  # a CPU we may use, and one that surely is not ours
    for one in usable:
        write(tmp_path, {f"{cpu}/cpu{one}/topology/thread_siblings_list": str(one)})
    write(
        tmp_path,
        {
            f"{cpu}/cpu{mine}/topology/thread_siblings_list": f"{mine},{sibling}",
            # user nice system idle iowait irq softirq steal guest guest_nice
            "proc/stat": (
                f"cpu  9 9\ncpu{mine} 100 0 0 900 0 0 0 5 50 0\ncpu{sibling} 0 0 0 0 0 0 0 0"
            ),
            "proc/10/stat": "10 (an odd) name)) S 1 1 1 0 -1 0 0 0 0 0 100 50 0 0 20",
            "proc/11/stat": "11 (light) S 1 1 1 0 -1 0 0 0 0 0 7 7 0 0 20",
            f"proc/{os.getpid()}/stat": "1 (me) R 1 1 1 0 -1 0 0 0 0 0 0 0 0 0 20",
        },
    )

    def sleep(seconds):
        assert seconds == 0.5
        write(
            tmp_path,
            {
                "proc/stat": f"cpu  9 9\ncpu{mine} 110 0 0 970 10 0 0 15 90 0\n"
                f"cpu{sibling} 20 10 10 50 5 2 3 0",
                "proc/10/stat": "10 (an odd) name)) S 1 1 1 0 -1 0 0 0 0 0 106 55 0 0 20",
                "proc/11/stat": "11 (light) S 1 1 1 0 -1 0 0 0 0 0 12 12 0 0 20",
                f"proc/{os.getpid()}/stat": "1 (me) R 1 1 1 0 -1 0 0 0 0 0 90 0 0 0 20",
            },
        )

    # 100 ticks passed on each of two CPUs: 10 + 10 stolen busy on one, 45 on the other;
    # process 10 used 11 of them, process 11 used 10, which is not above a tenth.
    assert activity.watch(tmp_path, 0.5, sleep) == {
        "busy": round(65 / 200, 4),
        "steal": 0.05,
        "sibling_busy": 0.45,
        "heavy_processes": 1,
    }


def test_software_names_the_versions_without_numba():
    code = (
        "import sys, json; from rtbench.measure import machine; found = machine.software();"
        "assert 'numba' not in sys.modules; print(json.dumps(found))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["python"] == platform.python_version()
    assert found["numpy"] == np.__version__
    from llvmlite import binding

    assert found["llvm"] == ".".join(map(str, binding.llvm_version_info))
    assert set(found) == {
        "python",
        "implementation",
        "numba",
        "llvmlite",
        "llvm",
        "numpy",
        "rtbench",
        "commit",
        "dirty",
    }


@pytest.mark.skipif(not shutil.which("git"), reason="no git")
def test_commit_and_dirty_flag_are_those_of_git(tmp_path):
    def git(*words):
        name = ["-c", "user.name=a", "-c", "user.email=a@b.invalid", "-c", "commit.gpgsign=false"]
        done = subprocess.run(
            ["git", "-C", str(tmp_path), *name, *words], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    write(tmp_path, {"rtbench/a.py": "1"})
    assert versions.checkout(tmp_path) == {"commit": "unknown", "dirty": "unknown"}
    git("init", "-q")
    git("add", ".")
    git("commit", "-q", "-m", "first")
    commit = git("rev-parse", "HEAD")
    assert versions.checkout(tmp_path) == {"commit": commit, "dirty": False}
    write(tmp_path, {"results/run.json": "{}"})  # what a run leaves behind changes no code
    assert versions.checkout(tmp_path) == {"commit": commit, "dirty": False}
    write(tmp_path, {"rtbench/a.py": "2"})
    assert versions.checkout(tmp_path) == {"commit": commit, "dirty": True}


MXCSR, FTZ, DAZ = 7, 0x8000, 0x0040  # word of glibc's fenv_t on x86-64, and its bits


@pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="glibc's fenv_t on x86-64"
)
@pytest.mark.parametrize("bits", [0, FTZ, DAZ, FTZ | DAZ])
def test_float_state_sees_the_bits_of_the_control_register(bits):
    libm = ctypes.CDLL("libm.so.6")
    kept, changed = (ctypes.c_uint32 * 8)(), (ctypes.c_uint32 * 8)()
    libm.fegetenv(kept)
    libm.fegetenv(changed)
    changed[MXCSR] = changed[MXCSR] & ~(FTZ | DAZ) | bits
    libm.fesetenv(changed)
    try:
        found = machine.float_state()
    finally:
        libm.fesetenv(kept)
    assert found == {"ftz": bool(bits & FTZ), "daz": bool(bits & DAZ)}


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="pinning is Linux's")
def test_pin_leaves_one_cpu_and_names_the_others_on_error():
    before = os.sched_getaffinity(0)
    cpu = max(before)
    try:
        with pytest.raises(RtbenchError, match="--cpu -1.*allowed: " + str(min(before))):
            machine.pin(-1)
        with pytest.raises(RtbenchError, match="--cpu 99999: no such CPU"):
            machine.pin(99999)
        assert os.sched_getaffinity(0) == before
        machine.pin(cpu)
        assert os.sched_getaffinity(0) == {cpu}
    finally:
        os.sched_setaffinity(0, before)


def test_pin_says_where_it_cannot(monkeypatch):
    monkeypatch.delattr(os, "sched_setaffinity", raising=False)
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(RtbenchError, match="cannot pin to a CPU on darwin") as caught:
        machine.pin(0)
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value)
