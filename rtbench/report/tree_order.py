"""Whether the thesis's order of the split rules holds: SAH, object median, spatial median."""

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from rtbench.records.statistics import Estimate
from rtbench.report.digits import measured
from rtbench.report.tree_cells import ENDINGS, RULES, Timed

if TYPE_CHECKING:
    from rtbench.report.trees import Trees

ORDER = ("sah", "object_median", "spatial_median")
VERDICTS = HOLDS, FAILS, UNRESOLVED = "holds", "does not hold", "not resolved"


class Step(NamedTuple):
    """Two rules beside each other: how many times as long the one expected later takes.

    `verdict` is HOLDS where that is resolved above 1, FAILS where below, else UNRESOLVED.
    """

    model: str
    rays: str
    ending: str
    before: Timed
    after: Timed
    ratio: Estimate | None
    verdict: str


def steps(trees: "Trees", model: str) -> list[Step]:
    """Return every neighbouring pair of the expected order that was timed alike.

    Parameters
    ----------
    trees : Trees
    model : str

    Returns
    -------
    list of Step
        By ray set and ending; each by its own 95 % interval: of twenty one may err.

    Source
    ------
    Šilhavý 2010, sections 3.2.3 and 3.3.2
    """
    found = []
    for rays in trees.ray_sets(model):
        alike: dict[tuple, dict[str, Timed]] = {}
        for one in trees.of(model, rays):
            structure, rule, builder, ending = one.key
            # Builders of the SAH beside the first are variants, no rules.
            if structure == "kd" and rule in ORDER and " " not in builder:
                group = alike.setdefault((*one.form, one.cell["way"], ending), {})
                group.setdefault(rule, one)
        for (_, _, _, ending), group in alike.items():
            there = [group[rule] for rule in ORDER if rule in group]
            found += [(rays, ending, *pair) for pair in pairwise(there)]
    ratios = [trees.ratio(after, before) for _, _, before, after in found]
    return [
        Step(model, *one, ratio, _verdict(ratio)) for one, ratio in zip(found, ratios, strict=True)
    ]


def _verdict(ratio: Estimate | None) -> str:
    low, high = (None if ratio is None else ratio.interval()) or (0.0, math.inf)
    return HOLDS if low > 1 else FAILS if high < 1 else UNRESOLVED


def order_notes(found: list[Step]) -> list[str]:
    """Return lines that say how far the expected order holds, and where it is reversed."""
    if not found:
        return []
    whole = len(found)
    by_median = sum(step.ratio is not None and step.ratio.value > 1 for step in found)
    line = "expected order SAH, object median, spatial median"
    if any(step.ratio is not None and step.ratio.draws is not None for step in found):
        count = [sum(step.verdict == verdict for step in found) for verdict in VERDICTS]
        told = f"of {whole} steps {count[0]} hold, {count[1]} do not, {count[2]} are not resolved"
    else:
        told = f"{by_median} of {whole} steps by the medians"
    lines = [f"{line}: {told}"]
    # What is reversed, be it by the medians alone.
    reverse = [step for step in found if step.ratio is not None and step.ratio.value < 1]
    for words in [_words(step) for step in reverse]:
        lines.append(f"the other way round: {words}")
    return lines


def _words(step: Step) -> str:
    later, sooner = (RULES[one.key[1]] for one in (step.after, step.before))
    place = [step.rays, ENDINGS.get(step.ending, step.ending), step.after.cell["way"]]
    ends = step.ratio.interval() or (None, None)
    text = measured(step.ratio.value, *ends, most=2).text
    span = "" if ends[0] is None else f" [{ends[0]:.2f}, {ends[1]:.2f}]"
    sure = " (not resolved)" if step.verdict == UNRESOLVED else ""
    return f"{', '.join(filter(None, place))}: {later} {text}{span} of {sooner}'s time{sure}"
