"""Signs and values of determinants against rationals, over the whole range of float64."""

from fractions import Fraction

import numpy as np
import pytest

from rtbench.kernels import exact_signs
from rtbench.kernels.exact_signs import ALL, SECOND, THIRD
from rtbench.kernels.where import where


def rational(a, b, c, o, mode):
    a, b, c, o = ([Fraction(float(x)) for x in vector] for vector in (a, b, c, o))
    b = [x - y for x, y in zip(b, o, strict=True)]
    if mode != SECOND:
        c = [x - y for x, y in zip(c, o, strict=True)]
    if mode == ALL:
        a = [x - y for x, y in zip(a, o, strict=True)]
    return sum(a[i - 2] * (b[i - 1] * c[i] - b[i] * c[i - 1]) for i in range(3))


def vectors(kind, seed, n=60):
    """Return four three-vectors, n times: everyday ones, ties, or of any size at all."""
    draw = np.random.default_rng(seed)
    if kind == "everyday":
        return draw.normal(size=(n, 4, 3))
    if kind == "whole numbers":  # many determinants are 0
        return draw.integers(-2, 3, (n, 4, 3)).astype(float)
    if kind == "nearly in a plane":  # the third vector made of the others, and rounded
        found = draw.normal(size=(n, 4, 3))
        weights = draw.normal(size=(n, 2, 1))
        base = found[:, 3]
        found[:, 2] = base + (weights * (found[:, :2] - base[:, None])).sum(axis=1)
        return found
    sizes = 10.0 ** draw.uniform(-320, 308, (n, 4, 3))
    found = sizes * draw.choice([-1.0, 0.0, 1.0, 1.0], (n, 4, 3))
    found[: n // 3, 3] = found[: n // 3, 1]  # differences that are 0
    return found


KINDS = ("everyday", "whole numbers", "nearly in a plane", "of any size")


@pytest.mark.parametrize("mode", [SECOND, THIRD, ALL])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["exact_value", "sliced_value"])
@np.errstate(all="ignore")
def test_values_are_right_to_46_bits_and_zeros_are_zeros(name, kind, mode):
    zeros = 0
    for given in vectors(kind, 7):
        mantissa, power = getattr(exact_signs, name)(*given, mode)
        exact = rational(*given, mode)
        found = Fraction(float(mantissa)) * Fraction(2) ** int(power)
        assert abs(found - exact) <= abs(exact) * Fraction(1, 2**46)
        zeros += exact == 0
    assert zeros > 5 or kind not in ("whole numbers", "of any size")


@pytest.mark.parametrize("kind", KINDS)
@np.errstate(all="ignore")
def test_a_certain_sign_is_right(kind):
    sure = 0
    for d, p, q, o in vectors(kind, 8, 200):
        found = exact_signs.certain_sign(d, p - o, q - o)
        if found:
            sure += 1
            assert found == exact_signs.sign(rational(d, p, q, o, THIRD))
    assert sure > (150 if kind == "everyday" else 3)


def test_compensated_values_leave_ties_to_the_slices():
    """What is 0, or far below a roundoff of a roundoff of its terms, threefold precision leaves."""
    a, b, c, o = (1.0, 2.0, 3.0), (0.5, 1.0, 1.5), (2.0, 1.0, 7.0), (0.0, 0.0, 0.0)
    assert exact_signs.compensated_value(a, b, c, o, THIRD) == 0
    assert exact_signs.sliced_value(a, b, c, o, THIRD)[0] == 0
    tiny = (0.5, 1.0, np.nextafter(1.5, 2))
    assert exact_signs.compensated_value(a, tiny, c, o, THIRD) != 0


@pytest.mark.parametrize("seed", range(3))
def test_where_a_slender_triangle_is_met_equals_rationals(seed):
    """Needles down to 1e-14 of their length: t, u and v to within a few roundings."""
    draw = np.random.default_rng(seed)
    for _ in range(40):
        a, along = draw.normal(size=(2, 3))
        b, c = a + along, a + along * draw.uniform(0.3, 2) + draw.normal(size=3) * 1e-14
        weights = draw.dirichlet((1, 1, 1))
        o = draw.normal(size=3) * 3
        d = weights @ np.stack([a, b, c]) - o
        exact = [[Fraction(float(x)) for x in vector] for vector in (a, b, c, o, d)]
        e, f, s = ([x - y for x, y in zip(v, exact[0], strict=True)] for v in exact[1:4])
        direction = exact[4]

        def det(x, y, z):
            return sum(x[i - 2] * (y[i - 1] * z[i] - y[i] * z[i - 1]) for i in range(3))

        across = det(direction, e, f)
        if across == 0:
            continue
        right = (
            -det(s, e, f) / across,
            det(direction, s, f) / across,
            det(direction, e, s) / across,
        )
        for found, wanted in zip(where(a, b, c, o, d), right, strict=True):
            wanted = min(max(wanted, 0), 1) if wanted is not right[0] else wanted
            assert abs(Fraction(float(found)) - wanted) <= abs(wanted) * Fraction(1, 2**44)
