"""Šilhavý's statements on what trees are made of and what rays meet in them: counts, not times."""

from __future__ import annotations

import numpy as np

from rtbench.experiments.silhavy_measured import (
    OBJECT,
    SAH,
    SPATIAL,
    Rules,
    brief,
    counted,
    each_shown,
    middle,
    missing,
    over,
    verdict_of,
    words,
)
from rtbench.experiments.verdicts import shown, side, within
from rtbench.records.resampling import Estimate
from rtbench.report.tree_correlation import ALL, correlations

ALMOST_NONE = 0.05  # of the leaves
ORDERS = 10**2.5  # what rounds to three orders of magnitude
TELLS = 0.5  # a rank correlation that tells something
FOURTEEN = (0.105, 0.175)  # 14 %, give or take a quarter of it
# As described, and otherwise.
THREE_STAGE = "three_stage_world"
FORMS = {
    THREE_STAGE: "planes of 45 degrees",
    "three_stage": "scaled to the cell",
    "box": "bounding box alone",
}
THESIS_ENDING = "ad_hoc"  # of the medians, which know no cost (3.2.4)


def empty_leaves(runs):
    """Judge how many leaves of object median trees are empty."""
    run: Rules = runs["5"]
    shares: dict[str, dict[str, Estimate]] = {}
    for rule in (OBJECT, SPATIAL, SAH):
        for model in run.models:
            there = run.built(model, rule)
            there = [tree for tree in there if tree.key[3] == THESIS_ENDING] or there
            for tree in there[:1]:
                share = float(tree.facts["empty_leaves"]) / float(tree.facts["leaves"])
                shares.setdefault(rule, {})[model] = counted(share)
    if OBJECT not in shares:
        return missing("no model has a tree by the object median")
    means = {rule: over(each, run.seed, geometric=False) for rule, each in shares.items()}
    others = [f"{words(r)} {shown(m, ' %', 100, 1)}" for r, m in means.items() if r != OBJECT]
    return verdict_of(-side(means[OBJECT], ALMOST_NONE)), (
        f"empty leaves over models {shown(means[OBJECT], ' %', 100, 1)}: "
        + each_shown(shares[OBJECT], unit=" %", scale=100, digits=1)
        + f"; beside: {', '.join(others)}; almost none is up to {ALMOST_NONE:.0%}"
    )


def _tests(run: Rules, model: str, rule: str, rays: str) -> float | None:
    one = run.best(model, rule, rays)
    found = run.trees.visits(one).get("leaf_tests") if one is not None else None
    return float(found) if found else None


def tested(runs):
    """Judge by what factor the SAH lets rays test fewer triangles than the medians do."""
    run: Rules = runs["5"]
    fewer: dict[str, dict[str, Estimate]] = {}
    naive = {}
    for model in run.models:
        own = {rays: _tests(run, model, SAH, rays) for rays in run.ray_sets(model)}
        for rule in (OBJECT, SPATIAL):
            others = {rays: _tests(run, model, rule, rays) for rays in own}
            ratios = [counted(others[r] / own[r]) for r in own if own[r] and others[r]]
            if ratios:
                fewer.setdefault(rule, {})[model] = middle(ratios)
        all_of_them = [counted(run.trees.triangles(model) / t) for t in own.values() if t]
        if all_of_them:
            naive[model] = middle(all_of_them)
    if not fewer:
        return missing("what rays meet in trees by the SAH and by a median")
    both = {m: middle(each.get(m) for each in fewer.values()) for m in naive}
    mean = over({m: value for m, value in both.items() if value is not None}, run.seed)
    parts = "; ".join(
        f"{words(rule)}/SAH {each_shown(each, digits=1)}" for rule, each in fewer.items()
    )
    return verdict_of(side(mean, ORDERS)), (
        f"tests of a ray, medians/SAH over models {shown(mean, digits=1)}; {parts}; naive/SAH "
        f"{each_shown(naive, digits=0)}; confirmed above {ORDERS:.0f}"
    )


def cost_tells_time(runs):
    """Judge the rank correlation between trees' SAH costs and the times of rays in them."""
    run: Rules = runs["5"]
    there = [one for one in correlations(run.trees) if one.measure == "sah_cost"]
    forms = [one.form for one in there]
    per_model: dict[str, list[float]] = {}
    trees = 0
    for one in there:
        if one.model != ALL and one.form == forms[0]:
            per_model.setdefault(one.model, []).append(one.rho)
            trees += one.trees
    if not per_model:
        return missing("a model with trees enough for a rank correlation")
    found = {model: Estimate(float(np.mean(each))) for model, each in per_model.items()}
    mean = over(found, run.seed, geometric=False)
    each = ", ".join(f"{model} {value.value:.2f}" for model, value in found.items())
    return verdict_of(side(mean, TELLS)), (
        f"Spearman's rank correlation within a model, mean over models {shown(mean, digits=2)}: "
        f"{each} ({trees} trees and ray sets); confirmed above {TELLS}"
    )


def let_in(runs):
    """Judge how many triangles the three stages let into cells that they do not touch."""
    shares: dict[str, dict[str, dict[str, Estimate]]] = {}
    for one in runs["overlaps"]:
        for test in FORMS:
            if one["passed"].get(test):
                share = counted(one["needless"][test] / one["passed"][test])
                shares.setdefault(test, {}).setdefault(one["model"], {})[one["rule"]] = share
    if THREE_STAGE not in shares:
        return missing("triangles in the leaves of a model")
    models = {
        test: {model: over(rules, geometric=False) for model, rules in each.items()}
        for test, each in shares.items()
    }
    models = {test: {m: counted(e.value) for m, e in each.items()} for test, each in models.items()}
    means = {test: over(each, geometric=False) for test, each in models.items()}
    rules = {
        words(rule): np.mean([each[rule].value for each in shares[THREE_STAGE].values()])
        for rule in (SAH, OBJECT, SPATIAL)
        if all(rule in each for each in shares[THREE_STAGE].values())
    }
    low, high = FOURTEEN
    return verdict_of(within(means[THREE_STAGE], low, high)), (
        "let in for nothing, of all let in, mean of the rules, over models: "
        + "; ".join(f"{FORMS[test]} {brief(mean, ' %', 100, 1)}" for test, mean in means.items())
        + f"; {FORMS[THREE_STAGE]}: "
        + each_shown(models[THREE_STAGE], unit=" %", scale=100, digits=1)
        + "; "
        + ", ".join(f"{rule} {share * 100:.1f} %" for rule, share in rules.items())
        + f"; 14 % is {low:.1%} to {high:.1%}"
    )
