"""What a method gives of itself: a denominator, and the numerators of t and of two weights.

A method gives its pieces once, and has every ending (`rtbench.kernels.endings`) at that::

    @method(title=..., method=..., source=...)
    def my_method(tri, ray):
        ...
        return pieces(denominator, t, b, c)

b is the weight of v1 times the denominator, c that of v2.

A method that meets the triangle's plane first takes ``(tri, ray, along, scale)`` and writes its
point as ``ray.orig * scale + ray.dir * along``. With the division first that is O + t D (scale is
1 and drops out); with the division moved it is the same point times the denominator. So b and c
are divided by scale, in any ending. The stable endings are not of these, since a point of the plane
is as good as its t, nor of methods that do not keep the vertices.

Pieces named in ``pieces(...)``:

``area``
    A second denominator of b and c (Badouel's and Keidy's second division).
``a``
    The weight of v0, where the method tests three signs rather than b + c <= 1.
``normal``
    (x, y, z) of a normal of the triangle, of any length, where the method has one.

Source: Havel 2008, sections 3 and 4.2.4.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable

from rtbench.kernels.contract import ARGUMENTS, STORED, Kernel, check_name
from rtbench.kernels.endings import ENDINGS, suffix

ORDERS = {"tuv": "t first", "uvt": "u, v first"}
POINT_PARAMETERS = [*ARGUMENTS, "along", "scale"]


def pieces(denominator, t, b, c, *, a=None, area=None, normal=None):
    """Name the pieces of a method; see the module's text.

    Plain Python sees the tuple of them all, absent ones None.
    """
    return denominator, t, b, c, a, area, normal


def gives_normal(function: Callable) -> bool:
    """Tell whether a method's pieces have a normal."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    return any(isinstance(n, ast.keyword) and n.arg == "normal" for n in ast.walk(tree))


def method(
    *,
    title: str,
    method: str,
    source: str,
    prepare: Callable | None = None,
    stored: str = "none",
    order: str = "tuv",
) -> Callable[[Callable], Callable]:
    """Declare the function below to give the pieces of a method named as the function.

    It becomes a kernel with every ending that fits, ``NAME`` with the method's own order of tests
    and the division first, each of them once returning t alone and once t, u and v (``_uv``). Its
    body is assignments alone, its last line ``return pieces(...)``.

    Parameters
    ----------
    title, method, source, prepare, stored
        As in `rtbench.kernels.contract.Kernel`.
    order : str
        One of ORDERS: what the published method tests first.

    Returns
    -------
    callable
        A decorator that returns the function unchanged, its ``kernels`` attribute set.

    Raises
    ------
    ValueError
        If a declaration is not one the rest of rtbench can honour.
    """
    if order not in ORDERS:
        raise ValueError(f"order {order!r}: allowed are {', '.join(ORDERS)}")
    if stored not in STORED:
        raise ValueError(f"stored {stored!r}: allowed are {', '.join(STORED)}")

    def declare(function: Callable) -> Callable:
        parameters = list(inspect.signature(function).parameters)
        name = function.__name__
        if parameters not in ([*ARGUMENTS], POINT_PARAMETERS):
            raise ValueError(
                f"method {name!r} must take (tri, ray) or ({', '.join(POINT_PARAMETERS)})"
            )
        check_name(name)
        function.kernels = tuple(
            Kernel(
                name + suffix(ending, order) + uv,
                function,
                f"{title}; {ending.title}{what}",
                method,
                "ray" if ending.takes_tmax else None,
                ending.outcomes,
                outputs,
                source,
                prepare,
                stored=stored,
                ending=ending,
            )
            for ending in ENDINGS
            if ending.takes_tmax or parameters == POINT_PARAMETERS
            if not ending.reads_vertices or (stored == "none" and parameters == [*ARGUMENTS])
            for uv, what, outputs in (
                ("", "", ("t",)),
                ("_uv", ", with u and v", ("t", "u", "v")),
            )
        )
        return function

    return declare
