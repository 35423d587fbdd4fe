"""``rtbench run``: what goes to stdout and what to stderr."""

import csv
import io
import json
import subprocess
import sys

import pytest

TINY = ("run", "--tris", 40, "--reps", 6, "--kernel", "moller1", "--density", 0.5)
TINY = (*TINY, "--processes", 1)


def test_json_is_one_object(rtbench, tmp_path):
    ended = rtbench(*TINY, "--quiet", "--format", "json")
    assert (ended.code, ended.err) == (0, "")
    told = json.loads(ended.out)
    assert list(told) == ["run", "path", "tables"]
    folder = tmp_path / "here" / told["path"]
    assert folder.name == told["run"] and (folder / "summary.csv").is_file()
    with open(folder / "summary.csv", newline="") as file:
        summary = {(r["kernel"], r["order"]): r for r in csv.DictReader(file)}
    times = {(row["kernel"], row["order"]): row for row in told["tables"]["times"]}
    for key, row in summary.items():
        if key[0] != "empty":
            assert times[key]["ns_per_test"] == float(row["ns_per_test"])
            assert times[key]["hits"] == 20
    assert sum(row["count"] for row in told["tables"]["outcomes"]) == 40


def test_csv_is_the_first_table_alone(rtbench):
    ended = rtbench(*TINY, "--quiet", "--format", "csv")
    assert (ended.code, ended.err) == (0, "")
    head, *rows = csv.reader(io.StringIO(ended.out))
    assert "ns_per_test" in head and {len(row) for row in rows} == {len(head)}
    assert [row[0] for row in rows].count("moller1") == 2


@pytest.mark.parametrize("form", ["plain", "github", "latex"])
def test_the_others_print_all_tables(rtbench, form):
    ended = rtbench(*TINY, "--format", form, "--order", "sweep")
    assert ended.code == 0
    assert "hits" in ended.out and "parallel" in ended.out
    assert ("Records, tables and plots: results" in ended.out) == (form != "latex")
    # Without a terminal: what is measured, and no control characters.
    assert "cells" in ended.err and "\r" not in ended.err and "\033" not in ended.err


def test_options_reach_the_records(rtbench, tmp_path):
    ended = rtbench(
        *("run", "working-set", "--tris", 20, "--reps", 30, "-k", "mol*0", "--seed", 8, "-q"),
        *("--layout", "own", "--generator", "msvc", "--precision", "float64", "--order", "repeat"),
        *("--samples", 2, "--processes", 3, "--cpu", 0, "--label", "a b", "--out", "else where"),
        *("--format", "json", "--density", 0.25),
    )
    assert ended.code == 0, ended.err
    path = tmp_path / "here" / json.loads(ended.out)["path"]
    assert path.parent.name == "else where" and path.name.endswith("-a-b-working-set")
    info = json.loads((path / "run.json").read_text())
    wanted = {"kernels": ["mol*0"], "triangles": 20, "repetitions": 30, "seed": 8, "layout": "own"}
    wanted |= {"generator": "msvc", "precisions": ["float64"], "orders": ["repeat"], "samples": 2}
    wanted |= {"processes": 3, "densities": [0.25], "experiment": "working_set"}
    assert {key: info["config"][key] for key in wanted} == wanted
    assert info["plan"] | {"processes": 3, "rounds": 2, "cpu": 0} == info["plan"]
    assert info["command"][1:3] == ["run", "working-set"]


def test_a_config_of_ones_own_from_any_folder(rtbench, tmp_path):
    (tmp_path / "mine.toml").write_text('kernels = ["chirkov"]\ntriangles = 30\nrepetitions = 3\n')
    ended = rtbench("run", tmp_path / "mine.toml", "--density", 1, "-q", "--format", "json")
    told = json.loads(ended.out)
    assert told["run"].endswith("-mine")
    assert {row["kernel"] for row in told["tables"]["outcomes"]} == {"chirkov"}


def test_warnings_as_errors(process):
    ended = process(*TINY, "--quiet", python=("-W", "error"))
    out, err = ended.communicate(timeout=120)
    assert (ended.returncode, err) == (0, "")
    assert "moller1" in out


def test_a_reader_that_has_seen_enough(process):
    one = process(*TINY, "--quiet")
    one.stdout.close()
    assert one.wait(timeout=120) == 0
    assert one.stderr.read() == ""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_a_bar_with_the_time_left_on_a_terminal(tmp_path):
    import os
    import pty

    parent, terminal = pty.openpty()
    arguments = [*map(str, TINY), "--tris", "500", "--reps", "100000", "--order", "repeat"]
    one = subprocess.Popen(
        [sys.executable, "-m", "rtbench", *arguments],
        cwd=tmp_path,
        stderr=terminal,
        stdout=subprocess.PIPE,
        text=True,
    )
    os.close(terminal)
    shown = b""
    while True:
        try:
            part = os.read(parent, 4096)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown += part
    os.close(parent)
    out, _ = one.communicate(timeout=60)
    assert one.returncode == 0 and "moller1" in out and "\r" not in out
    shown = shown.decode()
    lines = shown.split("\r\033[K")
    assert any(line.startswith("compiling moller1") for line in lines)
    bars = [line for line in lines if line.startswith("measuring [")]
    assert bars[0].startswith("measuring [......")
    assert any("#" in line and line.endswith("left") for line in bars)
    assert lines[-1] == "", "the line is not cleared at the end"
    assert all(len(line) < 80 for line in lines if "cells" not in line)


def test_without_numba_in_sight_the_kernels_are_listed():
    import rtbench

    code = (
        "import sys; sys.argv = ['rtbench', 'kernels', '--format', 'json']\n"
        "from rtbench.cli import main\n"
        "try:\n    main()\n"
        "finally:\n    assert 'numba' not in sys.modules and 'pandas' not in sys.modules\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (0, "")
    assert json.loads(found.stdout) == rtbench.list_kernels()


def test_the_package_is_quick_to_import():
    code = "import sys, rtbench; assert not {'numpy', 'numba', 'click'} & set(sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
