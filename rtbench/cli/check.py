"""``rtbench check``: what a kernel, or a function of yours, gets wrong of hard cases."""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path

import click

from rtbench.cli import options

EXAMPLES = """\b
Examples:
  rtbench check moller1 --precision float32
  rtbench check wald --family needle --family cap
"""


@click.command(epilog=EXAMPLES)
@click.argument("names", metavar="[KERNEL | MODULE:FUNCTION ...]", nargs=-1)
@click.option(
    "--precision",
    "precisions",
    multiple=True,
    metavar="P",
    help="float32, float64 or mixed (float32 data, float64 arithmetic); repeatable.  "
    "[float32 float64]",
)
@click.option(
    "--corpus",
    type=click.Path(path_type=Path),
    metavar="FILE.npz",
    help="Cases of your own, as rtbench corpus writes them.",
)
@click.option("--all", "every", is_flag=True, help="Every kernel in every form.")
@click.option(
    "--family", "families", multiple=True, metavar="F", help="Only this family; repeatable."
)
@click.option("--seed", type=int, default=1, show_default=True, help="Of the cases.")
@options.table_format
@options.quiet
def command(names, precisions, corpus, every, families, seed, form, quiet):
    """Check kernels against hard cases whose exact answers are known; nothing is timed.

    Without a name: every method in its own way to end, with u and v where it returns them.

    A function of yours is MODULE:FUNCTION or FILE.py:FUNCTION, compiled or plain numpy:

    \b
      function(triangles (N, 3, 3), origins (N, 3), directions (N, 3))
        -> hit (N,), or (hit, t), or (hit, t, u, v)

    It is called once a precision with arrays of float32 or float64; t in units of the direction, u
    the weight of the second vertex and v of the third. Only hits with t > 0 count, of a kernel that
    tests lines too.

    One kernel is also told by family, and over the length of dir. json is one list: counts, C*,
    errors and the verdict of each kernel and precision; csv is the table of kernels. Exit code 1: a
    kernel is less stable than it claims.
    """
    from rtbench.cli.progress import Progress
    from rtbench.errors import RtbenchError

    if every and names:
        raise RtbenchError(f"--all and {names[0]!r}: name kernels, or take all")
    progress = Progress(quiet)
    try:
        checks, remarks = _checked(names, precisions, corpus, every, families, seed, progress)
    finally:
        progress.end()
    _show(checks, remarks, form)
    _must_keep_claims(checks)


def _checked(names, precisions, corpus, every, families, seed, progress):
    """Return the checks and what is to be remarked."""
    from rtbench.compiled.layout import PRECISIONS, check_precision
    from rtbench.errors import RtbenchError
    from rtbench.experiments import stability
    from rtbench.measure import float_control

    for precision in precisions:
        check_precision(precision)
    asked = precisions or ("float32", "float64")
    asked = [precision for precision in PRECISIONS if precision in asked]
    chosen, remarks = stability.subjects(names, every)
    cases, lengths = stability.cases(corpus, families, seed, progress.say)
    work = [(subject, precision) for subject in chosen for precision in asked]
    progress.plan(f"checking {len(chosen)} x {len(asked)} on {len(cases):,} cases")
    checks = []
    with contextlib.redirect_stdout(sys.stderr):  # what a function of the user's may print
        for place, (subject, precision) in enumerate(work):
            progress.progress(place / len(work))
            checks.append(subject.check(precision, cases, lengths))
        floats = float_control.state(), float_control.compiled_state()
    if not checks:
        raise RtbenchError("; ".join(remarks))
    found = float_control.complaints(*floats)  # a function's library may have switched them
    return checks, [*remarks, *(f"{one.what}: {one.why}; {one.cure}" for one in found)]


def _show(checks, remarks, form: str) -> None:
    from rtbench.experiments import stability
    from rtbench.report.layouts import stability as layouts

    told = [stability.tables(check) for check in checks]
    rows = [row for row, _, _ in told]
    if form == "json":
        found = [_object(check, row) for check, row in zip(checks, rows, strict=True)]
        click.echo(json.dumps(found, indent=2, ensure_ascii=False, allow_nan=False))
    elif form == "csv":
        click.echo(layouts.summary_table(rows).render(form))
    else:
        notes = [*layouts.LEGEND, *layouts.whys(rows)]
        tables = [layouts.summary_table(rows, notes)]
        if len({check.name for check in checks}) == 1:
            notes += [
                f"{check.precision} {name}: {reason}"
                for check in checks
                for name, reason in check.verdict.reasons.items()
            ]
            tables.append(layouts.causes_table(rows))
            for check, (_, families, _) in zip(checks, told, strict=True):
                name = f"{check.name} {check.precision}"
                tables.append(layouts.family_table(families, name))
            tables.append(layouts.lengths_table([p for _, _, points in told for p in points]))
        click.echo("\n\n".join(table.render(form) for table in tables if table.rows))
    for remark in remarks:
        click.echo(f"rtbench: {remark}", err=True)


def _object(check, row: dict) -> dict:
    """Return a check as an object of the list that JSON is; infinite numbers are null."""
    import math

    from rtbench.records.schema import SCORES

    found = {key: row[key] for key in SCORES}
    found["verdict"] = dict(check.verdict.holds)
    for key in ("edges", "nonfinite", "wrong_outside_core"):
        found[key] = row[key]
    for key in ("wrong_by_method", "wrong_by_stored_data", "wrong_by_arithmetic"):
        found[key] = row.get(key)
    found["leaks_by_method"] = row.get("leaks_by_method")
    found |= {"claims": list(check.claims), "reasons": dict(check.verdict.reasons)}
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in found.items()
    }


def _must_keep_claims(checks) -> None:
    from rtbench.errors import CheckFailed

    told = [
        f"{check.name} {check.precision} claims {' '.join(check.broken)} and fails: "
        + "; ".join(f"{name}: {check.verdict.reasons[name]}" for name in check.broken)
        for check in checks
        if check.broken
    ]
    if told:
        raise CheckFailed("; ".join(told))
