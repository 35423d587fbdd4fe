"""Help: quick, complete, and its examples work as typed."""

import json
import re
import shlex
import subprocess
import sys

import pytest

from rtbench import cli

# They measure for minutes, or ask for runs or pictures: they have tests of their own.
OF_THEIR_OWN = ("reproduce", "advise", "accuracy", "trees", "render", "effects", "compare-images")
COMMANDS = [(), *((name,) for name in cli.COMMANDS), ("kernels", "show")]


def examples(text: str) -> list[list[str]]:
    """Return what stands below the word Example, each line a command."""
    _, _, below = text.rpartition("Example")
    lines = re.sub(r"^s?:", "", below).strip().splitlines()
    return [shlex.split(line) for line in lines]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_help_ends_in_examples(rtbench, command):
    told = rtbench(*command, "--help")
    assert (told.code, told.err) == (0, "")
    found = examples(told.out)
    assert found
    for line in found:
        assert line[0] == "rtbench" and line[1] in cli.COMMANDS
        assert not command or line[1] == command[0]


def cheaper(arguments: list[str]) -> list[str]:
    """Return an example with settings that make its work small."""
    if arguments[0] == "run":
        small = {"working-set": ("--tris", "20")}.get(arguments[1], ("--tris", "40"))
        return [*arguments, *small, "--reps", "20", "--processes", "1", "--samples", "1"]
    return arguments


def shown(text):
    return [tuple(line[1:]) for line in examples(text)]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_examples_work(rtbench, command):
    for arguments in shown(rtbench(*command, "--help").out):
        if arguments[0] in OF_THEIR_OWN:
            continue
        if "working-set" in arguments:
            continue  # draws a million pairs
        told = rtbench(*cheaper(list(arguments)))
        assert told.code == 0, told.err
        assert told.out.strip()


def test_without_a_command_there_is_help(rtbench):
    assert rtbench() == rtbench("--help")
    assert all(name in rtbench().out for name in cli.COMMANDS)


def test_short_help(process):
    # In a process of its own: click keeps the names of an option from the first call that asked.
    one = process("diff", "-h")
    out, err = one.communicate(timeout=60)
    assert (one.returncode, err) == (0, "")
    assert out.startswith("Usage: ")


def test_the_version(rtbench):
    import importlib.metadata

    assert importlib.metadata.version("rtbench") in rtbench("--version").out


def imported(*arguments: str) -> set[str]:
    """Return the packages that a command has imported when it ends."""
    code = (
        f"import sys; sys.argv = {['rtbench', *arguments]!r}\n"
        "from rtbench.cli import main\n"
        "try:\n    main()\n"
        "finally:\n"
        "    names = sorted({name.partition('.')[0] for name in sys.modules})\n"
        "    import json; print('\\n' + json.dumps(names))\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (0, "")
    return set(json.loads(found.stdout.splitlines()[-1]))


@pytest.mark.parametrize("arguments", [(), *((name, "--help") for name in cli.COMMANDS)])
def test_help_imports_click_alone(arguments):
    heavy = {"numba", "llvmlite", "pandas", "numpy", "matplotlib", "scipy", "tabulate"}
    assert imported(*(arguments or ("--help",))) & heavy == set()


@pytest.mark.parametrize(
    "arguments", [("diff", "blecha-pc1", "blecha-pc4"), ("table", "blecha-pc1"), ("kernels",)]
)
def test_what_only_reads_does_not_import_the_compiler(arguments):
    assert not imported(*arguments) & {"numba", "llvmlite"}


def test_listed_kernels_can_be_shown(rtbench):
    for kernel in json.loads(rtbench("kernels", "--format", "json").out):
        told = rtbench("kernels", "show", kernel["name"])
        assert told.code == 0
        assert all(label in told.out for label in kernel["outcomes"])
