"""What an epsilon on the determinant costs: one test three times, only that comparison changed.

Möller and Trumbore's test, division first, u and v before t. They are no methods of their own and
not in the registry: an absolute EPSILON, one relative to the lengths, and a comparison with 0.

Source: Möller & Trumbore 1997 (the absolute one, 1e-6).
"""

from rtbench.kernels.contract import EPSILON, HIT, NO_T, ONE, ZERO, kernel
from rtbench.kernels.exact_signs import length_1
from rtbench.kernels.vectors import cross, difference, dot

_OUTCOMES = ("hit", "parallel", "u outside", "v outside", "t outside (0, tmax)")
_TOLD = {
    "method": "Möller-Trumbore",
    "domain": "ray",
    "outcomes": _OUTCOMES,
    "outputs": ("t", "u", "v"),
    "source": "Möller & Trumbore 1997",
}


@kernel(title="Möller-Trumbore, det against an absolute EPSILON", **_TOLD)
def epsilon_absolute(tri, ray, tmax):
    a = (tri.v0[0], tri.v0[1], tri.v0[2])
    d = (ray.dir[0], ray.dir[1], ray.dir[2])
    e1 = difference((tri.v1[0], tri.v1[1], tri.v1[2]), a)
    e2 = difference((tri.v2[0], tri.v2[1], tri.v2[2]), a)
    p = cross(d, e2)
    det = dot(e1, p)
    if not abs(det) > EPSILON:
        return 1, NO_T, NO_T, NO_T
    inverse = ONE / det
    s = difference((ray.orig[0], ray.orig[1], ray.orig[2]), a)
    u = dot(s, p) * inverse
    if not min(ONE - u, u) >= ZERO:
        return 2, NO_T, NO_T, NO_T
    q = cross(s, e1)
    v = dot(d, q) * inverse
    if not min(ONE - u - v, v) >= ZERO:
        return 3, NO_T, NO_T, NO_T
    t = dot(e2, q) * inverse
    if not min(tmax - t, t) > ZERO:
        return 4, NO_T, NO_T, NO_T
    return HIT, t, u, v


@kernel(title="Möller-Trumbore, det against an EPSILON of its greatest value", **_TOLD)
def epsilon_relative(tri, ray, tmax):
    a = (tri.v0[0], tri.v0[1], tri.v0[2])
    d = (ray.dir[0], ray.dir[1], ray.dir[2])
    e1 = difference((tri.v1[0], tri.v1[1], tri.v1[2]), a)
    e2 = difference((tri.v2[0], tri.v2[1], tri.v2[2]), a)
    p = cross(d, e2)
    det = dot(e1, p)
    if not abs(det) > EPSILON * (length_1(d) * length_1(e1) * length_1(e2)):
        return 1, NO_T, NO_T, NO_T
    inverse = ONE / det
    s = difference((ray.orig[0], ray.orig[1], ray.orig[2]), a)
    u = dot(s, p) * inverse
    if not min(ONE - u, u) >= ZERO:
        return 2, NO_T, NO_T, NO_T
    q = cross(s, e1)
    v = dot(d, q) * inverse
    if not min(ONE - u - v, v) >= ZERO:
        return 3, NO_T, NO_T, NO_T
    t = dot(e2, q) * inverse
    if not min(tmax - t, t) > ZERO:
        return 4, NO_T, NO_T, NO_T
    return HIT, t, u, v


@kernel(title="Möller-Trumbore, det against 0", **_TOLD)
def epsilon_none(tri, ray, tmax):
    a = (tri.v0[0], tri.v0[1], tri.v0[2])
    d = (ray.dir[0], ray.dir[1], ray.dir[2])
    e1 = difference((tri.v1[0], tri.v1[1], tri.v1[2]), a)
    e2 = difference((tri.v2[0], tri.v2[1], tri.v2[2]), a)
    p = cross(d, e2)
    det = dot(e1, p)
    if not abs(det) > ZERO:
        return 1, NO_T, NO_T, NO_T
    inverse = ONE / det
    s = difference((ray.orig[0], ray.orig[1], ray.orig[2]), a)
    u = dot(s, p) * inverse
    if not min(ONE - u, u) >= ZERO:
        return 2, NO_T, NO_T, NO_T
    q = cross(s, e1)
    v = dot(d, q) * inverse
    if not min(ONE - u - v, v) >= ZERO:
        return 3, NO_T, NO_T, NO_T
    t = dot(e2, q) * inverse
    if not min(tmax - t, t) > ZERO:
        return 4, NO_T, NO_T, NO_T
    return HIT, t, u, v


KERNELS = {
    kernel.name: kernel
    for function in (epsilon_absolute, epsilon_relative, epsilon_none)
    for kernel in function.kernels
}
