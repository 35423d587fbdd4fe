"""Which exact numbers the oracle computes in, and the way from and to floats.

Whole numbers over one common denominator are about five times as fast as fractions, which reduce
after every operation. gmpy2 is taken where it is installed: it pays once numbers have a thousand
digits, as those that span the range of float64 do.
"""

import math
from collections.abc import Sequence
from fractions import Fraction

try:
    from gmpy2 import mpz as Integer
except ImportError:
    Integer = int

Vector = Sequence[float] | Sequence[Fraction]
Ratio = tuple[int, int]
"""Numerator and denominator, not reduced; the denominator is not 0 but may be negative."""


def over_one_denominator(*vectors: Vector) -> tuple[list[list[int]], int]:
    """Return vectors as whole numbers over one common denominator, and that denominator.

    Parameters
    ----------
    *vectors : sequence of finite float, int or Fraction

    Returns
    -------
    tuple
        Lists of `Integer`, and a positive `Integer`.

    Raises
    ------
    ValueError, OverflowError
        If a number is not finite.
    """
    ratios = [[x.as_integer_ratio() for x in vector] for vector in vectors]
    common = math.lcm(*[below for vector in ratios for _, below in vector])
    whole = [[Integer(above * (common // below)) for above, below in vector] for vector in ratios]
    return whole, Integer(common)


def same(a: Ratio, b: Ratio) -> bool:
    """Tell whether two ratios are the same rational."""
    return a[0] * b[1] == b[0] * a[1]


def nearest_float(above: int, below: int) -> float:
    """Round a ratio to float64, to nearest even; to infinity beyond its range.

    Parameters
    ----------
    above, below : Integer
        Numerator and denominator; the latter not 0.

    Returns
    -------
    float
    """
    try:
        # Python rounds the quotient of two integers once, subnormal numbers included.
        return int(above) / int(below)
    except OverflowError:
        return math.inf if (above > 0) == (below > 0) else -math.inf
