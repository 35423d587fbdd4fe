"""``rtbench diff`` as a user meets it."""

import json
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from rtbench.cli.diff import command
from rtbench.errors import CheckFailed, NotComparable, RtbenchError
from rtbench.records import schema
from rtbench.records.writer import RunWriter

CELL = ["kernel", "density"]


def diff(*arguments: str):
    return CliRunner().invoke(command, list(arguments))


@pytest.fixture
def two_runs(tmp_path):
    paths = []
    for seed, (name, ns) in enumerate((("before", 1000), ("after", 1300))):
        info = {"experiment": "density", "cell": CELL}
        rng = np.random.default_rng(seed)
        columns = schema.sample_columns(CELL)
        with RunWriter.create(tmp_path, name, "t", info, columns) as writer:
            for process in range(5):
                row = dict.fromkeys(columns[3:], 1) | {"process": process, "tests": 100}
                row["density"] = 0.5
                for number in range(6):
                    slow = {"kernel": "m", "ns": round(ns * np.exp(rng.normal(0, 0.01)))}
                    same = {"kernel": "c", "ns": round(1000 * np.exp(rng.normal(0, 0.01)))}
                    writer.append([row | slow | {"round": number}, row | same | {"round": number}])
            writer.finish()
        paths.append(str(writer.path))
    return paths


def test_the_example_of_the_help_works_as_typed():
    example = diff("--help").output.strip().splitlines()[-1].strip()
    assert example == "Example: rtbench diff blecha-pc1 blecha-pc4"
    result = diff(*example.split()[3:])
    assert result.exit_code == 0
    order = [
        "Environments",
        "Cells",
        "Cells without a partner",
        "Geometric mean",
        "Ranking on each machine",
        "Kernels that change places",
    ]
    places = [result.stdout.index(title) for title in order]
    assert places == sorted(places)
    assert "chirkov, moller1" in result.stdout and "no interval" in result.stdout


def test_json_is_one_object():
    result = diff("blecha-pc1", "blecha-pc4", "--format", "json")
    found = json.loads(result.stdout)
    assert found["runs"] == ["blecha-pc1", "blecha-pc4"]
    (ranked,) = found["rankings"]
    assert ranked["kernels"]["blecha-pc4"] == ["moller1", "chirkov", "badouel"]
    assert len(found["missing"]) == 48


def test_csv_is_the_table_of_cells():
    lines = diff("blecha-pc3", "blecha-pc4", "--format", "csv").stdout.splitlines()
    assert (
        lines[0]
        == "kernel,precision,order,density,run,first_ns,ns,ratio,low,high,beside_shift,verdict"
    )
    assert lines[1].startswith("moller1,float32,repeat,mean,blecha-pc4,47.124,36.818,0.78")
    assert len(lines) == 4


@pytest.mark.parametrize("form", ["github", "latex", "plain"])
def test_forms_with_a_reference_kernel(form):
    result = diff(
        "blecha-pc1", "blecha-pc2", "blecha-pc4", "--relative-to", "moller1", "--format", form
    )
    assert result.exit_code == 0
    assert "Relative to moller1" in result.stdout


def test_a_resolved_slowdown_fails_only_above_the_bound(two_runs):
    result = diff(*two_runs, "--fail-above", "5%")
    assert isinstance(result.exception, CheckFailed) and result.exception.exit_code == 1
    assert "1 cells are slower by more than 5 %" in str(result.exception)
    assert "m 0.5" in str(result.exception)
    assert "slower" in result.stdout and "no difference resolved" in result.stdout
    assert diff(*two_runs, "--fail-above", "60").exit_code == 0
    assert diff(*reversed(two_runs), "--fail-above", "5%").exit_code == 0
    assert diff(*two_runs, "--threshold", "50%", "--fail-above", "0%").exit_code == 0


def test_a_cell_without_interval_is_told_and_does_not_fail():
    result = diff("blecha-pc4", "blecha-pc1", "--fail-above", "5%")
    assert result.exit_code == 0
    assert "3 cells have no interval" in result.stderr
    assert "3 cells" not in result.stdout


@pytest.mark.parametrize(
    ("arguments", "kind", "words"),
    [
        (["blecha-pc1"], RtbenchError, "needs two runs"),
        (["blecha-pc1", "blecha-pc9"], RtbenchError, "did you mean"),
        (["blecha-pc1", "blecha-operations"], NotComparable, "different experiments"),
        (["blecha-pc1", "blecha-pc4", "--fail-above", "x"], RtbenchError, "not a percentage"),
        (["blecha-pc1", "blecha-pc4", "--threshold", "-5%"], RtbenchError, "not a percentage"),
        (["blecha-pc1", "blecha-pc4", "--relative-to", "moler1"], RtbenchError, "'moller1'"),
    ],
)
def test_bad_input_is_one_line(arguments, kind, words):
    result = diff(*arguments)
    assert type(result.exception) is kind
    assert words in str(result.exception) and "\n" not in str(result.exception)


def test_numba_and_matplotlib_are_never_imported():
    code = (
        "import sys; from rtbench.cli.diff import command\n"
        "assert not {'pandas', 'numpy'} & sys.modules.keys()\n"
        "command.main(['blecha-pc1', 'blecha-pc4'], standalone_mode=False)\n"
        "sys.exit(bool({'numba', 'matplotlib', 'scipy'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
