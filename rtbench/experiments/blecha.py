"""What chapter 4 of Blecha 2007 states, each decided on this machine by a number."""

from __future__ import annotations

import numpy as np

from rtbench.experiments.measured import Measured, kind_of, share, weighted
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
from rtbench.records.resampling import Estimate, joined, p_value, ratio
from rtbench.records.run import Run
from rtbench.records.schema import FIVE_DENSITIES
from rtbench.records.statistics import holm, ranking
from rtbench.records.store import load_run

THESIS = "Blecha 2007"
STRAIGHT = 0.02  # a line is straight if no point is off by more
MIXTURE = 0.03  # the mixture law holds if sum f_i t_i is the measured cost within so much


def judged(runs: dict[str, Run]) -> list[dict]:
    """Judge every statement whose tables were measured.

    Parameters
    ----------
    runs : dict of str to Run
        Runs by the thesis's table ("4.1" ...) or the config's name ("stages").

    Returns
    -------
    list of dict
        ``section, statement, verdict, number``.
    """
    measured = {
        table: Measured(run)
        for table, run in runs.items()
        if "repeat" in run.info["config"].get("orders", ["repeat"])  # what the thesis measured
    }
    return rows(STATEMENTS, measured)


def _slower(run: Measured, than: str, kernels: list[str]) -> dict[str, Estimate]:
    """Return how many times as long each kernel takes as one of them, over all densities."""
    base = run.whole(than)
    return {name: ratio(run.whole(name), base, paired=True) for name in kernels if name != than}


def _times_as_long(found: dict[str, Estimate], than: str) -> str:
    return ", ".join(f"{name}/{than} {shown(value)}" for name, value in found.items())


def _variant_1_best(runs):
    found = _slower(runs["4.1"], "moller1", ["moller0", "moller2", "moller3"])
    return decided([side(value) for value in found.values()]), _times_as_long(found, "moller1")


def _variant_3_at_density_1(runs):
    run = runs["4.1"]
    found = {
        density: ratio(run.cost("moller3", density), run.cost("moller1", density), paired=True)
        for density in FIVE_DENSITIES
    }
    sides = [side(value) * (-1 if density == 1 else 1) for density, value in found.items()]
    number = "; ".join(f"{density:g}: {shown(value)}" for density, value in found.items())
    return decided(sides), f"moller3/moller1 at density {number}"


def _linear(runs):
    run, sides, numbers = runs["4.2"], [], []
    densities = np.array(run.run.info["config"]["densities"])
    for kernel in ("moller1", "badouel", "chirkov"):
        costs = [run.cost(kernel, density) for density in densities]
        draws = None
        if all(cost.draws is not None for cost in costs):
            draws = _bend(densities, np.array([cost.draws for cost in costs]))
        off = joined(float(_bend(densities, np.array([[c.value] for c in costs]))[0]), draws, costs)
        _, high = off.interval() or (0.0, np.inf)
        # A greatest distance grows with the noise, and in resamples grows again: what noise alone
        # made of it is taken off (the basic bootstrap's end) before a line is called bent.
        low = 2 * off.value - high
        sides.append(1 if high <= STRAIGHT else (-1 if low > STRAIGHT else 0))
        numbers.append(f"{kernel} {shown(off, ' %', 100, 1)}")
    text = f"greatest distance from a straight line: {'; '.join(numbers)}"
    return decided(sides), f"{text}; straight is within {STRAIGHT:.0%}"


def _bend(densities: np.ndarray, costs: np.ndarray) -> np.ndarray:
    """Return how far the costs (densities, resamples) lie from their own fitted lines at most."""
    fit = np.polynomial.polynomial
    lines = fit.polyval(densities, fit.polyfit(densities, costs, 1)).T
    return np.max(np.abs(costs / lines - 1), axis=0)


def _mixture(runs):
    run, sides, numbers = runs["4.2"], [], []
    densities = run.run.info["config"]["densities"]
    for kernel in ("moller1", "badouel", "chirkov"):
        mixed = weighted([run.mixture(kernel, d) for d in densities], [1] * len(densities))
        cost = weighted([run.cost(kernel, d) for d in densities], [1] * len(densities))
        found = ratio(mixed, cost, paired=True)
        sides.append(within(found, 1 - MIXTURE, 1 + MIXTURE))
        numbers.append(f"{kernel} {shown(found)}")
    text = f"sum f_i t_i / measured: {', '.join(numbers)}; holds within {MIXTURE:.0%}"
    return decided(sides), text


def _table_45_explains_42(runs):
    misses = {code: g for code, g in runs["4.5"].groups("moller1", None).items() if code}
    mixed = weighted([cost for _, cost in misses.values()], [count for count, _ in misses.values()])
    found = ratio(mixed, runs["4.2"].cost("moller1", 0.0))
    return decided([within(found, 1 - MIXTURE, 1 + MIXTURE)]), (
        f"times of 4.5 mixed / 4.2 at density 0: {shown(found)}; 28.294 / 28.297 in the thesis; "
        f"holds within {MIXTURE:.0%}"
    )


def _chirkov_fastest(runs):
    run = runs["4.2"]
    found = _slower(run, "chirkov", ["moller1", "badouel"])
    leads = [
        ratio(run.cost("moller1", density), run.cost("chirkov", density), paired=True)
        for density in (0.0, 1.0)
    ]
    growth = ratio(leads[1], leads[0], paired=True)
    sides = [*(side(value) for value in found.values()), side(growth)]
    return decided(sides), (
        f"{_times_as_long(found, 'chirkov')}; lead over moller1 at density 1 / at 0: "
        f"{shown(growth)}"
    )


def _badouel_last(runs):
    run = runs["4.2"]
    found = {
        name: ratio(run.whole("badouel"), run.whole(name), paired=True)
        for name in ("moller1", "chirkov")
    }
    number = ", ".join(f"badouel/{name} {shown(value)}" for name, value in found.items())
    return decided([side(value) for value in found.values()]), number


def _vendor(runs):
    run = runs["4.3"]
    found = ratio(run.whole("chirkov"), run.whole("moller1"), paired=True)
    there = {
        name: dict(
            load_run(name).summary.query("density == 'mean'")[["kernel", "ns_per_test"]].values
        )
        for name in ("blecha-pc1", "blecha-pc2", "blecha-pc3", "blecha-pc4")
    }
    thesis = ", ".join(
        f"{name.removeprefix('blecha-')} {cost['chirkov'] / cost['moller1']:.3f}"
        for name, cost in there.items()
    )
    return NOT_RESOLVED, (
        f"one machine cannot decide it: chirkov/moller1 {shown(found)} here; thesis: {thesis} "
        "(pc1, pc2 AMD, pc3, pc4 Intel); compare machines with rtbench diff"
    )


def _conditions_dearest(runs):
    run, sides, numbers = runs["stages"], [], []
    for kernel in ("moller1", "badouel", "chirkov"):
        shares = {
            kind: share(run, kernel, lambda stage, kind=kind: kind_of(stage) == kind)
            for kind in ("conditions", "differences", "products", "divisions")
        }
        mine = shares.pop("conditions")
        other = max(shares, key=lambda kind: shares[kind].value)
        sides.append(side(ratio(mine, shares[other], paired=True)))
        numbers.append(
            f"{kernel} {shown(mine, ' %', 100, 0)}, {other} {shown(shares[other], ' %', 100, 0)}"
        )
    return decided(sides), f"part of the conditions, and the dearest other: {'; '.join(numbers)}"


def _last_condition(runs):
    found = share(runs["stages"], "moller1", lambda stage: stage == "condition: v")
    low, high = found.interval() or (-np.inf, np.inf)
    verdict = REFUTED if not low <= 0.06 <= high else CONFIRMED
    if high - low > 0.06:  # an interval this wide would confirm anything
        verdict = NOT_RESOLVED if verdict == CONFIRMED else verdict
    return verdict, f"last condition of moller1: {shown(found, ' %', 100, 1)} of the test"


def _division_lifts(runs):
    run = runs["4.3"]
    here = ratio(run.whole("badouel"), run.whole("moller1"), paired=True)
    thesis = load_run("blecha-pc1").summary.query("density == 'mean'").set_index("kernel")
    there = thesis.loc["badouel", "ns_per_test"] / thesis.loc["moller1", "ns_per_test"]
    part = share(runs["stages"], "badouel", lambda stage: "division" in stage)
    verdict = CONFIRMED if side(here, there) == -1 else NOT_RESOLVED
    return verdict, (
        f"badouel/moller1 {shown(here)} here, {there:.3f} on pc1; three divisions are "
        f"{shown(part, ' %', 100, 0)} of badouel here (what else changed since is not told apart)"
    )


def _operations(runs):
    counts = load_run("blecha-operations").operations.set_index("kernel")
    sums = counts[["add", "sub", "mul", "div", "cond"]].sum(axis=1).astype(int)
    run = runs["4.2"]
    found, ratios = [], []
    for fewer, more in (("badouel", "moller1"), ("moller1", "chirkov"), ("badouel", "chirkov")):
        value = ratio(run.whole(fewer), run.whole(more), paired=True)
        ratios.append(value)
        found.append(f"{fewer} ({sums[fewer]})/{more} ({sums[more]}) {shown(value)}")
    # Three chances to find one: corrected for their number.
    sure = holm([p_value(value) for value in ratios])
    slower = [value.value > 1 for value in ratios]
    verdict = CONFIRMED if any(a and b for a, b in zip(sure, slower, strict=True)) else NOT_RESOLVED
    if all(sure) and not any(slower):
        verdict = REFUTED
    return verdict, "cost of the one with fewer operations / with more: " + ", ".join(found)


def _with_uv(runs):
    run, without = runs["4.10"], runs["4.3"]
    found = _slower(run, "moller1_uv", ["badouel_uv", "chirkov_uv"])
    gaps = ratio(
        found["badouel_uv"],
        ratio(without.whole("badouel"), without.whole("moller1"), paired=True),
    )
    order = ", ".join(ranking({name: run.whole(name).value for name in ["moller1_uv", *found]}))
    return decided([*(side(value) for value in found.values()), -side(gaps)]), (
        f"order {order}; {_times_as_long(found, 'moller1_uv')}; badouel's gap with u, v / "
        f"without: {shown(gaps)}"
    )


STATEMENTS = (
    Statement("4.1", "Möller's variant 1 is the best", ("4.1",), _variant_1_best),
    Statement(
        "4.1", "variant 3 is ahead of 1 only at density 1", ("4.1",), _variant_3_at_density_1
    ),
    Statement("4.2", "cost is linear in the density of hits", ("4.2",), _linear),
    Statement("4.2", "cost is the mixture of the outcomes' times", ("4.2",), _mixture),
    Statement("4.5", "table 4.5 explains table 4.2", ("4.2", "4.5"), _table_45_explains_42),
    Statement(
        "4.2", "Chirkov is the fastest and its lead grows with density", ("4.2",), _chirkov_fastest
    ),
    Statement("4.2", "Badouel is last in spite of stored data", ("4.2",), _badouel_last),
    Statement("4.3", "the winner turns with the processor's vendor", ("4.3",), _vendor),
    Statement("4.4", "conditions are the dearest part", ("stages",), _conditions_dearest),
    Statement("4.4", "the last condition of Möller is 6 % of it", ("stages",), _last_condition),
    Statement(
        "4.5.4", "a processor that divides fast lifts Badouel", ("4.3", "stages"), _division_lifts
    ),
    Statement("4.5.4", "fewer operations do not mean less time", ("4.2",), _operations),
    Statement(
        "4.6", "with u, v Möller is first and Badouel's gap smaller", ("4.3", "4.10"), _with_uv
    ),
)
