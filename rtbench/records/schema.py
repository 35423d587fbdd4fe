"""The names and the layout of what a run folder holds (schema 1)."""

SCHEMA = 1

RUN = "run.json"
SAMPLES = "samples.csv"
SUMMARY = "summary.csv"
OUTCOMES = "outcomes.csv"
OPERATIONS = "operations.csv"
ERRORS = "errors.csv"
CHOICES = "choices.csv"
STABILITY = "stability.csv"
FAMILIES = "families.csv"
CURVES = "curves.csv"
LEAKS = "leaks.csv"
PEERS = "peers.csv"
ACCURACY = "accuracy.csv"
TREES = "trees.csv"
VISITS = "visits.csv"
BUILDS = "builds.csv"
EFFECTS = "effects.csv"
SUBSAMPLING = "subsampling.csv"
TECHNIQUES = "techniques.csv"

# Experiments without samples.
UNTIMED = frozenset(
    {"operations", "relative_error", "stability", "tree_builders", "watertightness"}
)

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
# Hard cases: counts are over the core families; p99 in roundoffs of condition and value; the
# criteria are 1 where they hold. What is said of causes is absent without an exact form.
CRITERIA = ("S1", "S2", "S3", "S4", "S5", "S6", "R1", "X1", "X2")
SCORES = (
    "kernel",
    "precision",
    "wrong",
    "unstable",
    "leaks",
    "groups",
    "doubles",
    "invalid_accepted",
    "permutation",
    "c_star",
    "p99_t",
    "p99_u",
    "p99_v",
)
STABILITY_COLUMNS = (
    *SCORES,
    *CRITERIA,
    "edges",
    "decided",
    "wrong_outside_core",
    "nonfinite",
    "wrong_by_method",
    "wrong_by_stored_data",
    "wrong_by_arithmetic",
    "leaks_by_method",
    "claims",
    "why",
)
# The same by family: p50, p99 and greatest error, and p99 of the relative error and of ulps.
FAMILY_COLUMNS = (
    "kernel",
    "precision",
    "family",
    "cases",
    "decided",
    "wrong",
    "unstable",
    "c_star",
    "leaks",
    "groups",
    "doubles",
    "permutation",
    "strange",
    "accepted",
    "knee",
    *(f"{measure}_{x}" for x in "tuv" for measure in ("p50", "p99", "max", "relative", "ulps")),
)
CURVE_COLUMNS = (
    "kernel",
    "precision",
    "family",
    "difficulty",
    "decided",
    "wrong",
    "wrong_share",
    "p99_t",
    "p99_u",
    "p99_v",
)
# Rays from inside a closed mesh, by what they were aimed at; peer: a library's version, absent of
# kernels. exact: pass through their target exactly; elsewhere: hit far from it.
LEAK_COLUMNS = (
    "kernel",
    "peer",
    "precision",
    "place",
    "aim",
    "rays",
    "exact",
    "leaks",
    "elsewhere",
)
# Hard cases as libraries answer them; scene_leaks: groups in one scene of which nothing is hit.
PEER_COLUMNS = (
    "kernel",
    "peer",
    "precision",
    "decided",
    "wrong",
    "unstable",
    "leaks",
    "groups",
    "doubles",
    "scene_leaks",
    "permutation",
    "invalid_accepted",
    "refused",
    "c_star",
    "p99_t",
    "p99_u",
    "p99_v",
)
# Typical tests and hard cases (workload: corpus) as each form answers them; wrong, unstable, leaks
# and doubles of the corpus are over the core families. undecided: by the filter alone;
# undecided64: of these by a float64 filter too.
ACCURACY_COLUMNS = (
    "kernel",
    "precision",
    "flags",
    "reciprocal",
    "workload",
    "tests",
    "decided",
    "hits",
    "wrong",
    "missed",
    "extra",
    "unstable",
    "leaks",
    "groups",
    "doubles",
    "invalid_accepted",
    "wrong_outside_core",
    "p99_t",
    "relative_t",
    "undecided",
    "undecided64",
    *CRITERIA,
)
# A row a build of a tree, or of a peer's own (structure: the peer's name).
TREE_COLUMNS = (
    "model",
    "triangles",
    "structure",
    "rule",
    "builder",
    "ending",
    "axes",
    "candidates",
    "overlap",
    "traversal_cost",
    "intersection_cost",
    "max_leaf",
    "block",
    "process",
    "build_seconds",
    "build_cpu_seconds",
    "nodes",
    "leaves",
    "empty_leaves",
    "references",
    "depth",
    "bytes",
    "sah_cost",
    "expected_steps",
    "expected_leaves",
    "expected_tests",
    "digest",
)
# What rays meet in a tree whose leaves count in blocks of so many: means of those that meet the
# scene's box. wrong: of rays_judged, by brute force; exact_wrong: of exact_judged, by the oracle.
VISIT_COLUMNS = (
    "model",
    "structure",
    "rule",
    "builder",
    "ending",
    "rays",
    "kernel",
    "precision",
    "block",
    "rays_counted",
    "hits",
    "steps",
    "leaves",
    "leaf_tests",
    "wrong",
    "rays_judged",
    "exact_wrong",
    "exact_judged",
    "never_hit",
)
BUILD_COLUMNS = (
    "builder",
    "rule",
    "axes",
    "candidates",
    "overlap",
    "model",
    "triangles",
    "process",
    "seconds",
    "cpu_seconds",
    "peak_bytes",
    "nodes",
    "references",
    "sah_cost",
    "digest",
)
# A row a tracer of a scene: what it shot, digests of its picture and of its code (of some), and
# the functions that it was compiled from.
EFFECT_COLUMNS = (
    "kernel",
    "precision",
    "scene",
    "tracer",
    "width",
    "height",
    "picture",
    *(f"rays_{kind}" for kind in ("primary", "shadow", "reflection", "refraction", "indirect")),
    "code",
    "instructions",
    "functions",
)
# A row a way to subsample a scene's picture: pixels that were not traced, rays with and without,
# and errors beside the full picture as a display shows it (absent of the full one).
SUBSAMPLING_COLUMNS = (
    "kernel",
    "precision",
    "scene",
    "grid",
    "tolerance",
    "interpolation",
    "width",
    "height",
    "interpolated",
    "primary",
    "rays",
    "rays_full",
    "mean_square",
    "ssim",
    "greatest",
    "differing",
    "above_two_steps",
    "picture",
)
# A row a technique and number of threads over a scene.
TECHNIQUE_COLUMNS = (
    "kernel",
    "precision",
    "scene",
    "technique",
    "threads",
    "width",
    "height",
    "picture",
    *(f"rays_{kind}" for kind in ("primary", "shadow", "reflection", "refraction", "indirect")),
)
LENGTHS = "length of dir"  # a curve of its own, of no family: easy cases over log10 |dir|
STABILITY_TABLES = (STABILITY, FAMILIES, CURVES)

TABLES = {
    OPERATIONS: OPERATION_COLUMNS,
    ERRORS: ERROR_COLUMNS,
    CHOICES: CHOICE_COLUMNS,
    STABILITY: STABILITY_COLUMNS,
    FAMILIES: FAMILY_COLUMNS,
    CURVES: CURVE_COLUMNS,
    LEAKS: LEAK_COLUMNS,
    PEERS: PEER_COLUMNS,
    ACCURACY: ACCURACY_COLUMNS,
    TREES: TREE_COLUMNS,
    VISITS: VISIT_COLUMNS,
    BUILDS: BUILD_COLUMNS,
    EFFECTS: EFFECT_COLUMNS,
    SUBSAMPLING: SUBSAMPLING_COLUMNS,
    TECHNIQUES: TECHNIQUE_COLUMNS,
}

# A kernel may be called 1e3 and a label 7: these columns stay text whatever they look like.
TEXT_COLUMNS = frozenset(
    {
        *("kernel", "label", "precision", "order", "table", "family", "edges", "claims", "why"),
        *("peer", "model", "digest", "tracer", "picture", "code", "functions"),
        *("grid", "interpolation", "technique"),
    }
)
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
