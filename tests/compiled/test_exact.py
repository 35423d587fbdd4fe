"""Kernels in rational arithmetic against the oracle, which shares no code with them."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy.exact import line_hit, numerators
from rtbench.compiled.exact import EPSILON, UNDEFINED, divide, exact_form, exact_records
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import HIT, ONE, ZERO, kernel
from rtbench.kernels.registry import all_kernels
from rtbench.workloads.pairs import random_pairs

# Methods of pieces are tested so in tests/kernels/test_pieces.py.
KERNELS = {name: each for name, each in all_kernels().items() if not each.ending and each.exact}
MOLLERS = [name for name in KERNELS if name.startswith("moller")]
N = 2000


def run(name, triangles, origins, directions):
    """Return the outcome and outputs of every pair."""
    vertices = tuple(np.asarray(triangles)[:, i] for i in range(3))
    records = exact_records(KERNELS[name], vertices, origins, directions)
    form = exact_form(KERNELS[name])
    return [form(tri, ray) for tri, ray in zip(*records, strict=True)]


@pytest.fixture(scope="module")
def drawn():
    """Pairs of both generators, as drawn: triangles, origins, directions."""
    both = [random_pairs(N // 2, generator, seed=3) for generator in ("pcg64", "msvc")]
    return (
        np.concatenate([np.stack([p.v0, p.v1, p.v2], axis=1) for p in both]),
        np.concatenate([p.orig for p in both]),
        np.concatenate([p.dir for p in both]),
    )


@pytest.fixture(scope="module")
def grid():
    """Pairs of small integers: lines through edges and vertices, in the plane, flat triangles."""
    random = np.random.default_rng(11)
    triangles = random.integers(0, 3, (N, 3, 3)).astype(float)
    origins = random.integers(-1, 4, (N, 3)).astype(float)
    directions = random.integers(-2, 3, (N, 3)).astype(float)
    # Half of the lines go through a point of the triangle's edges or through a vertex.
    ends = triangles[np.arange(N), random.integers(0, 3, N)]
    middle = (ends + triangles[np.arange(N), random.integers(0, 3, N)]) / 2
    through = np.arange(N) % 2 == 0
    directions[through] = (middle - origins)[through]
    return triangles, origins, directions


def oracle(pairs):
    return [line_hit(*tri, org, dir) for tri, org, dir in zip(*pairs, strict=True)]


@pytest.mark.parametrize("name", KERNELS)
def test_on_random_pairs_every_exact_kernel_agrees_with_the_oracle(name, drawn):
    hits = 0
    for (outcome, *outputs), truth in zip(run(name, *drawn), oracle(drawn), strict=True):
        ahead = KERNELS[name].domain == "line" or (truth.hit and truth.t > 0)
        assert (outcome == HIT) == (truth.hit and ahead)
        if outcome == HIT:
            hits += 1
            assert tuple(outputs) == (truth.t, truth.u, truth.v)[: len(outputs)]
    assert hits > N / 20


def test_the_grid_has_what_it_is_for(grid):
    on_edge = flat = parallel = 0
    for tri, org, dir in zip(*grid, strict=True):
        det, u, v, _ = numerators(*tri, org, dir)
        on_edge += det != 0 and 0 in (u, v, det - u - v)
        is_flat = not np.cross(tri[1] - tri[0], tri[2] - tri[0]).any()
        flat += is_flat
        parallel += det == 0 and not is_flat
    assert on_edge > 200 and flat > 100 and parallel > 100


@pytest.mark.parametrize("name", MOLLERS)
def test_moller_is_the_oracle_on_ties_and_flat_triangles_too(name, grid):
    """Edges belong to the triangle, a line in its plane does not meet it, nor does a flat one."""
    for (outcome, *outputs), truth in zip(run(name, *grid), oracle(grid), strict=True):
        assert (outcome == HIT) == truth.hit
        if truth.hit:
            assert tuple(outputs) == (truth.t, truth.u, truth.v)[: len(outputs)]
        assert (outcome == 5) == (truth.t is None)


def test_badouel_is_the_oracle_on_ties_where_it_divides_by_something(grid):
    """Its own rule: where u1 = 0 it divides by u2 and v1, and one of them is 0 for a flat triangle
    only, of which the un-normalised normal is 0 too: parallel."""
    for (outcome, *outputs), truth in zip(run("badouel_uv", *grid), oracle(grid), strict=True):
        assert (outcome == HIT) == truth.hit
        if truth.hit:
            assert tuple(outputs) == (truth.t, truth.u, truth.v)
        assert (outcome == 1) == (truth.t is None)


def test_chirkov_is_the_oracle_but_for_its_own_rules_about_edges(grid):
    """Of the edges, b (u = 0) belongs to Chirkov's triangle, a (v = 0) and c (w = 0) do not.

    It multiplies the area at a by that at b (>= 0 goes on) and by that at c (< 0 hits): no area at
    a or c, no hit. The oracle's triangle is closed.
    """
    seen = set()
    for pair, (outcome, *outputs), truth in zip(
        zip(*grid, strict=True), run("chirkov_uv", *grid), oracle(grid), strict=True
    ):
        tri, org, dir = pair
        det, u, v, _ = numerators(*tri, org, dir)
        on_open_edge = 0 in (v, det - u - v)
        assert (outcome == HIT) == (truth.hit and not on_open_edge)
        seen.add((truth.hit, on_open_edge, det != 0 and u == 0))
        if outcome == HIT:
            assert tuple(outputs) == (truth.t, truth.u, truth.v)
    assert {(True, False, True), (True, True, False), (True, False, False)} <= seen


def test_epsilon_is_below_every_determinant_of_float_inputs():
    """The smallest determinant that float64 can make: three products of the smallest subnormals."""
    assert 0 < EPSILON < Fraction(5e-324) ** 6
    tiny = 5e-324
    triangle = np.array([[[0.0, 0, 0], [tiny, 0, 0], [0, tiny, 0]]])
    answers = run("moller1", triangle, np.array([[0, 0, -1.0]]), np.array([[0, 0, tiny]]))
    assert answers[0][0] == HIT


def test_the_numbers_of_the_contract_are_exact():
    def thirds(tri, ray):
        return HIT, ONE / (ONE + ONE + ONE) + 0.1 - ZERO

    form = exact_form(declared(thirds))
    assert form(None, None) == (HIT, Fraction(1, 3) + Fraction(0.1))


def test_division_in_place_is_exact():
    def halves(tri, ray):
        t = ONE
        t /= ONE + ONE + ONE
        return HIT, t

    assert exact_form(declared(halves))(None, None) == (HIT, Fraction(1, 3))


def test_integers_divide_to_a_rational():
    assert divide(1, 3) == Fraction(1, 3)


def test_division_by_zero_is_undefined_and_no_comparison_of_it_holds():
    x = divide(Fraction(1), Fraction(0))
    assert x is UNDEFINED
    for y in (x, Fraction(0), 1, 2.5):
        for a, b in itertools.permutations((x, y)):
            assert not (a < b or a <= b or a > b or a >= b or a == b or a != b)


def test_what_is_computed_from_undefined_is_undefined():
    one = Fraction(1)
    results = [UNDEFINED + one, one + UNDEFINED, UNDEFINED - one, one - UNDEFINED]
    results += [UNDEFINED * 0, 0 * UNDEFINED, -UNDEFINED, abs(UNDEFINED)]
    results += [divide(UNDEFINED, one), divide(one, UNDEFINED), divide(UNDEFINED, UNDEFINED)]
    assert all(result is UNDEFINED for result in results)


def test_a_miss_tells_undefined_outputs():
    answers = run("moller1", np.zeros((1, 3, 3)), np.zeros((1, 3)), np.ones((1, 3)))
    assert answers[0][0] == 5 and answers[0][1] is UNDEFINED


def test_end_is_exactly_origin_plus_direction():
    _, rays = exact_records(
        KERNELS["chirkov"], (np.eye(3)[None, 0],) * 3, np.full((1, 3), 1e20), np.full((1, 3), 1e-20)
    )
    assert list(rays[0].end) == [Fraction(1e20) + Fraction(1e-20)] * 3


def test_a_kernel_that_needs_roots_has_no_exact_form():
    def rooted(tri, ray):
        return HIT, ray.dir[0]

    with pytest.raises(RtbenchError, match="'rooted' has no exact form"):
        exact_form(declared(rooted, exact=False))


def declared(function, **more):
    made = kernel(
        title="hand-made",
        method="hand-made",
        domain="line",
        outcomes=("hit", "miss"),
        outputs=("t",),
        source="this test",
        **more,
    )(function)
    return made.kernels[0]
