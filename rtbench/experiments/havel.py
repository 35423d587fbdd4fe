"""What Havel 2008 states of his methods, each decided on this machine by a number."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from rtbench.experiments.measured import Measured
from rtbench.experiments.verdicts import (
    CONFIRMED,
    NOT_RESOLVED,
    REFUTED,
    Statement,
    decided,
    rows,
    shown,
    side,
    within,
)
from rtbench.records import derive
from rtbench.records.resampling import Estimate, mean, median, ratio, seed_of
from rtbench.records.run import Run

THESIS = "Havel 2008"
LEVEL = 0.05  # two times are level if neither is longer by more


class Soups:
    """The cells of a run over soups as estimates that were resampled together."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.ratios = run.info["config"]["densities"]
        self.methods = run.info.get("methods") or {}

    @cached_property
    def cells(self) -> dict[tuple, object]:
        """The samples by kernel, precision and hit ratio."""
        return derive.cells(self.run, ["kernel", "precision", "density"])

    def cost(self, kernel: str, density: float, precision: str = "float32") -> Estimate:
        """Return ns a test of a cell."""
        times = derive.times(self.cells[kernel, precision, density])
        return median(times, seed_of(self.run.name))

    def whole(self, kernel: str, precision: str = "float32") -> Estimate:
        """Return the mean over the hit ratios."""
        costs = [self.cost(kernel, density, precision) for density in self.ratios]
        return mean(costs)

    def compared(self, slow: str, fast: str) -> Estimate:
        """Return how many times as long the first takes, over all hit ratios."""
        return ratio(self.whole(slow), self.whole(fast), paired=True)


def judged(runs: dict[str, Run]) -> list[dict]:
    """Judge every statement whose tables were measured.

    Parameters
    ----------
    runs : dict of str to Run
        Runs by the thesis's section ("5.1.1" ...) or the config's name ("order").

    Returns
    -------
    list of dict
        ``section, statement, verdict, number``.
    """
    return rows(STATEMENTS, {name: Soups(run) for name, run in runs.items()})


def _error(runs):
    off = []
    for run in runs.values():
        for samples in run.cells.values() if run.run.info["experiment"] == "soup" else ():
            ns = derive.times(samples).ns
            off += (np.abs(ns / np.median(ns) - 1)).tolist()
    inside = float(np.mean(np.array(off) <= 0.03))
    verdict = CONFIRMED if inside >= 0.95 else REFUTED
    middle, most = np.quantile(off, [0.5, 0.95])
    return verdict, (
        f"{inside:.0%} of {len(off)} samples lie within 3 % of their cell's median; half of them "
        f"within {middle:.1%}, 95 % within {most:.1%} (confirmed if 95 % lie within 3 %)"
    )


def _decade(runs):
    sides, numbers = [], []
    for density in runs["5.1.1"].ratios:
        costs = {
            name: run.cost(name, density)
            for run in (runs["5.1.1"], runs["5.1.2"])
            for name in run.methods
        }
        slow = max(costs, key=lambda name: costs[name].value)
        fast = min(costs, key=lambda name: costs[name].value)
        found = ratio(costs[slow], costs[fast])
        sides.append(within(found, 5, 10))
        numbers.append(f"hit ratio {density:g}: {slow}/{fast} {shown(found, digits=1)}")
    return decided(sides), f"{'; '.join(numbers)} (confirmed between 5 and 10)"


def _first_tests_distance(runs):
    """Kensler-Shirley leads as published, and is level where both test the same first."""
    run = runs["order"]
    lead = run.compared("moller_trumbore_last_uv", "kensler_shirley_last_uv")
    tuv = run.compared("moller_trumbore_last_tuv_uv", "kensler_shirley_last_uv")
    uvt = run.compared("moller_trumbore_last_uv", "kensler_shirley_last_uvt_uv")
    # What the order explains of the lead: all of it if the two are level in either order.
    sides = [side(lead, 1 + LEVEL), *(within(each, 1 - LEVEL, 1 + LEVEL) for each in (tuv, uvt))]
    explained = 1 - np.log(tuv.value) / np.log(lead.value) if lead.value > 1 else np.nan
    return decided(sides), (
        f"Möller-Trumbore/Kensler-Shirley each in its own order {shown(lead)}; both t first "
        f"{shown(tuv)}, both u, v first {shown(uvt)}; the order explains {explained:.0%} of the "
        f"lead; level is within {LEVEL:.0%}"
    )


def _level_in_the_worst_case(runs):
    found = runs["5.3"].compared("moller_trumbore_last_whole_uv", "kensler_shirley_last_whole_uv")
    return decided([within(found, 1 - LEVEL, 1 + LEVEL)]), (
        f"Möller-Trumbore/Kensler-Shirley {shown(found)}; level is within {LEVEL:.0%}"
    )


PROJECTING = ("wald", "shevtsov", "badouel_cramer")


def _projection_single(runs):
    run, sides, numbers = runs["5.1.2"], [], []
    for base in PROJECTING:
        found = run.compared(f"{base}_last_uv", "perpendicular_planes_last_uv")
        sides.append(side(found))
        numbers.append(f"{base} {shown(found)}")
    return decided(sides), f"time over perpendicular planes': {', '.join(numbers)}"


def _fewer_operations(runs):
    run = runs["5.1.2"]
    counted = {
        name: sum(facts["operations"].values())
        for name, facts in run.methods.items()
        if facts["operations"]
    }
    found = []
    for fewer in counted:
        for more in counted:
            if counted[fewer] < counted[more]:
                value = run.compared(fewer, more)
                if side(value, 1 + LEVEL) == 1:
                    found.append((value.value, fewer, more, value))
    if not found:
        return REFUTED, "no method with fewer operations is slower"
    _, fewer, more, value = max(found)
    return CONFIRMED, (
        f"{len(found)} pairs; most: {fewer} ({counted[fewer]} operations)/{more} "
        f"({counted[more]}) {shown(value)}"
    )


def _multiplications(runs):
    run, sides, numbers = runs["5.2"], [], []
    for base, said in (("wald", 5), ("perpendicular_planes", 6)):
        counts = [run.methods[f"{base}{e}"]["operations"]["mul"] for e in ("_uv", "_last_uv")]
        # At the end a hit's u and v are multiplied by the inverse, which the first form has done.
        more = counts[1] - counts[0] - 2
        sides.append(1 if more == said else -1)
        numbers.append(f"{base} {more} (and 2 for u and v of a hit)")
    return decided(sides), f"multiplications more, from the syntax trees: {', '.join(numbers)}"


BOTH = (
    "moller_trumbore",
    "kensler_shirley",
    "keidy",
    "badouel_cramer",
    "wald",
    "perpendicular_planes",
    "shevtsov",
)


def _moved(run: Soups, ending: str) -> tuple[dict[str, Estimate], str]:
    """Return time with the division last over time with it first, of each method."""
    found = {base: run.compared(f"{base}_last{ending}_uv", f"{base}{ending}_uv") for base in BOTH}
    return found, ", ".join(f"{base} {shown(value)}" for base, value in found.items())


def _moved_as_tested(runs):
    found, number = _moved(runs["5.2"], "")
    return decided([-side(value) for value in found.values()]), f"last/first: {number}"


def _moved_worst(runs):
    found, number = _moved(runs["5.2"], "_whole")
    sides = [
        1 if side(value, 1 + LEVEL) == -1 else -side(value, 1 + LEVEL) for value in found.values()
    ]
    return decided(sides), f"last/first, nothing skipped: {number}; little is up to {LEVEL:.0%}"


def _planes_beat_wald(runs):
    run, numbers, best = runs["5.2"], [], None
    for ending in ("", "_last", "_whole", "_last_whole"):
        for density in run.ratios:
            found = ratio(
                run.cost(f"wald{ending}_uv", density),
                run.cost(f"perpendicular_planes{ending}_uv", density),
                paired=True,
            )
            numbers.append(f"{ending.strip('_') or 'first'} at {density:g}: {shown(found)}")
            if best is None or found.value > best.value:
                best = found
    if side(best, 1.1) == 1:
        verdict = CONFIRMED
    else:
        verdict = REFUTED if side(best, 1.1) == -1 else NOT_RESOLVED
    return verdict, (
        f"Wald/perpendicular planes {'; '.join(numbers)} (confirmed if somewhere above 1.1)"
    )


def _keidy(runs):
    run = runs["5.3"]
    found = {
        other: run.compared("keidy_last_whole_uv", f"{other}_last_whole_uv")
        for other in ("moller_trumbore", "kensler_shirley")
    }
    division = runs["5.2"].compared("keidy_last_whole_uv", "keidy_whole_uv")
    number = ", ".join(f"Keidy/{other} {shown(value)}" for other, value in found.items())
    return decided([side(value) for value in found.values()]), (
        f"{number} in the worst case; both divisions last/first {shown(division)}"
    )


def _shevtsov_beats_wald(runs):
    found = {
        name: runs[name].compared(f"wald{ending}", f"shevtsov{ending}")
        for name, ending in (("5.1.2", "_last_uv"), ("5.3", "_last_whole_uv"))
    }
    number = ", ".join(f"{name}: {shown(value)}" for name, value in found.items())
    return decided([side(value) for value in found.values()]), f"Wald/Shevtsov {number}"


def _same_triangles(runs):
    counted = [
        entry
        for run in runs.values()
        for entry in run.run.info.get("nearest") or []
        if not entry["kernel"].startswith("angle_sum")
    ]
    if "5.5" in runs:
        choices = runs["5.5"].run.choices
        counted += choices[choices["kernel"].notna()].to_dict("records")
    differ = [entry for entry in counted if entry["differ"]]
    total = sum(entry["rays"] for entry in counted)
    return (REFUTED if differ else CONFIRMED), (
        f"{sum(entry['differ'] for entry in differ)} of {total} rays end at another triangle than "
        "the exact one, over all kernels, precisions and sets but angle sum"
        + (": " + ", ".join(sorted({entry["kernel"] for entry in differ})) if differ else "")
    )


def _errors(run: Soups, precision: str):
    frame = run.run.errors
    return frame[(frame["precision"] == precision) & (frame["reference"] == "exact")]


def _order_of_errors(runs):
    single, double = (_errors(runs["5.5"], p)["mean"] for p in ("float32", "float64"))
    good = single.between(1e-7, 1e-5).all() and double.between(1e-16, 1e-13).all()
    return (CONFIRMED if good else REFUTED), (
        f"means from {single.min():.2g} to {single.max():.2g} in single and from {double.min():.2g} "
        f"to {double.max():.2g} in double precision (confirmed within a factor of 10 of 1e-6, and "
        "of 100 of 1e-14: his double-precision reference had errors of its own)"
    )


def _largest_error(runs):
    frame = _errors(runs["5.5"], "float32")
    numbers, sides = [], []
    for quantity, rows_ in frame.groupby("quantity"):
        own = rows_[rows_["kernel"] == "moller_trumbore_uv"].iloc[0]
        worst = rows_.loc[rows_["mean"].idxmax()]
        larger = int((rows_["mean"] > own["mean"]).sum())
        sides.append(-1 if worst["ci_low"] > own["ci_high"] else int(larger == 0))
        numbers.append(
            f"{quantity}: {own['mean'] * 1e6:.2f} [{own['ci_low'] * 1e6:.2f}, "
            f"{own['ci_high'] * 1e6:.2f}] millionths, {larger} of {len(rows_)} are larger "
            f"({worst['kernel']} {worst['mean'] * 1e6:.2f})"
        )
    return decided(sides), f"Möller-Trumbore against exact answers: {'; '.join(numbers)}"


def _moved_error(runs):
    frame = _errors(runs["5.5"], "float32").set_index(["kernel", "prepared", "quantity"])
    found = {}
    for (kernel, prepared, quantity), row in frame.iterrows():
        last = kernel.removesuffix("_uv") + "_last_uv", prepared, quantity
        if last in frame.index:
            found[last] = frame.loc[last, "mean"] / row["mean"]
    low, high = min(found.values()), max(found.values())
    worst = max(found, key=lambda key: abs(np.log(found[key])))
    verdict = CONFIRMED if 0.8 <= low and high <= 1.25 else REFUTED
    return verdict, (
        f"mean error with the division last / first: {low:.2f} to {high:.2f} over {len(found)} "
        f"cells, most {' '.join(worst)} {found[worst]:.2f} (confirmed between 0.8 and 1.25)"
    )


def _compiler_error(runs):
    variants = runs["compilers"].run.info["variants"]
    numbers, strict = [], 0
    for flags in dict.fromkeys(each["flags"] for each in variants):
        own = [each for each in variants if each["flags"] == flags]
        rays_, hits, t = (sum(e[name] for e in own) for name in ("rays", "other_hits", "other_t"))
        strict = t if flags == "strict" else strict
        numbers.append(f"{flags}: another t for {t / rays_:.1%}, another triangle for {hits}")
    return (REFUTED if strict else CONFIRMED), (
        f"against strict arithmetic for {variants[0]['target']}, of all rays, {'; '.join(numbers)} "
        "(confirmed if strict arithmetic is the same for every target)"
    )


def _point_in_triangle(runs):
    measured = Measured(runs["6.1.2"].run)
    found = {
        other: ratio(
            measured.whole(f"{other}_inside_uv"), measured.whole("keidy_inside_uv"), paired=True
        )
        for other in ("half_spaces_perpendicular", "signed_areas")
    }
    stored = ratio(measured.whole("keidy_inside_uv"), measured.whole("wald_inside_uv"), paired=True)
    number = ", ".join(f"{other}/Keidy {shown(value)}" for other, value in found.items())
    return decided([side(value) for value in found.values()]), (
        f"{number}; with stored data Wald's is faster still: Keidy/Wald {shown(stored)}"
    )


STATEMENTS = (
    Statement("5", "measurements have an error of about 3 %", ("5.1.1", "5.1.2"), _error),
    Statement(
        "5.1",
        "between the fastest and the slowest method lies almost a factor of 10",
        ("5.1.1", "5.1.2"),
        _decade,
    ),
    Statement(
        "5.1.1",
        "Kensler-Shirley is ahead of Möller-Trumbore only because it tests t first",
        ("order",),
        _first_tests_distance,
    ),
    Statement(
        "5.1.2", "methods with fewer operations need not be faster", ("5.1.2",), _fewer_operations
    ),
    Statement(
        "5.1.2",
        "for single rays projection costs more than its simpler formulas save",
        ("5.1.2",),
        _projection_single,
    ),
    Statement(
        "5.2",
        "moving the division costs Wald 5 multiplications and perpendicular planes 6",
        ("5.2",),
        _multiplications,
    ),
    Statement("5.2", "moving the division pays where tests end early", ("5.2",), _moved_as_tested),
    Statement(
        "5.2", "moving the division hardly hurts even in the worst case", ("5.2",), _moved_worst
    ),
    Statement(
        "5.3",
        "in the worst case Möller-Trumbore and Kensler-Shirley are level",
        ("5.3",),
        _level_in_the_worst_case,
    ),
    Statement("5.3", "Keidy's second division limits it", ("5.2", "5.3"), _keidy),
    Statement(
        "5.5",
        "no two methods choose different triangles for a ray",
        ("5.1.1", "5.1.2"),
        _same_triangles,
    ),
    Statement(
        "5.5",
        "errors are of the order of 1e-6 in single precision and 1e-14 in double",
        ("5.5",),
        _order_of_errors,
    ),
    Statement("5.5", "Möller-Trumbore's errors are the largest", ("5.5",), _largest_error),
    Statement("5.5", "moving the division does not change the errors", ("5.5",), _moved_error),
    Statement("5.5", "the compiler does not change the errors", ("compilers",), _compiler_error),
    Statement(
        "6", "perpendicular planes are up to 20 % faster than Wald", ("5.2",), _planes_beat_wald
    ),
    Statement(
        "6.1.2",
        "Keidy is of use where a point is tested and no normal is at hand",
        ("6.1.2",),
        _point_in_triangle,
    ),
    Statement("6.1.3", "Shevtsov is faster than Wald", ("5.1.2", "5.3"), _shevtsov_beats_wald),
)
