"""Small CSV tables to and from values: whole numbers, numbers, words, and nothing."""

import csv
import io
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rtbench.errors import NotComparable, RtbenchError
from rtbench.records.schema import INTEGER_COLUMNS, TEXT_COLUMNS

if TYPE_CHECKING:
    import pandas

_WHOLE = re.compile(r"[+-]?\d+\Z")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")


def parse(column: str, text: str) -> object:
    """Return the value that a CSV field stands for.

    Parameters
    ----------
    column : str
        The column, since names stay text even where they look like numbers.
    text : str
        The field.

    Returns
    -------
    None, str, int or float
        None for an empty field; a density is always a float or a word.

    Raises
    ------
    ValueError
        If the column holds whole numbers and the field is none.
    """
    if text == "":
        return None
    if column in TEXT_COLUMNS:
        return text
    if column in INTEGER_COLUMNS:
        if not _WHOLE.match(text):
            raise ValueError(f"{column} must be a whole number, not {text!r}")
        return int(text)
    if column != "density" and _WHOLE.match(text):
        return int(text)
    return float(text) if _NUMBER.match(text) else text


def plain(value: object) -> object:
    """Return a value as cells are compared: no numpy types, no NaN, whole floats kept as floats."""
    if hasattr(value, "item"):
        value = value.item()
    missing = value is None or str(value) == "<NA>" or value != value
    return None if missing else value


def lines(rows: Iterable[dict], columns: Sequence[str]) -> str:
    """Return rows as lines of CSV, without a header.

    Parameters
    ----------
    rows : iterable of dict
        Absent keys and None become empty fields.
    columns : sequence of str
        The order of the fields.

    Returns
    -------
    str
        One line a row, each ended by a newline.

    Raises
    ------
    ValueError
        If a row has a key that is no column, or a text with a line break.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    known = set(columns)
    for row in rows:
        if not row.keys() <= known:
            raise ValueError(f"not columns of this table: {sorted(row.keys() - known)}")
        fields = [plain(row.get(column)) for column in columns]
        if any(isinstance(field, str) and ("\n" in field or "\r" in field) for field in fields):
            raise ValueError(f"a line break in a record: {fields}")
        writer.writerow(["" if field is None else field for field in fields])
    return text.getvalue()


def frame(rows: Sequence[dict], columns: Sequence[str]) -> "pandas.DataFrame":
    """Return rows as a table with steady column types.

    Parameters
    ----------
    rows : sequence of dict
        Values as `parse` gives them.
    columns : sequence of str
        The columns, in order.

    Returns
    -------
    pandas.DataFrame
        Whole numbers are int64 (Int64 where some are absent), numbers float64 (NaN where absent),
        all else object with None where absent; a density column with the word ``mean`` is object.
    """
    import pandas

    table = {}
    for column in columns:
        values = [plain(row.get(column)) for row in rows]
        known = [value for value in values if value is not None]
        whole = all(isinstance(value, int) for value in known)
        number = all(isinstance(value, int | float) for value in known)
        if column in INTEGER_COLUMNS or (known and whole and column != "density"):
            table[column] = pandas.array(values, dtype="Int64")
            if len(known) == len(values):
                table[column] = table[column].astype("int64")
        elif column in TEXT_COLUMNS or not number:
            table[column] = pandas.Series(values, dtype=object)
        else:
            table[column] = pandas.Series(values, dtype="float64")
    return pandas.DataFrame(table, columns=list(columns))


def read(path: Path, required: Sequence[str]) -> "pandas.DataFrame":
    """Read a table that was derived or published.

    Parameters
    ----------
    path : Path
        A CSV with a header.
    required : sequence of str
        Columns that it must have.

    Returns
    -------
    pandas.DataFrame
        As `frame` makes it.

    Raises
    ------
    NotComparable
        If it cannot be read, is foreign, or a line is damaged.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise NotComparable(f"cannot read {path}: {reason(error)}") from error
    rows = list(csv.reader(text.splitlines()))
    columns = rows[0] if rows else []
    absent = [name for name in required if name not in columns]
    if absent:
        raise NotComparable(f"{path} is not a table of rtbench: no column {', '.join(absent)}")
    values = []
    for number, fields in enumerate(rows[1:], start=2):
        values.append(row_of(path, number, columns, fields))
    return frame(values, columns)


def row_of(path: Path, number: int, columns: Sequence[str], fields: Sequence[str]) -> dict:
    """Return one line of a CSV as a dict of values.

    Raises
    ------
    NotComparable
        If the number of fields or a value is wrong; the message names the file and the line.
    """
    if len(fields) != len(columns):
        raise NotComparable(
            f"{path}, line {number} is damaged: {len(fields)} fields where {len(columns)} belong"
        )
    try:
        return {name: parse(name, field) for name, field in zip(columns, fields, strict=True)}
    except ValueError as error:
        raise NotComparable(f"{path}, line {number} is damaged: {error}") from error


def replace(path: Path, text: str) -> None:
    """Put a text file in place at once: written beside it, flushed to the disk, renamed.

    Parameters
    ----------
    path : Path
        The file; what was there stays whole if anything fails.
    text : str
        Its content.

    Raises
    ------
    RtbenchError
        If it cannot be written.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        try:
            with open(beside, "w", encoding="utf-8", newline="") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, path)
        except OSError:
            beside.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise RtbenchError(f"cannot write {path}: {reason(error)}") from error


def write(path: Path, table: "pandas.DataFrame") -> None:
    """Replace a derived CSV by a table.

    Raises
    ------
    RtbenchError
        If it cannot be written.
    """
    columns = list(table.columns)
    body = lines(table.to_dict("records"), columns)
    replace(path, ",".join(columns) + "\n" + body)


def reason(error: Exception) -> str:
    """Return why a file could not be read or written, in the system's own words."""
    return (getattr(error, "strerror", None) or str(error)).lower()
