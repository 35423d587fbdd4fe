"""What endings promise at their borders, what Text 9 as printed does there, and what they cost."""

import itertools

import numpy as np
import plain
import pytest

import rtbench
from rtbench.compiled.operations import operations
from rtbench.kernels.contract import HIT
from rtbench.kernels.endings import ENDINGS
from rtbench.kernels.registry import all_kernels

KERNELS = all_kernels()
METHODS = list(dict.fromkeys(k.function.__name__ for k in KERNELS.values() if k.ending))
# A form with u and v decides as the one without does: it is the same tree, cut off later.
ENDED = {n: k for n, k in KERNELS.items() if k.ending and len(k.outputs) == 3}
RAYS = [n for n, k in ENDED.items() if k.ending.takes_tmax]
SAFE = [n for n in RAYS if KERNELS[n].ending.name != "text9"]
TEXT9 = {n for n in RAYS if KERNELS[n].ending.name == "text9"}

TRIANGLE = np.array([[0.0, 0, 1], [4, 0, 1], [0, 4, 1]])
ORIGIN = np.array([1.0, 2, -1])
DIRECTION = np.array([0.0, 0, 2])  # hits at t = 1, u = 0.25, v = 0.5


def outcomes(name, triangles, origins, directions, tmax=np.inf):
    return [answer[0] for answer in plain.run(KERNELS[name], triangles, origins, directions, tmax)]


def test_every_method_has_every_ending_once():
    endings = {ending.name for ending in ENDINGS}
    stable = {"stable", "stable_whole"}
    for method in METHODS:
        own = [k for k in KERNELS.values() if k.function.__name__ == method]
        has = {k.ending.name for k in own}
        # A method of points finds the plane first; one that stores data may not keep the vertices.
        of_points = "inside" in has
        fit = endings - ({"inside"} if not of_points else set())
        if of_points or own[0].stored != "none":
            fit -= stable
        assert has == fit
        assert len(own) == 2 * len(has)
        assert method in KERNELS  # its own order of tests, division first, bears its name
        assert {k.domain for k in own if k.ending.name == "inside"} <= {None}


TIES = [np.inf, np.nextafter(1, 2), 1.0, np.nextafter(1, 0), 0.0, -1.0]


@pytest.mark.parametrize("name", RAYS)
def test_t_equal_to_tmax_misses(name):
    """t is exactly 1 here, whatever the method computes: all numbers are small integers."""
    for tmax in TIES:
        (found,) = plain.run(KERNELS[name], [TRIANGLE], [ORIGIN], [DIRECTION], tmax)
        if name not in TEXT9 or tmax != 1:
            assert (found[0] == HIT) == (tmax > 1)
        if found[0] == HIT:
            assert found == (HIT, 1.0, 0.25, 0.5)


@pytest.mark.parametrize("name", sorted(TEXT9))
def test_text_9_has_a_tie_hit_from_one_side_and_not_from_the_other(name):
    """det tmax - t is +0 there, which has the sign of a det above 0 only."""
    from_behind = ORIGIN + 2 * DIRECTION
    found = outcomes(name, [TRIANGLE] * 2, [ORIGIN, from_behind], [DIRECTION, -DIRECTION], 1.0)
    assert sorted(code == HIT for code in found) == [False, True]


@pytest.mark.parametrize("name", SAFE)
def test_what_lies_behind_or_at_the_origin_misses(name):
    at = np.array([1.0, 2, 1])
    found = outcomes(name, [TRIANGLE] * 2, [ORIGIN, at], [-DIRECTION, DIRECTION])
    assert HIT not in found


def broken():
    """Return pairs that hit, each with one number, or a whole vector, no number or infinite."""
    random = np.random.default_rng(5)
    cases = [(TRIANGLE, ORIGIN, DIRECTION)]
    for _ in range(12):
        triangle, origin = random.random((3, 3)), random.random(3) - 2
        cases.append((triangle, origin, random.dirichlet((2, 2, 2)) @ triangle - origin))
    found = []
    for case, bad, vector in itertools.product(cases, (np.nan, np.inf, -np.inf), range(5)):
        for place in (0, 1, 2, slice(None)):
            rows = np.vstack(case)
            rows[vector, place] = bad
            found.append((rows[:3], rows[3], rows[4]))
    return cases, [np.array(each) for each in zip(*found, strict=True)]


WHOLE, BROKEN = broken()


@pytest.mark.parametrize("name", SAFE)
def test_nan_and_infinity_in_the_input_miss(name):
    assert set(outcomes(name, *map(np.array, zip(*WHOLE, strict=True)))) == {HIT}
    for tmax in (np.inf, 1e3):
        assert HIT not in outcomes(name, *BROKEN, tmax)


@pytest.mark.parametrize("name", SAFE)
def test_a_tmax_that_is_no_number_misses(name):
    assert outcomes(name, [TRIANGLE], [ORIGIN], [DIRECTION], np.nan) != [HIT]


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", [n for n in SAFE if KERNELS[n].method in ("Wald", "Plücker")])
def test_compiled_they_miss_too(name, precision):
    triangles, origins, directions = BROKEN
    assert not rtbench.intersect(name, triangles, origins, directions, precision).hit.any()


@pytest.mark.parametrize("name", [n for n, k in ENDED.items() if k.domain is None])
def test_a_point_without_a_triangle_misses(name):
    """What a method does not read, the coordinate along which it projects, may be anything."""
    triangles, origins, _ = BROKEN
    bad = ~np.isfinite(triangles).all(axis=(1, 2)) | ~np.isfinite(origins).any(axis=1)
    assert bad.sum() > 400
    found = np.array(outcomes(name, triangles[bad], origins[bad], np.ones_like(origins[bad])))
    assert (found != HIT).all()
    flat = np.array([[[0.0, 0, 0], [1, 1, 1], [2, 2, 2]], [[1.0, 2, 3]] * 3])
    assert HIT not in outcomes(name, flat, np.ones((2, 3)), np.ones((2, 3)))


# No area, or no angle between ray and plane, and small integers: every determinant is exactly 0.
ZERO_DENOMINATORS = (
    (TRIANGLE, [1.0, 2, 1], [1.0, 0, 0]),  # in the plane
    (TRIANGLE, [1.0, 2, -1], [1.0, 0, 0]),  # beside it
    ([[0.0, 0, 0], [1, 1, 1], [2, 2, 2]], [1.0, 2, -1], [0.0, 0, 2]),  # three points of a line
    ([[1.0, 1, 1]] * 3, [0.0, 0, 0], [1.0, 1, 1]),  # one point, met
    ([[1.0, 1, 1], [1, 1, 1], [3, 1, 2]], [0.0, 0, 0], [1.0, 1, 1]),  # two of three in one
    (TRIANGLE, [1.0, 2, -1], [0.0, 0, 0]),  # a ray that goes nowhere
)


@pytest.mark.parametrize("name", SAFE)
def test_zero_denominators_miss(name):
    for tmax in (np.inf, 5.0):
        pairs = map(np.array, zip(*ZERO_DENOMINATORS, strict=True))
        assert HIT not in outcomes(name, *pairs, tmax)


def degenerate(n=60):
    """Return rays through points and lines that are triangles, in small integers."""
    random = np.random.default_rng(3)
    corner, origin = random.integers(-3, 4, (2, n, 3)).astype(float)
    triangles = np.repeat(corner[:, None], 3, axis=1)
    way = random.integers(-2, 3, (n, 3))
    for vertex in (1, 2):  # the first half are points
        triangles[n // 2 :, vertex] += (random.integers(-2, 3, (n, 1)) * way)[n // 2 :]
    return triangles, origin, corner - origin


@pytest.mark.parametrize("method", METHODS)
def test_text_9_calls_a_degenerate_triangle_hit_and_no_other_ending_does(method):
    """Its numerators are all 0: no sign differs from another. What is stored of it is no number.

    (A 0 that a method makes by a minus is -0, which has the other sign: so not with every method.)
    """
    hits = {
        name: outcomes(name, *degenerate(), 5.0).count(HIT)
        for name in ENDED
        if KERNELS[name].function.__name__ == method
    }
    hit = {name for name, count in hits.items() if count}
    assert hit <= TEXT9
    assert hit or method not in ("moller_trumbore", "kensler_shirley", "keidy", "wald")


@pytest.mark.parametrize("method", METHODS)
def test_text_9_and_an_infinite_tmax(method):
    """det tmax is 0 * inf where the ray is parallel: NaN, of whatever sign; a hit is the same."""
    name = f"{method}_text9_uv"
    assert outcomes(name, [TRIANGLE], [ORIGIN], [DIRECTION], np.inf) == [HIT]
    beside = np.array([[1.0, 2, z] for z in (-1, 0, 2, 3)]).repeat(2, axis=0)
    ways = np.array([[1.0, 0, 0], [0, -1, 0]] * 4)
    finite = outcomes(name, [TRIANGLE] * 8, beside, ways, 5.0)
    assert set(finite) == {1}  # 0 * 5 - t and t differ in sign
    # Infinity takes that away: whichever sign the NaN has, one side of the plane passes as near.
    infinite = outcomes(name, [TRIANGLE] * 8, beside, ways, np.inf)
    assert set(infinite) != {1}


def test_text_9_signed_zeros_flip_answers():
    """On the edge u = 0 the sign of the zero is that of the way it came about."""
    name = "kensler_shirley_text9_uv"
    on_edge = np.array([0.0, 2, -1])
    turned = TRIANGLE[[0, 2, 1]]  # the same triangle, its other edge on the left
    mirrored = TRIANGLE * [-1, 1, 1]
    answers = {
        outcomes(name, [triangle], [origin], [direction], 5.0)[0] == HIT
        for triangle, origin, direction in (
            (TRIANGLE, on_edge, DIRECTION),
            (turned, on_edge, DIRECTION),
            (mirrored, on_edge, DIRECTION),
            (TRIANGLE, [0.0, 2, 3], -DIRECTION),
            (turned, [0.0, 2, 3], -DIRECTION),
        )
    }
    assert answers == {True, False}
    for safe in ("kensler_shirley_uv", "kensler_shirley_last_uv", "kensler_shirley_whole_uv"):
        assert outcomes(safe, [TRIANGLE, turned], [on_edge] * 2, [DIRECTION] * 2) == [HIT, HIT]


@pytest.mark.parametrize(("name", "more"), [("wald", 5), ("perpendicular_planes", 6)])
def test_moving_the_division_costs_as_many_multiplications_as_havel_says(name, more):
    """Havel 2008, 5.2; counted on the longest path of the forms that return t alone."""
    first, last = operations(KERNELS[name]), operations(KERNELS[f"{name}_last"])
    assert last["mul"] - first["mul"] == more
    assert (first["div"], last["div"]) == (1, 1)


@pytest.mark.parametrize("name", METHODS)
def test_whole_endings_have_no_early_exit_and_moved_divisions_stand_behind_the_tests(name):
    import ast

    from rtbench.compiled import syntax

    for ending in ("_whole", "_last_whole", "_stable_whole"):
        if f"{name}{ending}_uv" in KERNELS:
            body = syntax.tree(KERNELS[f"{name}{ending}_uv"]).body
            assert not any(isinstance(statement, ast.If) for statement in body)
    text = ast.unparse(syntax.tree(KERNELS[f"{name}_last_uv"]))
    assert text.index("/") > text.rindex("return (2") and text.index("/") > text.rindex("return (1")
