"""Table of trees beside libraries: how many times their speed, paired in the same rounds."""

from typing import NamedTuple

import numpy as np

from rtbench.records import statistics
from rtbench.records.statistics import Estimate, Times
from rtbench.report import machine
from rtbench.report.digits import absent, measured
from rtbench.report.layouts.tree_kernels import head_of
from rtbench.report.tables import Cell, Table
from rtbench.report.tree_cells import TREE, Timed, clock_note, clocks
from rtbench.report.trees import Trees

MEAN = "geometric mean"


class Against(NamedTuple):
    """One of our cells beside a library's: how many times its speed.

    `speed` is by the processor's time of the thread, which others on the machine disturb less; with
    more threads, or where it was not taken, by the clock. `wall` is by the clock alone; `least` and
    `greatest` are those of single rounds.
    """

    ours: Timed
    peer: Timed
    speed: Estimate
    wall: float
    least: float
    greatest: float


def against_peers(trees: Trees) -> list[Against]:
    """Return every cell of ours beside every library's of the same model and rays."""
    found = []
    for model in trees.models:
        for rays in trees.ray_sets(model):
            timed = trees.of(model, rays)
            for peer in (one for one in timed if one.cell["way"] == "peer"):
                for one in (one for one in timed if one.ours):
                    against = _against(trees, one, peer)
                    found += [against] if against is not None else []
    return found


def beside(found: list[Against]) -> list[Against]:
    """Return those of the trees that somebody would take beside a library: SAH's usual ones.

    Median rules and variants of the SAH's builder stand in the records alone, as do other endings
    than the first of each model.
    """
    first: dict[str, str] = {}
    chosen = []
    for one in found:
        structure, rule, builder, ending = one.ours.key
        if rule == "sah" and " " not in builder:
            usual = first.setdefault(structure, ending)
            chosen += [one] if ending == usual else []
    return chosen


def _against(trees: Trees, one: Timed, peer: Timed) -> Against | None:
    speed = trees.ratio(peer, one)
    if speed is None:
        return None
    rounds, wall = (_rounds(*pair) for pair in (clocks(one, peer), (one.times, peer.times)))
    return Against(
        one, peer, speed, float(np.median(wall)), float(rounds.min()), float(rounds.max())
    )


def _rounds(ours: Times, theirs: Times) -> np.ndarray:
    """Return the ratios of the rounds that both have."""
    there = dict(zip(zip(theirs.process, theirs.round, strict=True), theirs.ns, strict=True))
    keys = zip(ours.process, ours.round, strict=True)
    pairs = [there[key] / ns for key, ns in zip(keys, ours.ns, strict=True) if key in there]
    return np.array(pairs, float)


def peers_table(trees: Trees) -> Table:
    """Return our speed over a library's: a row a ray set, tree, way, kernel and model.

    Parameters
    ----------
    trees : Trees

    Returns
    -------
    Table
        With its 95 % interval and the least and greatest of single rounds; under each group of
        several models their geometric mean with the spread.
    """
    groups: dict[tuple, list[Against]] = {}
    whole = against_peers(trees)
    for one in beside(whole):
        key = one.peer.cell["kernel"], one.ours.cell["rays"], head_of(one.ours), *one.ours.form
        groups.setdefault(key, []).append(one)
    rows = []
    for (peer, rays, tree, kernel, precision), group in groups.items():
        same = {"peer": peer, "rays": rays, "tree": tree, "kernel": kernel, "precision": precision}
        rows += [same | _row(trees, one) for one in group]
        if len(group) > 1:
            mean = statistics.geometric_mean([one.speed for one in group])
            spread = f"{mean.least:.2f} to {mean.greatest:.2f}"
            row = {"model": MEAN, "least": mean.least, "greatest": mean.greatest}
            rows.append(same | row | _speed(mean.estimate) | {"spread": spread})
    shown = {(id(one.ours), id(one.peer)) for group in groups.values() for one in group}
    more = [
        _row(trees, one) | {"peer": one.peer.cell["kernel"]}
        for one in whole
        if (id(one.ours), id(one.peer)) not in shown
    ]
    precise = len({row["precision"] for row in rows}) > 1
    columns = ["peer", "rays", "tree", "kernel", *(["precision"] if precise else []), "model"]
    columns += ["peer_ns", "ns", "speed", "interval", "wall", "spread"]
    raw = ["peer", "model", "triangles", "rays", *TREE, "kernel", "precision", "way", "peer_ns"]
    raw += ["ns", "speed", "low", "high", "wall", "least", "greatest"]
    return Table(
        "tree-peers",
        rows,
        columns,
        "trees beside libraries: how many times their speed, paired by rounds of one process",
        raw,
        rows + more if more else [],
        headers={
            "peer_ns": "its ns/ray",
            "ns": "ns/ray",
            "speed": "x its speed",
            "interval": "95 %",
            "wall": "by the clock",
            "spread": "single rounds",
        },
        notes=[
            "above 1: rtbench is faster; k-d trees by SAH; single rounds: least to greatest",
            "what a user of Python gets: of a library with the copies that its call makes",
            clock_note([each for one in whole for each in (one.ours, one.peer)]),
            *_answers(trees),
            machine.provenance(trees.run),
        ],
    )


def _row(trees: Trees, one: Against) -> dict:
    row = one.ours.cell | dict(zip(TREE, one.ours.key, strict=True))
    row |= {"model": one.ours.cell["model"], "triangles": one.ours.triangles}
    for name, timed in (("peer_ns", one.peer), ("ns", one.ours)):
        estimate = trees.median(timed)
        row[name] = measured(estimate.value, *(estimate.interval() or (None, None)), most=1)
    row |= {"least": one.least, "greatest": one.greatest}
    row["spread"] = f"{one.least:.2f} to {one.greatest:.2f}"
    row["wall"] = Cell(one.wall, f"{one.wall:.2f}")
    return row | _speed(one.speed)


def _speed(speed: Estimate) -> dict:
    low, high = speed.interval() or (None, None)
    span = "" if low is None else f"[{low:.2f}, {high:.2f}]"
    found = {"speed": Cell(speed.value, f"{speed.value:.2f}"), "interval": span}
    return found | {"low": low, "high": high}


def _answers(trees: Trees) -> list[str]:
    """Return how far the libraries' answers differ from ours, and who was absent."""
    told = trees.run.info.get("peer_answers") or []
    differ = [
        f"{one['peer']} {one['model']} {one['rays']}: {one['hit_differs']:,} hits"
        + ("" if absent(one.get("t_differs")) else f", {one['t_differs']:,} t")
        + f" of {one['compared']:,}"
        for one in told
        if one.get("hit_differs") or one.get("t_differs")
    ]
    notes = [f"answers that differ from a library's: {'; '.join(differ)}"] if differ else []
    if told and not differ:
        notes.append(f"no answer differs, of {sum(one['compared'] for one in told):,} compared")
    peers = trees.run.info.get("peers") or []
    there = [f"{p['name']} {p.get('version') or ''}".strip() for p in peers if not p.get("absent")]
    gone = [f"{p['name']}: {p['absent']}" for p in peers if p.get("absent")]
    notes += [", ".join(there)] if there else []
    return notes + ([f"absent: {'; '.join(gone)}"] if gone else [])
