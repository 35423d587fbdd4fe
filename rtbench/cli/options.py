"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path

import click

FORMATS = ("plain", "github", "latex", "csv", "json")

table_format = click.option(
    "--format",
    "form",
    type=click.Choice(FORMATS),
    default="plain",
    show_default=True,
    help="How tables are printed.",
)
out = click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results"),
    show_default=True,
    help="The folder of runs.",
)
quiet = click.option("--quiet", "-q", is_flag=True, help="No progress on stderr.")
