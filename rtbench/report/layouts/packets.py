"""Tables of packets: lanes against one by one, how packets break up, layouts, axes, reciprocal."""

from typing import TYPE_CHECKING

from rtbench.report import cells, packed
from rtbench.report.digits import measured
from rtbench.report.layouts.compared import (
    Comparison,
    alike,
    compared,
    lines_of,
    speed_text,
    table_of,
    told,
)
from rtbench.report.tables import Table

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

EXIT = "any"  # beside an angle: with the any-lane exit
_UNIT = "million tests a second"
_GAIN = ("gain", "gain_low", "gain_high")


def packets_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``packets``.

    Parameters
    ----------
    run : Run
        Measured, finished or not.

    Returns
    -------
    list of Table
        Lanes of every width; how packets break up as they spread; layouts; axes; reciprocal.
        What the run has no cells of has no rows.
    """
    return [
        widths_table(run),
        spread_table(run),
        layouts_table(run),
        axes_table(run),
        reciprocal_table(run),
    ]


def widths_table(run: "Run") -> Table:
    """Return the speed in lanes beside that of the same kernel one by one.

    Parameters
    ----------
    run : Run
        A run of the experiment ``packets``.

    Returns
    -------
    Table
        A row a form (with the any-lane exit and without), hit ratio and kernel, a column a width:
        million tests a second with its 95 % interval; then how many times the scalar form's speed
        the greatest width has.
    """
    frame = cells.times_of(run)
    base, there, gains = packed.base(run, frame), packed.widths(frame), packed.Gains(run)
    about = f"{_UNIT} and 95 % interval, by tests at a time (1: scalar, with its early exits)"
    what = Comparison("packets", about, {}, _forms(frame))
    rows, raw = [], []
    for line in lines_of(run, frame, what.ways):
        found = {w: packed.cell(line.block, base, **line.changed, width=w) for w in there}
        found = {w: cell for w, cell in found.items() if cell}
        widest = max(found, default=packed.SCALAR)
        if widest == packed.SCALAR:
            continue
        row = line.shown | {f"{w}": speed_text(cell) for w, cell in found.items()}
        scalar = found.get(packed.SCALAR)
        for width, cell in found.items():
            gain = gains.of(scalar, cell) if scalar else packed.Speed(None, None, None)
            if width == widest:
                row["gain"] = measured(*gain, 2)
            # The scalar form stands beside several forms, but is one cell.
            if all(cell[name] == value for name, value in line.changed.items()):
                raw.append(told(cell) | dict(zip(_GAIN, gain, strict=True)))
        rows.append(row)
    notes = [*_meanings(frame, base), "gain: speed of the most at a time / of the scalar form"]
    return table_of(run, what, rows, raw, [*map(str, there), "gain"], notes, _GAIN)


def spread_table(run: "Run") -> Table:
    """Return how packets break up as their rays spread.

    Parameters
    ----------
    run : Run
        A run of the experiment ``packets``.

    Returns
    -------
    Table
        A row a hit ratio, kernel and kind of packet; for each angle million tests a second with
        the any-lane exit, then for each without it.
    """
    frame = cells.times_of(run)
    wide = packed.angles(frame)
    columns = {f"{angle:g}° {EXIT}": {"angle": angle, "exit": "any"} for angle in wide}
    columns |= {f"{angle:g}°": {"angle": angle, "exit": "none"} for angle in wide}
    kinds = cells.values(frame, "packet", packed.KINDS)
    about = f"{_UNIT} over the angle that a packet spreads, with the exit (any) and without"
    lines = [({"packet": kind}, {"packet": kind}) for kind in kinds]
    notes = [
        "common: rays of one origin; parallel: of one direction; general: of neither",
        f"{EXIT}: packets leave when no lane is left",
    ]
    return compared(run, Comparison("spread", about, columns, lines, notes, between=False))


def layouts_table(run: "Run") -> Table:
    """Return the speed by the layout of what lies in lanes: blocks, arrays, records."""
    words = {"blocks": "blocks", "soa": "struct of arrays", "aos": "array of structs"}
    columns = {words[name]: {"layout": name} for name in packed.LAYOUTS}
    forms = cells.values(cells.times_of(run), "form", packed.FORMS)
    about = f"{_UNIT} and 95 % interval, by the layout of what lies in lanes"
    lines = [({"form": form}, {"form": form}) for form in forms]
    return compared(run, Comparison("layouts", about, columns, lines))


def axes_table(run: "Run") -> Table:
    """Return the speed by how the axes of projection are found, of kernels that project."""
    columns = {name: {"axes": name} for name in packed.AXES}
    about = f"{_UNIT} and 95 % interval, by how the axes of projection are found"
    notes = [
        "stored: indices with the triangle; table: from one stored number; fixed: code for each "
        "axis, the triangles sorted by it"
    ]
    return compared(run, Comparison("axes", about, columns, notes=notes))


def reciprocal_table(run: "Run") -> Table:
    """Return division against the processor's estimate: speed, and the error of t that it costs."""
    columns = {name: {"reciprocal": name} for name in packed.RECIPROCALS}
    about = f"{_UNIT} and 95 % interval, by division or the estimate with one Newton step"
    notes = [
        "error: of t by the estimate against division, relative, the median and the most; rays: "
        "for which it finds another triangle"
    ]
    return compared(run, Comparison("reciprocal", about, columns, notes=notes, errors=True))


def _forms(frame: "DataFrame") -> list[tuple[dict, dict]]:
    return [
        ({"form": f"{form}, exit" if way == "any" else form}, {"form": form, "exit": way})
        for form in cells.values(frame, "form", packed.FORMS)
        for way in packed.EXITS
    ]


def _meanings(frame: "DataFrame", base: dict) -> list[str]:
    words = {
        "rays": "rays: a packet of rays against one triangle",
        "triangles": "triangles: a group of triangles against one ray",
        "pairs": "pairs: blocks of pairs of one ray and one triangle",
    }
    there = [words[form] for form in cells.values(frame, "form", packed.FORMS) if form in words]
    if "any" in cells.values(frame, "exit"):
        there.append("exit: packets leave when no lane is left")
    return ["; ".join(there[:2]), "; ".join(there[2:]), alike(base, {"width", "form", "exit"})]
