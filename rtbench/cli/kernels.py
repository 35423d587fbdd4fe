"""``rtbench kernels``: list the kernels, or show one."""

from __future__ import annotations

import json

import click

from rtbench.cli import options

LIST_EXAMPLE = """\b
Examples:
  rtbench kernels
  rtbench kernels show moller1
  rtbench kernels show chirkov --asm
"""
COLUMNS = (
    "name",
    "method",
    "domain",
    "outputs",
    "bytes",
    "add",
    "sub",
    "mul",
    "div",
    "cond",
    "source",
)


@click.group(invoke_without_command=True, epilog=LIST_EXAMPLE)
@options.table_format
@click.pass_context
def command(context, form):
    """List the kernels: method, domain, outputs, bytes of a triangle, operations, source.

    Bytes are of what the kernel reads of a triangle, float32, packed. Operations are the greatest
    number on any path through the code, one condition an `if`.
    """
    if context.invoked_subcommand is not None:
        return
    from rtbench.compiled.catalogue import list_kernels

    listed = list_kernels()
    if form == "json":
        click.echo(json.dumps(listed, indent=2, ensure_ascii=False))
        return
    from rtbench.report.tables import render

    rows = [
        {
            **kernel,
            **(kernel["operations"] or {}),
            "outputs": " ".join(kernel["outputs"]),
            "bytes": kernel["bytes_per_triangle"],
        }
        for kernel in listed
    ]
    click.echo(render(rows, list(COLUMNS), form))


@command.command(epilog="Example: rtbench kernels show moller1")
@click.argument("name")
@click.option("--asm", is_flag=True, help="The machine code of its loop, compiled afresh.")
@click.option(
    "--precision",
    default="float32",
    show_default=True,
    metavar="P",
    help="Of the machine code: float32, float64 or mixed.",
)
@click.option(
    "--layout",
    default="shared",
    show_default=True,
    metavar="LAYOUT",
    help="Of the machine code: shared or own.",
)
def show(name, asm, precision, layout):
    """Print a kernel's source, outcomes and operation counts.

    NAME is a kernel, or FILE.py:NAME.
    """
    from rtbench.compiled.catalogue import facts, listing
    from rtbench.kernels import registry
    from rtbench.kernels.contract import DOMAINS

    kernel = registry.find(name)
    known = facts(kernel)
    if asm:
        from rtbench.compiled.loops import machine_code

        click.echo(machine_code(kernel, precision, layout))
        return
    click.echo(f"{kernel.name}: {kernel.title}")
    click.echo(f"  source      {kernel.source}")
    click.echo(f"  tests       {DOMAINS[kernel.domain]}")
    click.echo(f"  returns     outcome, {', '.join(kernel.outputs)}")
    for code, label in enumerate(kernel.outcomes):
        click.echo(f"  outcome {code:<3} {label}")
    click.echo(f"  stored      {known['bytes_per_triangle']} bytes a triangle (float32, packed)")
    for title, counts in (
        ("operations", known["operations"]),
        ("vectors", known["vector_operations"]),
    ):
        told = (
            "no tree bounds them"
            if counts is None
            else ", ".join(f"{count} {what}" for what, count in counts.items())
        )
        click.echo(f"  {title:<11} {told}")
    click.echo()
    click.echo(listing(kernel))
