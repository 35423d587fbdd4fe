"""Signs of determinants: by a float64 filter with a proven bound, else by exact summation.

The filter
----------
For d . (p x q) of three-vectors whose components carry up to one rounding each, summed in any
order, with or without fused operations, the error is below gamma_7 times the permanent of the
absolute values (gamma_8 where all three are rounded differences); 10 u times the computed permanent
covers both and the rounding of the bound itself. An operation that underflows errs by at most
2^-1075 and is multiplied by at most one vector afterwards: 2^-1022 (1 + |d| + |p| + |q|).

The exact sum
-------------
First the sum is taken in threefold precision, which decides all but ties. Expanded without
translation, each determinant is a sum of at most 24 products of three given numbers. Such a product
is 2^e times four doubles, exactly: two of Dekker's products of mantissas in [0.5, 1). They are
multiples of 2^-159 below 1, so 40 bits more than 200 places below 2^e are none of theirs. The sum
is taken in slices of 40 bits, from the top down. Slices are whole numbers below 2^40 and at most 96
a level; with what is carried down, at most 128 units of the level above, each level's sum is a
whole number below 2^49, exact. What is left below a level is less than 96 of its units, so a sum
beyond 128 has its sign. Nothing is stored and nothing overflows or underflows: the sign is right
for all finite numbers.

Source: the filter's form is that of Shewchuk 1997; slices from the top: Rump, Ogita and Oishi 2008.
"""

import math

import numpy as np

UNIT_ROUNDOFF = 2.0**-53
SMALLEST_NORMAL = 2.0**-1022
SPLITTER = 134217729.0  # 2^27 + 1
SLICE = 40
UNIT = 2.0**40
BOTTOM = 200  # from 2^e down to where a product has no bits
ENOUGH = 128.0
MODERATE, SMALL = 2.0**300, 2.0**-700  # components and sums that threefold precision can take
THREEFOLD = 2.0**-80
NOTHING = -100000  # below the exponent of every product

# What is subtracted of det(a, b, c) to translate by o: each mode does what the one before does.
# Floats: of whole numbers each would be compiled on its own.
SECOND, THIRD, ALL = 0.0, 1.0, 2.0  # b by o; b and c by o; a, b and c by o


def double(x):
    """Return x as float64; in rational arithmetic x itself."""
    return np.float64(x)


def scaled(x, power):
    """Return x 2^power."""
    return math.ldexp(x, power)


def determinant(d, p, q):
    """Return d . (p x q), and the permanent of the absolute values."""
    yz, zy = p[1] * q[2], p[2] * q[1]
    zx, xz = p[2] * q[0], p[0] * q[2]
    xy, yx = p[0] * q[1], p[1] * q[0]
    value = d[0] * (yz - zy) + d[1] * (zx - xz) + d[2] * (xy - yx)
    permanent = (
        abs(d[0]) * (abs(yz) + abs(zy))
        + abs(d[1]) * (abs(zx) + abs(xz))
        + abs(d[2]) * (abs(xy) + abs(yx))
    )
    return value, permanent


def length_1(x):
    """Return the sum of absolute components."""
    return abs(x[0]) + abs(x[1]) + abs(x[2])


def with_bound(d, p, q):
    """Return d . (p x q) of vectors rounded once at most, and what bounds its error."""
    value, permanent = determinant(d, p, q)
    norms = 1.0 + length_1(d) + length_1(p) + length_1(q)
    return value, 10.0 * permanent * UNIT_ROUNDOFF + SMALLEST_NORMAL * norms


def certain_sign(d, p, q):
    """Return 1 or -1, the sign of d . (p x q), or 0 where rounding may have made it."""
    value, bound = with_bound(d, p, q)
    if abs(value) > bound:  # never where something overflowed: the bound is infinite then
        return 1 if value > 0.0 else -1
    return 0


def exponent(x, y, z):
    """Return an e with |x y z| < 2^e, NOTHING where that is 0."""
    if x == 0.0 or y == 0.0 or z == 0.0:
        return NOTHING
    return math.frexp(x)[1] + math.frexp(y)[1] + math.frexp(z)[1]


def product(a, b):
    """Return a b rounded, and what rounding left out (Dekker 1971), of mantissas exact."""
    high = a * b
    large = SPLITTER * a
    a_high = large - (large - a)
    a_low = a - a_high
    large = SPLITTER * b
    b_high = large - (large - b)
    b_low = b - b_high
    return high, a_low * b_low - (((high - a_high * b_high) - a_low * b_high) - a_high * b_low)


def bits(x, factor):
    """Return the 40 bits before the point of x times a power of two, with its sign."""
    whole = np.trunc(x * factor)
    return whole - np.trunc(whole / UNIT) * UNIT


def slice_of_product(x, y, z, level):
    """Return the slice of x y z whose unit is 2^level."""
    shift = exponent(x, y, z) - level
    if shift <= 0 or shift > BOTTOM:
        return 0.0
    factor = scaled(1.0, shift)
    high, low = product(math.frexp(x)[0], math.frexp(y)[0])
    third = math.frexp(z)[0]
    one, two = product(high, third)
    three, four = product(low, third)
    return bits(one, factor) + bits(two, factor) + bits(three, factor) + bits(four, factor)


def slice_of_determinant(a, b, c, level):
    """Return the slices of the six products of a . (b x c), summed."""
    total = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        total += slice_of_product(a[i], b[j], c[k], level)
        total -= slice_of_product(a[i], b[k], c[j], level)
    return total


def slice_of_all(a, b, c, o, mode, level):
    """Return the slices of all products, summed."""
    total = slice_of_determinant(a, b, c, level) - slice_of_determinant(a, o, c, level)
    if mode >= THIRD:
        total -= slice_of_determinant(a, b, o, level)
    if mode == ALL:
        total -= slice_of_determinant(o, b, c, level)
    return total


def exponents(a, b, c):
    """Return the greatest and the least exponent of the products of a . (b x c)."""
    greatest, least = NOTHING, -NOTHING
    for i in range(3):
        for j in range(3):
            if i != j:
                each = exponent(a[i], b[j], c[3 - i - j])
                greatest = max(greatest, each)
                if each != NOTHING:
                    least = min(least, each)
    return greatest, least


def sliced_value(a, b, c, o, mode):
    """Return what `exact_value` does, for any finite numbers."""
    greatest, least = exponents(a, b, c)
    more, less = exponents(a, o, c)
    greatest, least = max(greatest, more), min(least, less)
    if mode >= THIRD:
        more, less = exponents(a, b, o)
        greatest, least = max(greatest, more), min(least, less)
    if mode == ALL:
        more, less = exponents(o, b, c)
        greatest, least = max(greatest, more), min(least, less)
    if greatest == NOTHING:
        return 0.0, 0
    level = greatest - SLICE
    total = slice_of_all(a, b, c, o, mode, level)
    while abs(total) <= ENOUGH and level > least - BOTTOM:
        level -= SLICE
        total = total * UNIT + slice_of_all(a, b, c, o, mode, level)
    for _ in range(2):  # the sign is sure: two more slices make 46 bits at least
        level -= SLICE
        total = total * UNIT + slice_of_all(a, b, c, o, mode, level)
    return total, level


def added(sums, x):
    """Return three sums with x added to the first, and what rounding left out to the next."""
    total, rest = two_sum(sums[0], x)
    second, rest = two_sum(sums[1], rest)
    return total, second, sums[2] + rest


def two_sum(a, b):
    """Return a + b rounded, and what rounding left out (Knuth 1969)."""
    total = a + b
    from_b = total - a
    return total, (a - (total - from_b)) + (b - from_b)


def with_product(sums, magnitude, x, y, z):
    """Return three sums with x y z added, and the sum of magnitudes."""
    high, low = product(x, y)
    one, two = product(high, z)
    three, four = product(low, z)
    return added(added(added(added(sums, one), two), three), four), magnitude + abs(one)


def with_determinant(sums, magnitude, a, b, c, factor):
    """Return three sums with the six products of a . (b x c) times a factor of 1 or -1 added."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        sums, magnitude = with_product(sums, magnitude, factor * a[i], b[j], c[k])
        sums, magnitude = with_product(sums, magnitude, -factor * a[i], b[k], c[j])
    return sums, magnitude


def compensated_value(a, b, c, o, mode):
    """Return the same sum in threefold precision (Ogita, Rump, Oishi 2005), 0 if it may be off.

    The error is below gamma_200^3 < 2^-130 of the sum of magnitudes, beside a rounding; between the
    limits of size neither overflow nor what underflows can matter.
    """
    sums, magnitude = with_determinant((0.0, 0.0, 0.0), 0.0, a, b, c, 1.0)
    sums, magnitude = with_determinant(sums, magnitude, a, o, c, -1.0)
    if mode >= THIRD:
        sums, magnitude = with_determinant(sums, magnitude, a, b, o, -1.0)
    if mode == ALL:
        sums, magnitude = with_determinant(sums, magnitude, o, b, c, -1.0)
    value = sums[0] + (sums[1] + sums[2])
    largest = max(length_1(a), length_1(b), length_1(c), length_1(o))
    fine = largest < MODERATE and abs(value) > SMALL and abs(value) > THREEFOLD * magnitude
    return value if fine else 0.0


def exact_value(a, b, c, o, mode):
    """Return m, e with det(a, b, c), translated by o as the mode says, = m 2^e, to 46 bits.

    The sign of m is exact, and so is m = 0. THIRD: a . ((b - o) x (c - o)); ALL: a - o too;
    SECOND: a . ((b - o) x c).
    """
    value = compensated_value(a, b, c, o, mode)
    if value != 0.0:
        return value, 0
    return sliced_value(a, b, c, o, mode)


def sign(x):
    """Return 1, 0 or -1."""
    return 1 if x > 0 else (-1 if x < 0 else 0)


def tie_sign(p, q, d):
    """Return how an origin moved by (e, e^2, e^3) sees the edge from p to q that d touches.

    The derivative of d . ((p - o) x (q - o)) by o is (p - q) x d: its first component that is not
    0 decides, exactly; 0 where the edge is parallel to d.

    Source: simulation of simplicity, Edelsbrunner and Mücke 1990.
    """
    x = sign(exact_value((1.0, 0.0, 0.0), p, d, q, SECOND)[0])
    if x != 0:
        return x
    y = sign(exact_value((0.0, 1.0, 0.0), p, d, q, SECOND)[0])
    if y != 0:
        return y
    return sign(exact_value((0.0, 0.0, 1.0), p, d, q, SECOND)[0])
