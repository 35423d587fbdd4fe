"""``rtbench machine``: what it prints, and its exit code on quiet and noisy machines."""

import json
import subprocess
import sys

import pytest
from click.testing import CliRunner

from rtbench.cli.machine import command
from rtbench.errors import CheckFailed
from rtbench.measure import machine, noise

NOISY = noise.Complaint("a drum is beaten", "it shakes the table", "stop drumming")
HUM = noise.Complaint("a fridge hums", "it is heard", "pull the plug", serious=False)


@pytest.fixture
def told(monkeypatch):
    """Replace what takes time, and let the test say what is complained of."""
    found = []
    monkeypatch.setattr(noise, "jitter", lambda: {"lost": 0.0, "largest_ns": 0, "gaps": {}})
    monkeypatch.setattr(noise, "complaints", lambda *parts: list(found))
    monkeypatch.setattr(machine, "load", lambda: {"loadavg": [0.5, 0.25, 0.0]})
    return found


def test_json_holds_all_parts_and_the_verdict(told):
    told[:] = [NOISY, HUM]
    done = CliRunner().invoke(command, ["--format", "json"])
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert found["machine"]["label"] == machine.label()
    assert found["load"] == {"loadavg": [0.5, 0.25, 0.0]}
    assert found["quiet_enough"] is False
    assert [one["cure"] for one in found["complaints"]] == ["stop drumming", "pull the plug"]
    assert {"software", "float_state", "noise"} <= set(found)


def test_plain_prints_each_complaint_with_its_cure(told):
    told[:] = [NOISY, HUM]
    done = CliRunner().invoke(command, [])
    lines = done.stdout.splitlines()
    start = lines.index("NOT quiet enough to measure")
    assert lines[start + 1 :] == [
        "- a drum is beaten: it shakes the table",
        "  cure: stop drumming",
        "- a fridge hums (a remark): it is heard",
        "  cure: pull the plug",
    ]
    assert any(line.split() == ["label", machine.label()] for line in lines)


@pytest.mark.parametrize("format_", ["plain", "json"])
def test_strict_fails_on_what_is_serious_only_and_prints_first(told, format_):
    told[:] = [HUM]
    done = CliRunner().invoke(command, ["--strict", "--format", format_])
    assert done.exit_code == 0
    told[:] = [NOISY, HUM]
    done = CliRunner().invoke(command, ["--strict", "--format", format_])
    assert isinstance(done.exception, CheckFailed)
    assert done.exception.exit_code == 1
    assert str(done.exception) == "not quiet enough to measure: a drum is beaten"
    assert "stop drumming" in done.stdout


def test_help_ends_in_an_example():
    done = CliRunner().invoke(command, ["--help"])
    assert done.output.rstrip().splitlines()[-1].strip().startswith("Example:  rtbench machine")


def test_neither_numba_nor_pandas_is_imported():
    code = (
        "import sys; from rtbench.cli.machine import command\n"
        "assert 'numpy' not in sys.modules\n"
        "command(['--format', 'json'], standalone_mode=False)\n"
        "assert not {'numba', 'pandas', 'matplotlib', 'scipy'} & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["machine"]["cpu_model"]
