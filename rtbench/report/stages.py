"""What each stage of a kernel adds to its time, from the kernel cut off after each stage."""

from typing import TYPE_CHECKING, NamedTuple

from rtbench.report import cells
from rtbench.report.digits import absent

if TYPE_CHECKING:
    from rtbench.records.run import Run


class Stage(NamedTuple):
    """One stage; times in ns a test.

    `start` is the time of the kernel cut off after the stage before (of the empty loop, for the
    first stage), `end` that after this stage with its interval; `share` is what the stage adds
    over the whole kernel's time less the empty loop's; `group` is what of precision, order and
    density tells it from others of the run, in words.
    """

    kernel: str
    group: str
    precision: str | None
    order: str | None
    density: float | str | None
    index: int
    name: str
    start: float
    end: float
    ci_low: float | None
    ci_high: float | None
    share: float

    @property
    def added(self) -> float:
        """What this stage adds, ns a test; negative where the shorter form is slower."""
        return self.end - self.start


def stages_of(run: "Run") -> list[Stage]:
    """Return the stages of every kernel of a run, in the order in which they are computed.

    Parameters
    ----------
    run : Run
        A run of the experiment ``stages``, with columns ``stage`` and ``stage_index``.

    Returns
    -------
    list of Stage
        Empty if the run has no such columns.
    """
    frame = cells.times_of(run)
    if "stage" not in frame.columns or "stage_index" not in frame.columns:
        return []
    found = []
    for group, block in cells.groups(frame):
        floor = cells.where(block, kernel=cells.EMPTY_LOOP)["ns_per_test"]
        base = float(floor.iloc[0]) if len(floor) else 0.0
        for kernel in cells.kernels(block):
            rows = cells.where(block, kernel=kernel).sort_values("stage_index", kind="stable")
            whole = float(rows["ns_per_test"].iloc[-1]) - base
            start = base
            for row in rows.to_dict("records"):
                end = float(row["ns_per_test"])
                found.append(
                    Stage(
                        kernel,
                        cells.group_words(frame, group),
                        group["precision"],
                        group["order"],
                        group["density"],
                        int(row["stage_index"]),
                        str(row["stage"]),
                        start,
                        end,
                        None if absent(row.get("ci_low")) else float(row["ci_low"]),
                        None if absent(row.get("ci_high")) else float(row["ci_high"]),
                        (end - start) / whole if whole > 0 else float("nan"),
                    )
                )
                start = end
    return found
