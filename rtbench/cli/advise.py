"""``rtbench advise``: which kernel to take."""

from __future__ import annotations

import json
import re
from pathlib import Path

import click

from rtbench.cli import options
from rtbench.errors import RtbenchError

UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "ki": 2**10, "mi": 2**20, "gi": 2**30}
EXAMPLES = """\b
Examples:
  rtbench advise
  rtbench advise --stored none --outputs tuv --hit-ratio 0.1
  rtbench advise --stored precomputed --hit-ratio 0.3 --rays-per-triangle 20
  rtbench advise --outputs tuv --triangles 1000000 --memory 50MB
"""


class Bytes(click.ParamType):
    """``50000000``, ``50MB`` or ``48MiB``: a number of bytes."""

    name = "bytes"

    def convert(self, value, param, ctx) -> int:
        found = re.fullmatch(r"(\d+(?:\.\d*)?)\s*([kmg]?i?)b?", str(value).lower())
        if not found or found[2] not in UNITS:
            raise RtbenchError(
                f"{param.opts[0]} {value!r} is not a number of bytes (50000000, 50MB, 48MiB)"
            )
        return int(float(found[1]) * UNITS[found[2]])


@click.command(epilog=EXAMPLES)
@click.argument("runs", metavar="[RUN ...]", nargs=-1)
@click.option(
    "--stored",
    default="precomputed",
    show_default=True,
    metavar="WHAT",
    help="The most that may be stored of a triangle: none (its vertices), normal, or precomputed.",
)
@click.option(
    "--outputs",
    default="t",
    show_default=True,
    metavar="WHAT",
    help="What must come back of a hit: t, or tuv. Who returns u and v too fits t.",
)
@click.option(
    "--hit-ratio",
    type=float,
    default=0.1,
    show_default=True,
    help="Share of the tests that hit. Between two that were measured their times are mixed.",
)
@click.option(
    "--precision",
    default="float32",
    show_default=True,
    metavar="P",
    help="float32, float64 or mixed.",
)
@click.option(
    "--rays-per-triangle",
    type=float,
    metavar="N",
    help="How many rays are tested against a triangle that was prepared once: a test costs its "
    "time and 1/N of the preparation.  [preparation is free]",
)
@click.option("--packets", is_flag=True, help="Rays come in packets.")
@click.option("--stable", is_flag=True, help="Only kernels that are stable (S1 to S6).")
@click.option("--watertight", is_flag=True, help="Only kernels through which no ray leaks (S2).")
@click.option("--exact", is_flag=True, help="Only kernels whose answers are exact (X1, X2).")
@click.option(
    "--triangles", type=int, metavar="N", help="How many there are: the nearest measured number."
)
@click.option("--memory", type=Bytes(), metavar="BYTES", help="Room for all of them: 50MB, 48MiB.")
@options.table_format
@options.out
def command(runs, form: str, out: Path, **asked) -> None:
    """Which kernel to take, by what was measured on this machine.

    Prints the fastest kernel that fits, all that the measurement cannot tell from it, the ranking,
    and why the others fell out. Nothing is measured.

    The runs are made by rtbench reproduce havel --quick, or rtbench run havel-5.1.1 and others.
    RUN is a path or a folder name under the output folder; runs of several machines are refused.
    Without RUN: the newest finished run of each config that this machine made over soups (soup,
    break_even; without any of these: density), with --packets over packets. What several runs
    measured counts as the newest has it.

    Within a run, ratios are paired round by round. Between runs they are taken beside what both
    runs' identical machine code (or a third run between them) shows of their clocks; where two
    runs share less than two such kernels, only what is resolved to be more than 10 % slower counts
    as slower. Preparation was timed without an interval: it may be a fifth quicker or slower.

    With --stable, --watertight or --exact: what that costs beside the fastest without it. Asked are
    then the newest runs of rtbench accuracy first, which times such kernels; which kernel holds
    what the newest run of accuracy or stability on this machine says, else what kernels claim.

    json is one object: advice, question, advice table and what fell out; csv is the ranking alone.
    """
    from rtbench.records.store import load_run
    from rtbench.report.advise import Question, advise

    given = [word for word in ("stable", "watertight", "exact") if asked.pop(word)]
    if len(given) > 1:
        raise RtbenchError(f"--{given[0]} and --{given[1]}: one of them can be asked")
    question = Question(**asked, accuracy=given[0] if given else None)
    if runs:
        chosen = [load_run(run, out) for run in runs]
        for run in chosen:
            if run.published:
                raise RtbenchError(f"{run.name} was published: it has no samples to ask")
    else:
        chosen = _newest(out, question.packets, question.accuracy is not None)
    standard = _standard(question.accuracy, chosen, out) if question.accuracy else None
    show(advise(chosen, question, standard), form)


def _newest(out: Path, packets: bool, judged: bool) -> list:
    from rtbench.measure.machine import fingerprint
    from rtbench.report.candidates import measured_runs

    found = measured_runs(out, fingerprint(), packets, judged)
    if not found:
        what = "packets" if packets else "kernels"
        cure = "accuracy --quick" if judged else "reproduce havel --quick"
        raise RtbenchError(
            f"no finished run of this machine in {str(out)!r} measured {what}: "
            f"rtbench {cure} makes {'one' if judged else 'them'}"
        )
    return found


def _standard(word: str, chosen: list, out: Path):
    """Return who says which kernels are stable, watertight or exact."""
    from rtbench.kernels.registry import all_kernels
    from rtbench.report.standards import Standard, judging_runs

    machine = chosen[0].info.get("machine") or {}
    claims = {name: kernel.claims for name, kernel in all_kernels().items()}
    return Standard(word, judging_runs(out, machine), claims)


def show(advice, form: str) -> None:
    """Print the advice and its tables."""
    import dataclasses

    from rtbench.report.layouts.advise import advice_tables, sentence

    tables = advice_tables(advice)
    if form == "json":
        told = {"advice": sentence(advice), "question": dataclasses.asdict(advice.question)}
        told |= {"best": [one.candidate.kernel for one in advice.level]}
        told |= {name: [] for name in ("ranking", "fell_out")}
        for table in tables:
            key = "ranking" if table.name == "advice" else table.name
            told[key] = json.loads(table.render(form))
        told |= {"runs": [run.name for run in advice.runs], "remarks": advice.remarks}
        click.echo(json.dumps(told, indent=2, ensure_ascii=False))
        return
    if form == "csv":
        for table in tables:
            if table.name == "advice":
                click.echo(table.render(form))
        click.echo(f"rtbench: {sentence(advice)}", err=True)
        return
    text = sentence(advice)
    if form == "latex":
        from rtbench.report.tables import latex_text

        text = latex_text(text)
    click.echo("\n\n".join([text, *(table.render(form) for table in tables)]))
