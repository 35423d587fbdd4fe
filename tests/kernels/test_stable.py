"""The stable endings, and half-open edges: as accurate as the problem lets be, on slivers too."""

import ast
from fractions import Fraction

import numpy as np
import plain
import pytest
import truth
import workload

import rtbench
from rtbench.compiled import packets, packing, syntax
from rtbench.compiled.operations import operations
from rtbench.compiled.packing import Packing
from rtbench.kernels.contract import HIT
from rtbench.kernels.registry import all_kernels, find

STABLE = [n for n, k in all_kernels().items() if k.ending and k.ending.name.startswith("stable")]
METHODS = list(dict.fromkeys(find(n).function.__name__ for n in STABLE))
ROUNDOFF = {"float32": 2.0**-24, "float64": 2.0**-53}
BOUND = 64  # of errors in units of eps (cond_t + |t|): what S5 asks of the 99th percentile


def slivers(kind, precision, n=250):
    """Return triangles of which most are thin, in any order of vertices, and rays that hit."""
    random = np.random.default_rng(6)
    triangles = random.normal(size=(n, 3, 3))
    thin = 10.0 ** -random.uniform(0, 5 if precision == "float32" else 12, (n, 1))
    first, last = triangles[:, 0], triangles[:, 1]
    if kind == "needle":
        triangles[:, 2] = last + random.normal(size=(n, 3)) * thin
    elif kind == "cap":
        share = random.uniform(0.3, 0.7, (n, 1))
        triangles[:, 2] = first + share * (last - first) + random.normal(size=(n, 3)) * thin
    elif kind == "far":
        triangles[:, 2] = last + random.normal(size=(n, 3)) * thin**0.3
        triangles = triangles + 10.0 ** random.uniform(0, 3, (n, 1, 1))
    triangles = shuffled(triangles)
    points = np.einsum("ni,nij->nj", random.dirichlet((2, 2, 2), n), triangles)
    origins = points + random.normal(size=(n, 3)) * 2
    data = workload.DATA[precision]
    return [a.astype(data) for a in (triangles, origins, points - origins)]


def shuffled(triangles):
    """Return the vertices of each triangle in an order of its own."""
    random = np.random.default_rng(7)
    return np.stack([random.permutation(each) for each in triangles])


def rational(vector):
    return [Fraction(float(x)) for x in vector]


def condition(triangle, origin, direction):
    """Return t, u, v exactly, each with how much it may change when every input does by 1 eps."""
    (a, b, c), o, d = map(rational, triangle), rational(origin), rational(direction)
    det, u, v, t = truth.exact.numerators(a, b, c, o, d)
    if det == 0:
        return None
    t, u, v = t / det, u / det, v / det
    if t <= 0 or min(u, v, 1 - u - v) < 0:
        return None
    edges = [[y - x for x, y in zip(a, p, strict=True)] for p in (b, c)]
    normal = truth._cross(*edges)
    moved = [
        abs(o[i]) + t * abs(d[i]) + (1 - u - v) * abs(a[i]) + u * abs(b[i]) + v * abs(c[i])
        for i in range(3)
    ]
    along = abs(truth._dot(normal, d))
    rows = normal, truth._cross(d, edges[1]), truth._cross(edges[0], d)
    return {
        what: (float(x), float(truth._dot([abs(part) for part in row], moved) / along))
        for what, x, row in zip("tuv", (t, u, v), rows, strict=True)
    }


def errors(name, precision, pairs, exact, what="t"):
    """Return the errors of t, u or v of the hits, in units of eps (its condition + |it|)."""
    found = rtbench.intersect(name, *pairs, precision)
    eps = ROUNDOFF[precision]
    told = [
        abs(float(value) - right[what][0]) / (eps * (right[what][1] + right[what][0]))
        for value, hit, right in zip(getattr(found, what), found.hit, exact, strict=True)
        if hit and right and eps * right["t"][1] < 0.01 * right["t"][0]
    ]
    assert len(told) > 100
    return np.array(told)


@pytest.mark.parametrize("precision", workload.DATA)
@pytest.mark.parametrize("kind", ["random", "needle", "cap", "far"])
def test_t_is_as_good_as_its_condition_also_on_slivers(kind, precision):
    pairs = slivers(kind, precision)
    exact = [condition(*pair) for pair in zip(*pairs, strict=True)]
    for method in METHODS:
        stable = errors(f"{method}_stable_uv", precision, pairs, exact)
        assert np.percentile(stable, 99) < BOUND / 8
        if kind in ("needle", "cap") and method == "moller_trumbore":
            own = errors(f"{method}_uv", precision, pairs, exact)
            assert np.percentile(own, 99) > 10 * BOUND
    for what in "tuv":  # relative to the ray's origin, and u and v from the edges
        told = errors("half_open_uv", precision, pairs, exact, what)
        assert np.percentile(told, 99) < BOUND / 8
    if kind == "needle":  # from edge functions alone they are lost
        assert np.percentile(errors("pluecker_uv", precision, pairs, exact, "u"), 99) > 10 * BOUND


@pytest.mark.parametrize("precision", workload.DATA)
@pytest.mark.parametrize("method", METHODS)
def test_u_and_v_and_their_tests_are_those_of_the_method(method, precision):
    order = "_uvt" if f"{method}_uvt_uv" in all_kernels() else ""
    for group in (workload.groups(precision)[each] for each in ("random", "edges")):
        names = [f"{method}{ending}_uv" for ending in (order, "_stable", "_stable_whole", "_whole")]
        own, stable, whole, own_whole = (group.answers(find(name), precision) for name in names)
        both = (own[0] == HIT) & (stable[0] == HIT)
        assert both.sum() > 30
        assert ((own[0] == HIT) != (stable[0] == HIT)).sum() <= 1  # t is another one
        assert np.array_equal(np.isin(own[0], (2, 3)), np.isin(stable[0], (2, 3)))
        for values in "uv":
            assert np.array_equal(own[1][values][both], stable[1][values][both])
            assert np.array_equal(whole[1][values], own_whole[1][values], equal_nan=True)
        hit = stable[0] == HIT
        assert np.array_equal(whole[1]["t"][hit], stable[1]["t"][hit])


@pytest.mark.parametrize("name", [n for n in STABLE if n.endswith("_uv")])
def test_an_infinite_denominator_misses(name):
    """u and v would be 0 then, and inside."""
    large = np.array([[[0.0, 0, 2.0**10], [2.0**52, 0, 2.0**10], [0, 2.0**52, 2.0**10]]])
    origin, direction = np.array([[2.0**40, 2.0**40, 0]]), np.array([[0.0, 0, 2.0**10]])
    assert rtbench.intersect(name, large, origin, direction, "float32").hit.all()
    assert not rtbench.intersect(name, large, origin, direction * 2.0**20, "float32").hit.any()


@pytest.mark.parametrize("name", STABLE)
def test_nothing_is_computed_twice(name):
    body = syntax.tree(find(name)).body
    values = [ast.dump(each.value) for each in body if isinstance(each, ast.Assign)]
    assert len(values) == len(set(values)) > 30


def test_what_a_stable_t_costs():
    """Beside Möller and Trumbore's, whose edges and s it finds: one cross, four dots, two steps."""
    own, stable = operations(find("moller_trumbore_uv")), operations(find("moller_trumbore_stable"))
    assert stable["div"] - own["div"] == 2
    assert stable["differences"] == own["differences"]
    assert stable["crosses"] - own["crosses"] == 1


def test_names_of_the_method_and_of_the_ending_do_not_meet(tmp_path):
    source = ast.unparse(syntax.parse(find("moller_trumbore").function))
    for one, other in (("e1x", "crossx"), ("px", "normalx"), ("sx", "longx"), ("qz", "u")):
        source = source.replace(one, other)
    path = tmp_path / "taken.py"
    path.write_text(
        "from rtbench.kernels.pieces import method, pieces\n\n\n"
        '@method(title="Taken", method="Taken", source="this test")\n'
        + source.replace("moller_trumbore", "taken"),
        encoding="utf-8",
    )
    group = workload.groups("float64")["random"]
    pairs = group.triangles, group.origins, group.directions
    for ending in ("stable_uv", "stable_whole_uv"):
        own, renamed = (
            plain.run(find(name), *pairs)
            for name in (f"moller_trumbore_{ending}", f"{path}:taken_{ending}")
        )
        assert str(own) == str(renamed)


@np.errstate(all="ignore")
@pytest.mark.parametrize(
    ("name", "width"),
    [
        ("moller_trumbore_stable_whole_uv", 16),
        ("moller_trumbore_stable_uv", 8),
        ("pluecker_stable_whole", 4),
        ("half_open_uv", 16),
    ],
)
@pytest.mark.parametrize("precision", workload.DATA)
def test_in_lanes_the_answers_are_the_same_bit_for_bit(name, width, precision):
    kernel, chosen = find(name), Packing("pairs", width)
    group = workload.groups(precision)["random"]
    n = len(group.triangles) // width * width
    wide = workload.Group(group.triangles[:n], group.origins[:n], group.directions[:n], np.inf)
    outcome, outputs = wide.answers(kernel, precision)
    triangles = packing.fill_triangles(kernel, precision, chosen, wide.triangles)
    rays = packing.fill_rays(kernel, precision, chosen, wide.origins, wide.directions)
    made = packets.loop(kernel, precision, chosen)
    found = packets.run_once(made, kernel, precision, chosen, (triangles, rays), n)
    hit = outcome == HIT
    assert hit.sum() > 30 and np.array_equal(found[0].reshape(-1) == 0, hit)
    for values, lanes in zip(outputs.values(), found[1:], strict=False):
        assert np.array_equal(values[hit], lanes.reshape(-1)[hit])
