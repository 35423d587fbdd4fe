"""The exact answers, by rationals or proven in float64: no kernel takes part."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from bounded import Bounded

from rtbench.accuracy import certified, exact


def hits(triangles, origins, directions, domain, tmax=np.inf) -> np.ndarray:
    """Return which lines (domain "line") or rays with 0 < t < tmax ("ray") hit, exactly.

    Parameters
    ----------
    triangles : (N, 3, 3) array
    origins, directions : (N, 3) arrays
        Of float32 or float64; t is in units of the direction.
    domain : str
        ``line`` or ``ray``.
    tmax : float

    Returns
    -------
    (N,) bool array
    """
    found = certified.line_hits(triangles, origins, directions)
    if domain == "line":
        return found
    at = np.flatnonzero(found)
    reference = certified.reference(triangles[at], origins[at], directions[at])
    far = (reference.t > reference.t_error) & (tmax - reference.t > reference.t_error * (1 + 1e-9))
    near = (reference.t < -reference.t_error) | (tmax - reference.t < -reference.t_error)
    found[at] = far
    for i in at[~(far | near)]:
        det, _, _, t = exact.numerators(
            *triangles[i].tolist(), origins[i].tolist(), directions[i].tolist()
        )
        found[i] = t / det > 0 and (np.isinf(tmax) or t / det < Fraction(tmax))
    return found


def weights(triangle, point, direction=None) -> tuple[Fraction, Fraction] | None:
    """Return exactly u and v of a point, brought into the plane along the normal or a direction.

    Parameters
    ----------
    triangle : (3, 3) array
    point : (3,) array
    direction : (3,) array, optional

    Returns
    -------
    tuple of Fraction or None
        None where there is no such point.
    """
    a, b, c, p = ([Fraction(float(x)) for x in vector] for vector in (*triangle, point))
    ab, ac = ([x - y for x, y in zip(e, a, strict=True)] for e in (b, c))
    along = _cross(ab, ac) if direction is None else [Fraction(float(x)) for x in direction]
    return exact.line_hit(a, b, c, p, along)[2:] if any(along) else (None, None)


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def inside(triangles, points, axes=None) -> np.ndarray:
    """Return which points lie in their triangles, brought into the plane, exactly.

    Parameters
    ----------
    triangles : (N, 3, 3) array
    points : (N, 3) array
    axes : (N,) int array, optional
        The axis along which each is brought there; along the normal if not given.

    Returns
    -------
    (N,) bool array
    """
    if axes is not None:
        return certified.line_hits(triangles, points, np.eye(3)[axes])
    a, b, c, p = (
        [Bounded(vector[:, axis].astype(float)) for axis in range(3)]
        for vector in (*np.moveaxis(triangles, 1, 0), points)
    )
    ab, ac, ap = ([x - y for x, y in zip(e, a, strict=True)] for e in (b, c, p))
    normal = _cross(ab, ac)
    u, v = _dot(_cross(ap, ac), normal), _dot(_cross(ab, ap), normal)
    zero = Bounded(np.zeros(1))
    within = (u >= zero) & (v >= zero) & (_dot(normal, normal) - u - v >= zero)
    within = within & (_dot(normal, normal) > zero)
    for i in np.flatnonzero(~within.sure):
        u, v = weights(triangles[i], points[i])
        within.computed[i] = u is not None and u >= 0 and v >= 0 and u + v <= 1
    return within.computed
