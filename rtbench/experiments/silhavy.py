"""What chapters 2 to 4 of Šilhavý 2010 state, each decided on this machine by a number.

A ratio is paired by rounds within each model; over models it is their geometric mean, whose
interval takes the models as the unit: the thesis speaks of scenes, not of one.
"""

from __future__ import annotations

from collections.abc import Mapping

from rtbench.experiments import silhavy_builds, silhavy_counts, silhavy_growth, silhavy_times
from rtbench.experiments.silhavy_measured import Rules, missing
from rtbench.experiments.silhavy_overlap import count
from rtbench.experiments.verdicts import Statement, rows
from rtbench.records.run import Run

THESIS = "Šilhavý 2010"


def further(runs: Mapping[str, Run], watcher: object) -> dict[str, object]:
    """Count what no run has and `judged` takes: what overlap tests let into cells.

    Parameters
    ----------
    runs : mapping of str to Run
    watcher : object
        Is told the plan and how far it is, as of a run.
    """
    if "5" not in runs:
        return {}
    watcher.plan("counting the triangles that are let into cells")
    return {"overlaps": count(runs["5"], watcher.progress)}


def judged(runs: Mapping[str, Run], overlaps: list[dict] | None = None) -> list[dict]:
    """Judge every statement whose tables were measured.

    Parameters
    ----------
    runs : mapping of str to Run
        Runs by what their config's name ends in: "5", "builders", "sizes", "naive" ...
    overlaps : list of dict, optional
        What `rtbench.experiments.silhavy_overlap.count` gives.

    Returns
    -------
    list of dict
        ``section, statement, verdict, number``.
    """
    told: dict[str, object] = {
        name: Rules(run) if run.info["experiment"] == "trees" else run for name, run in runs.items()
    }
    if overlaps is not None:
        told["overlaps"] = overlaps
    return rows(STATEMENTS, told)


def _not_built(what):
    return lambda runs: missing(what)


STATEMENTS = (
    Statement(
        "2.1",
        "the naive way's time is proportional to the number of objects, a tree's hardly depends on "
        "it (p. 7, 22)",
        ("sizes",),
        silhavy_growth.naive_and_trees,
    ),
    Statement(
        "2.3",
        "tests take 75 % of the naive way's time in a simple scene, up to 95 % in a complex one "
        "(p. 15, Whitted)",
        ("naive",),
        silhavy_growth.tests_share,
    ),
    Statement(
        "2.3.1",
        "a shadow cache helps in very simple scenes, and is only more work in others (p. 16)",
        ("5",),
        _not_built("with these trees; rtbench run tracer-techniques decides it"),
    ),
    Statement(
        "3.1.1",
        "planes across the axes are met up to three times as fast as planes of any direction "
        "(p. 19, Havran)",
        ("5",),
        _not_built("rtbench builds no trees with planes of any direction"),
    ),
    Statement(
        "3.2.1",
        "a k-d tree is several hundred times faster than the naive way in complex scenes (p. 22)",
        ("5",),
        silhavy_times.hundreds,
    ),
    Statement(
        "3.2.2",
        "the number of cells is almost linear in the number of objects (p. 23, Havran)",
        ("sizes",),
        silhavy_growth.cells,
    ),
    Statement(
        "3.2.2",
        "in evenly filled scenes uniform splitting is slightly better (p. 23)",
        ("5",),
        silhavy_times.even_scenes,
    ),
    Statement(
        "3.2.2",
        "in uneven scenes uniform splitting falls far behind (p. 23)",
        ("5",),
        silhavy_times.uneven_scenes,
    ),
    Statement(
        "3.2.3",
        "the SAH gives almost twice the performance of the medians (p. 24)",
        ("5",),
        silhavy_times.twice,
    ),
    Statement(
        "3.2.3",
        "the SAH is ahead of both medians in every scene (p. 25, Havran)",
        ("5",),
        silhavy_times.always_first,
    ),
    Statement(
        "3.2.3",
        "a tree by the SAH is built in O(N log N) (p. 24)",
        ("builders",),
        silhavy_builds.n_log_n,
    ),
    Statement(
        "3.3.1",
        "the spatial median is the fastest to build (p. 26)",
        ("builders",),
        silhavy_builds.fastest_build,
    ),
    Statement(
        "3.3.2",
        "rays through object median trees are faster than through spatial median trees (p. 27)",
        ("5",),
        silhavy_times.object_second,
    ),
    Statement(
        "3.3.2",
        "a tree by the object median has almost no empty leaves (p. 27)",
        ("5",),
        silhavy_counts.empty_leaves,
    ),
    Statement(
        "3.3.3",
        "with the SAH a thousandth of the objects is tested that other methods test (p. 27, "
        "MacDonald)",
        ("5",),
        silhavy_counts.tested,
    ),
    Statement(
        "3.3.3",
        "the SAH is up to a thousand times faster in scenes of many small evenly spread objects "
        "(p. 27, MacDonald)",
        ("5",),
        silhavy_times.thousand,
    ),
    Statement(
        "3.3.3",
        "the cost of a tree by the SAH tells its time (p. 27-28, Havran)",
        ("5",),
        silhavy_counts.cost_tells_time,
    ),
    Statement(
        "3.3.3",
        "the longest axis alone (6 N to 2 N candidates) loses nothing noticeable (p. 29, Havran)",
        ("5",),
        silhavy_times.longest_axis,
    ),
    Statement(
        "3.3.3",
        "of these the half nearer to the object median (2 N to N) loses nothing noticeable (p. 29, "
        "Havran)",
        ("5",),
        silhavy_times.near_half,
    ),
    Statement(
        "4.1",
        "Wald's node of 8 bytes is faster by tens of per cent than a fat one (p. 33)",
        ("5",),
        silhavy_times.fat_node,
    ),
    Statement(
        "4.1.1",
        "of the triangles that the three-stage test lets into a cell 14 % do not touch it (p. 34, "
        "David)",
        ("overlaps",),
        silhavy_counts.let_in,
    ),
    Statement(
        "4.1.2",
        "counting triangles anew at each candidate takes O(N^2), extreme times (p. 34)",
        ("builders",),
        silhavy_builds.quadratic,
    ),
    Statement(
        "4.1.2",
        "candidates sorted once are faster, by a factor that grows, than sorted in every node "
        "(p. 35)",
        ("builders",),
        silhavy_builds.sorted_once,
    ),
)
