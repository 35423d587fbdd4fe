"""The command line in this process, and as a process of its own."""

import os
import subprocess
import sys
from typing import NamedTuple

import pytest

from rtbench import cli


class Ended(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def rtbench(monkeypatch, capsys, tmp_path):
    """Run a command in this process, in an empty folder; return exit code, stdout, stderr."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)

    def run(*arguments) -> Ended:
        monkeypatch.setattr(sys, "argv", ["rtbench", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main()
        told = capsys.readouterr()
        return Ended(ended.value.code or 0, told.out, told.err)

    return run


@pytest.fixture
def process(tmp_path):
    """Start a command as a process of its own, in the folder of the test."""
    started = []

    scratch = tmp_path / "scratch"  # what a killed process leaves there goes with the test
    scratch.mkdir()

    def start(*arguments, prefix=(), python=(), cwd=tmp_path, **env) -> subprocess.Popen:
        command = [*prefix, sys.executable, *python, "-m", "rtbench", *map(str, arguments)]
        started.append(
            subprocess.Popen(
                command,
                cwd=cwd,
                env=os.environ | {"TMPDIR": str(scratch)} | env,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return started[-1]

    yield start
    for one in started:
        one.kill()
        one.communicate()
