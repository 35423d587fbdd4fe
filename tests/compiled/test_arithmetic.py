"""Every kernel in float32, float64 and mixed against exact t, u, v, with first-order error bounds.

u is the unit roundoff, |.| the sum of absolute components. With e1, e2 the edges, n = e1 x e2,
s = orig - v0, and det = dir . n, a normal that is stored at unit length errs by at most about
8 u |e1||e2| / |n| (7 roundings of the product and the length, 1 of the quotient), and so

    plane: the signed distance of a point x errs by K u |e1||e2| / |n| (|x| + |v0|) =: side(x),
    t:     K u |e1||e2| / |det| (|s| + |orig| + |v0| + |t||dir|)

holds for all methods with K = 16 (Möller's t needs 10, 8 more for det, and not |orig| + |v0|).
u and v are bounded from what each method computes them of. The bounds are not proofs (terms in
u^2 are left out): they tell a wrong term, or one step in float32 among float64, from
rounding, which comes to a fortieth of them.
"""

import functools
from fractions import Fraction

import numpy as np
import pytest

from rtbench.accuracy.exact import line_hit
from rtbench.compiled.intersect import intersect
from rtbench.kernels.registry import all_kernels

# Bounds of methods of pieces are derived from their trees, in tests/kernels/running_error.py.
LISTINGS = [name for name, each in all_kernels().items() if not each.ending and each.exact]
KERNELS = [name for name in LISTINGS if all_kernels()[name].domain == "line"]
METHODS = [
    f"{name}_uv"
    for name, each in all_kernels().items()
    if each.ending and name == each.function.__name__
]
ROUNDOFF = {"float32": 2.0**-24, "float64": 2.0**-53, "mixed": 2.0**-53}
DATA = {"float32": np.float32, "float64": np.float64, "mixed": np.float32}
K = 16
N = 500


@functools.cache
def safe_pairs(data):
    """Return N pairs that hit well inside, and exact t, u, v of each."""
    random = np.random.default_rng(31)
    pairs, truths = [], []
    while len(pairs) < N:
        tri = random.random((3, 3)).astype(data)
        org, end = random.random((2, 3)).astype(data)
        dir = ((end - org) / np.linalg.norm(end - org)).astype(data)
        truth = line_hit(*tri, org, dir)
        edges = np.abs([tri[1] - tri[0], tri[2] - tri[0], tri[2] - tri[1]])
        normal = np.cross(tri[1] - tri[0], tri[2] - tri[0])
        slope = abs(normal @ dir) / np.linalg.norm(normal)
        inside = truth.hit and min(truth.u, truth.v, 1 - truth.u - truth.v) > 0.001
        if inside and edges.min() > 0.01 and slope > 0.01:
            pairs.append((tri, org, dir))
            truths.append(truth[1:])
    return tuple(np.stack(each) for each in zip(*pairs, strict=True)), truths


def size(vectors):
    return np.abs(vectors).sum(axis=-1)


class Bounds:
    """What t, u and v of each method may be off by."""

    def __init__(self, precision):
        (tris, org, dir), truths = safe_pairs(DATA[precision])
        self.unit = ROUNDOFF[precision]
        self.org, self.dir = org.astype(float), dir.astype(float)
        self.v0, v1, v2 = (tris[:, i].astype(float) for i in range(3))
        self.e1, self.e2, self.s = v1 - self.v0, v2 - self.v0, self.org - self.v0
        self.normal = np.cross(self.e1, self.e2)
        self.length = np.linalg.norm(self.normal, axis=1)
        self.det = np.abs((self.normal * self.dir).sum(1))
        self.t_true, self.u_true, self.v_true = np.array(truths, float).T
        self.edges = size(self.e1) * size(self.e2)
        reach = size(self.s) + size(self.org) + size(self.v0)
        reach = reach + np.abs(self.t_true) * size(self.dir)
        self.t = K * self.unit * self.edges / self.det * reach

    def moller(self):
        """u = s.(dir x e2) / det and v = dir.(s x e1) / det."""
        rounding = K * self.unit * size(self.dir) / self.det
        u = rounding * (size(self.s) * size(self.e2) + np.abs(self.u_true) * self.edges)
        v = rounding * (size(self.s) * size(self.e1) + np.abs(self.v_true) * self.edges)
        return u, v

    def _projected(self):
        """Return e1, e2, s, orig and dir on the two axes of the projection."""
        i0 = np.argmax(np.abs(self.normal), axis=1)
        axes = np.array([[1, 2], [0, 2], [0, 1]])[i0]
        vectors = self.e1, self.e2, self.s, self.org, self.dir
        return [np.take_along_axis(x, axes, 1).T for x in vectors]

    def badouel(self):
        """v = beta from the point's two coordinates, u = alpha from one of them and beta."""
        (uu1, vv1), (uu2, vv2), s, org, dir = (np.abs(x) for x in self._projected())
        point = (self.t * dir + K * self.unit * (org + self.t_true * dir)).max(axis=0)
        at = s + np.abs(self.t_true) * dir  # uu0 and vv0 at most
        area = np.abs(self.normal).max(axis=1)
        products = at[1] * uu1 + at[0] * vv1 + np.abs(self.v_true) * (vv2 * uu1 + uu2 * vv1)
        v = (point * (uu1 + vv1) + K * self.unit * products) / area
        u = (point + K * self.unit * (at[0] + uu2) + uu2 * v) / uu1
        return u, v

    def chirkov(self):
        """u = b / (dd A), v = a / (dd A), a and b from the sides of orig and end (rounded)."""
        e1, e2, s, _, dir = (np.abs(x) for x in self._projected())
        end = size(self.org) + size(self.dir)
        side = K * self.unit * self.edges / self.length * (end + size(self.v0))
        across = self.det / self.length
        source = np.abs(self.t_true) * across
        area = np.abs(self.normal).max(axis=1)
        denominator = 2 * side * area + K * self.unit * across * (e1[0] * e2[1] + e1[1] * e2[0])

        def weight(edge, value):
            along = dir[0] * edge[1] + dir[1] * edge[0]
            base = s[0] * edge[1] + s[1] * edge[0]
            above = side * (along + 2 * base) + K * self.unit * (source * along + across * base)
            above = above + K * self.unit * source * end * (edge[0] + edge[1])
            return (above + np.abs(value) * denominator) / (across * area)

        return weight(e2, self.u_true), weight(e1, self.v_true)


@pytest.mark.parametrize("precision", DATA)
@pytest.mark.parametrize("name", KERNELS)
def test_errors_stay_below_the_bounds_of_the_arithmetic(name, precision):
    pairs, truths = safe_pairs(DATA[precision])
    found = intersect(name, *pairs, precision=precision, tmin=-np.inf)
    assert found.hit.all()
    bounds = Bounds(precision)
    outputs, allowed = [found.t], [bounds.t]
    if name.endswith("_uv"):
        outputs += [found.u, found.v]
        allowed += getattr(bounds, name.removesuffix("_uv").rstrip("0123"))()
    for column, (values, bound) in enumerate(zip(outputs, allowed, strict=True)):
        errors = np.array(
            [
                float(abs(Fraction(float(value)) - truth[column]))
                for value, truth in zip(values, truths, strict=True)
            ]
        )
        assert (errors <= bound).all(), (errors / bound).max()
        # An error of 0 everywhere would mean that nothing was computed in this precision.
        assert (errors > 0).mean() > 0.5


@pytest.mark.parametrize("name", [*LISTINGS, *METHODS, "angle_sum"])
def test_mixed_is_float64_on_float32_data_to_the_last_bit(name):
    pairs, _ = safe_pairs(np.float32)
    mixed, double, single = (
        intersect(name, *pairs, precision=p) for p in ("mixed", "float64", "float32")
    )
    assert np.array_equal(mixed.outcome, double.outcome)
    for field in "tuv":
        a, b = getattr(mixed, field), getattr(double, field)
        assert a.dtype == b.dtype == np.float64
        assert np.array_equal(a, b, equal_nan=True)
    assert not np.array_equal(mixed.t, single.t)


@pytest.mark.parametrize("precision", DATA)
def test_methods_agree_on_which_pairs_hit(precision):
    """All pairs of a draw that are not within a thousandth of an edge."""
    random = np.random.default_rng(77)
    tris = random.random((3000, 3, 3)).astype(DATA[precision])
    org, end = random.random((2, 3000, 3)).astype(DATA[precision])
    truths = [line_hit(*pair) for pair in zip(*tris.swapaxes(0, 1), org, end - org, strict=True)]
    clear = np.array(
        [x.t is not None and min(abs(y) for y in (x.u, x.v, 1 - x.u - x.v)) > 1e-3 for x in truths]
    )
    expected = np.array([x.hit for x in truths])[clear]
    assert 200 < expected.sum() < clear.sum()
    for name in KERNELS:
        found = intersect(name, tris, org, end - org, precision=precision, tmin=-np.inf)
        wrong = int((found.hit[clear] != expected).sum())
        assert wrong == 0, name
