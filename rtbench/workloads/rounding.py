"""How near to its border a pair may lie before a kernel's own rounding decides it.

The bands are those of ``accuracy.bounds`` with the kernel's roundoff in place of float64's, and
with the sizes of the points in place of their differences, since Wald, Badouel, Plücker's
coordinates and others work with coordinates as they are.
"""

import numpy as np

from rtbench.accuracy import certified

ROUNDOFF = {"float32": 2.0**-24, "mixed": 2.0**-24, "float64": 2.0**-53}
"""Of each precision; mixed computes in float64, but from stored normals rounded to float32."""

ROUNDINGS = 16.0
"""Multiple of roundoff times sizes: the methods' largest errors reach a third of the bands."""


def bands(
    triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray, precision: str = "float32"
) -> tuple[certified.Reference, np.ndarray, np.ndarray]:
    """Return t, u, v of each pair and how far a kernel's own may lie from them.

    Parameters
    ----------
    triangles : (N, 3, 3) array
        Vertices.
    origins, directions : (N, 3) arrays
        Lines, one a triangle.
    precision : str
        The kernel's arithmetic: a key of ROUNDOFF.

    Returns
    -------
    reference : Reference
        As `certified.reference` returns it.
    t_band, weight_band : (N,) float64 arrays
        For t, and for each of u, v and w = 1 - u - v; infinite or NaN where the line is parallel
        to the plane or the triangle has no area.
    """
    reference = certified.reference(triangles, origins, directions)
    corners = triangles.astype(np.float64)
    d = directions.astype(np.float64)
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(e, f)
    area, det = np.linalg.norm(normal, axis=1), np.abs((normal * d).sum(axis=1))
    size = np.maximum(np.abs(corners).sum(axis=2).max(axis=1), np.abs(origins).sum(axis=1))
    length = np.linalg.norm(d, axis=1)
    edges = np.linalg.norm(e, axis=1) * np.linalg.norm(f, axis=1)
    # Badouel divides by a component of an edge unless it is zero; its errors use up a twelfth of
    # what the whole quotient would allow (tests), so a quarter of it is enough.
    components = np.abs(np.concatenate([e, f, f - e], axis=1))
    components[components == 0] = np.inf
    tilt = components.max(axis=1, initial=0, where=components < np.inf) / components.min(axis=1)
    unit = ROUNDINGS * ROUNDOFF[precision] * size**2
    with np.errstate(divide="ignore", invalid="ignore"):
        t_band = unit * (size + np.abs(reference.t) * length) / det
        # Projections divide by the normal once more: the flatter the triangle, the worse.
        weight_band = unit * length / det * np.maximum(edges / area, tilt / 4)
    return reference, t_band, weight_band


def doubtful(
    reference: certified.Reference, t_band: np.ndarray, weight_band: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Tell which rays, t > 0, may come out either way, and which clearly miss.

    Parameters
    ----------
    reference, t_band, weight_band
        As `bands` returns them.

    Returns
    -------
    unsafe, misses : (N,) bool arrays
        Whatever is NaN is unsafe.
    """
    inner = np.minimum(np.minimum(reference.u, reference.v), 1 - reference.u - reference.v)
    misses = (inner < -weight_band) | (reference.t < -t_band)
    hits = (inner > weight_band) & (reference.t > t_band)
    return ~(hits | misses), misses
