"""Named cases from other projects' tests and bug reports, gathered one by one.

Where a report gives coordinates they are used as given; where it describes a construction, the
construction is built. The answer is always exact arithmetic's, which may not be the reporter's.
Cases about trees (traversal, boxes, splitting planes) are not here.
"""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.geometry import Format, Geometry


class FieldList:
    """Named cases in one format.

    Parameters
    ----------
    form : Format
        What all numbers are rounded to. In float64 those that float32 holds are left out: they
        are in its own list.
    """

    def __init__(self, form: Format) -> None:
        self._form = form
        self._rows: list[np.ndarray] = []
        self._groups: list[int] = []
        self._names: list[tuple[str, str]] = []

    def case(self, name: str, source: str, triangle, origin, direction) -> None:
        """Add one ray with one triangle."""
        self._add(name, source, np.asarray([triangle]), origin, direction, -1)

    def group(self, name: str, source: str, triangles, origin, direction) -> None:
        """Add one ray with all triangles around it."""
        number = max(self._groups, default=-1) + 1
        self._add(name, source, np.asarray(triangles), origin, direction, number)

    def each(self, name: str, source: str, triangles, origin, direction) -> None:
        """Add one ray with each of several triangles; they are cases of their own."""
        self._add(name, source, np.asarray(triangles), origin, direction, -1)

    def _add(self, name, source, triangles, origin, direction, group) -> None:
        ray = np.broadcast_to(np.stack([origin, direction]), (len(triangles), 2, 3))
        rows = self._form.round(np.concatenate([triangles, ray], axis=1))
        if self._form.bits > 24:
            with np.errstate(over="ignore"):
                short = rows.astype(np.float32).astype(np.float64)
            if np.array_equal(short, rows, equal_nan=True):
                return
            if group >= 0 and np.array_equal(short[:, 3:], rows[:, 3:], equal_nan=True):
                # A ray that float32 holds would leave some triangles of the group in both lists.
                rows[:, 4] *= 1 + 2.0**-30
        self._rows.append(rows)
        self._groups += [group] * len(rows)
        self._names += [(name, source)] * len(rows)

    def geometry(self) -> Geometry:
        """Return what was added, in order."""
        rows = np.concatenate(self._rows)
        names, sources = (np.array(texts) for texts in zip(*self._names, strict=True))
        group = np.array(self._groups)
        return Geometry(
            rows[:, :3], rows[:, 3], rows[:, 4], np.zeros(len(rows)), group, names, sources
        )
