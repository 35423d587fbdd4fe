"""samples.csv as bytes on the disk: which lines are whole, which one was cut off."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from rtbench.errors import NotComparable
from rtbench.records.schema import TIMING, sample_columns
from rtbench.records.tabular import reason, row_of


@dataclass(frozen=True)
class WholeLines:
    """The part of samples.csv that was written whole.

    Attributes
    ----------
    columns : list of str
        The header.
    rows : list of dict
        A sample each.
    dropped : int
        1 if the last line was cut off, else 0.
    size : int
        Bytes up to the end of the last whole line; 0 if not even the header is whole.
    """

    columns: list[str]
    rows: list[dict]
    dropped: int
    size: int


def read_samples(path: Path, cell: list[str]) -> WholeLines:
    """Read samples.csv; a last line that was cut off is left out and counted.

    Parameters
    ----------
    path : Path
        The file.
    cell : list of str
        The columns of the run's cells, which must be in the header.

    Returns
    -------
    WholeLines
        Whatever is whole. A file without a whole header has no rows: the run was cut off there.

    Raises
    ------
    NotComparable
        If the file cannot be read, is foreign, or a line before the last is damaged.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise NotComparable(f"cannot read {path}: {reason(error)}") from error
    *whole, tail = data.split(b"\n")
    dropped = int(tail != b"")
    if not whole:
        return WholeLines(sample_columns(cell), [], dropped, 0)
    columns = _fields(path, 1, whole[0])
    absent = [name for name in (*cell, *TIMING) if name not in columns]
    if absent:
        raise NotComparable(f"{path} is not a samples.csv: no column {', '.join(absent)}")
    size = len(data) - len(tail)
    # A last line that ends in a newline but is too short was cut off by a lost disk block.
    if len(whole) > 1 and not dropped and _short(whole[-1], len(columns)):
        size -= len(whole.pop()) + 1
        dropped = 1
    rows = []
    for number, line in enumerate(whole[1:], start=2):
        row = row_of(path, number, columns, _fields(path, number, line))
        _must_be_whole(path, number, row)
        rows.append(row)
    return WholeLines(columns, rows, dropped, size)


def _short(line: bytes, fields: int) -> bool:
    try:
        return len(next(csv.reader([line.decode()]), [])) != fields
    except (UnicodeDecodeError, csv.Error):
        return True


def _fields(path: Path, number: int, line: bytes) -> list[str]:
    try:
        text = line.decode().removesuffix("\r")
        if re.search(r"[\x00-\x08\x0b-\x1f]", text):
            raise ValueError("not text")
        return next(csv.reader([text]), [])
    except (ValueError, csv.Error) as error:
        raise NotComparable(f"{path}, line {number} is damaged: not text") from error


def _must_be_whole(path: Path, number: int, row: dict) -> None:
    for name in TIMING:
        if row[name] is None:
            raise NotComparable(f"{path}, line {number} is damaged: {name} is empty")
        if row[name] < 0 or (name == "tests" and row[name] == 0):
            raise NotComparable(f"{path}, line {number} is damaged: {name} is {row[name]}")
