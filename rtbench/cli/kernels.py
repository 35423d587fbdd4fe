"""``rtbench kernels``: list the kernels, or show one."""

from __future__ import annotations

import json
import textwrap

import click

from rtbench.cli import options

LIST_EXAMPLE = """\b
Examples:
  rtbench kernels
  rtbench kernels --all
  rtbench kernels show wald_last
  rtbench kernels show chirkov --asm
"""
COLUMNS = (
    "name",
    "method",
    "endings",
    "domain",
    "stored",
    "outputs",
    "bytes",
    "padded",
    "add",
    "sub",
    "mul",
    "div",
    "cond",
    "source",
)


@click.group(invoke_without_command=True, epilog=LIST_EXAMPLE)
@options.table_format
@click.option("--all", "every", is_flag=True, help="Every name: each method with each ending.")
@click.pass_context
def command(context, form, every):
    """List the kernels: method, domain, outputs, bytes of a triangle, operations, source.

    One line a method, in its own way to end and with t alone where there is such a form; --all
    lists every name, and so does JSON. Bytes are of what the kernel reads of a triangle, float32,
    packed and in rows of 16 bytes. Operations are the greatest number on any path through the code,
    one condition an `if`.
    """
    if context.invoked_subcommand is not None:
        return
    from rtbench.compiled.catalogue import facts, list_kernels
    from rtbench.kernels.registry import all_kernels

    if form == "json":
        click.echo(json.dumps(list_kernels(), indent=2, ensure_ascii=False))
        return
    from rtbench.report.tables import Table

    kernels = all_kernels().values()
    shown = [each for each in kernels if every or each.name == each.function.__name__]
    rows = []
    for kernel in shown:
        known = facts(kernel)
        rows.append(
            {
                **known,
                **(known["operations"] or {}),
                "endings": len(_endings(kernel)) or None,
                "outputs": " ".join(known["outputs"]),
                "bytes": known["bytes_per_triangle"],
                "padded": known["bytes_per_triangle_padded"],
            }
        )
    notes = [
        f"{len(rows)} of {len(kernels)} kernels, each as it returns t alone; the others are these "
        "with other endings, or return u and v too: see --all"
    ]
    left_out = "endings" if every else "outputs"
    columns = [name for name in COLUMNS if name != left_out]
    table = Table("kernels", rows, columns, notes=[] if every else notes)
    click.echo(table.render(form))


def _endings(kernel) -> list[str]:
    """Return the endings that a method has; none of a whole listing."""
    named = (each.ending.name for each in kernel.function.kernels if each.ending)
    return list(dict.fromkeys(named))


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
    from rtbench.kernels.contract import DOMAINS, STORED

    kernel = registry.find(name)
    known = facts(kernel)
    if asm:
        from rtbench.compiled.loops import machine_code

        click.echo(machine_code(kernel, precision, layout))
        return
    click.echo(f"{kernel.name}: {kernel.title}")
    click.echo(f"  source      {kernel.source}")
    click.echo(f"  tests       {DOMAINS.get(kernel.domain, 'a point, the origin of the ray')}")
    click.echo(f"  returns     {', '.join(('outcome', *kernel.outputs))}")
    for code, label in enumerate(kernel.outcomes):
        click.echo(f"  outcome {code:<3} {label}")
    click.echo(
        f"  stored      {STORED[kernel.stored]}: {known['bytes_per_triangle']} bytes a triangle "
        f"(float32, packed), {known['bytes_per_triangle_padded']} in rows of 16"
    )
    if kernel.fallback:
        click.echo(f"  undecided   {kernel.fallback.__name__} in {kernel.fallback.__module__}")
    if kernel.claims:
        click.echo(f"  claims      {', '.join(kernel.claims)}: see rtbench check")
    for title, counts in (
        ("operations", known["operations"]),
        ("vectors", known["vector_operations"]),
        *([("preparing", known["preparation"])] if kernel.prepare else []),
    ):
        told = (
            "no tree bounds them"
            if counts is None
            else ", ".join(f"{count} {what}" for what, count in counts.items())
        )
        click.echo(f"  {title:<11} {told}")
    own = next((k for k in kernel.function.kernels if k.name == kernel.function.__name__), kernel)
    for title, names in (
        ("forms", [each.name for each in kernel.function.kernels if each.ending]),
        ("outputs", list(registry.derived(own))),
    ):
        if names:
            click.echo(_filled(f"  {title:<11} ", names))
    click.echo()
    click.echo(listing(kernel))


def _filled(start: str, names: list[str]) -> str:
    """Return names in lines of at most 100 letters, under each other behind a start."""
    return textwrap.fill(
        ", ".join(names),
        100,
        initial_indent=start,
        subsequent_indent=" " * len(start),
        break_long_words=False,
    )
