"""Šilhavý's statements on how long rays take: rule against rule, and against the naive way."""

from __future__ import annotations

from collections.abc import Mapping

from rtbench.experiments.silhavy_measured import (
    EVEN,
    OBJECT,
    SAH,
    SPATIAL,
    SURFACES,
    UNEVEN,
    Rules,
    brief,
    each_shown,
    family,
    middle,
    missing,
    over,
    verdict_of,
    words,
)
from rtbench.experiments.verdicts import decided, shown, side, within
from rtbench.records.resampling import Estimate, ratio

TWICE = (1.5, 2.5)  # about twice
HUNDREDS, THOUSAND = 100, 1000
COMPLEX = 10_000  # triangles
NOTICED = 1.05  # a loss of more can be noticed
SLIGHTLY = 1.25
TENS = (1.1, 2.0)  # tens of per cent


def _over_medians(run: Rules) -> dict[str, dict[str, Estimate]]:
    """Return, of each median, how many times as long it takes as the SAH, by model."""
    return {rule: found for rule in (OBJECT, SPATIAL) if (found := run.each_slower(rule, SAH))}


def twice(runs):
    run = runs["5"]
    found = _over_medians(run)
    if not found:
        return missing("no model has the SAH and a median")
    both = {m: middle(each.get(m) for each in found.values()) for m in run.models}
    mean = over({m: value for m, value in both.items() if value is not None}, run.seed)
    parts = "; ".join(
        f"{words(rule)}/SAH {shown(over(each, run.seed), digits=2)} ({each_shown(each, digits=2)})"
        for rule, each in found.items()
    )
    low, high = TWICE
    return verdict_of(within(mean, low, high)), (
        f"medians/SAH over models {shown(mean, digits=2)}; {parts}; about twice is {low} to {high}"
    )


def always_first(runs):
    found = _over_medians(runs["5"])
    if not found:
        return missing("no model has the SAH and a median")
    sides = [side(value) for each in found.values() for value in each.values()]
    return decided(sides), (
        f"{sides.count(1)} of {len(sides)} ratios are resolved above 1, {sides.count(-1)} below: "
        + "; ".join(f"{words(rule)}/SAH {_places(each)}" for rule, each in found.items())
    )


def _places(found: Mapping[str, Estimate]) -> str:
    """Return which model has the least and the greatest."""
    least, most = (pick(found, key=lambda m: found[m].value) for pick in (min, max))
    return f"{brief(found[least])} ({least}) to {brief(found[most])} ({most})"


def object_second(runs):
    run = runs["5"]
    found = run.each_slower(SPATIAL, OBJECT)
    if not found:
        return missing("no model has both medians")
    mean = over(found, run.seed)
    return verdict_of(side(mean)), (
        f"spatial/object median over models {shown(mean, digits=2)}; {each_shown(found, digits=2)}"
    )


def _naive(run: Rules, least: int = 0) -> dict[str, Estimate]:
    found = {m: run.naive(m) for m in run.models if run.trees.triangles(m) >= least}
    return {model: value for model, value in found.items() if value is not None}


def hundreds(runs):
    run = runs["5"]
    found = _naive(run, COMPLEX)
    if not found:
        return missing(f"no model of {COMPLEX:,} triangles or more was traced the naive way")
    mean = over(found, run.seed)
    return verdict_of(side(mean, HUNDREDS)), (
        f"naive/SAH over models of {COMPLEX:,} triangles and more {shown(mean, digits=0)}; "
        f"{each_shown(found, digits=0)}; confirmed above {HUNDREDS}"
    )


def thousand(runs):
    run = runs["5"]
    # Of the scanned models the thesis says that they are fairly even too (5.1).
    found = {m: v for m, v in _naive(run).items() if family(m) in (*EVEN, *SURFACES)}
    if not found:
        return missing("no model of evenly spread triangles was traced the naive way")
    others = {m: v for m, v in _naive(run).items() if m not in found}
    most = max(found, key=lambda model: found[model].value)
    beside = f"; the others: {each_shown(others, digits=0)}" if others else ""
    return verdict_of(side(found[most], THOUSAND)), (
        f"naive/SAH: {most}, {run.trees.triangles(most):,} triangles, "
        f"{shown(found[most], digits=0)}{beside}; confirmed above {THOUSAND:,}; it grows with the "
        "number of triangles"
    )


def _without_loss(runs, before, after):
    """Judge whether fewer candidates cost more than can be noticed; tell what building gains."""
    run = runs["5"]
    slower, gained = {}, {}
    for model in run.models:
        there = run.variants(model)
        if before not in there or after not in there:
            continue
        common = [rays for rays in there[before] if rays in there[after]]
        cells = [(there[after][rays], there[before][rays]) for rays in common]
        slower[model] = middle(run.trees.ratio(*pair) for pair in cells)
        gained[model] = middle(run.build_ratio(b, a) for a, b in cells[:1])
    slower, gained = ({m: v for m, v in d.items() if v is not None} for d in (slower, gained))
    if not slower:
        return missing(f"no model has trees with {_planes(before)} and with {_planes(after)}")
    mean = over(slower, run.seed)
    build = f"{shown(over(gained, run.seed), digits=2)} times as fast" if gained else "not timed"
    return verdict_of(-side(mean, NOTICED)), (
        f"time a ray with {_planes(after)} / with {_planes(before)}: over models {shown(mean)}; "
        f"{each_shown(slower, digits=3)}; building is {build}; a loss up to {NOTICED - 1:.0%} is "
        "not noticed"
    )


def _planes(which: tuple[str, str]) -> str:
    names = {("all", "all"): "6 N", ("longest", "all"): "2 N", ("longest", "half"): "N"}
    return f"{names[which]} candidates"


def longest_axis(runs):
    return _without_loss(runs, ("all", "all"), ("longest", "all"))


def near_half(runs):
    return _without_loss(runs, ("longest", "all"), ("longest", "half"))


def even_scenes(runs):
    run = runs["5"]
    found = run.each_slower(SAH, SPATIAL, EVEN)
    if not found:
        return missing("no model of evenly spread triangles has both rules")
    surfaces = run.each_slower(SAH, SPATIAL, SURFACES)
    beside = f"; on surfaces: {each_shown(surfaces, digits=2)}" if surfaces else ""
    mean = over(found, run.seed)
    sign = -1 if side(mean, SLIGHTLY) == 1 else side(mean)  # far better is not slightly
    return verdict_of(sign), (
        f"SAH/spatial median {each_shown(found, digits=2)}{beside}; confirmed above 1, slightly is "
        f"up to {SLIGHTLY}"
    )


def uneven_scenes(runs):
    run = runs["5"]
    uneven = run.each_slower(SPATIAL, SAH, UNEVEN)
    others = run.each_slower(SPATIAL, SAH, (*EVEN, *SURFACES))
    if not uneven or not others:
        return missing("rules over even and over uneven models")
    means = over(uneven, run.seed), over(others, run.seed + 1)
    found = ratio(*means)
    return verdict_of(side(found)), (
        f"spatial median/SAH in uneven scenes {shown(means[0], digits=2)} "
        f"({each_shown(uneven, digits=2)}), elsewhere {shown(means[1], digits=2)}: "
        f"{shown(found, digits=2)} times as far behind"
    )


def fat_node(runs):
    run, found = runs["5"], {}
    for model in run.models:
        for one in run.trees.of(model):
            if (one.cell["way"] or "").startswith("fat"):
                same = [
                    other
                    for other in run.trees.of(model, one.cell["rays"])
                    if (other.form, other.key, other.cell["way"]) == (one.form, one.key, "stack")
                ]
                if same:
                    found.setdefault(model, []).append(run.trees.ratio(one, same[0]))
    if not found:
        return missing("there is no fat node in rtbench, only that of 8 bytes")
    each = {model: middle(values) for model, values in found.items()}
    mean, (low, high) = over(each, run.seed), TENS
    return verdict_of(within(mean, low, high)), (
        f"fat node/8 bytes over models {shown(mean)}; {each_shown(each)}; tens of per cent are "
        f"{low} to {high}"
    )
