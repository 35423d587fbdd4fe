"""Errors of the nearest hits, recomputed another way, and which kernels are asked."""

from collections import Counter
from contextlib import closing
from fractions import Fraction

import numpy as np
import pytest

from rtbench.compiled.intersect import intersect
from rtbench.errors import RtbenchError
from rtbench.experiments import config as configs
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.relative_error import chosen, widened
from rtbench.kernels import registry
from rtbench.workloads.soup import soup

SMALL = Config(
    experiment="relative_error",
    kernels=("moller_trumbore_uv", "wald_uv"),
    precisions=("float32", "float64"),
    prepared=("own", "double"),
    densities=(0.1, 0.5),
    triangles=24,
    rays=60,
    layout="own",
)
NEVER = """
from rtbench.kernels.contract import NO_T, kernel

@kernel(
    title="never hits", method="none", domain="ray", outcomes=("hit", "miss"),
    outputs=("t", "u", "v"), source="none",
)
def never(tri, ray, tmax):
    return 1, NO_T, NO_T, NO_T
"""


def solved(corners, origin, direction):
    """Return t, u, v by Gaussian elimination with rationals."""
    v0, v1, v2, o, d = (
        [Fraction(float(x)) for x in vector] for vector in (*corners, origin, direction)
    )
    rows = [[-d[i], v1[i] - v0[i], v2[i] - v0[i], o[i] - v0[i]] for i in range(3)]
    for i in range(3):
        pivot = next(k for k in range(i, 3) if rows[k][i] != 0)
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(3):
            if k != i:
                rows[k] = [x - rows[k][i] * y for x, y in zip(rows[k], rows[i], strict=True)]
    return [row[3] for row in rows]


def kernels_of(config):
    with closing(Bench(config, print)) as bench:
        return [kernel.name for kernel in chosen(bench)]


@pytest.fixture
def rows(go, table):
    done = go(SMALL)
    assert done.finished
    return table(done, "errors.csv"), table(done, "choices.csv")


def test_every_cell_is_there_once(rows):
    found, choices = rows
    keys = Counter(
        tuple(row[name] for name in ("kernel", "precision", "prepared", "quantity", "reference"))
        for row in found
    )
    assert set(keys.values()) == {1}
    # Three references in float32, two in float64; wald is prepared in two ways in float32 only.
    ways = Counter(row["kernel"] + " " + row["precision"] for row in found)
    assert ways == {
        "moller_trumbore_uv float32": 9,
        "wald_uv float32": 18,
        "moller_trumbore_uv float64": 6,
        "wald_uv float64": 6,
    }
    for row in found:
        assert 0 < int(row["hits"]) <= 120
        assert float(row["median"]) <= float(row["p99"]) <= float(row["max"])
        assert float(row["ci_low"]) <= float(row["mean"]) <= float(row["ci_high"])
    assert all(row["differ"] == row["within_rounding"] for row in choices)


@pytest.mark.parametrize("kernel", ["moller_trumbore_uv", "wald_uv"])
def test_means_against_exact_answers_are_those_of_the_definition(rows, kernel):
    own = {name: [] for name in "tuv"}
    for ratio in SMALL.densities:
        drawn = soup(ratio, SMALL.triangles, SMALL.rays, SMALL.seed)
        hit = np.flatnonzero(drawn.nearest >= 0)
        corners = drawn.triangles[drawn.nearest[hit]]
        origins, directions = drawn.orig[hit], drawn.dir[hit]
        answers = intersect(kernel, corners, origins, directions, "float32")
        assert answers.hit.all()
        for i in range(len(hit)):
            truth = solved(corners[i], origins[i], directions[i])
            for name, x in zip("tuv", truth, strict=True):
                if abs(x) > Fraction(1, 1000):
                    error = abs(Fraction(float(getattr(answers, name)[i])) - x) / abs(x)
                    own[name].append(float(error))
    for row in rows[0]:
        key = row["kernel"], row["precision"], row["reference"]
        if key == (kernel, "float32", "exact") and row["prepared"] in ("", "own"):
            errors = own.pop(row["quantity"])
            assert int(row["hits"]) == len(errors)
            assert float(row["mean"]) == pytest.approx(np.mean(errors), rel=1e-6)
            assert float(row["median"]) == pytest.approx(np.median(errors), rel=1e-6)
            assert float(row["max"]) == pytest.approx(max(errors), rel=1e-6)
    assert not own


def test_havel_s_reference_has_no_errors_of_its_own(rows):
    for row in rows[0]:
        if row["precision"] == "float64" and row["kernel"] == "moller_trumbore_uv":
            assert (float(row["mean"]) == 0) == (row["reference"] == "moller_trumbore")


def test_precisions_err_in_their_last_digits(rows):
    for row in rows[0]:
        mean = float(row["mean"])
        if row["precision"] == "float32":
            assert 1e-8 < mean < 1e-4
        elif row["reference"] == "exact":
            assert 1e-17 < mean < 1e-12


def test_a_kernel_that_never_hits_chooses_no_triangle(go, table, tmp_path):
    file = tmp_path / "never.py"
    file.write_text(NEVER, encoding="utf-8")
    done = go(SMALL, kernels=("moller_trumbore_uv", f"{file}:never_uv"), precisions=("float32",))
    hits = {w["density"]: w["rays_that_hit"] for w in done.info["workloads"]}
    for row in table(done, "choices.csv"):
        wrong = row["kernel"] in ("never_uv", "")  # "": some two differ
        assert int(row["differ"]) == (hits[float(row["density"])] if wrong else 0)
        assert row["within_rounding"] == "0"
    own = [row for row in table(done, "errors.csv") if row["kernel"] == "never_uv"]
    assert {row["hits"] for row in own} == {"0"} and {row["mean"] for row in own} == {""}


def test_data_of_more_digits_round_to_those_of_fewer():
    drawn = soup(0.5, 50, 50)
    wide = widened(drawn, 1)
    for name in ("v0", "v1", "v2", "orig", "dir"):
        narrow, more = getattr(drawn, name), getattr(wide, name)
        assert more.dtype == np.float64 and (more.astype(np.float32) == narrow).all()
        assert (more != narrow).mean() > 0.99


def test_powers_of_two_round_to_themselves():
    drawn = soup(0.5, 50, 50)
    drawn.orig[:] = np.float32([1.0, -2.0, 0.25])
    wide = widened(drawn, 1)
    assert (wide.orig.astype(np.float32) == drawn.orig).all() and (wide.orig != drawn.orig).all()


def test_of_a_pattern_both_endings_are_taken():
    assert kernels_of(Config(kernels=("wald*",))) == ["wald_uv", "wald_last_uv"]
    assert kernels_of(
        Config(
            kernels=(
                "wald_whole_uv",
                "wal?_*",
            )
        )
    ) == ["wald_whole_uv", "wald_uv", "wald_last_uv"]


def test_what_cannot_be_asked_is_told():
    with pytest.raises(RtbenchError, match="'wald' does not return t, u and v"):
        kernels_of(Config(kernels=("wald",)))
    with pytest.raises(RtbenchError, match="no method matches moller"):
        kernels_of(Config(kernels=("moller?_uv",)))


def test_the_shipped_config_asks_every_method():
    found = kernels_of(configs.find("havel-5.5"))
    methods = {k.function.__name__ for k in registry.all_kernels().values() if k.ending}
    assert len(methods) > 10
    wanted = {f"{method}{ending}" for method in methods for ending in ("_uv", "_last_uv")}
    assert len(found) == len(set(found)) and set(found) == wanted | {
        "moller1_uv",
        "badouel_uv",
        "chirkov_uv",
    }
