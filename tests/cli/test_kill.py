"""Killed at any moment, stopped, or out of disk: what is there loads, and --resume ends it."""

import csv
import os
import signal
import sys
import time
from collections import defaultdict
from pathlib import Path

import pytest

from rtbench.experiments import run
from rtbench.experiments.config import Config
from rtbench.records.store import load_run

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")

WORK = Config(
    kernels=("moller1",), densities=(0.3,), triangles=200, repetitions=8000, processes=2, samples=5
)
COMMAND = ("run", "--tris", 200, "--reps", 8000, "--density", 0.3, "--kernel", "moller1")
COMMAND = (*COMMAND, "--processes", 2, "--samples", 5, "--quiet")
# 2 orders of kernel and empty loop, 5 outcomes (nothing is parallel), in each of 2 x 5 rounds.
CELLS, ROUNDS = 9, 10


class Nobody:
    def say(self, text):
        pass

    plan = progress = say


def folders(out: Path) -> list[Path]:
    return [path for path in out.glob("*") if not path.name.startswith(".")]


def samples(out: Path) -> int:
    return sum((path / "samples.csv").read_bytes().count(b"\n") - 1 for path in folders(out))


def derived(out: Path, pid: int) -> bool:
    return any((path / "summary.csv").exists() for path in folders(out))


def finished(out: Path, pid: int) -> bool:
    return any('"finished": null' not in (path / "run.json").read_text() for path in folders(out))


def measured(rounds: int):
    return lambda out, pid: samples(out) >= rounds * CELLS


def children(pid: int) -> list[int]:
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            _, _, rest = status.read_text().rpartition(")")
        except OSError:
            continue
        if int(rest.split()[1]) == pid:
            found.append(int(status.parent.name))
    return found


def runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until(happens, one, out: Path) -> None:
    """Wait for a moment of a run; one that is over before it was seen is over."""
    while one.poll() is None and not happens(out, one.pid):
        time.sleep(0.001)


def substance(path: Path) -> dict:
    """Return what is in a run but its times."""
    repetitions, places = defaultdict(int), []
    with open(path / "samples.csv", newline="") as file:
        for row in csv.DictReader(file):
            key = row["kernel"], row["order"], row["density"], row["outcome"], row["triangles"]
            repetitions[key] += int(row["repetitions"])
            places.append((*key, row["process"], row["round"]))
    assert len(set(places)) == len(places) == CELLS * ROUNDS
    with open(path / "outcomes.csv", newline="") as file:
        outcomes = [(row["outcome"], row["count"], row["tests"]) for row in csv.DictReader(file)]
    with open(path / "summary.csv", newline="") as file:
        summary = sorted(
            (r["kernel"], r["order"], r["hits"], r["tests"]) for r in csv.DictReader(file)
        )
    workloads = load_run(path).info["workloads"]
    return {"r": dict(repetitions), "o": outcomes, "s": summary, "w": workloads}


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    done = run.start(WORK, Nobody(), tmp_path_factory.mktemp("unbroken"))
    found = substance(done.path)
    assert set(found["r"].values()) >= {8000}
    return found


MOMENTS = {
    "at the start": lambda out, pid: True,
    "while it imports": lambda out, pid: "numba" in Path(f"/proc/{pid}/maps").read_text(),
    "while it prepares": lambda out, pid: bool(children(pid)),
    "as the folder appears": lambda out, pid: bool(folders(out)),
    "in the first round": measured(1),
    "in the third round": measured(3),
    "in the middle": measured(5),
    "in the last round": measured(9),
    "as it is measured": measured(10),
    "while it derives": derived,
    "while it draws": finished,
}


@pytest.mark.parametrize("moment", MOMENTS)
def test_killed_and_resumed(process, tmp_path, unbroken, moment):
    out = tmp_path / "results"
    one = process(*COMMAND)
    wait_until(MOMENTS[moment], one, out)
    workers = children(one.pid)
    one.kill()
    _, err = one.communicate()
    assert err == ""
    found = folders(out)
    if not found:
        assert moment in list(MOMENTS)[:4]
        return
    (path,) = found
    halfway = load_run(path)
    assert len(halfway.summary) <= 4 and len(halfway.outcomes) == 6
    assert len(halfway.samples) <= CELLS * ROUNDS
    if halfway.finished:
        assert moment == list(MOMENTS)[-1]
    else:
        assert run.resume(path, Nobody()).finished
    assert substance(path) == unbroken
    deadline = time.monotonic() + 30
    while any(map(runs, workers)) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not any(map(runs, workers)), "a worker outlives its parent"


def test_killed_while_it_compiles(process, tmp_path):
    """What lies half-written in the cache does no harm to the next run."""
    cache = {"RTBENCH_CACHE_DIR": str(tmp_path / "cache")}
    one = process(*COMMAND, **cache)
    wait_until(lambda out, pid: list((tmp_path / "cache").glob("*/*.py")), one, tmp_path)
    one.kill()
    one.communicate()
    assert folders(tmp_path / "results") == []
    again = process(*COMMAND, **cache)
    _, err = again.communicate(timeout=120)
    assert (again.returncode, err) == (0, "")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_and_resumed_by_the_command_that_is_told(process, tmp_path, unbroken, number):
    one = process(*COMMAND)
    wait_until(measured(2), one, tmp_path / "results")
    workers = children(one.pid)
    one.send_signal(number)
    out, err = one.communicate(timeout=60)
    assert (one.returncode, out, err.count("\n")) == (130, "", 1)
    assert err.startswith("rtbench: stopped; what was measured is kept")
    assert not any(map(runs, workers))
    command = err.split("go on with: rtbench ")[1].split()
    again = process(*command, "--quiet")
    out, err = again.communicate(timeout=60)
    assert (again.returncode, err) == (0, "")
    assert "moller1" in out
    (path,) = folders(tmp_path / "results")
    assert substance(path) == unbroken
    assert list((path / "plots").glob("*.png")) and list((path / "tables").glob("*.csv"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_before_anything_was_measured(process, tmp_path, number):
    scratch = tmp_path / "scratch"
    one = process(*COMMAND)
    wait_until(lambda out, pid: children(pid), one, tmp_path / "results")
    one.send_signal(number)
    out, err = one.communicate(timeout=60)
    assert (one.returncode, out, err.count("\n")) == (130, "", 1)
    assert err.startswith("rtbench: stopped")
    assert list(scratch.iterdir()) == []


def limited(kibibytes: int) -> tuple[str, ...]:
    """Return a shell that allows files of so many KiB: to the run, a disk that is full."""
    return "bash", "-c", f'ulimit -f {kibibytes}; exec "$@"', "bash"


def test_a_full_disk(process, tmp_path):
    # 2 x 300 rounds of 9 samples need far more than 64 KiB, and nothing else does.
    work = (*COMMAND, "--samples", 300)
    one = process(*work, prefix=limited(64))
    out, err = one.communicate(timeout=120)
    assert (one.returncode, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("rtbench: cannot write") and "too large" in err
    (path,) = folders(tmp_path / "results")
    halfway = load_run(path)
    assert not halfway.finished and halfway.dropped == 0
    assert 0 < len(halfway.samples) < 2 * 300 * CELLS
    assert len(halfway.samples) % CELLS == 0, "half a round is kept"
    ended = run.resume(path, Nobody())
    assert ended.finished and len(ended.samples) == 2 * 300 * CELLS
    assert set(ended.summary["repetitions"]) == {8000}


def test_a_full_temporary_folder(process, tmp_path):
    scratch = tmp_path / "scratch"
    one = process(*COMMAND, prefix=limited(8))
    out, err = one.communicate(timeout=60)
    assert (one.returncode, out, err.count("\n")) == (2, "", 1)
    assert str(scratch) in err and "TMPDIR" in err
    assert folders(tmp_path / "results") == [] and list(scratch.iterdir()) == []


def test_two_do_not_write_one_run(process, tmp_path, unbroken):
    one = process(*COMMAND)
    wait_until(measured(3), one, tmp_path / "results")
    one.kill()
    one.communicate()
    (path,) = folders(tmp_path / "results")
    first, second = (process("run", "--resume", path, "--quiet") for _ in range(2))
    ends = sorted((p.communicate(timeout=60)[1], p.returncode) for p in (first, second))
    assert ends[0] == ("", 0)
    told, code = ends[1]
    assert code == 2 and ("being written by another" in told or "is finished" in told)
    assert substance(path) == unbroken


def test_a_worker_killed_from_outside(process, tmp_path, unbroken):
    one = process(*COMMAND)
    wait_until(measured(2), one, tmp_path / "results")
    for worker in children(one.pid):
        os.kill(worker, signal.SIGKILL)
    out, err = one.communicate(timeout=60)
    assert (one.returncode, out, err.count("\n")) == (2, "", 1)
    assert "signal 9" in err and "--resume" in err
    (path,) = folders(tmp_path / "results")
    run.resume(path, Nobody())
    assert substance(path) == unbroken
