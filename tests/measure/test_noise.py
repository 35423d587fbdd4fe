"""Complaints about made-up machines, one disturbance at a time."""

import re
import time

import pytest

from rtbench.measure import noise

QUIET = {
    "governor": "performance",
    "turbo": "off",
    "cpu_vendor": "GenuineIntel",
    "cpu_quota": "none",
    "mhz_max": 4000.0,
    "virtual": False,
    "cores_usable": 8,
    "smt": "off",
    "memory_bytes": 16 * 2**30,
    "aslr": "off",
}
IDLE = {
    "mhz_now": 4000.0,
    "steal": 0.0,
    "loadavg": [0.1, 5.0, 9.0],
    "heavy_processes": 0,
    "cpu_pressure": 0.0,
    "sibling_busy": 0.0,
    "memory_available": 12 * 2**30,
}
STILL = {"lost": 0.001, "largest_ns": 4000, "gaps": {}}


def test_a_quiet_machine_has_no_complaints():
    assert noise.complaints(QUIET, IDLE, STILL, 30) == []
    assert noise.quiet_enough([])


def test_unknown_is_no_complaint():
    fingerprint, load = dict.fromkeys(QUIET, "unknown"), dict.fromkeys(IDLE, "unknown")
    assert noise.complaints(fingerprint, load) == []
    assert noise.complaints({}, {}) == []


@pytest.mark.parametrize(
    ("fingerprint", "load", "what", "cure"),
    [
        ({"governor": "powersave"}, {}, "governor is 'powersave'", "cpupower frequency-set"),
        ({"turbo": "on"}, {}, "turbo is on", "intel_pstate/no_turbo"),
        ({"turbo": "on", "cpu_vendor": "AuthenticAMD"}, {}, "turbo is on", "cpufreq/boost"),
        ({"cpu_quota": 0.5}, {}, "time of 0.5 CPUs", "--cpuset-cpus"),
        ({}, {"mhz_now": 1200.0}, "1200 of 4000 MHz", "cpupower"),
        ({}, {"steal": 0.031}, "3.1 % of the CPU time", "vmstat"),
        ({"virtual": True}, {"steal": 0.031}, "3.1 % of the CPU time", "vmstat"),
        ({}, {"loadavg": [4.5, 0.0, 0.0]}, "4.50 on 8 usable CPUs", "ps -eo"),
        ({}, {"heavy_processes": 1}, "1 other process uses", "ps -eo"),
        ({}, {"heavy_processes": 2}, "2 other processes use", "ps -eo"),
        ({}, {"cpu_pressure": 25.0}, "25 % of the last 10 s", "ps -eo"),
        ({"smt": "on"}, {"sibling_busy": 0.4}, "sibling is busy 40 %", "smt/control"),
        ({}, {"memory_available": 100 * 2**20}, "100 of 16384 MiB", "rss"),
        ({}, {"memory_available": 0}, "0 of 16384 MiB", "rss"),
    ],
)
def test_each_disturbance_is_told_with_its_cure(fingerprint, load, what, cure):
    (found,) = noise.complaints(QUIET | fingerprint, IDLE | load, STILL, 30)
    assert what in found.what
    assert cure in found.cure
    assert found.why
    assert not noise.quiet_enough([found])


@pytest.mark.parametrize("remark", [{"virtual": True}, {"aslr": "on"}, {"cpu_quota": 4.0}])
def test_a_remark_does_not_make_a_machine_unfit(remark):
    (found,) = noise.complaints(QUIET | remark, IDLE, STILL, 30)
    assert not found.serious
    assert noise.quiet_enough([found])


@pytest.mark.parametrize(
    ("jitter", "resolution", "what"),
    [
        ({"lost": 0.05, "largest_ns": 3_500_000}, 30, "5.0 % of the time .* 3.50 ms"),
        (STILL, 15_600_000, "steps of 15600000 ns"),
    ],
)
def test_what_was_measured_is_judged(jitter, resolution, what):
    (found,) = noise.complaints(QUIET, IDLE, jitter, resolution)
    assert re.search(what, found.what)
    assert found.serious


def test_just_below_a_limit_nothing_is_said():
    load = {
        "mhz_now": 2801.0,
        "steal": 0.005,
        "loadavg": [4.0, 0, 0],
        "cpu_pressure": 5.0,
        "sibling_busy": 0.05,
        "memory_available": 2**29 + 1,
    }
    fingerprint = QUIET | {"smt": "on"}
    assert noise.complaints(fingerprint, load, {"lost": 0.01, "largest_ns": 1}, 1000) == []


class Clock:
    """A clock whose readings the test has chosen."""

    def __init__(self, steps):
        self.now, self.steps = 10**12, iter(steps)

    def __call__(self):
        self.now += next(self.steps)
        return self.now


def test_jitter_adds_up_the_gaps_above_a_microsecond(monkeypatch):
    # 1 ms in all: 100 steps of 1000 ns (no gaps), 5 us, 50 us, 500 us, and 345 us at the end.
    steps = [0, *[1000] * 100, 5_000, 50_000, 500_000, 345_000]
    monkeypatch.setattr(time, "perf_counter_ns", Clock(steps))
    assert noise.jitter(0.001) == {
        "lost": 0.9,
        "largest_ns": 500_000,
        "gaps": {"1us": 1, "10us": 1, "100us": 2, "1ms": 0},
    }


def test_timer_resolution_is_the_smallest_step_above_zero(monkeypatch):
    monkeypatch.setattr(time, "perf_counter_ns", Clock([0, 0, 0, 300, 0, 100, 200]))
    assert noise.timer_resolution(6) == 100


def test_timer_resolution_waits_for_a_coarse_clock(monkeypatch):
    monkeypatch.setattr(time, "perf_counter_ns", Clock([0, *[0] * 50, 15_600_000]))
    assert noise.timer_resolution(6) == 15_600_000
