import csv
import importlib.util
import io
import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from rtbench.cli.table import command
from rtbench.errors import RtbenchError

SAMPLES = Path(__file__).parents[1] / "report" / "sample_runs.py"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(here):
    spec = importlib.util.spec_from_file_location("sample_runs", SAMPLES)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.density_run(here / "results" / "a-run", processes=2, rounds=2)


def table(*arguments):
    return CliRunner().invoke(command, arguments, catch_exceptions=True)


def test_the_thesis_s_table(here):
    done = table("blecha-pc1-4.1")
    assert done.exit_code == 0, done.exception
    lines = done.stdout.splitlines()
    assert lines[2].split()[:7] == ["kernel", "order", "0", "0.25", "0.5", "0.75", "1"]
    assert lines[4].split()[:3] == ["moller0", "repeat", "69.59"]
    assert not list(here.iterdir())


def test_files_beside_the_run_and_nothing_but_the_table_on_stdout(run):
    done = table("a-run", "--format", "csv", "--only", "times")
    read = list(csv.DictReader(io.StringIO(done.stdout)))
    assert len(read) == 8 and {row["order"] for row in read} == {"repeat", "sweep"}
    assert "tables" in done.stderr
    assert sorted(path.name for path in (run / "tables").iterdir())[:3] == [
        "outcomes.csv",
        "outcomes.md",
        "outcomes.tex",
    ]


def test_json_is_one_document(run):
    found = json.loads(table("a-run", "--format", "json").stdout)
    assert list(found) == ["times", "outcomes"]


def test_runs_under_another_folder(run, here):
    (here / "results").rename(here / "elsewhere")
    assert isinstance(table("a-run").exception, RtbenchError)
    assert table("a-run", "--out", "elsewhere").exit_code == 0


def test_tables_are_printed_even_where_they_cannot_be_written(run):
    (run / "tables").write_text("in the way", encoding="utf-8")
    done = table("a-run")
    assert done.exit_code == 0 and "moller1" in done.stdout
    assert "cannot write" in done.stderr


def test_unknown_table(here):
    done = table("blecha-pc1", "--only", "outcome")
    assert isinstance(done.exception, RtbenchError)
    assert "did you mean 'outcomes'" in str(done.exception)


def test_help_ends_in_an_example_that_works(here):
    example = table("--help").stdout.strip().splitlines()[-1].split()
    assert example[:3] == ["Example:", "rtbench", "table"]
    assert table(*example[3:]).exit_code == 0


def test_numba_and_matplotlib_stay_out(here):
    code = (
        "import sys\nfrom rtbench.cli.table import command\n"
        "command(['blecha-pc1'], standalone_mode=False)\n"
        "print([m for m in ('numba', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
