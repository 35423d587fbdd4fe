"""Run folders: written, cut off anywhere, refused, found and resumed."""

import json
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from rtbench.errors import NotComparable, RtbenchError
from rtbench.records import schema
from rtbench.records.store import find_run, load_run
from rtbench.records.writer import RunWriter

CELL = ["kernel", "precision", "order", "density"]
COLUMNS = schema.sample_columns(CELL)
INFO = {"experiment": "density", "title": "t", "cell": CELL, "config": {"kernels": ["moller1"]}}


def sample(round_number=0, kernel="moller1", ns=1000, **more) -> dict:
    row = {"kernel": kernel, "precision": "float32", "order": "repeat", "density": 0.5}
    row |= {"process": 0, "launch": 0, "round": round_number, "position": 0, "triangles": 10}
    return row | {"repetitions": 2, "tests": 20, "ns": ns, "cpu_ns": ns} | more


@pytest.fixture
def writer(tmp_path):
    with RunWriter.create(tmp_path, "pc", "blecha-4.1", INFO, COLUMNS) as made:
        yield made


def line(error) -> str:
    text = str(error.value)
    assert "\n" not in text
    return text


def test_what_is_written_is_read(writer, tmp_path):
    writer.append([sample(0), sample(0, "badouel", 1500)])
    writer.append([sample(1, ns=1100)])
    run = load_run(writer.name, tmp_path)
    assert run.samples["ns"].tolist() == [1000, 1500, 1100]
    assert run.samples["outcome"].isna().all()
    assert run.samples["density"].dtype == float
    assert (run.dropped, run.finished, run.cell) == (0, False, CELL)
    assert run.info["schema"] == 1 and run.info["finished"] is None


def test_lines_of_samples_are_whole_numbers(writer):
    writer.append([sample(density=np.float64(0.1), ns=np.int64(7))])
    text = (writer.path / schema.SAMPLES).read_text()
    assert text.splitlines()[1] == "moller1,float32,repeat,0.1,,0,0,0,0,10,2,20,7,7"


def test_rows_of_another_table_are_refused(writer):
    with pytest.raises(ValueError, match="speed"):
        writer.append([sample(speed=3)])
    with pytest.raises(ValueError, match="line break"):
        writer.append([sample(kernel="a\nb")])
    assert load_run(writer.path).samples.empty


def test_names_that_csv_must_quote_come_back(writer):
    name = 'my, "own".py:moller,1'
    writer.append([sample(kernel=name)])
    assert load_run(writer.path).samples["kernel"].tolist() == [name]


def test_a_second_run_gets_a_number_and_nothing_is_overwritten(tmp_path, monkeypatch):
    names = []
    for _ in range(3):
        with RunWriter.create(tmp_path, "my pc/../x", "c", INFO, COLUMNS) as made:
            names.append(made.name)
            assert made.path.parent == tmp_path
            assert json.loads((made.path / schema.RUN).read_text())["name"] == made.name
    assert len(set(names)) == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)


def test_run_json_only_grows(writer):
    writer.update(machine={"cpu": "x"}, load={"before": 1, "after": None}, remarks=["a"])
    writer.update(machine={"cpu": "other", "os": "Linux"}, load={"after": 2}, remarks=["a", "b"])
    info = json.loads((writer.path / schema.RUN).read_text())
    assert info["machine"] == {"cpu": "x", "os": "Linux"}
    assert info["load"] == {"before": 1, "after": 2}
    assert info["remarks"] == ["a", "b"]
    assert info["title"] == "t"


def test_a_cut_off_line_is_dropped_counted_and_removed_by_reopening(writer):
    writer.append([sample(0), sample(1)])
    writer.close()
    path = writer.path / schema.SAMPLES
    whole = path.read_bytes()
    with open(path, "ab") as file:
        file.write(b"moller1,float32,repeat,0.5,,0,0,2,0,10,2,20,10")
    run = load_run(writer.path)
    assert (run.dropped, len(run.samples)) == (1, 2)
    with RunWriter.reopen(writer.path) as again:
        assert path.read_bytes() == whole
        again.append([sample(2, launch=1)])
    run = load_run(writer.path)
    assert (run.dropped, run.samples["launch"].tolist()) == (0, [0, 0, 1])


@pytest.mark.parametrize("cut", range(0, 260, 7))
def test_cut_anywhere_every_whole_line_is_there(writer, cut):
    writer.append([sample(number) for number in range(4)])
    writer.close()
    path = writer.path / schema.SAMPLES
    data = path.read_bytes()[:cut]
    path.write_bytes(data)
    run = load_run(writer.path)
    assert len(run.samples) == max(data.count(b"\n") - 1, 0)
    assert run.dropped == int(data != b"" and not data.endswith(b"\n"))
    with RunWriter.reopen(writer.path) as again:
        again.append([sample(9)])
    after = load_run(writer.path)
    assert len(after.samples) == len(run.samples) + 1
    assert after.dropped == 0


def test_a_short_last_line_is_dropped_too(writer):
    writer.append([sample(0)])
    with open(writer.path / schema.SAMPLES, "a") as file:
        file.write("moller1,float32\n")
    assert (load_run(writer.path).dropped, len(load_run(writer.path).samples)) == (1, 1)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ("moller1,float32", "line 3 is damaged: 2 fields"),
        ("moller1,float32,repeat,0.5,,0,0,0,0,10,2,20,1.5,7", "ns must be a whole number"),
        ("moller1,float32,repeat,0.5,,0,0,0,0,10,2,20,,7", "ns is empty"),
        ("moller1,float32,repeat,0.5,,0,0,0,0,10,2,0,9,7", "tests is 0"),
        ("moller1,float32,repeat,0.5,,0,0,0,0,10,2,20,-9,7", "ns is -9"),
        ("\0\0\0\0", "line 3 is damaged: not text"),
    ],
)
def test_damage_in_the_middle_is_an_error_that_names_the_line(writer, damage, words):
    writer.append([sample(0)])
    with open(writer.path / schema.SAMPLES, "a") as file:
        file.write(damage + "\n")
    writer.append([sample(1)])
    with pytest.raises(NotComparable) as error:
        load_run(writer.path)
    assert words in line(error) and "line 3" in line(error)


def test_a_run_killed_before_its_first_round_has_no_rows(writer):
    run = load_run(writer.path)
    assert run.samples.empty and run.summary.empty and run.outcomes.empty
    assert list(run.summary.columns)[:4] == CELL


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "no run.json"),
        ("{", "damaged"),
        ("[]", "no schema number"),
        ('{"schema": 2, "cell": ["kernel"]}', "schema 2"),
        ('{"schema": 1}', "cell"),
    ],
)
def test_run_json_that_cannot_be_read(writer, text, words):
    file = writer.path / schema.RUN
    file.unlink() if text is None else file.write_text(text)
    with pytest.raises(NotComparable, match=words) as error:
        load_run(writer.path)
    assert str(writer.path) in line(error)
    assert error.value.exit_code == 3


def test_foreign_or_missing_samples(writer):
    path = writer.path / schema.SAMPLES
    path.write_text("a,b\n1,2\n")
    with pytest.raises(NotComparable, match=r"not a samples.csv: no column kernel"):
        load_run(writer.path)
    path.unlink()
    with pytest.raises(NotComparable, match=r"has no samples.csv"):
        load_run(writer.path)


def test_a_foreign_summary_is_refused(writer):
    writer.append([sample()])
    summary = writer.path / schema.SUMMARY
    summary.write_text("x,y\n")
    os.utime(summary, (2e9, 2e9))
    with pytest.raises(NotComparable, match="not a table of rtbench"):
        _ = load_run(writer.path).summary


def test_finished_published_and_busy_runs_are_not_resumed(writer):
    with pytest.raises(RtbenchError, match="being written by another process"):
        RunWriter.reopen(writer.path)
    writer.finish(remarks=["done"])
    with pytest.raises(RtbenchError, match="nothing is left to resume") as error:
        RunWriter.reopen(writer.path)
    assert line(error) and error.value.exit_code == 2
    assert load_run(writer.path).finished
    with pytest.raises(RtbenchError, match="published"):
        RunWriter.reopen(find_run("blecha-pc1", writer.path))


def test_runs_are_found_by_path_then_name_then_published(tmp_path, writer, monkeypatch):
    assert find_run(str(writer.path), tmp_path / "no") == writer.path
    assert find_run(str(writer.path / schema.RUN), tmp_path) == writer.path
    assert find_run(writer.name, tmp_path) == writer.path
    assert find_run("blecha-pc1", tmp_path).parent.name == "published"
    (tmp_path / "blecha-pc1").mkdir()
    assert find_run("blecha-pc1", tmp_path).parent == tmp_path
    here = tmp_path / "here"
    (here / "blecha-pc1").mkdir(parents=True)
    monkeypatch.chdir(here)
    assert find_run("blecha-pc1", tmp_path).resolve() == here / "blecha-pc1"


def test_an_unknown_run_is_told_with_the_nearest_name(tmp_path):
    with pytest.raises(RtbenchError, match="did you mean 'blecha-pc1'") as error:
        find_run("blecha-p1", tmp_path)
    assert error.value.exit_code == 2 and line(error)


def test_a_folder_that_is_a_file_is_told_in_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RtbenchError, match="cannot write to") as error:
        RunWriter.create(tmp_path / "file", "pc", "c", INFO, COLUMNS)
    assert str(tmp_path / "file") in line(error)


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_an_unwritable_folder_is_told_in_one_line(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(RtbenchError, match="permission denied"):
        RunWriter.create(tmp_path, "pc", "c", INFO, COLUMNS)


def test_records_of_a_start_need_no_pandas():
    code = "import rtbench.records.store, sys; print([m for m in sys.modules if m in %r])"
    heavy = ("pandas", "matplotlib", "scipy", "numba")
    done = subprocess.run(
        [sys.executable, "-c", code % (heavy,)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


WRITE_FOREVER = """
import sys
from pathlib import Path
from rtbench.records import schema
from rtbench.records.writer import RunWriter
cell = ["kernel", "density"]
info = {"experiment": "density", "cell": cell, "remarks": []}
made = RunWriter.create(Path(sys.argv[1]), "pc", "c", info, schema.sample_columns(cell))
print(made.path, flush=True)
number = 0
while True:
    row = dict(density=0.5, process=0, launch=0, round=number, position=0, triangles=10,
               repetitions=1, tests=10, ns=12345, cpu_ns=12345)
    made.append([row | {"kernel": f"kernel{k}"} for k in range(40)])
    made.update(remarks=[f"round {number}"])
    print(number, flush=True)
    number += 1
"""


@pytest.mark.parametrize("seed", range(8))
def test_killed_at_any_moment_the_run_loads(tmp_path, seed):
    started = [sys.executable, "-c", WRITE_FOREVER, str(tmp_path)]
    with subprocess.Popen(started, stdout=subprocess.PIPE, text=True) as process:
        path = process.stdout.readline().strip()
        time.sleep(random.Random(seed).uniform(0, 0.15))
        process.send_signal(signal.SIGKILL)
        told = process.stdout.read().splitlines()
    run = load_run(path)
    # The last number may have been cut off on its way here; those before it were told whole.
    rounds = int(told[-2]) + 1 if len(told) > 1 else 0
    assert len(run.samples) >= 40 * rounds
    counts = run.samples.groupby("round").size()
    assert (counts.iloc[:-1] == 40).all()
    assert run.info["remarks"] == [f"round {k}" for k in range(len(run.info["remarks"]))]
    with RunWriter.reopen(run.path) as again:
        again.append([dict.fromkeys(COLUMNS[5:], 1) | {"kernel": "k", "density": 1}])
    assert len(load_run(path).samples) == len(run.samples) + 1


WRITE_TO_THE_END = WRITE_FOREVER.replace(
    "number = 0",
    "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))\nnumber = 0",
).replace("while True:", "from rtbench.errors import RtbenchError\ntry:\n  while True:")
WRITE_TO_THE_END = "\n".join(
    "  " + text if number > WRITE_TO_THE_END.splitlines().index("  while True:") else text
    for number, text in enumerate(WRITE_TO_THE_END.splitlines())
)
WRITE_TO_THE_END += "\nexcept RtbenchError as error: print('told', error)"


def test_a_full_disk_is_told_and_the_run_goes_on_later(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", WRITE_TO_THE_END, str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )
    path, *rounds, told = done.stdout.strip().splitlines()
    assert told.startswith(f"told cannot write {path}")
    assert f"rtbench run --resume {path}" in told
    run = load_run(path)
    assert run.dropped == 0
    # The round that did not fit was taken back as a whole.
    assert len(run.samples) == 40 * len(rounds) > 0
    RunWriter.reopen(run.path).close()


def test_what_a_kill_left_half_made_is_swept_up_later(tmp_path):
    old, young = tmp_path / ".making-old", tmp_path / ".making-young"
    for folder in (old, young):
        folder.mkdir()
        (folder / "samples.csv").write_text("kernel\n")
    os.utime(old, (0, 0))
    RunWriter.create(tmp_path, "x", "y", {"cell": ["kernel"]}, ["kernel"]).close()
    assert not old.exists() and young.exists()
