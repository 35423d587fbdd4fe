"""Mispredictions counted against numbers worked out by hand; a known penalty found again."""

import numpy as np
import pytest

from rtbench.experiments import prediction
from rtbench.kernels.contract import HIT, NO_T, ONE, ZERO, Kernel
from rtbench.records import schema
from rtbench.records.store import load_run
from rtbench.records.writer import RunWriter
from rtbench.workloads.pairs import random_pairs

HALF = 0.5


def made(function) -> Kernel:
    return Kernel(
        function.__name__, function, "by hand", "hand", "line", ("hit", "miss"), ("t",), "a test"
    )


@pytest.fixture(scope="module")
def pairs():
    return random_pairs(1500, "pcg64", 3)


def share(condition) -> float:
    """Return what a predictor that knows p alone gets wrong of independent outcomes."""
    p = np.mean(condition)
    return min(p, 1 - p)


def one_branch(tri, ray):
    if ray.orig[0] < 0.25:
        return HIT, ONE
    return 1, NO_T


def either(tri, ray):
    if ray.orig[0] < 0.25 or ray.orig[1] < HALF:
        return HIT, ONE
    return 1, NO_T


def both(tri, ray):
    if ray.orig[0] > 0.25 and ray.orig[0] < HALF:
        return HIT, ONE
    return 1, NO_T


def nested(tri, ray):
    if ray.orig[0] < 0.25:
        if ray.orig[1] < HALF:
            return HIT, ONE
        return 1, NO_T
    if ray.orig[2] < 0.125:
        return HIT, ONE
    return 1, NO_T


def small(x):
    if x < 0.125:
        return ONE
    return ZERO


def helped(tri, ray):
    t = small(ray.orig[0])
    if t > ZERO:
        return HIT, t
    return 1, NO_T


def never(tri, ray):
    if ray.orig[0] < -ONE:
        return HIT, ONE
    t = ONE / ZERO * (ray.dir[0] - ray.dir[0])
    if t > ZERO:
        return HIT, t
    return 1, NO_T


def test_mispredictions(pairs):
    x, y, z = pairs.orig.astype(float).T
    n = len(pairs)

    def few(condition, met):  # of a branch that only some tests meet
        taken = np.count_nonzero(condition & met)
        return min(taken, np.count_nonzero(met) - taken) / n

    low = x < 0.25
    everywhere = np.ones(n, bool)
    wanted = {
        one_branch: share(low),
        either: share(low) + few(y < 0.5, ~low),
        both: share((x > 0.25) & (x < 0.5)),
        nested: share(low) + few(y < 0.5, low) + few(z < 0.125, ~low),
        helped: 2 * few(x < 0.125, everywhere),
    }
    for function, expected in wanted.items():
        assert expected > 0.05
        assert prediction.mispredictions(made(function), pairs) == pytest.approx(expected)


def test_a_branch_that_always_goes_one_way_is_never_mispredicted(pairs):
    assert prediction.mispredictions(made(never), pairs) == 0


@pytest.mark.parametrize("penalty", [0.0, 4.25, 11.0])
def test_a_known_penalty_is_found_again(tmp_path, penalty):
    """Times made so that cost = sum f_i t_i + m x penalty holds, for two kernels at once."""
    times = {"a": {0: 8.0, 1: 3.0}, "b": {0: 5.0, 1: 4.0}}
    branches, outcomes, rows = [], [], []
    key = {"precision": "float32", "launch": 0, "triangles": 100, "repetitions": 1000}
    for kernel, t in times.items():
        for density in (0.0, 0.25, 0.5):
            hits = round(1000 * density)
            m = {0.0: 0.0, 0.25: 0.25, 0.5: 0.5}[density] * (2 if kernel == "b" else 1)
            where = {"kernel": kernel, "precision": "float32", "density": density}
            branches.append(where | {"mispredictions": m})
            outcomes += [
                where | {"triangles": 1000, "outcome": code, "label": str(code), "count": count}
                for code, count in ((0, hits), (1, 1000 - hits))
            ]
            mixture = density * t[0] + (1 - density) * t[1]
            cells = [("shuffled", None, mixture + m * penalty), ("sweep", None, 1000.0)]
            cells += [("repeat", c, t[c]) for c in (0, 1) if density or c]
            for process in range(3):
                for turn in range(2):
                    rows += [
                        key
                        | {"kernel": kernel, "density": density, "order": order, "outcome": code}
                        | {"process": process, "round": turn, "position": position}
                        | {"tests": 100_000, "ns": round(100_000 * ns), "cpu_ns": 1}
                        for position, (order, code, ns) in enumerate(cells)
                    ]
    info = {"cell": list(prediction.CELL), "branches": branches, "outcomes": outcomes}
    columns = schema.sample_columns(list(prediction.CELL))
    with RunWriter.create(tmp_path, "x", "y", info, columns) as writer:
        writer.append(rows)
    fit = prediction.conclude(load_run(writer.path))["fit"]
    assert fit["penalty_ns"] == pytest.approx(penalty, abs=1e-4)
    assert fit["kernels"] == {name: pytest.approx(penalty, abs=1e-4) for name in times}
    assert fit["ci"] == pytest.approx([penalty, penalty], abs=1e-4)
    assert len(fit["points"]) == 6
    for point in fit["points"]:
        assert point["measured"] == pytest.approx(point["predicted"], abs=1e-3)
    at = next(p for p in fit["points"] if (p["kernel"], p["density"]) == ("a", 0.25))
    assert at["mixture"] == pytest.approx(0.25 * 8 + 0.75 * 3)


def test_nothing_is_concluded_from_nothing(tmp_path):
    info = {"cell": list(prediction.CELL), "branches": [], "outcomes": []}
    columns = schema.sample_columns(list(prediction.CELL))
    with RunWriter.create(tmp_path, "x", "y", info, columns) as writer:
        pass
    assert prediction.conclude(load_run(writer.path)) == {}
