"""What Badouel and Chirkov store beside the vertices: the triangle's plane and its projection."""

from rtbench.kernels.projection import dominant
from rtbench.kernels.vectors import corners, cross, difference, dot, length, quotient


def stored_plane(tri):
    """Compute the plane N.P + d = 0 of a triangle and the axes it is projected along.

    The normal is of unit length in floating point; in rational arithmetic it keeps its length,
    which no sign test sees.

    Returns
    -------
    dict
        ``normal`` and ``d``; ``i0``, ``i1``, ``i2``: the dominant axis of the normal and the two
        others, i1 < i2.

    Source
    ------
    Badouel 1990; Blecha 2007, equations 3.8, 3.9, 3.15 and section 4.5.
    """
    a, b, c = corners(tri)
    normal = cross(difference(b, a), difference(c, a))
    normal = quotient(normal, length(normal))
    i0 = dominant(normal)
    return {
        "normal": normal,
        "d": -dot(a, normal),
        "i0": i0,
        "i1": 1 if i0 == 0 else 0,
        "i2": 1 if i0 == 2 else 2,
    }
