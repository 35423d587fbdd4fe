"""How much a processor itself changed between two runs: its clock, its load."""

from rtbench.records.run import Run
from rtbench.records.statistics import Estimate, geometric_mean, ratio


def shift_of(
    same_code: set[tuple[str, str]], columns: list[str], ratios: dict[tuple, Estimate]
) -> Estimate | None:
    """Return how much slower a processor ran what is the same code: its clock, or its load.

    Processes are resampled inside a run, so no interval knows how runs differ from each other. On
    one processor the cells whose machine code is the same tell it.
    """
    kernel = columns.index("kernel")
    precision = columns.index("precision") if "precision" in columns else None
    controls = [
        value
        for key, value in ratios.items()
        if (key[kernel], "" if precision is None else key[precision]) in same_code
        and value.draws is not None
    ]
    return geometric_mean(controls).estimate if len(controls) > 1 else None


def shift_words(run: Run, shift: Estimate) -> str:
    """Return the remark that tells a reader of the shift."""
    low, high = shift.interval()
    return (
        f"{run.name}: the same code on the same processor took {shift.value:.3f} "
        f"[{low:.3f}, {high:.3f}] times as long: its clock or its load was another; "
        "verdicts are about what a cell differs by beside that"
    )


def beside(found: Estimate, shift: Estimate | None) -> Estimate:
    """Return a ratio over the shift; as it is where there is none, or no interval."""
    return found if shift is None or found.draws is None else ratio(found, shift, paired=True)
