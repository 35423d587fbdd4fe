"""One table, five ways to print it: plain, github, latex, csv, json."""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from tabulate import tabulate

from rtbench.errors import RtbenchError, unknown

FORMS = ("plain", "github", "latex", "csv", "json")
RAW_FORMS = ("csv", "json")
SUFFIXES = {"plain": "txt", "github": "md", "latex": "tex", "csv": "csv", "json": "json"}

_LATEX = {"latex": "latex_booktabs", "github": "github", "plain": "simple"}
_LATEX_ESCAPES = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


class Cell(NamedTuple):
    """A value as it is, for csv and json, and the text that stands for it everywhere else."""

    value: Any
    text: str


@dataclass(frozen=True)
class Table:
    """Rows with the columns to print, a title above and remarks below.

    Attributes
    ----------
    name : str
        File name without suffix.
    rows : list of dict
        Column to value; a value may be a `Cell`.
    columns : list of str
        The columns for plain, github and latex, in order.
    raw_columns : list of str
        The columns for csv and json; the same as `columns` if empty.
    raw_rows : list of dict
        The rows for csv and json; the same as `rows` if empty.
    headers : dict
        Column to the words printed at its head; a column without an entry is its own head.
        csv and json keep the column names.
    notes : list of str
        Lines below the table; csv and json go without.
    """

    name: str
    rows: list[dict]
    columns: list[str]
    title: str = ""
    raw_columns: list[str] = field(default_factory=list)
    raw_rows: list[dict] = field(default_factory=list)
    headers: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def render(self, form: str = "plain") -> str:
        """Return the table as text, its notes below it; see `render`."""
        if form in RAW_FORMS:
            return render(self.raw_rows or self.rows, self.raw_columns or self.columns, form)
        text = render(self.rows, self.columns, form, self.title, headers=self.headers)
        if not self.notes:
            return text
        notes = [latex_text(note) for note in self.notes] if form == "latex" else self.notes
        # An empty line ends a paragraph in all three, and a table in Markdown.
        return text + "\n\n" + ("\n\n" if form != "plain" else "\n").join(notes)


def render(
    rows: Sequence[Mapping[str, Any]],
    columns: Sequence[str],
    form: str = "plain",
    title: str = "",
    missing: str = "-",
    headers: Mapping[str, str] | None = None,
) -> str:
    """Return a table as text.

    Parameters
    ----------
    rows : sequence of mappings
        Column to value: text, a number, a `Cell` (value and its text), or nothing: None, NaN and
        an absent key are the same. Floats that come without a text get four significant digits.
    columns : sequence of str
        The columns in order; other keys of a row are not printed.
    form : str
        ``plain``, ``github``, ``latex`` (booktabs), ``csv`` or ``json``.
    title : str
        Line above the table, caption in latex; csv and json go without.
    missing : str
        What stands for nothing; csv leaves the cell empty and json says null.
    headers : mapping of str to str, optional
        What to print at the head of a column instead of its name; not in csv and json.

    Returns
    -------
    str
        The text without a newline at its end. Columns of numbers stand to the right with their
        decimal points in line. csv and json hold the values, not their texts.

    Raises
    ------
    RtbenchError
        For an unknown form.
    """
    if form not in FORMS:
        raise RtbenchError(unknown("format", form, FORMS))
    if form == "json":
        objects = [{column: _raw(row.get(column)) for column in columns} for row in rows]
        return json.dumps(objects, indent=2, ensure_ascii=False, allow_nan=False)
    if form == "csv":
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([_raw(row.get(column)) for column in columns] for row in rows)
        return out.getvalue().rstrip("\n")
    return _printed(rows, columns, form, title, missing, headers or {})


def latex_text(text: str) -> str:
    """Return text with the characters escaped that mean something to LaTeX."""
    return "".join(_LATEX_ESCAPES.get(character, character) for character in text)


def _printed(rows, columns, form, title, missing, headers) -> str:
    heads = [headers.get(column, column) for column in columns]
    body, sides = [], []
    for column in columns:
        values = [row.get(column) for row in rows]
        texts = [_text(value, missing) for value in values]
        if form == "github":
            texts = [text.replace("|", r"\|").replace("\n", " ") for text in texts]
        numeric = _is_numeric(values)
        sides.append("right" if numeric else "left")
        body.append(_points_in_line(texts) if numeric and form != "latex" else texts)
    table = tabulate(
        [list(line) for line in zip(*body, strict=True)],
        headers=heads,
        tablefmt=_LATEX[form],
        disable_numparse=True,
        colalign=sides if rows else None,
        preserve_whitespace=True,
    )
    table = "\n".join(line.rstrip() for line in table.splitlines())
    if not title:
        return table
    if form == "latex":
        caption = f"\\caption{{{latex_text(title)}}}"
        return f"\\begin{{table}}\n\\centering\n{caption}\n{table}\n\\end{{table}}"
    return (f"**{title}**" if form == "github" else title) + "\n\n" + table


def _raw(value):
    if isinstance(value, Cell):
        value = value.value
    if hasattr(value, "item"):  # numpy's scalars are not known to json
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _text(value, missing: str) -> str:
    if isinstance(value, Cell):
        return value.text or missing
    value = _raw(value)
    if value is None or value == "":
        return missing
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return four_digits(value)
    return str(value)


def four_digits(value: float) -> str:
    """Return a number with four significant digits and no exponent; whole digits are all kept."""
    if value == 0:
        return "0"
    places = 3 - math.floor(math.log10(abs(value)))
    return f"{value:,.{min(max(places, 0), 12)}f}"


def _is_numeric(values) -> bool:
    """Whether a column stands to the right: it has a number and nothing but numbers."""
    given = [raw for raw in map(_raw, values) if raw is not None and raw != ""]
    return bool(given) and all(
        isinstance(raw, int | float) and not isinstance(raw, bool) for raw in given
    )


def _points_in_line(texts: list[str]) -> list[str]:
    """Pad numbers on the right, so that right-aligned they have their decimal points in line."""
    tails = []
    for text in texts:
        digits = text.split(" ")[0]
        tails.append(len(text) - text.index(".") if "." in digits else _after_digits(text))
    longest = max(tails)
    return [text + " " * (longest - tail) for text, tail in zip(texts, tails, strict=True)]


def _after_digits(text: str) -> int:
    """Length of what follows the digits of a text without a decimal point ("5 *" has 2)."""
    return len(text) - len(text.split(" ")[0])
