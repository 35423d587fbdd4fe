"""Numbers computed as a kernel computes them, each with a bound of what rounding did to it.

Running error analysis (Wilkinson 1986; Higham 2002, section 3.3). A computed value x stands for the
number X that the same formula gives without any rounding, and |x - X| <= e. Where z = fl(x op y),
|z - (x op y)| <= u |z| (u = 2^-24 or 2^-53; rounding to nearest moves a number by at most u times
the result), so that

    x + y, x - y:  e_z = e_x + e_y + u |z|
    x * y:         e_z = |x| e_y + |y| e_x + e_x e_y + u |z|
    x / y:         e_z = (e_x + |x / y| e_y) / (|y| - e_y) + u |z|, none where |y| <= e_y
    sqrt x:        e_z = e_x / sqrt(x) + u |z|
    arccos x:      e_z = how far arccos gets within e_x of x, + 4 u |z| (libm's own error)

Products and quotients that underflow err by half a smallest number more. The bounds are computed
in float64 and made larger by 2^-45 of themselves each time, which is more than their own roundings
take away.
"""

from __future__ import annotations

import numpy as np

LARGER = 1 + 2.0**-45


def values(x):
    """Return a number's computed value."""
    return x.value if isinstance(x, Bounded) else x


def errors(x):
    """Return how far the computed value may be off; 0 of a number that is exact."""
    return x.error if isinstance(x, Bounded) else 0.0


class Truth:
    """What a comparison computes to, and where it is sure that without rounding it is the same."""

    def __init__(self, computed, sure):
        self.computed, self.sure = computed, sure

    def __and__(self, other):
        a, b = self, other
        sure = (a.sure & b.sure) | (a.sure & ~a.computed) | (b.sure & ~b.computed)
        return Truth(a.computed & b.computed, sure)

    def __or__(self, other):
        return ~(~self & ~other)

    def __invert__(self):
        return Truth(~self.computed, self.sure)

    def __ne__(self, other):
        return Truth(self.computed ^ other.computed, self.sure & other.sure)

    __hash__ = None


class Bounded(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of computed numbers and the bounds of their errors.

    Parameters
    ----------
    value : float32 or float64 array
    error : float64 array or number
        Of the same shape; none if not given.
    """

    def __init__(self, value, error=0.0):
        self.value = np.asarray(value)
        self.error = np.broadcast_to(np.asarray(error, np.float64), self.value.shape).copy()

    def astype(self, dtype):
        """Return the numbers in another precision; what that rounds is an error."""
        value = self.value.astype(dtype)
        moved = np.abs(value.astype(np.float64) - self.value.astype(np.float64))
        return Bounded(value, (self.error + moved) * LARGER)

    def __array_ufunc__(self, ufunc, method, *inputs, **more):
        if method != "__call__" or more or ufunc not in UFUNCS:
            return NotImplemented
        with np.errstate(all="ignore"):
            return UFUNCS[ufunc](*inputs)


def _rounded(z, error, underflow=False):
    z = np.asarray(z)
    size = np.abs(z).astype(np.float64)
    error = error + np.finfo(z.dtype).eps / 2 * size
    limits = np.finfo(z.dtype)
    if underflow is not False:
        error = error + np.where(
            underflow & (size < limits.smallest_normal), float(limits.smallest_subnormal), 0.0
        )
    return Bounded(z, error * LARGER)


def _wide(x):
    return np.abs(np.asarray(values(x), np.float64))


def _add(x, y):
    z = values(x) + values(y)
    exact = np.isinf(_wide(x)) | np.isinf(_wide(y))  # infinity stays what it is
    found = _rounded(z, errors(x) + errors(y))
    found.error = np.where(exact, errors(x) + errors(y), found.error)
    return found


def _subtract(x, y):
    return _add(x, -y)


def _multiply(x, y):
    z = values(x) * values(y)
    a, b = _wide(x), _wide(y)
    error = a * errors(y) + b * errors(x) + errors(x) * errors(y)
    found = _rounded(z, error, (a > 0) & (b > 0))
    infinite = (np.isinf(a) & (b > errors(y))) | (np.isinf(b) & (a > errors(x)))
    found.error = np.where(infinite, 0.0, found.error)
    return found


def _divide(x, y):
    z = values(x) / values(y)
    below = _wide(y) - errors(y)
    quotient = _wide(z) * (1 + np.finfo(np.asarray(z).dtype).eps)
    error = np.where(below > 0, (errors(x) + quotient * errors(y)) / below, np.inf)
    return _rounded(z, error, _wide(x) > 0)


def _sqrt(x):
    z = np.sqrt(values(x))
    return _rounded(z, np.where(errors(x) > 0, errors(x) / z.astype(np.float64), 0.0))


def _arccos(x):
    z = np.arccos(values(x))
    wide = np.asarray(values(x), np.float64)
    ends = [np.arccos(np.clip(wide + sign * errors(x), -1, 1)) for sign in (-1, 1)]
    middle = np.arccos(np.clip(wide, -1, 1))
    reach = np.maximum(np.abs(ends[0] - middle), np.abs(ends[1] - middle)) + 2.0**-50
    found = _rounded(z, reach)
    found.error = found.error + 3 * np.finfo(z.dtype).eps * _wide(z)
    return found


def _compared(compare):
    def decide(x, y):
        a, b = values(x), values(y)
        gap = np.abs(np.asarray(b, np.float64) - np.asarray(a, np.float64))
        room = errors(x) + errors(y)
        # Of two numbers without error the comparison is what it is, equal ones included.
        sure = (gap > room * LARGER) | ((room == 0) & ~np.isnan(gap))
        infinite = np.isinf(np.asarray(a, np.float64)) ^ np.isinf(np.asarray(b, np.float64))
        return Truth(compare(a, b), sure | (infinite & np.isfinite(room)))

    return decide


UFUNCS = {
    np.add: _add,
    np.subtract: _subtract,
    np.multiply: _multiply,
    np.true_divide: _divide,
    np.negative: lambda x: Bounded(-values(x), errors(x)),
    np.absolute: lambda x: Bounded(np.abs(values(x)), errors(x)),
    np.sqrt: _sqrt,
    np.arccos: _arccos,
    np.less: _compared(np.less),
    np.less_equal: _compared(np.less_equal),
    np.greater: _compared(np.greater),
    np.greater_equal: _compared(np.greater_equal),
    np.equal: _compared(np.equal),
    np.not_equal: _compared(np.not_equal),
}


def choose(test, yes, no):
    """Return ``yes if test else no``; where the test is not sure the other one may be right.

    Of whole numbers, axes that is, each is as good as the other.
    """
    if not isinstance(yes, Bounded):
        return np.where(test.computed if isinstance(test, Truth) else test, yes, no)
    pick = np.where(test.computed, values(yes), values(no))
    own = np.where(test.computed, errors(yes), errors(no))
    other = np.where(test.computed, errors(no), errors(yes))
    apart = np.abs(np.asarray(values(yes), np.float64) - np.asarray(values(no), np.float64))
    hull = np.maximum(own, (apart + other) * LARGER)
    return Bounded(pick, np.where(test.sure, own, hull))


def pick(vector, axis):
    """Return the component of a tuple of three that each pair's own axis names."""
    if isinstance(axis, int):
        return vector[axis]
    return Bounded(
        np.choose(axis, [each.value for each in vector]),
        np.choose(axis, [each.error for each in vector]),
    )


def sign(one, x) -> Bounded:
    """Return 1 with the sign bit of x, -0 included; a sign that is not sure may be the other."""
    return Bounded(np.copysign(values(one), values(x)), np.where(_wide(x) > errors(x), 0.0, 2.0))


def least(first, *others) -> Bounded:
    """Return Python's min: the first of equals, and the first one where it is NaN."""
    for other in others:
        first = _one_of(np.less, other, first)
    return first


def greatest(first, *others) -> Bounded:
    """Return Python's max."""
    for other in others:
        first = _one_of(np.greater, other, first)
    return first


def _one_of(compare, x, y) -> Bounded:
    """Return x where it compares so with y, else y; neither comes off by more than the two are."""
    test = _compared(compare)(x, y)
    own = np.where(test.computed, errors(x), errors(y))
    either = np.maximum(errors(x), errors(y))
    return Bounded(np.where(test.computed, values(x), values(y)), np.where(test.sure, own, either))
