"""Cells of a run of packets: what is alike in all of them, and which one thing a cell varies."""

from typing import TYPE_CHECKING, NamedTuple

from rtbench.records import derive, statistics
from rtbench.report import cells
from rtbench.report.digits import absent

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

FORMS = ("rays", "triangles", "pairs")
KINDS = ("general", "common", "parallel")
EXITS = ("none", "any")
LAYOUTS = ("blocks", "soa", "aos")
AXES = ("stored", "table", "fixed")
RECIPROCALS = ("division", "estimate")
SCALAR = 1
_PLAIN = {
    "exit": EXITS[0],
    "layout": LAYOUTS[0],
    "axes": AXES[0],
    "reciprocal": RECIPROCALS[0],
}
# What the scalar loop over all triangles and that over pairs do not have.
_OF_LANES = ("packet", "angle", *_PLAIN)


class Speed(NamedTuple):
    """Million tests a second, and the ends of its 95 % interval; None where there is none."""

    middle: float
    low: float | None
    high: float | None


def speed(cell: dict) -> Speed:
    """Return the speed of a row of a summary."""
    low, high = cell.get("ci_low"), cell.get("ci_high")
    known = not absent(low) and not absent(high) and low > 0
    return Speed(1e3 / cell["ns_per_test"], *((1e3 / high, 1e3 / low) if known else (None, None)))


def base(run: "Run", frame: "DataFrame") -> dict:
    """Return the packets from which one thing at a time is varied.

    Parameters
    ----------
    run : Run
        A run of the experiment ``packets``; its config names the first kind and angle.
    frame : DataFrame
        Rows of its summary.

    Returns
    -------
    dict
        Column to value, for packets of rays of the greatest width.
    """
    config = run.info.get("config") or {}
    kinds = cells.values(frame, "packet", tuple(config.get("packets") or ()))
    angles = cells.values(frame, "angle", tuple(config.get("angles") or ()))
    found = {"form": FORMS[0], "width": max(widths(frame), default=SCALAR)}
    first = {"packet": kinds[0] if kinds else None, "angle": angles[0] if angles else None}
    return found | first | _PLAIN


def cell(frame: "DataFrame", base: dict, **changed) -> dict | None:
    """Return the one row that is as the base but for what is changed, None if there is none.

    Parameters
    ----------
    frame : DataFrame
        Rows of one kernel, precision, way of preparing and density.
    base : dict
        As `base` returns it.
    **changed
        Columns and their values; width 1 is the scalar loop, of which nothing else is asked.
    """
    wanted = base | changed
    if wanted["form"] == "pairs":
        wanted |= {"packet": None, "angle": None}
    if wanted["width"] == SCALAR:
        # Groups of triangles are the same tests as packets of rays, one by one.
        wanted |= {"form": FORMS[0] if wanted["form"] == FORMS[1] else wanted["form"]}
        wanted |= dict.fromkeys(_OF_LANES)
    rows = cells.where(frame, **wanted)
    return rows.iloc[0].to_dict() if len(rows) else None


def widths(frame: "DataFrame") -> list[int]:
    """Return how many lanes there are at a time, 1 for none."""
    return sorted(int(width) for width in cells.values(frame, "width"))


def angles(frame: "DataFrame") -> list[float]:
    """Return the angles of the packets, degrees."""
    return sorted(cells.values(frame, "angle"))


class Gains:
    """How many times as fast one cell of a run is as another, paired by process and round."""

    def __init__(self, run: "Run"):
        self._run = run
        self._seed = statistics.seed_of(run.name)
        sampled = not run.published and len(run.samples)
        self._samples = derive.cells(run, run.cell) if sampled else {}

    def of(self, slow: dict, fast: dict) -> Speed:
        """Return the ratio of the speeds of two rows of the summary."""
        samples = [self._samples.get(self._key(one)) for one in (slow, fast)]
        plain = Speed(slow["ns_per_test"] / fast["ns_per_test"], None, None)
        if any(one is None for one in samples):
            return plain
        found = statistics.paired_ratio(*map(derive.times, samples), self._seed)
        if found is None:
            return plain
        return Speed(found.value, *(found.interval() or (None, None)))

    def _key(self, row: dict) -> tuple:
        return tuple(None if absent(row.get(name)) else row[name] for name in self._run.cell)


def work(run: "Run") -> str:
    """Return the size of the soups in words, nothing where the config does not tell it."""
    config = run.info.get("config") or {}
    triangles, shot = config.get("triangles"), config.get("rays")
    if not isinstance(triangles, int) or not isinstance(shot, int):
        return ""
    return f"{triangles:,} triangles x {shot:,} rays"
