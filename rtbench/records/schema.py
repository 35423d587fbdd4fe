"""The names and the layout of what a run folder holds (schema 1)."""

SCHEMA = 1

RUN = "run.json"
SAMPLES = "samples.csv"
SUMMARY = "summary.csv"
OUTCOMES = "outcomes.csv"
OPERATIONS = "operations.csv"
ERRORS = "errors.csv"
CHOICES = "choices.csv"

# Experiments without samples.
UNTIMED = frozenset({"operations", "relative_error"})

# The loop without a kernel: shown as a row of its own, never ranked, never averaged.
EMPTY = "empty"

# The density of a cell that is the mean over FIVE_DENSITIES (the thesis's table 4.3).
MEAN = "mean"
FIVE_DENSITIES = (0.0, 0.25, 0.5, 0.75, 1.0)

# One row of samples.csv after the columns of its cell.
TIMING = ("process", "launch", "round", "position", "triangles", "repetitions", "tests", "ns")
TIMING_COLUMNS = ("outcome", *TIMING, "cpu_ns")

SUMMARY_COLUMNS = (
    "kernel",
    "precision",
    "order",
    "density",
    "triangles",
    "repetitions",
    "tests",
    "hits",
    "ns_per_test",
    "ci_low",
    "ci_high",
    "seconds",
)
OUTCOME_COLUMNS = (
    "kernel",
    "precision",
    "density",
    "outcome",
    "label",
    "count",
    "fraction",
    "ns_per_test",
    "ci_low",
    "ci_high",
    "pairs_timed",
    "tests",
)
OPERATION_COLUMNS = (
    "kernel",
    "add",
    "sub",
    "mul",
    "div",
    "cond",
    "differences",
    "crosses",
    "dots",
)
# Errors are relative, parts of the value; over_condition: in roundoffs of the pair's condition.
ERROR_COLUMNS = (
    "kernel",
    "precision",
    "prepared",
    "quantity",
    "reference",
    "mean",
    "ci_low",
    "ci_high",
    "median",
    "p99",
    "max",
    "over_condition_median",
    "over_condition_p99",
    "over_condition_max",
    "hits",
)
# Rays for which a kernel (some two, where none is named) chose another triangle than is right.
CHOICE_COLUMNS = (
    "kernel",
    "precision",
    "prepared",
    "density",
    "rays",
    "differ",
    "within_rounding",
)
TABLES = {OPERATIONS: OPERATION_COLUMNS, ERRORS: ERROR_COLUMNS, CHOICES: CHOICE_COLUMNS}

# A kernel may be called 1e3 and a label 7: these columns stay text whatever they look like.
TEXT_COLUMNS = frozenset({"kernel", "label", "precision", "order", "table"})
INTEGER_COLUMNS = frozenset(
    {
        "outcome",
        "process",
        "launch",
        "round",
        "position",
        "triangles",
        "repetitions",
        "tests",
        "ns",
        "cpu_ns",
        "hits",
        "count",
        "pairs_timed",
        "samples",
        "processes",
        "outliers",
        "rays",
        "differ",
        "within_rounding",
    }
)


def sample_columns(cell: list[str]) -> list[str]:
    """Return the header of samples.csv for runs whose cells have these columns.

    Parameters
    ----------
    cell : list of str
        The columns that identify a cell.

    Returns
    -------
    list of str
        The cell's columns, then those of the timing that are not among them already.
    """
    return [*cell, *(name for name in TIMING_COLUMNS if name not in cell)]
