"""The command line: parse, call, print. No logic."""

from __future__ import annotations

import importlib
import os
import sys

import click

from rtbench.cli import stopping
from rtbench.errors import RtbenchError

COMMANDS = {
    "run": "Measure kernels.",
    "reproduce": "Repeat a thesis's table, beside its numbers.",
    "kernels": "List the kernels, or show one.",
    "check": "Is a kernel, or a function of yours, right about hard cases?",
    "accuracy": "What accuracy costs in time, and what it buys.",
    "trees": "What k-d trees and a BVH over a model cost, and what they save.",
    "effects": "What it saves to simulate only the effects a scene calls for.",
    "render": "Trace a scene, and only the effects that it calls for.",
    "machine": "What am I running on, and is it quiet enough to measure?",
    "compare-images": "By how much two pictures differ, and whether it can be seen.",
    "table": "Print a run as tables.",
    "plot": "Draw a run's plots.",
    "roofline": "What bounds each kernel of a run, and what it reaches of that.",
    "diff": "Compare runs.",
    "advise": "Which kernel to take, by what was measured here.",
    "corpus": "Write hard cases with their exact answers.",
}


class Commands(click.Group):
    """Commands that are imported when they are called: ``--help`` needs click alone."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        return importlib.import_module(f"rtbench.cli.{name.replace('-', '_')}").command

    def resolve_command(self, context: click.Context, args: list[str]):
        """Name the nearest command for one that is not there."""
        if args and not args[0].startswith("-") and args[0] not in COMMANDS:
            from rtbench.errors import unknown

            raise RtbenchError(unknown("command", args[0], COMMANDS))
        return super().resolve_command(context, args)

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.command(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Example: rtbench run --density 0.3 --tris 2000 --reps 10000",
)
@click.version_option(package_name="rtbench")
def group() -> None:
    """Measure what intersecting rays with triangles costs, and what accuracy costs in time."""


def main() -> None:
    """Run the command line; every error is one line and an exit code."""
    code = 0
    try:
        stopping.install()
        # Not group.main: it prints an empty line at Ctrl-C.
        with group.make_context("rtbench", sys.argv[1:] or ["--help"]) as context:
            group.invoke(context)
        sys.stdout.flush()
    except RtbenchError as problem:
        _end(str(problem), problem.exit_code)
    except click.exceptions.Exit as end:
        code = end.exit_code
    except click.ClickException as problem:
        _end(problem.format_message(), problem.exit_code)
    except KeyboardInterrupt:
        _end("stopped", 130)
    except BrokenPipeError:  # the reader of our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except MemoryError:
        _end("not enough memory: fewer triangles need less", 2)
    except OSError as problem:
        where = f" {problem.filename!r}" if problem.filename else ""
        _end(f"{problem.strerror or problem}{where}", 2)
    sys.exit(code)


def _end(message: str, code: int) -> None:
    print(f"rtbench: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(code)
