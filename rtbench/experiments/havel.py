"""What Havel 2008 states of his methods, each decided on this machine by a number."""

from __future__ import annotations

import numpy as np

from rtbench.experiments import havel_errors
from rtbench.experiments.measured import Measured, Soups
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


def _packet(run: Soups, kernel: str, width: int) -> Estimate:
    """Return ns a test of a kernel in general packets of W rays at the first angle."""
    config = run.run.info["config"]
    layout = config["layout"] if width == 1 else "blocks"
    which = {"form": "rays", "packet": config["packets"][0], "angle": config["angles"][0]}
    which |= {"width": width, "exit": "none", "axes": "stored", "reciprocal": "division"}
    which |= {"kernel": kernel, "layout": layout}
    columns = [*which, "density"]
    cells = derive.cells(run.run, columns)
    costs = [
        median(derive.times(cells[(*which.values(), density)]), seed_of(run.run.name))
        for density in run.ratios
    ]
    return mean(costs)


def _projection_in_packets(runs):
    run = runs["5.1.3"]
    widest = max(run.run.info["config"]["widths"])
    lead = ratio(
        _packet(run, "kensler_shirley_uv", widest), _packet(run, "wald_uv", widest), paired=True
    )
    planes = {
        width: ratio(
            _packet(run, "wald_uv", width),
            _packet(run, "perpendicular_planes_uv", width),
            paired=True,
        )
        for width in (1, widest)
    }
    sides = [side(lead, 1 + LEVEL), 1 if side(planes[widest], 1 + LEVEL) == -1 else 0]
    sides[1] = -1 if side(planes[widest], 1 + LEVEL) == 1 else sides[1]
    return decided(sides), (
        f"packets of {widest}: Kensler-Shirley/Wald {shown(lead)}; Wald/perpendicular planes "
        f"{shown(planes[widest])}, ray by ray {shown(planes[1])}"
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
        "5.1.3",
        "in packets projection is no problem: Wald is level with perpendicular planes, and "
        "Kensler-Shirley falls behind",
        ("5.1.3",),
        _projection_in_packets,
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
        havel_errors.same_triangles,
    ),
    Statement(
        "5.5",
        "errors are of the order of 1e-6 in single precision and 1e-14 in double",
        ("5.5",),
        havel_errors.order_of_errors,
    ),
    Statement(
        "5.5", "Möller-Trumbore's errors are the largest", ("5.5",), havel_errors.largest_error
    ),
    Statement(
        "5.5", "moving the division does not change the errors", ("5.5",), havel_errors.moved_error
    ),
    Statement(
        "5.5",
        "the compiler does not change the errors",
        ("compilers",),
        havel_errors.compiler_error,
    ),
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
