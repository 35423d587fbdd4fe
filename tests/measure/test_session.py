"""Turns of the workers: with a stand-in that keeps a diary, and with real processes."""

import csv
import json
import os
import signal
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rtbench.compiled import elsewhere, targets
from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.experiments import density
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.measure import session
from rtbench.measure.arrays import Arrays
from rtbench.measure.session import Plan, Timed, Worker, WorkerDied, measure

TINY = Config(
    kernels=("moller1",), densities=(0.3,), orders=("repeat", "sweep"), triangles=60, repetitions=11
)


def cell(repetitions: int, count: int = 5, tests: int = 1, environment=(), **key) -> Timed:
    instance = SimpleNamespace(path="module", entry="entry")
    names = ("tri", "ray", "pairs", ("o", "t", "u", "v"))
    return Timed(key, instance, *names, "repeat", count, repetitions, 1.0, tests, environment)


@pytest.fixture
def arrays():
    kept = Arrays()
    yield kept
    kept.close()


@pytest.fixture
def diary(monkeypatch):
    """What the parent does to stand-in workers, in order: (worker, what, how many cells)."""
    lines = []

    class Diarist:
        def __init__(self, environment=()):
            self.environment = environment
            self.number = sum(line[1] == "started" for line in lines)
            self.answers = []
            lines.append((self.number, "started", 0))

        def tell(self, message):
            self.cpu = message.get("cpu")
            if "cells" in message:
                self.answers.append({"ready": True})
            for i, repetitions in message.get("round", ()):
                self.answers.append([i, 1000 * repetitions + i, repetitions])
            lines.append((self.number, "told", len(message.get("round", ()))))

        def hear(self):
            lines.append((self.number, "heard", len(self.answers)))
            return self.answers.pop(0)

        def close(self):
            lines.append((self.number, "closed", len(self.answers)))

    monkeypatch.setattr(session, "Worker", Diarist)
    return lines


def test_one_worker_at_a_time_is_told_to_measure(diary, arrays):
    measure([cell(12, kernel="a"), cell(12, kernel="b")], arrays, Plan(3, 2, 1), lambda rows: 0)
    busy = None
    for worker, what, waiting in diary:
        if what == "told":
            assert busy is None, "two workers at work"
            busy = worker
        elif what == "heard":
            assert worker == busy
            busy = None if waiting == 1 else busy
    assert [line for line in diary if line[1] == "closed"] == [(n, "closed", 0) for n in range(3)]


def test_rows_are_numbered_and_add_up(diary, arrays):
    rows, shown = [], []
    cells = [cell(23, kernel="a"), cell(2, kernel="b", count=7), cell(12, kernel="c")]
    measure(cells, arrays, Plan(3, 2, 1), rows.extend, shown.append)
    assert shown == sorted(shown) and shown[-1] == pytest.approx(1)
    for told, kernel in zip(cells, "abc", strict=True):
        own = [row for row in rows if row["kernel"] == kernel]
        assert sum(row["repetitions"] for row in own) == told.repetitions
        assert all(row["tests"] == told.count * row["repetitions"] for row in own)
        assert all(row["ns"] // 1000 == row["repetitions"] == row["cpu_ns"] for row in own)
    # Two repetitions in six samples: four of those are not taken, not taken as zero.
    assert Counter(row["kernel"] for row in rows) == {"a": 6, "b": 2, "c": 6}
    places = [(row["process"], row["round"], row["position"]) for row in rows]
    assert len(set(places)) == len(places)


def test_what_is_done_is_not_done_again(diary, arrays):
    cells = [cell(23, kernel="a"), cell(12, kernel="b")]
    whole, rest = [], []
    measure(cells, arrays, Plan(2, 3, 1), whole.extend)
    kept = [row for row in whole if (row["round"], row["kernel"]) in ((0, "a"), (0, "b"), (1, "a"))]
    done = [(row["process"], row["round"], "ab".index(row["kernel"])) for row in kept]
    measure(cells, arrays, Plan(2, 3, 1), rest.extend, done=done, launch=1)
    assert {row["launch"] for row in rest} == {1}

    def taken(rows):
        return sorted(
            (row["kernel"], row["process"], row["round"], row["repetitions"]) for row in rows
        )

    assert taken(kept + rest) == taken(whole)


def test_a_pair_may_stand_for_many_tests(diary, arrays):
    """Three rays against 1,000 triangles each are 3,000 tests, and 100 times the work of 30."""
    rows, shown = [], []
    cells = [cell(1, count=3, tests=1000, kernel="a"), cell(10, count=3, kernel="b")]
    measure(cells, arrays, Plan(1, 1, 1), rows.extend, shown.append)
    done = {row["kernel"]: row for row in rows}
    assert (done["a"]["tests"], done["b"]["tests"]) == (3000, 30)
    assert (done["a"]["triangles"], done["b"]["triangles"]) == (3000, 3)
    first = done["a"]["position"] == 0
    assert shown == pytest.approx([3000 / 3030 if first else 30 / 3030, 1])


OLD = (("NUMBA_CPU_NAME", "x86-64"), ("NUMBA_CPU_FEATURES", "+sse2"))


def in_two_environments():
    return [
        cell(12, kernel=f"{name}{i}", environment=environment)
        for i in range(3)
        for name, environment in (("new", ()), ("old", OLD))
    ]


def test_an_environment_has_workers_of_its_own(diary, arrays, monkeypatch):
    started = []

    class Kept(session.Worker):
        def __init__(self, environment=()):
            super().__init__(environment)
            self.cells = []
            started.append(self)

        def tell(self, message):
            super().tell(message)
            for i, told in enumerate(message.get("cells", ())):
                self.cells += [i] if told else []

        def hear(self):
            answer = super().hear()
            if isinstance(answer, list):
                assert answer[0] in self.cells, "told to time another's cell"
            return answer

    monkeypatch.setattr(session, "Worker", Kept)
    rows = []
    first = Kept()
    measure(in_two_environments(), arrays, Plan(2, 2, 1), rows.extend, first_worker=first)
    assert Counter(worker.environment for worker in started) == {(): 2, OLD: 2}
    assert all(w.cells == ([1, 3, 5] if w.environment else [0, 2, 4]) for w in started)
    assert first.cells and len(rows) == 6 * 4
    assert sum(line[1] == "closed" for line in diary) == 4
    assert all(row["ns"] // 1000 == row["repetitions"] for row in rows)


def test_environments_take_turns_in_the_order_of_the_round(diary, arrays):
    """What is compared is measured interleaved, and nobody is started while another measures."""
    rows = []
    measure(in_two_environments(), arrays, Plan(2, 3, 1), rows.extend)
    same = []
    measure(
        [cell(12, kernel=c.key["kernel"]) for c in in_two_environments()],
        arrays,
        Plan(2, 3, 1),
        same.extend,
    )
    places = ("process", "round", "position", "kernel")
    assert [[row[p] for p in places] for row in rows] == [[row[p] for p in places] for row in same]
    busy = None
    for worker, what, waiting in diary:
        if what == "started":
            assert busy is None, "started while another measures"
        elif what == "told":
            assert busy is None, "two workers at work"
            busy = worker
        elif what == "heard":
            assert worker == busy
            busy = None if waiting == 1 else busy


def test_the_first_worker_is_not_taken_for_another_environment(diary, arrays):
    first = session.Worker()
    measure(
        [cell(4, environment=OLD, kernel="a")],
        arrays,
        Plan(1, 1, 1),
        lambda rows: None,
        first_worker=first,
    )
    assert [line for line in diary if line[0] == 0] == [(0, "started", 0), (0, "closed", 0)]
    assert (1, "closed", 0) in diary


TWICE = """def twice(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            outcome[k] = 0
            t[k] = triangles[k] * rays[k] + triangles[k]
"""


@pytest.fixture
def twice(arrays):
    """A cell of code for another processor, and what it must answer, found by numpy."""
    if "x86-64" not in targets.runnable():
        pytest.skip("not an x86-64 processor")
    random = np.random.default_rng(1)
    triangles, rays = random.random((2, 50), np.float32)
    real = "float32[::1]"
    signature = (
        f"void({real}, {real}, uint64[::1], uint64[::1], int32[::1], {real}, {real}, {real})"
    )
    made = elsewhere.instantiate_for("x86-64", TWICE, signature=signature)
    arrays.add("tri", triangles)
    arrays.add("ray", rays)
    arrays.add("pairs", np.arange(50, dtype=np.uint64))
    arrays.add("o", np.zeros(50, np.int32))
    arrays.add("t", triangles * rays + triangles)
    for name in "uv":
        arrays.add(name, np.zeros(0, np.float32))
    elsewhere.close()
    names = ("tri", "ray", "pairs", ("o", "t", "u", "v"))
    return Timed({"kernel": "a"}, made, *names, "sweep", 50, 20, 1.0, environment=made.environment)


def test_code_for_another_target_is_timed_in_its_environment(twice, arrays):
    rows = []
    measure([twice], arrays, Plan(2, 2, 1), rows.extend)
    assert sum(row["tests"] for row in rows) == 50 * 20


def test_code_for_another_target_is_not_taken_for_ones_own(twice, arrays):
    """numba alone would compile it again, for the worker's own processor."""
    with pytest.raises(WorkerDied, match="was made for x86-64"):
        measure([replace(twice, environment=())], arrays, Plan(1, 1, 1), lambda rows: None)


@pytest.fixture
def bench():
    built = Bench(TINY, lambda text: None)
    density.build(built)
    yield built
    built.close()


def test_a_wrong_answer_in_the_timed_loop_ends_the_session(bench):
    chosen = next(c for c in bench.cells if c.key["kernel"] == "moller1" and c.order == "sweep")
    path = bench.arrays.paths[chosen.expected[0]]
    expected = np.load(path)
    expected[17] += 1
    np.save(path, expected)
    with pytest.raises(WrongAnswers, match=r"moller1.*float32.*0\.3") as raised:
        measure(bench.cells, bench.arrays, Plan(1, 1, 1), lambda rows: None)
    assert raised.value.exit_code == 4 and "\n" not in str(raised.value)


def test_an_answer_that_turns_wrong_later_is_noticed(bench):
    # The worker has mapped nothing: it keeps what it read, so a second worker sees the change.
    path = bench.arrays.paths[bench.cells[-1].expected[1]]
    rounds = []

    def sink(rows):
        rounds.append(rows)
        values = np.load(path)
        values.view(np.uint8)[:] ^= 1
        np.save(path, values)

    with pytest.raises(WrongAnswers):
        measure(bench.cells, bench.arrays, Plan(2, 1, 1), sink)
    assert len(rounds) == 1


def test_a_worker_that_is_killed_is_told_in_one_line(bench):
    worker = Worker()

    def sink(rows):
        os.kill(worker._process.pid, signal.SIGKILL)

    with pytest.raises(WorkerDied, match="ended by signal 9"):
        measure(bench.cells, bench.arrays, Plan(1, 2, 1), sink, first_worker=worker)
    assert worker._process.returncode == -signal.SIGKILL


def test_workers_end_with_the_session_whatever_ends_it(bench):
    worker = Worker()

    def sink(rows):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        measure(bench.cells, bench.arrays, Plan(1, 2, 1), sink, first_worker=worker)
    assert worker._process.returncode is not None


def test_a_worker_ends_when_its_stdin_closes():
    worker = subprocess.Popen(
        [sys.executable, "-P", "-m", "rtbench.measure.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    out, _ = worker.communicate(b"{}\n", timeout=60)
    assert (worker.returncode, out) == (0, b"")


def test_a_worker_checks_its_answers_bit_for_bit(bench):
    """As a process of its own, over its plain protocol: a sample is cell, ns, CPU ns."""
    chosen = bench.cells[1]
    told = {
        "cpu": None,
        "arrays": bench.arrays.paths,
        "cells": [
            {
                "module": str(chosen.instance.path),
                "entry": chosen.instance.entry,
                "triangles": chosen.triangles,
                "rays": chosen.rays,
                "pairs": chosen.pairs,
                "expected": chosen.expected,
                "order": order,
                "seed": [1, 0],
            }
            for order in ("repeat", "sweep", "shuffled")
        ],
    }
    messages = [told, {"round": [[2, 3], [0, 1], [1, 2]]}]
    found = subprocess.run(
        [sys.executable, "-P", "-m", "rtbench.measure.worker"],
        input="".join(json.dumps(message) + "\n" for message in messages),
        capture_output=True,
        text=True,
        timeout=60,
    )
    ready, *samples = map(json.loads, found.stdout.splitlines())
    assert ready == {"ready": True} and found.stderr == ""
    assert [sample[0] for sample in samples] == [2, 0, 1]
    assert all(isinstance(ns, int) and ns > 0 for _, *times in samples for ns in times[:1])


def test_the_shuffled_order_tests_every_pair_as_often(bench, monkeypatch):
    from rtbench.measure import worker

    seen = []

    def call(triangles, rays, first, second, *outputs):
        seen.append((first[:, None] + second[None, :]).ravel())
        for out, expected in zip(outputs, cell.expected, strict=True):
            out[:] = expected

    stand_in = SimpleNamespace(call=call)
    monkeypatch.setattr(worker, "load", lambda path, entry: stand_in)
    arrays = {
        "tri": np.zeros(6),
        "ray": np.zeros(6),
        "pairs": np.array([4, 1, 3], np.uint64),
        "none": np.zeros(0),
        "o": np.arange(6, dtype=np.int32),
    }
    told = {"module": "m", "entry": "e", "triangles": "tri", "rays": "ray", "pairs": "pairs"}
    told |= {"expected": ("o", "none", "none", "none"), "seed": [1, 0]}
    sequences = {}
    for order in ("repeat", "sweep", "sorted", "shuffled"):
        cell = worker.Cell(told | {"order": order}, arrays, {})
        assert cell.time(50) is not None
        sequences[order] = seen[-1].tolist()
    assert sequences["repeat"] == [4] * 50 + [1] * 50 + [3] * 50
    assert sequences["sweep"] == sequences["sorted"] == [4, 1, 3] * 50
    assert sorted(sequences["shuffled"]) == sorted(sequences["repeat"])
    assert sequences["shuffled"] not in (sequences["repeat"], sequences["sweep"])
    before = seen[-1]
    cell.time(50)
    assert not np.array_equal(before, seen[-1])  # a sequence never comes again


@pytest.mark.parametrize("missing", [(0,), (0, 4), (6, 0)])
def test_a_packet_is_checked_in_every_lane(missing, monkeypatch):
    from rtbench.measure import worker

    spoiled = []

    def call(triangles, rays, first, second, outcome, t, u, v):
        assert outcome.flags.c_contiguous and t.flags.c_contiguous
        assert u.shape == v.shape == missing
        outcome[first], t[first] = arrays["o"][first], arrays["t"][first]
        for place in spoiled:
            t[place] += np.float32(1)

    monkeypatch.setattr(worker, "load", lambda path, entry: SimpleNamespace(call=call))
    lanes = np.arange(24).reshape(6, 4)
    arrays = {
        "tri": np.zeros(6),
        "ray": np.zeros(6),
        "pairs": np.array([4, 1, 3], np.uint64),
        "none": np.zeros(missing, np.float32),
        "o": lanes.astype(np.int32),
        "t": np.asfortranarray(lanes.astype(np.float32)),
    }
    told = {"module": "m", "entry": "e", "triangles": "tri", "rays": "ray", "pairs": "pairs"}
    told |= {"expected": ("o", "t", "none", "none"), "seed": [1, 0], "order": "repeat"}
    cell = worker.Cell(told, arrays, {})
    assert cell.time(2) is not None
    spoiled[:] = [(2, 3)]  # no packet that is tested
    assert cell.time(2) is not None
    spoiled[:] = [(3, 2)]
    assert cell.time(2) is None


def test_a_worker_imports_nothing_heavy():
    code = (
        "import sys, rtbench.measure.worker;"
        "print(*{m.partition('.')[0] for m in sys.modules} & {'scipy', 'pandas', 'matplotlib'})"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (found.stdout.strip(), found.stderr) == ("", "")


def test_arrays_left_by_a_killed_process_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    in_use = Arrays()
    in_use.add("a", np.zeros(3))
    left = tmp_path / "rtbench-data-left"
    young = tmp_path / "rtbench-data-young"
    for folder in (left, young):
        folder.mkdir()
        (folder / "lock").touch()
        (folder / "0.npy").touch()
    for folder in (left, in_use.paths["a"].rpartition("/")[0]):
        os.utime(f"{folder}/lock", (1, 1))
    another = Arrays()
    assert not left.exists() and young.exists()
    assert np.load(in_use.paths["a"]).tolist() == [0, 0, 0]
    another.close()
    in_use.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["rtbench-data-young"]


def test_a_full_temporary_folder_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    def full(path, array):
        raise OSError("24 requested and 0 written")

    monkeypatch.setattr(np, "save", full)
    arrays = Arrays()
    with pytest.raises(RtbenchError, match=r"24 requested.*TMPDIR"):
        arrays.add("a", np.zeros(3))
    arrays.close()


def test_columns_of_the_rows_are_those_of_the_records(diary, arrays, tmp_path):
    from rtbench.records import schema
    from rtbench.records.writer import RunWriter

    columns = schema.sample_columns(["kernel"])
    with RunWriter.create(tmp_path, "x", "y", {"cell": ["kernel"]}, columns) as writer:
        measure([cell(4, kernel="a")], arrays, Plan(2, 1, 1), writer.append)
        with open(writer.path / "samples.csv", newline="") as file:
            rows = list(csv.DictReader(file))
    assert [row["ns"] for row in rows] == ["2000", "2000"]
