"""How many digits of a measured number are worth printing."""

import math
from collections.abc import Iterable, Mapping

from rtbench.report.tables import Cell, four_digits

MOST_DECIMALS = 3


def absent(value) -> bool:
    """Return whether a value of a record is an empty cell: None, NaN or no text."""
    if value is None or isinstance(value, str):
        return not value
    try:
        return bool(value != value)  # NaN is unequal to itself
    except TypeError:
        return True  # pandas.NA answers no comparison


def decimals(low: float, high: float) -> int:
    """Return the decimals worth printing: the last is uncertain by 3 to 29 units.

    Parameters
    ----------
    low, high : float
        The ends of the interval.

    Returns
    -------
    int
        From 0 to 3.
    """
    half = abs(high - low) / 2
    if half == 0:
        return MOST_DECIMALS
    # Two decimals for half a width from 0.03 to 0.29.
    return min(max(math.ceil(-math.log10(half / 2.95)), 0), MOST_DECIMALS)


def usual_decimals(rows: Iterable[Mapping]) -> int:
    """Return the middle one of the decimals that the intervals of a table's rows allow.

    Parameters
    ----------
    rows : iterable of mappings
        With ``ci_low`` and ``ci_high``, absent where there is no interval.

    Returns
    -------
    int
        From 0 to 3; the most where no row has an interval.
    """
    ends = [(row.get("ci_low"), row.get("ci_high")) for row in rows]
    allowed = [decimals(*pair) for pair in ends if not any(map(absent, pair))]
    return sorted(allowed)[len(allowed) // 2] if allowed else MOST_DECIMALS


def measured(value, low=None, high=None, most: int = MOST_DECIMALS) -> Cell:
    """Return a number with the digits that its interval allows, four digits without one.

    Parameters
    ----------
    value, low, high : float or None
        The number and its interval.
    most : int
        No more decimals than these, so that a column does not fray; see `usual_decimals`.

    Returns
    -------
    Cell
        The value and its text; both empty if there is none.
    """
    if absent(value):
        return Cell(None, "")
    value = float(value)
    if absent(low) or absent(high):
        return Cell(value, four_digits(value))
    return Cell(value, f"{value:,.{min(_places(value, low, high), most)}f}")


def interval(value, low, high, most: int = MOST_DECIMALS) -> str:
    """Return an interval as text, with as many decimals as the number that it belongs to."""
    if absent(value) or absent(low) or absent(high):
        return ""
    places = min(_places(float(value), low, high), most)
    return f"[{low:,.{places}f}, {high:,.{places}f}]"


def percent(share, mark: str = "") -> Cell:
    """Return a fraction as a percentage with one decimal, and a mark behind it."""
    if absent(share):
        return Cell(None, "")
    text = f"{100 * float(share):.1f}" if share else "0"
    return Cell(100 * float(share), f"{text} {mark}".rstrip())


def frequency(share) -> Cell:
    """Return a fraction as a percentage; one below 0.1 % keeps two digits, however small."""
    if absent(share):
        return Cell(None, "")
    share = 100 * float(share)
    if share == 0:
        return Cell(share, "0")
    if 0 < share < 0.1:
        return Cell(share, f"{share:.{1 - math.floor(math.log10(share))}f}")
    return Cell(share, f"{share:.2f}")


def _places(value: float, low: float, high: float) -> int:
    # An interval of no width would print digits that no clock can tell apart: four are enough.
    most = max(3 - math.floor(math.log10(abs(value))), 0) if value else MOST_DECIMALS
    return min(decimals(low, high), most)
