"""Does what the SAH expects of a tree tell how fast it is? Rank correlations with the times."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rtbench.report.digits import absent
from rtbench.report.tree_cells import EXPECTED, VISITS, Timed

if TYPE_CHECKING:
    from rtbench.report.trees import Trees

FEWEST = 4  # trees, below which a rank correlation says nothing
ALL = ""  # of all models together
COUNTED = tuple(f"counted_{name}" for name in VISITS)
MEASURES = {
    "sah_cost": "SAH cost",
    **{name: name.replace("_", " ") for name in EXPECTED},
    "counted_steps": "counted steps",
    "counted_leaves": "counted leaves",
    "counted_leaf_tests": "counted tests",
}


class Point(NamedTuple):
    """A tree of which times and measures are known."""

    timed: Timed
    ns: float
    measures: dict[str, float]


class Correlation(NamedTuple):
    """Spearman's rank correlation of a measure with the time, the p of none, and of how many."""

    model: str
    rays: str
    form: tuple
    measure: str
    rho: float
    p: float
    trees: int


def points(trees: "Trees", model: str, rays: str) -> list[Point]:
    """Return every k-d tree of a model that was timed with a ray set, with its measures.

    A BVH's cost is counted otherwise, and a step in it is another: it stays out.
    """
    found = []
    for one in trees.of(model, rays):
        tree = trees.tree(one)
        if not one.ours or one.key[0] != "kd" or tree is None or "," in one.cell["way"]:
            continue
        counted = trees.visits(one)
        told = {name: tree.facts.get(name) for name in ("sah_cost", *EXPECTED)}
        told |= {f"counted_{name}": counted.get(name) for name in VISITS}
        told = {name: float(value) for name, value in told.items() if not absent(value)}
        found.append(Point(one, trees.median(one).value, told))
    return found


def correlations(trees: "Trees") -> list[Correlation]:
    """Return the correlation of every measure with the time, by model, ray set, kernel and way.

    Returns
    -------
    list of Correlation
        Of at least FEWEST trees; last those over all models at once, where there are several.

    Source
    ------
    Spearman 1904; the question is Havran's (2000)
    """
    found = []
    models = [*trees.models, ALL] if len(trees.models) > 1 else trees.models
    for model in models:
        for rays in trees.ray_sets(model or None):
            some = [
                p
                for name in trees.models
                if model in (ALL, name)
                for p in points(trees, name, rays)
            ]
            groups: dict[tuple, list[Point]] = {}
            for point in some:
                groups.setdefault((*point.timed.form, point.timed.cell["way"]), []).append(point)
            for form, group in groups.items():
                for measure in MEASURES:
                    one = _correlation(model, rays, form, measure, group)
                    if one is not None:
                        found.append(one)
    return found


def _correlation(
    model: str, rays: str, form: tuple, measure: str, group: list[Point]
) -> Correlation | None:
    known = [point for point in group if measure in point.measures]
    values = np.array([point.measures[measure] for point in known])
    times = np.array([point.ns for point in known])
    if len(known) < FEWEST or np.ptp(values) == 0 or np.ptp(times) == 0:
        return None
    from scipy.stats import spearmanr

    rho, p = spearmanr(values, times)
    return Correlation(model, rays, form, measure, float(rho), float(p), len(known))
