import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from rtbench.cli.plot import command
from rtbench.errors import NotComparable, RtbenchError

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


def plot(*arguments):
    return CliRunner().invoke(command, arguments, catch_exceptions=True)


def test_paths_are_printed_and_are_there(run):
    done = plot("a-run")
    assert done.exit_code == 0, done.exception
    printed = [Path(line) for line in done.stdout.splitlines()]
    assert [path.name for path in printed] == [
        "density.png",
        "density.svg",
        "drift.png",
        "drift.svg",
    ]
    assert {path.resolve() for path in printed} == set((run / "plots").iterdir())


def test_a_published_run_is_not_written_to(here):
    done = plot("blecha-pc4", "--format", "svg")
    assert done.exit_code == 0, done.exception
    assert done.stdout.splitlines() == ["results/blecha-pc4-plots/density-4.3.svg"]


def test_out_and_formats(run, here):
    done = plot("a-run", "--out", "there", "--format", "pdf", "--format", "pdf")
    assert done.stdout.splitlines() == ["there/density.pdf", "there/drift.pdf"]
    assert not (run / "plots").exists()


def test_several_runs_are_one_chart(run, here):
    done = plot("blecha-pc1", "blecha-pc4", "a-run", "--format", "svg")
    assert done.exit_code == 0, done.exception
    (line,) = done.stdout.splitlines()
    assert line == "results/blecha-pc1-blecha-pc4-a-run-plots/machines.svg"
    assert (here / line).exists()


def test_a_read_only_record_is_not_touched(here):
    from rtbench import resources

    before = sorted(resources.published().rglob("*"))
    assert plot("blecha-pc1", "--format", "svg").exit_code == 0
    assert sorted(resources.published().rglob("*")) == before


def test_unknown_run_names_the_nearest(here):
    done = plot("blecha-pc9")
    assert isinstance(done.exception, RtbenchError)
    assert "blecha-pc9" in str(done.exception) and "did you mean 'blecha-pc" in str(done.exception)


def test_nothing_to_plot(here):
    done = plot("blecha-operations")
    assert isinstance(done.exception, RtbenchError)
    assert "nothing to plot" in str(done.exception)


def test_nothing_in_common(here):
    done = plot("blecha-pc1", "blecha-operations")
    assert isinstance(done.exception, NotComparable)


def test_help_ends_in_an_example_that_works(here):
    example = plot("--help").stdout.strip().splitlines()[-1].split()
    assert example[:3] == ["Example:", "rtbench", "plot"]
    assert plot(*example[3:]).exit_code == 0


def test_numba_and_pyplot_stay_out(here):
    code = (
        "import sys\nfrom rtbench.cli.plot import command\n"
        "command(['blecha-pc4', '--format', 'svg'], standalone_mode=False)\n"
        "print([m for m in ('numba', 'matplotlib.pyplot') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
