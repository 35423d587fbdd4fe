"""Frames per second of a camera that goes round, a row a variant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rtbench.report.tables import Cell, Table

REAL_TIME = 20.0  # frames a second (Blecha 2007, chapter 5)
COLUMNS = {
    "scene": "scene",
    "objects": "objects",
    "kernel": "kernel",
    "subsampling": "subsampling",
    "shading": "shading",
    "fps": "frames/s",
    "spread": "95 % of frames",
    "fps_least": "slowest",
    "frame_ms": "ms/frame",
    "mrays": "Mrays/frame",
    "speedup": "times as fast",
}


def table(rows: Sequence[Mapping], title: str = "") -> Table:
    """Return the table of the rows that the orbit gives.

    Parameters
    ----------
    rows : sequence of mappings
        With scene, objects, kernel, subsampling, shading, frames, fps, fps_low, fps_high,
        fps_least, frame_ms, rays and speedup.
    title : str
        What it was measured on: size, threads, precision.

    Returns
    -------
    Table
        csv and json hold the rows as they are.
    """
    shown = [
        dict(row)
        | {
            "kernel": row["kernel"] or "(no triangles)",
            "subsampling": _switch(row["subsampling"]),
            "shading": _switch(row["shading"]),
            "fps": Cell(row["fps"], f"{row['fps']:,.1f}"),
            "spread": f"[{row['fps_low']:,.1f}, {row['fps_high']:,.1f}]",
            "fps_least": Cell(row["fps_least"], f"{row['fps_least']:,.1f}"),
            "frame_ms": Cell(row["frame_ms"], f"{row['frame_ms']:,.2f}"),
            "mrays": Cell(row["rays"] / 1e6, f"{row['rays'] / 1e6:.3f}"),
            "speedup": Cell(row["speedup"], f"{row['speedup']:.2f}"),
        }
        for row in rows
    ]
    fast = sum(row["fps"] >= REAL_TIME for row in rows)
    always = sum(row["fps_least"] >= REAL_TIME for row in rows)
    notes = [
        "frames/s: of the median frame; 95 % of the frames of one turn lie in the brackets; "
        "slowest: the rate of the slowest frame",
        "times as fast: as the scene's first row, view by view, the median",
        f"{fast} of {len(rows)} reach {REAL_TIME:g} frames/s, {always} in every frame",
    ]
    return Table(
        "orbit",
        shown,
        list(COLUMNS),
        title=title,
        headers=COLUMNS,
        notes=notes,
        raw_rows=[dict(row) for row in rows],
        raw_columns=list(rows[0]) if rows else [],
    )


def _switch(on: bool) -> str:
    return "on" if on else "off"
